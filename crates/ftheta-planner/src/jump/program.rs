//! The linear program of the longest step: voltages and states as variables, sparse and banded.
//!
//! The condensed form, with voltages alone, is dense and loses the end condition in rounding;
//! with the states as variables every row couples neighbours only.

use super::JumpError;
use super::axis::{Axis, Plant};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT, ZeroConeT,
};
use ftheta_physics::galvo::{CURRENT, State};
use nalgebra::Matrix2;

/// Balancing and regularisation of the solver, in the order tried. With its own 1e-8 one robust
/// program in fifty stalls; with 1e-7 one in four hundred, most of which the others finish.
const ATTEMPTS: [(bool, f64); 3] = [(true, 1e-7), (true, 1e-8), (false, 1e-7)];
/// Feasibility and gap, in units of the largest values.
const TOLERANCE: f64 = 1e-9;

/// What the program gives.
pub(super) struct Solution {
    /// Longest step, rad.
    pub(super) step_rad: f64,
    /// Voltage of each tick, V; inexact by the tolerance.
    pub(super) voltages_v: Vec<f64>,
}

/// From a tick on the mirror stays near the step, for good.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tube {
    /// Ticks until the mirror is near.
    pub(super) arrival: usize,
    /// How near, rad.
    pub(super) epsilon_rad: f64,
}

/// Units in which the variables are of order one.
struct Units {
    voltage: f64,
    state: State,
}

impl Units {
    fn new(axis: &Axis, n_ticks: usize) -> Self {
        let galvo = &axis.galvo;
        let total = axis.tick_s * n_ticks as f64;
        let voltage = axis.voltage_max_v;
        let current = axis.current_max_a.min(voltage * total / galvo.inductance);
        let acceleration = galvo.torque_constant / galvo.inertia() * current;
        let angle = acceleration * total * total / 4.0;
        let twist = galvo.torque_constant / galvo.rotor_inertia * current;
        let period = galvo.omega.recip().min(total);
        let state =
            State::new(angle, angle / total, twist * period * period, twist * period, current);
        Self { voltage, state }
    }
}

/// Rows and entries of the program under construction.
#[derive(Default)]
struct Rows {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    right: Vec<f64>,
}

impl Rows {
    /// Adds a row with these entries; those of value zero are left out.
    fn add(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, right: f64) {
        let row = self.right.len();
        for (column, value) in entries {
            if value != 0.0 {
                self.row.push(row);
                self.column.push(column);
                self.value.push(value);
            }
        }
        self.right.push(right);
    }
}

/// Where each variable stands: voltage and then states for each tick, the place of rest, and with
/// a tube the step.
struct Layout {
    n_ticks: usize,
    n_states: usize,
    tube: bool,
}

impl Layout {
    fn voltage(&self, tick: usize) -> usize {
        tick * (1 + self.n_states)
    }

    /// Column of a state before this tick, which is neither the first nor behind the last.
    fn state(&self, tick: usize, position: usize) -> usize {
        self.voltage(tick - 1) + 1 + position
    }

    fn rest(&self) -> usize {
        self.voltage(self.n_ticks - 1) + 1
    }

    fn step(&self) -> usize {
        self.rest() + usize::from(self.tube)
    }

    fn n_columns(&self) -> usize {
        self.step() + 1
    }
}

/// The longest step from rest to rest.
///
/// # Errors
/// If the solver does not reach its tolerance.
pub(super) fn solve(
    axis: &Axis,
    n_ticks: usize,
    tube: Option<Tube>,
) -> Result<Solution, JumpError> {
    let layout = Layout { n_ticks, n_states: axis.active.len(), tube: tube.is_some() };
    let units = Units::new(axis, n_ticks);
    let mut rows = Rows::default();
    motion(axis, &layout, &units, &mut rows);
    let n_equal = rows.right.len();
    bounds(axis, &layout, &units, &mut rows);
    if let Some(tube) = tube {
        near(axis, tube, &layout, &units, &mut rows);
    }
    let n_bounds = rows.right.len() - n_equal;
    for plant in &axis.plants {
        residual(axis, plant, &layout, &units, &mut rows);
    }
    let mut cones = vec![ZeroConeT(n_equal), NonnegativeConeT(n_bounds)];
    cones.resize(2 + axis.plants.len(), SecondOrderConeT(3));
    let x = maximise(rows, &cones, &layout).map_err(|status| JumpError::Unsolved {
        n_ticks,
        tick_us: axis.tick_s * 1e6,
        status,
    })?;
    let voltage = |tick| x[layout.voltage(tick)] * units.voltage;
    Ok(Solution {
        step_rad: x[layout.step()] * units.state[0],
        voltages_v: (0..n_ticks).map(voltage).collect(),
    })
}

