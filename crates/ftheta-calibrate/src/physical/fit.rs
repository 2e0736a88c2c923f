//! The fit: linearise, judge scales and wrong marks, step, until it settles.

use super::evidence::{Posterior, Sums};
use super::linearised::{Linearised, Model};
use super::parameters::{Estimate, Parameters};
use super::residual::Residual;
use crate::axes::Axes;
use crate::mark::Mark;
use ftheta_model::machine::Optics;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::head::{Head, Tracer};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Rounds of linearising at most; four settle nearly always.
const N_ROUNDS_MAX: usize = 25;
/// A step below this, in prior standard deviations, has settled.
const SETTLED: f64 = 1e-6;
/// Marks whose removal is tried at once.
const N_SUSPECTS: usize = 8;
/// Logarithm of how likely a mark is wrong times how likely it is then where it is, 1/mm²: one in
/// fifty, anywhere within 20 mm × 20 mm.
const LOG_WRONG: f64 = -9.9;
/// At most this share of the marks may be taken for wrong.
const WRONG_SHARE: f64 = 0.25;
/// How much likelier right than wrong a dropped mark has to be, as a logarithm, to be taken back.
const TAKEN_BACK: f64 = 1.0;
/// Up to so many marks there is a second search for wrong ones.
const N_SECOND_LOOK: usize = 1000;
/// Rounds in which the marks that agree best are chosen anew.
const N_CONCENTRATIONS: usize = 6;
/// Fields drawn from the posterior for the expected maximum.
const N_DRAWS: usize = 40;

/// What is known of the marks' noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Standard deviation of each coordinate of a mark, mm; `None` has it estimated.
    pub sigma_mm: Option<f64>,
}

/// A fitted head.
pub struct Physical {
    model: Model,
    posterior: Posterior,
    tracer: Tracer,
    estimate: DVector<f64>,
    sums: Sums,
    /// Which marks were used.
    pub used: Vec<bool>,
    /// Of every mark, used or not: measured less predicted without it, mm, in measured coordinates.
    pub left_out_mm: Vec<Vector2<f64>>,
}

/// Fits the physics of a head; `None` where the equations break down.
///
/// Several wrong marks may hide each other from a search that drops one after the other, so there
/// is a second one that begins with the marks that agree best. The likelier outcome counts.
pub fn fit(optics: &Optics, axes: Axes, marks: &[Mark], noise: Noise) -> Option<Physical> {
    let residual = Residual::over(marks.iter().map(|mark| mark.command));
    let model = Model { parameters: Parameters::new(optics), axes, residual };
    let start = vec![true; marks.len()];
    let mut settled = settle(&model, marks, noise, start)?;
    if marks.len() <= N_SECOND_LOOK {
        let start = agreeing(&model, marks, noise, &settled.estimate)?;
        let second = settle(&model, marks, noise, start);
        settled = second.filter(|s| s.log_likely > settled.log_likely).unwrap_or(settled);
    }
    let Settled { estimate, used, posterior, equations, sums, .. } = settled;
    let left_out_mm = left_out(&equations, &posterior, &used, &model.axes);
    let tracer = Tracer::new(&model.parameters.head(head_values(&model, &estimate)));
    Some(Physical { model, posterior, tracer, estimate, sums, used, left_out_mm })
}

/// A fit that has settled.
struct Settled {
    estimate: DVector<f64>,
    used: Vec<bool>,
    posterior: Posterior,
    equations: Linearised,
    sums: Sums,
    /// Logarithm of how likely marks and wrong marks are.
    log_likely: f64,
}

/// Fits the marks used, and drops or takes back marks until none should be.
fn settle(model: &Model, marks: &[Mark], noise: Noise, start: Vec<bool>) -> Option<Settled> {
    let mut used = start;
    let mut estimate = DVector::zeros(model.n_unknowns());
    let mut settled: Option<(Posterior, Linearised, Sums)> = None;
    let mut n_changes = 0;
    for _ in 0..N_ROUNDS_MAX + 2 * marks.len().min(N_SECOND_LOOK) {
        let equations = model.linearised(marks, &estimate);
        let sums = Sums::new(&equations, &used, model.n_parameters());
        let posterior = match &settled {
            None => sums.best(noise.sigma_mm)?,
            Some((before, ..)) => sums.best_near(before.scales, noise.sigma_mm, true)?,
        };
        let step = (&posterior.estimate - &estimate).amax();
        estimate.copy_from(&posterior.estimate);
        let mut changes = Vec::new();
        // Dropping and taking back in turn could go on for ever.
        if step < 1.0 && n_changes < 2 * marks.len() {
            changes = right_marks(&equations, &posterior, &used);
            if changes.is_empty() {
                changes.extend(wrong_mark(&equations, &sums, &posterior, &used, noise));
            }
        }
        changes.iter().for_each(|&mark| used[mark] = !used[mark]);
        n_changes += changes.len();
        settled = Some((posterior, equations, sums));
        if step < SETTLED && changes.is_empty() {
            break;
        }
    }
    let (posterior, equations, sums) = settled?;
    let n_wrong = used.iter().filter(|&&used| !used).count() as f64;
    let log_likely = posterior.log_evidence + n_wrong * LOG_WRONG;
    Some(Settled { estimate, used, posterior, equations, sums, log_likely })
}

