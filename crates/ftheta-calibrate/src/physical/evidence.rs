//! Which noise and which residual the marks speak for, and the estimate that goes with them.

use super::linearised::Linearised;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Noise of the marks and size of the residual, both standard deviations, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    pub noise_mm: f64,
    pub residual_mm: f64,
}

/// Sums over marks from which any scales can be judged.
#[derive(Clone)]
pub struct Sums {
    gram: DMatrix<f64>,
    moment: DVector<f64>,
    square: f64,
    n_rows: usize,
    n_parameters: usize,
}

/// What the sums say with certain scales.
pub struct Posterior {
    pub scales: Scales,
    /// Logarithm of the evidence, with the prior of the scales.
    pub log_evidence: f64,
    /// The estimate: parameters in sigmas, residual in mm.
    pub estimate: DVector<f64>,
    /// Of the identity plus the information, in units of the priors.
    factor: Cholesky<f64, Dyn>,
    /// Prior standard deviations of the unknowns.
    prior: DVector<f64>,
}

/// Noise levels tried, mm, and their ratio: from a good camera to a bad ruler.
const NOISE_MM: [f64; 2] = [0.0005, 0.5];
const NOISE_RATIO: f64 = 1.35;
/// Sizes of the residual tried, mm: of optical imperfections, not of mounting errors.
const RESIDUAL_MM: [f64; 6] = [0.002, 0.004, 0.009, 0.018, 0.036, 0.072];
/// The noise is thought to be about this, within a factor e³ or so.
const LIKELY_NOISE_MM: f64 = 0.012;
const LIKELY_NOISE_LOG: f64 = 1.5;
/// The same of the residual.
const LIKELY_RESIDUAL_MM: f64 = 0.009;
const LIKELY_RESIDUAL_LOG: f64 = 1.5;

impl Sums {
    /// Sums over the marks that are used.
    pub fn new(equations: &Linearised, used: &[bool], n_parameters: usize) -> Self {
        let n_unknowns = equations.jacobian.ncols();
        let rows: Vec<usize> =
            (0..used.len()).filter(|&k| used[k]).flat_map(|k| [2 * k, 2 * k + 1]).collect();
        let jacobian = equations.jacobian.select_rows(&rows);
        let data = equations.data_mm.select_rows(&rows);
        let mut gram = DMatrix::zeros(n_unknowns, n_unknowns);
        gram.gemm_tr(1.0, &jacobian, &jacobian, 0.0);
        Self {
            gram,
            moment: jacobian.tr_mul(&data),
            square: data.norm_squared(),
            n_rows: rows.len(),
            n_parameters,
        }
    }

    /// The sums without one mark.
    pub fn without(&self, equations: &Linearised, mark: usize) -> Self {
        let rows = equations.jacobian.rows(2 * mark, 2);
        let data = equations.data_mm.rows(2 * mark, 2);
        let mut sums = self.clone();
        sums.gram.gemm_tr(-1.0, &rows, &rows, 1.0);
        sums.moment -= rows.tr_mul(&data);
        sums.square -= data.norm_squared();
        sums.n_rows -= 2;
        sums
    }

    /// The sums with more marks, of which only the equations are known.
    pub fn with(&self, jacobian: &DMatrix<f64>) -> Self {
        let mut sums = self.clone();
        sums.gram.gemm_tr(1.0, jacobian, jacobian, 1.0);
        sums
    }

    /// The scales with the greatest evidence, among all or at the noise given.
    pub fn best(&self, noise_mm: Option<f64>) -> Option<Posterior> {
        let levels = levels(noise_mm);
        let all = RESIDUAL_MM.iter().flat_map(|&r| levels.iter().map(move |&n| (n, r)));
        let tried =
            all.filter_map(|(noise_mm, residual_mm)| self.at(Scales { noise_mm, residual_mm }));
        tried.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
    }

