//! Makes a solver's voltages exact: the end met, limits kept also inside the ticks.

use super::axis::{Axis, Look, Plant};
use super::held::{Deviation, Held};
use super::program::{Ends, Request, Solution};
use ftheta_physics::galvo::{State, Step};
use nalgebra::{DMatrix, DVector};

/// Corrections until the end is met to rounding.
const N_CORRECTIONS: usize = 4;
/// Defect at the end, as a part of the largest of the ends.
const REST: f64 = 1e-10;
/// So that rounding in a later scaling cannot pass a limit.
const INSIDE: f64 = 1.0 - 1e-11;
/// A saturated tick may move by this part of what a free one does.
const SATURATED: f64 = 1e-6;

/// The factor and the voltages, corrected; `None` if the end is not met, as with too few ticks.
///
/// An interior-point solution meets the end to about 1e-9 of its largest state. The correction of
/// least norm on the ticks with voltage to spare brings it to rounding; then everything is scaled
/// down, by about as much, until no limit is passed.
pub(super) fn polish(
    axis: &Axis,
    request: &Request,
    solution: Solution,
) -> Option<(f64, Vec<f64>)> {
    let Solution { mut factor, mut voltages_v } = solution;
    let ends = &request.ends;
    let rows = end_rows(axis, ends);
    let columns = end_columns(axis, voltages_v.len(), &rows);
    for _ in 0..N_CORRECTIONS {
        let defect = -defect(axis, ends, factor, &voltages_v, &rows);
        let room = |voltage: &f64| (1.0 - (voltage / axis.voltage_max_v).abs()).max(SATURATED);
        let room = DVector::from_iterator(voltages_v.len(), voltages_v.iter().map(room));
        let weighted = DMatrix::from_fn(columns.nrows(), columns.ncols(), |row, column| {
            columns[(row, column)] * room[column]
        });
        let multipliers = (&weighted * columns.transpose()).lu().solve(&defect)?;
        let change = weighted.transpose() * multipliers;
        for (voltage, change) in voltages_v.iter_mut().zip(&change) {
            *voltage += change;
        }
    }
    let (_, peak_current_a) = run(axis, ends, factor, &voltages_v);
    let peak_voltage_v = voltages_v.iter().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
    let room = (axis.voltage_max_v / peak_voltage_v)
        .min(axis.current_max_a / peak_current_a)
        .min(axis.residual_max_rad / residual_rad(axis, ends, factor, &voltages_v))
        .min(axis.residual_max_rad / held_rad(axis, ends, factor, &voltages_v))
        .min(1.0)
        * INSIDE;
    voltages_v.iter_mut().for_each(|voltage| *voltage *= room);
    factor *= room;
    let sizes = rows
        .iter()
        .map(|row| row.weights.dot(&ends.end).abs() + row.weights.dot(&ends.start).abs());
    let angle = if ends.place { ends.end[0].abs() } else { 0.0 };
    let size = factor * sizes.fold(angle, f64::max);
    let met = defect(axis, ends, factor, &voltages_v, &rows).amax() <= REST * size;
    met.then_some((factor, voltages_v))
}

/// Something that must be met at the end.
struct EndRow {
    /// Weights of the states in it, rad.
    weights: State,
    /// Whether it is the angle to which the axis creeps.
    creep: bool,
}

/// What must be met at the end, with what of each counts like one radian.
fn end_rows(axis: &Axis, ends: &Ends) -> Vec<EndRow> {
    let omega = axis.galvo.omega;
    let acceleration = axis.galvo.torque_constant / axis.galvo.inertia();
    let units = [1.0, omega, 1.0, omega, omega * omega / acceleration];
    let row = |state: usize| {
        let mut weights = State::zeros();
        weights[state] = units[state].recip();
        EndRow { weights, creep: false }
    };
    let mut rows: Vec<EndRow> = axis.rest.iter().map(|&state| row(state)).collect();
    if ends.place && !axis.rests_anywhere {
        rows.push(match axis.creeps() {
            true => EndRow { weights: axis.creep_row(), creep: true },
            false => row(0),
        });
    }
    rows
}

/// By how much each row is missed at the end, rad.
fn defect(
    axis: &Axis,
    ends: &Ends,
    factor: f64,
    voltages_v: &[f64],
    rows: &[EndRow],
) -> DVector<f64> {
    let (end, _) = run(axis, ends, factor, voltages_v);
    let missed = end - ends.end * factor;
    let place_rad = place_rad(axis, ends, factor, voltages_v);
    let values =
        rows.iter().map(|row| if row.creep { place_rad } else { row.weights.dot(&missed) });
    DVector::from_iterator(rows.len(), values)
}

/// How far the place of rest is off the target, rad.
fn place_rad(axis: &Axis, ends: &Ends, factor: f64, voltages_v: &[f64]) -> f64 {
    axis.creep_rad(voltages_v) - axis.creep_row().dot(&(ends.end - ends.start)) * factor
}

/// How each voltage changes the rows, rad/V.
fn end_columns(axis: &Axis, n_ticks: usize, rows: &[EndRow]) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(rows.len(), n_ticks);
    let mut effect = axis.step.b;
    for tick in (0..n_ticks).rev() {
        for (index, row) in rows.iter().enumerate() {
            columns[(index, tick)] =
                if row.creep { axis.creep_rad(&[1.0]) } else { row.weights.dot(&effect) };
        }
        effect = axis.step.a * effect;
    }
    columns
}

/// End state and greatest current.
fn run(axis: &Axis, ends: &Ends, factor: f64, voltages_v: &[f64]) -> (State, f64) {
    let mut state = ends.start * factor;
    let mut peak_current_a = 0.0_f64;
    for &voltage in voltages_v {
        peak_current_a = peak_current_a.max(axis.peak_current_a(&state, voltage));
        state = axis.advance(&state, voltage);
    }
    (state, peak_current_a)
}

/// Greatest distance of the uncertain plants from what the end must be, rad.
fn residual_rad(axis: &Axis, ends: &Ends, factor: f64, voltages_v: &[f64]) -> f64 {
    let place_rad =
        if axis.rests_anywhere { place_rad(axis, ends, factor, voltages_v) } else { 0.0 };
    let residual = |plant: &Plant| {
        let Step { a, b } = plant.step;
        let start = ends.start * factor;
        let end = voltages_v.iter().fold(start, |state, voltage| a * state + b * *voltage);
        let missed = end - ends.end * factor;
        let at_look = |look: &Look| {
            let [creep, q, speed] = look.map(|weights| weights.dot(&missed));
            (place_rad - creep).abs() + q.hypot(speed)
        };
        plant.looks.iter().map(at_look).fold(0.0, f64::max)
    };
    axis.plants.iter().map(residual).fold(0.0, f64::max)
}

/// Greatest distance of the held plants from the nominal mirror, rad.
fn held_rad(axis: &Axis, ends: &Ends, factor: f64, voltages_v: &[f64]) -> f64 {
    let distance = |plant: &Held| {
        let mut state = ends.start * factor;
        let mut deviation = Deviation::zeros();
        for &voltage_v in voltages_v {
            deviation = plant.advance(&deviation, &state, voltage_v);
            state = axis.advance(&state, voltage_v);
        }
        plant.looks.iter().map(|weights| weights.dot(&deviation).abs()).fold(0.0, f64::max)
    };
    axis.held.iter().map(distance).fold(0.0, f64::max)
}