/// The marks that agree best with each other: all but the share that may be wrong.
fn agreeing(
    model: &Model,
    marks: &[Mark],
    noise: Noise,
    first: &DVector<f64>,
) -> Option<Vec<bool>> {
    let n_kept = marks.len() - (WRONG_SHARE * marks.len() as f64) as usize;
    let mut estimate = first.clone();
    let mut kept = vec![true; marks.len()];
    for _ in 0..N_CONCENTRATIONS {
        let equations = model.linearised(marks, &estimate);
        let residuals = &equations.data_mm - &equations.jacobian * &estimate;
        let size = |mark: usize| residuals[2 * mark].hypot(residuals[2 * mark + 1]);
        let mut order: Vec<usize> = (0..marks.len()).collect();
        order.sort_by(|&a, &b| size(a).total_cmp(&size(b)));
        kept.fill(false);
        order[..n_kept].iter().for_each(|&mark| kept[mark] = true);
        let sums = Sums::new(&equations, &kept, model.n_parameters());
        estimate = sums.best(noise.sigma_mm)?.estimate;
    }
    Some(kept)
}

/// The dropped marks that are likelier right than wrong.
fn right_marks(equations: &Linearised, posterior: &Posterior, used: &[bool]) -> Vec<usize> {
    let noise_square = posterior.scales.noise_mm.powi(2);
    let is_right = |&mark: &usize| {
        let (left, covariance) = innovation(equations, posterior, mark);
        let covariance = covariance + Matrix2::identity() * noise_square;
        let Some(inverse) = covariance.try_inverse() else {
            return false;
        };
        let area = 2.0 * std::f64::consts::PI * covariance.determinant().sqrt();
        -0.5 * left.dot(&(inverse * left)) - area.ln() > LOG_WRONG + TAKEN_BACK
    };
    (0..used.len()).filter(|&mark| !used[mark]).filter(is_right).collect()
}

/// Squares of the distances that a posterior leaves open, one for every two rows, mm².
fn left_open(posterior: &Posterior, jacobian: &DMatrix<f64>) -> Vec<f64> {
    let square =
        |index: usize| posterior.covariance(&jacobian.rows(2 * index, 2).into_owned()).trace();
    (0..jacobian.nrows() / 2).map(square).collect()
}

fn head_values<'a>(model: &Model, estimate: &'a DVector<f64>) -> &'a [f64] {
    &estimate.as_slice()[..model.n_parameters()]
}

/// Measured less predicted, mm, and how far it may be off by the unknowns, mm².
fn innovation(
    equations: &Linearised,
    posterior: &Posterior,
    mark: usize,
) -> (Vector2<f64>, Matrix2<f64>) {
    let rows: DMatrix<f64> = equations.jacobian.rows(2 * mark, 2).into_owned();
    let predicted = &rows * &posterior.estimate;
    let data = equations.data_mm.fixed_rows::<2>(2 * mark);
    let covariance = posterior.covariance(&rows);
    let covariance = Matrix2::new(
        covariance[(0, 0)],
        covariance[(0, 1)],
        covariance[(1, 0)],
        covariance[(1, 1)],
    );
    (data - Vector2::new(predicted[0], predicted[1]), covariance)
}