    /// The same, climbing from scales that are near: a tenth of the work.
    ///
    /// * `vary_residual`: whether the residual's size may change as well
    pub fn best_near(
        &self,
        near: Scales,
        noise_mm: Option<f64>,
        vary_residual: bool,
    ) -> Option<Posterior> {
        let levels = levels(noise_mm);
        let index_of = |values: &[f64], value: f64| {
            let off = |v: &f64| (v / value).ln().abs();
            (0..values.len()).min_by(|&a, &b| off(&values[a]).total_cmp(&off(&values[b])))
        };
        let mut at = [index_of(&levels, near.noise_mm)?, index_of(&RESIDUAL_MM, near.residual_mm)?];
        let posterior = |[noise, residual]: [usize; 2]| {
            self.at(Scales { noise_mm: levels[noise], residual_mm: RESIDUAL_MM[residual] })
        };
        let mut best = posterior(at)?;
        loop {
            let [noise, residual] = at;
            let mut steps = vec![[noise.wrapping_sub(1), residual], [noise + 1, residual]];
            if vary_residual {
                steps.extend([[noise, residual.wrapping_sub(1)], [noise, residual + 1]]);
            }
            let inside = |step: &[usize; 2]| step[0] < levels.len() && step[1] < RESIDUAL_MM.len();
            let tried = steps.into_iter().filter(inside);
            let tried = tried.filter_map(|step| Some((step, posterior(step)?)));
            let up = tried.max_by(|a, b| a.1.log_evidence.total_cmp(&b.1.log_evidence));
            match up.filter(|(_, up)| up.log_evidence > best.log_evidence) {
                Some((step, up)) => (at, best) = (step, up),
                None => return Some(best),
            }
        }
    }

    /// The posterior with given scales; `None` where numbers have broken down.
    pub fn at(&self, scales: Scales) -> Option<Posterior> {
        let n_unknowns = self.gram.nrows();
        let prior = DVector::from_fn(n_unknowns, |index, _| {
            if index < self.n_parameters { 1.0 } else { scales.residual_mm }
        });
        let noise = scales.noise_mm * scales.noise_mm;
        let mut information = self.gram.clone();
        for (column, mut cells) in information.column_iter_mut().enumerate() {
            for (row, cell) in cells.iter_mut().enumerate() {
                *cell *= prior[row] * prior[column] / noise;
            }
            cells[column] += 1.0;
        }
        let factor = Cholesky::new(information)?;
        let moment = self.moment.component_mul(&prior) / noise;
        let solved = factor.solve(&moment);
        let cost = self.square / noise - moment.dot(&solved);
        let log_determinant: f64 = factor.l_dirty().diagonal().iter().map(|v| v.ln()).sum();
        let off = |value: f64, likely: f64, spread: f64| ((value / likely).ln() / spread).powi(2);
        let scale_prior = off(scales.noise_mm, LIKELY_NOISE_MM, LIKELY_NOISE_LOG)
            + off(scales.residual_mm, LIKELY_RESIDUAL_MM, LIKELY_RESIDUAL_LOG);
        let log_evidence = -0.5 * cost
            - log_determinant
            - self.n_rows as f64 * (scales.noise_mm * (2.0 * std::f64::consts::PI).sqrt()).ln()
            - 0.5 * scale_prior;
        let estimate = solved.component_mul(&prior);
        log_evidence.is_finite().then_some(Posterior {
            scales,
            log_evidence,
            estimate,
            factor,
            prior,
        })
    }
}

/// Noise levels to be tried, mm.
fn levels(noise_mm: Option<f64>) -> Vec<f64> {
    match noise_mm {
        Some(noise_mm) => vec![noise_mm],
        None => std::iter::successors(Some(NOISE_MM[0]), |level| Some(level * NOISE_RATIO))
            .take_while(|&level| level <= NOISE_MM[1])
            .collect(),
    }
}

impl Posterior {
    /// Covariance of what rows of a Jacobian predict, mm², by the unknowns' uncertainty alone.
    pub fn covariance(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = rows.transpose();
        scaled.row_iter_mut().zip(&self.prior).for_each(|(mut row, prior)| row *= *prior);
        self.factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut scaled);
        scaled.tr_mul(&scaled)
    }

    /// A deviation of the unknowns drawn from the posterior.
    ///
    /// * `normal`: as many independent normal numbers as there are unknowns
    pub fn deviation(&self, normal: DVector<f64>) -> DVector<f64> {
        let mut deviation = normal;
        self.factor.l_dirty().tr_solve_lower_triangular_unchecked_mut(&mut deviation);
        deviation.component_mul(&self.prior)
    }

    /// Standard deviation of an unknown.
    pub fn sigma(&self, index: usize) -> f64 {
        let mut unit = DVector::zeros(self.prior.len());
        unit[index] = 1.0;
        self.factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut unit);
        unit.norm() * self.prior[index]
    }
}
