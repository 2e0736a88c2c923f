//! Equal segments of constant voltage between two states, the action time found by bisection.

use super::{LawError, Motion, Request};
use crate::jump::{JumpError, guess_s};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, Galvo, State, Step};
use nalgebra::{DMatrix, DVector};

/// Halvings of a period that the action time is found to.
const N_HALVINGS: i32 = 8;
/// The bracket starts at this multiple of a rough time, and grows by the other until it is wide
/// enough. With few segments, each near the mode's period, some longer times do not do although
/// shorter ones would; these two decide which is found.
const WIDE: f64 = 1.6;
const WIDER: f64 = 1.5;
/// Regularisation of the solver, in the order tried.
const REGULARISATIONS: [f64; 3] = [1e-8, 1e-7, 1e-9];
/// Most periods of the bracket.
const N_PERIODS_MAX: f64 = 1e6;

/// One axis between two states.
struct Transfer {
    galvo: Galvo,
    /// Which states must fit.
    states: &'static [usize],
    n_segments: usize,
    voltage_max_v: f64,
    /// Infinite where it may be anything.
    current_max_a: f64,
    from: State,
    to: State,
}

/// The motion in the least time that the bisection finds.
///
/// Three or four segments take the shaft as stiff, more the nominal mode. Source: patent
/// CN105005322B, claims on voltage and action time (T4, T5); its one voltage for all states is
/// read as one per segment, and literally for one segment.
pub(super) fn bisect(
    scanner: &Scanner,
    n_segments: usize,
    current_bound: bool,
    request: &Request,
) -> Result<Motion, LawError> {
    let transfer = Transfer {
        galvo: Galvo::new(scanner),
        states: match n_segments {
            0..=2 => &[0],
            3..=4 => &[0, 1, CURRENT],
            _ => &[0, 1, 2, 3, CURRENT],
        },
        n_segments: n_segments.max(1),
        voltage_max_v: scanner.voltage_max_v * (1.0 - request.reserve),
        current_max_a: if current_bound { scanner.current_max_a } else { f64::INFINITY },
        from: State::new(0.0, request.from_rad_s, 0.0, 0.0, 0.0),
        to: State::new(request.step_rad, request.to_rad_s, 0.0, 0.0, 0.0),
    };
    let period_s = request.period_s;
    let whole = |time_s: f64| (time_s / period_s).ceil() * period_s;
    let mut high_s = whole(WIDE * guess_s(scanner, request.step_rad.abs()));
    let mut found = transfer.voltages_v(high_s)?;
    while found.is_none() {
        high_s = whole(WIDER * high_s);
        if high_s > N_PERIODS_MAX * period_s {
            let (step_rad, limit) = (request.step_rad, N_PERIODS_MAX as usize);
            return Err(JumpError::TooLong { step_rad, limit, tick_us: period_s * 1e6 }.into());
        }
        found = transfer.voltages_v(high_s)?;
    }
    let mut low_s = 0.0;
    while high_s - low_s > period_s * 0.5_f64.powi(N_HALVINGS) {
        let middle_s = 0.5 * (low_s + high_s);
        match transfer.voltages_v(middle_s)? {
            Some(voltages_v) => (high_s, found) = (middle_s, Some(voltages_v)),
            None => low_s = middle_s,
        }
    }
    let hold_s = high_s / transfer.n_segments as f64;
    Ok(Motion { plan_s: high_s, hold_s, voltages_v: found.unwrap_or_default() })
}

impl Transfer {
    /// Voltages that do it in this time; `None` where some limit is in the way.
    fn voltages_v(&self, time_s: f64) -> Result<Option<Vec<f64>>, JumpError> {
        let step = self.step(time_s / self.n_segments as f64);
        // In units in which voltage and response are of order one.
        let (effects, free) = self.effects(&step);
        let wanted = DVector::from_iterator(
            self.states.len(),
            self.states.iter().map(|&state| (self.to - free)[state]),
        );
        let mut rows = effects;
        let mut right = wanted;
        for row in 0..rows.nrows() {
            let size = rows.row(row).amax().max(f64::MIN_POSITIVE);
            rows.row_mut(row).scale_mut(1.0 / size);
            right[row] /= size * self.voltage_max_v;
        }
        if rows.nrows() == rows.ncols() {
            // As many voltages as states: one solution, or none.
            let Some(voltages) = rows.lu().solve(&right) else { return Ok(None) };
            let within = voltages.amax() <= 1.0 && self.current_within(&step, &voltages);
            return Ok(within.then(|| self.scaled(&voltages)));
        }
        // The same conditions as orthonormal rows, which the solver stands better.
        let (q, r) = rows.transpose().qr().unpack();
        let Some(right) = r.transpose().solve_lower_triangular(&right) else { return Ok(None) };
        let rows = q.transpose();
        let Some(voltages) = self.solve(&rows, &right, &step, time_s)? else { return Ok(None) };
        // What the solver leaves of the end condition is taken away by the smallest change.
        let voltages = &voltages + q * (right - rows * &voltages);
        Ok((voltages.amax() <= 1.0).then(|| self.scaled(&voltages)))
    }