/// The mark whose removal the evidence speaks for most, if it does for any.
fn wrong_mark(
    equations: &Linearised,
    sums: &Sums,
    posterior: &Posterior,
    used: &[bool],
    noise: Noise,
) -> Option<usize> {
    let n_wrong = used.iter().filter(|&&used| !used).count();
    if (n_wrong + 1) as f64 > WRONG_SHARE * used.len() as f64 {
        return None;
    }
    let noise_square = posterior.scales.noise_mm.powi(2);
    let suspicion = |mark: usize| {
        let (left, covariance) = innovation(equations, posterior, mark);
        // What a fit leaves of a mark varies less than its noise, by what the fit took up.
        let varies = Matrix2::identity() * noise_square - covariance;
        let varies = varies + Matrix2::identity() * (1e-3 * noise_square);
        varies.try_inverse().map_or(0.0, |inverse| left.dot(&(inverse * left)))
    };
    let mut suspects: Vec<(f64, usize)> =
        (0..used.len()).filter(|&mark| used[mark]).map(|mark| (suspicion(mark), mark)).collect();
    suspects.sort_by(|a, b| b.0.total_cmp(&a.0));
    suspects.truncate(N_SUSPECTS);
    let gains = suspects.iter().filter_map(|&(_, mark)| {
        let without = sums.without(equations, mark);
        let without = without.best_near(posterior.scales, noise.sigma_mm, false)?;
        Some((without.log_evidence + LOG_WRONG - posterior.log_evidence, mark))
    });
    gains.filter(|(gain, _)| *gain > 0.0).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, mark)| mark)
}

/// Of every mark what would be left if it had not been used.
fn left_out(
    equations: &Linearised,
    posterior: &Posterior,
    used: &[bool],
    axes: &Axes,
) -> Vec<Vector2<f64>> {
    let noise_square = posterior.scales.noise_mm.powi(2);
    let each = |mark: usize| {
        let (left, covariance) = innovation(equations, posterior, mark);
        let kept = Matrix2::identity() - covariance / noise_square;
        let left = match kept.try_inverse() {
            Some(inverse) if used[mark] => inverse * left,
            _ => left,
        };
        let turned = axes.measured(FieldPoint::new(left.x, left.y));
        Vector2::new(turned.x_mm, turned.y_mm)
    };
    (0..used.len()).map(each).collect()
}

impl Physical {
    /// Where commands put the beam, in measured coordinates.
    pub fn place(&self, command: MirrorAngles) -> FieldPoint {
        self.model.place(&self.tracer, &self.estimate, command)
    }

    /// The axes found.
    pub fn axes(&self) -> Axes {
        self.model.axes
    }

    /// Standard deviation of the marks' noise, as found or given, mm.
    pub fn noise_mm(&self) -> f64 {
        self.posterior.scales.noise_mm
    }

    /// The head without the residual; mirror 1 moves its first coordinate.
    pub fn head(&self) -> Head {
        self.model.parameters.head(head_values(&self.model, &self.estimate))
    }

    /// The parameters with what the marks leave open.
    pub fn parameters(&self) -> Vec<Estimate> {
        let all = self.model.parameters.all().iter().enumerate();
        all.map(|(index, parameter)| Estimate {
            name: parameter.name,
            unit: parameter.unit,
            value: self.estimate[index] * parameter.sigma,
            sigma: self.posterior.sigma(index) * parameter.sigma,
            prior: parameter.sigma,
        })
        .collect()
    }

    /// What unknowns move at commands of the machine, mm.
    fn jacobian(&self, commands: &[MirrorAngles]) -> DMatrix<f64> {
        let turned: Vec<_> = commands.iter().map(|&c| self.model.axes.commands(c)).collect();
        self.model.jacobian(&turned, &self.estimate)
    }

    /// Errors to expect at `places` with `more` marks measured as well, mm rms.
    pub fn forecast_mm(&self, more: &[MirrorAngles], places: &[MirrorAngles]) -> Option<f64> {
        let posterior = self.sums.with(&self.jacobian(more)).at(self.posterior.scales)?;
        let squares = left_open(&posterior, &self.jacobian(places));
        Some((squares.iter().sum::<f64>() / places.len() as f64).sqrt())
    }

    /// Errors that are left at commands: standard deviation of the distance at each, and the mean
    /// of the greatest one over fields drawn from what the marks leave open, mm.
    pub fn expected_mm(&self, commands: &[MirrorAngles]) -> (Vec<f64>, f64) {
        let jacobian = self.jacobian(commands);
        let squares = left_open(&self.posterior, &jacobian);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let n_unknowns = self.model.n_unknowns();
        let greatest: f64 = (0..N_DRAWS)
            .map(|_| {
                let normal =
                    DVector::from_fn(n_unknowns, |_, _| StandardNormal.sample(&mut random));
                let field = &jacobian * self.posterior.deviation(normal);
                let pairs = field.as_slice().chunks_exact(2);
                pairs.map(|pair| pair[0].hypot(pair[1])).fold(0.0, f64::max)
            })
            .sum();
        (squares.into_iter().map(f64::sqrt).collect(), greatest / N_DRAWS as f64)
    }
}