/// The variables with the longest step; else the solver's status.
fn maximise(
    rows: Rows,
    cones: &[SupportedConeT<f64>],
    layout: &Layout,
) -> Result<Vec<f64>, String> {
    let Rows { row, column, value, right } = rows;
    let (n_rows, n_columns) = (right.len(), layout.n_columns());
    let a = CscMatrix::new_from_triplets(n_rows, n_columns, row, column, value);
    let p = CscMatrix::zeros((n_columns, n_columns));
    let mut cost = vec![0.0; n_columns];
    cost[layout.step()] = -1.0;
    let mut ended = Err(String::new());
    for (equilibrate_enable, static_regularization_constant) in ATTEMPTS {
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            equilibrate_enable,
            static_regularization_constant,
            // More threads would only contend with the atlas's own.
            max_threads: 1,
            ..DefaultSettings::default()
        };
        let mut solver = DefaultSolver::new(&p, &cost, &a, &right, cones, settings)
            .map_err(|error| error.to_string())?;
        solver.solve();
        let solution = solver.solution;
        match solution.status {
            SolverStatus::Solved => return Ok(solution.x),
            // The step may be 5e-5 short; the polish that follows keeps all limits anyhow.
            SolverStatus::AlmostSolved => ended = Ok(solution.x),
            status if ended.is_err() => ended = Err(format!("{status:?}")),
            _ => {}
        }
    }
    ended
}

/// Adds that each state follows from the one before, from rest to rest at the step.
fn motion(axis: &Axis, layout: &Layout, units: &Units, rows: &mut Rows) {
    let n_ticks = layout.n_ticks;
    for tick in 0..n_ticks {
        for (position, &to) in axis.active.iter().enumerate() {
            let mut entries =
                vec![(layout.voltage(tick), axis.step.b[to] * units.voltage / units.state[to])];
            if tick > 0 {
                for (from_position, &from) in axis.active.iter().enumerate() {
                    let gain = axis.step.a[(to, from)] * units.state[from] / units.state[to];
                    entries.push((layout.state(tick, from_position), gain));
                }
            }
            if tick + 1 < n_ticks {
                entries.push((layout.state(tick + 1, position), -1.0));
            } else if to == 0 {
                entries.push((layout.rest(), -1.0));
            }
            rows.add(entries, 0.0);
        }
    }
}

/// Adds a circular cone: what speed, current and voltage leave behind in one plant's vibration is
/// at most one, in units of its bound.
fn residual(axis: &Axis, plant: &Plant, layout: &Layout, units: &Units, rows: &mut Rows) {
    let mode: Matrix2<f64> = plant.step.a.fixed_view::<2, 2>(2, 2).into();
    let bound = axis.residual_max_rad;
    // From the state at the end of a tick to (q, q'/omega) at the end of the jump.
    let mut later = Matrix2::new(1.0 / bound, 0.0, 0.0, 1.0 / (bound * plant.omega));
    let mut entries = [Vec::new(), Vec::new()];
    for tick in (0..layout.n_ticks).rev() {
        for (component, entries) in entries.iter_mut().enumerate() {
            let weight = |gain_q: f64, gain_speed: f64| {
                later[(component, 0)] * gain_q + later[(component, 1)] * gain_speed
            };
            let (b, a) = (&plant.step.b, &plant.step.a);
            entries.push((layout.voltage(tick), weight(b[2], b[3]) * units.voltage));
            if tick > 0 {
                for (position, &from) in axis.active.iter().enumerate() {
                    let gain = weight(a[(2, from)], a[(3, from)]) * units.state[from];
                    entries.push((layout.state(tick, position), gain));
                }
            }
        }
        later *= mode;
    }
    rows.add([], 1.0);
    for entries in entries {
        rows.add(entries, 0.0);
    }
}

/// Adds the limits of voltage and current.
fn bounds(axis: &Axis, layout: &Layout, units: &Units, rows: &mut Rows) {
    let current = axis.current_max_a / units.state[CURRENT];
    let position = axis.active.len() - 1;
    for tick in 0..layout.n_ticks {
        for sign in [1.0, -1.0] {
            rows.add([(layout.voltage(tick), sign)], 1.0);
            if tick > 0 {
                rows.add([(layout.state(tick, position), sign)], current);
                for (weights, gain) in &axis.bounded {
                    let entries = axis.active.iter().enumerate().map(|(position, &state)| {
                        let weight = weights[state] * units.state[state] / units.state[CURRENT];
                        (layout.state(tick, position), weight * sign)
                    });
                    let gain = gain * units.voltage / units.state[CURRENT] * sign;
                    rows.add(entries.chain([(layout.voltage(tick), gain)]), current);
                }
            }
        }
    }
}

/// Adds that the mirror stays near the step from the arrival on.
fn near(axis: &Axis, tube: Tube, layout: &Layout, units: &Units, rows: &mut Rows) {
    let epsilon = tube.epsilon_rad / units.state[0];
    let mirror = axis.galvo.mirror_row();
    for tick in tube.arrival..=layout.n_ticks {
        for sign in [1.0, -1.0] {
            let mut entries = vec![(layout.step(), -sign)];
            if tick == layout.n_ticks {
                entries.push((layout.rest(), sign));
            } else {
                for (position, &state) in axis.active.iter().enumerate() {
                    let gain = sign * mirror[state] * units.state[state] / units.state[0];
                    entries.push((layout.state(tick, position), gain));
                }
            }
            rows.add(entries, epsilon);
        }
    }
}