    fn step(&self, hold_s: f64) -> Step {
        let mut galvo = self.galvo;
        if !self.states.contains(&2) {
            // A stiff shaft: the twist no longer acts on the coil.
            galvo.rotor_inertia = galvo.inertia();
            galvo.mirror_inertia = 0.0;
        }
        galvo.step(hold_s)
    }

    fn scaled(&self, voltages: &DVector<f64>) -> Vec<f64> {
        voltages.iter().map(|voltage| voltage * self.voltage_max_v).collect()
    }

    /// What one volt in each segment does to the end, and the end without voltage.
    fn effects(&self, step: &Step) -> (DMatrix<f64>, State) {
        let mut effects = DMatrix::zeros(self.states.len(), self.n_segments);
        let (mut effect, mut free) = (step.b, self.from);
        for segment in (0..self.n_segments).rev() {
            for (row, &state) in self.states.iter().enumerate() {
                effects[(row, segment)] = effect[state];
            }
            effect = step.a * effect;
            free = step.a * free;
        }
        (effects, free)
    }

    /// Whether the current keeps its limit at the segments' ends.
    fn current_within(&self, step: &Step, voltages: &DVector<f64>) -> bool {
        let mut state = self.from;
        voltages.iter().all(|voltage| {
            state = step.a * state + step.b * (voltage * self.voltage_max_v);
            state[CURRENT].abs() <= self.current_max_a
        })
    }

    /// The smallest greatest voltage as a linear program; `None` where the current forbids all.
    fn solve(
        &self,
        rows: &DMatrix<f64>,
        right: &DVector<f64>,
        step: &Step,
        time_s: f64,
    ) -> Result<Option<DVector<f64>>, JumpError> {
        let n = self.n_segments;
        let n_bounds = if self.current_max_a.is_finite() { 4 * n } else { 2 * n };
        let mut matrix = DMatrix::zeros(rows.nrows() + n_bounds, n + 1);
        let mut limits = vec![0.0; matrix.nrows()];
        matrix.view_mut((0, 0), rows.shape()).copy_from(rows);
        limits[..right.len()].copy_from_slice(right.as_slice());
        for segment in 0..n {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let row = rows.nrows() + 2 * segment + side;
                matrix[(row, segment)] = sign;
                matrix[(row, n)] = -1.0;
            }
        }
        if n_bounds == 4 * n {
            let first = rows.nrows() + 2 * n;
            self.bound_current(step, &mut matrix.rows_mut(first, 2 * n), &mut limits[first..]);
        }
        let mut cost = vec![0.0; n + 1];
        cost[n] = 1.0;
        let cones = [ZeroConeT(rows.nrows()), NonnegativeConeT(n_bounds)];
        let quadratic = CscMatrix::zeros((n + 1, n + 1));
        let matrix: Vec<Vec<f64>> =
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        let matrix = CscMatrix::from(matrix.iter());
        let mut ended = String::new();
        for static_regularization_constant in REGULARISATIONS {
            let settings = DefaultSettings {
                verbose: false,
                static_regularization_constant,
                max_threads: 1,
                ..DefaultSettings::default()
            };
            let solver = DefaultSolver::new(&quadratic, &cost, &matrix, &limits, &cones, settings);
            let Ok(mut solver) = solver.inspect_err(|error| ended = error.to_string()) else {
                continue;
            };
            solver.solve();
            match solver.solution.status {
                SolverStatus::Solved | SolverStatus::AlmostSolved => {
                    return Ok(Some(DVector::from_column_slice(&solver.solution.x[..n])));
                }
                SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                    return Ok(None);
                }
                status => ended = format!("{status:?}"),
            }
        }
        let tick_us = time_s / n as f64 * 1e6;
        Err(JumpError::Unsolved { n_ticks: n, tick_us, status: ended })
    }

    /// Fills in the current's bounds at the segments' ends.
    fn bound_current(
        &self,
        step: &Step,
        rows: &mut nalgebra::DMatrixViewMut<'_, f64>,
        limits: &mut [f64],
    ) {
        let mut free = self.from;
        let mut response = vec![step.b];
        for segment in 0..self.n_segments {
            free = step.a * free;
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let row = 2 * segment + side;
                for (column, effect) in response.iter().rev().enumerate() {
                    rows[(row, column)] =
                        sign * effect[CURRENT] * self.voltage_max_v / self.current_max_a;
                }
                limits[row] = 1.0 - sign * free[CURRENT] / self.current_max_a;
            }
            response.push(step.a * response[segment]);
        }
    }
}
