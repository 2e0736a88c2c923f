//! Makes a solver's voltages exact: rest at the end, limits kept also inside the ticks.

use super::axis::{Axis, Plant, Reach};
use ftheta_physics::galvo::{State, Step};
use nalgebra::{DMatrix, DVector};

/// Corrections until the end is at rest to rounding.
const N_CORRECTIONS: usize = 4;
/// Rest at the end, as a part of the step.
const REST: f64 = 1e-10;
/// So that rounding in a later scaling cannot pass a limit.
const INSIDE: f64 = 1.0 - 1e-11;
/// A saturated tick may move by this part of what a free one does.
const SATURATED: f64 = 1e-6;

/// The same voltages, corrected; `None` if they do not come to rest, as with too few ticks.
///
/// An interior-point solution ends at rest to about 1e-9 of its largest state. The correction of
/// least norm on the ticks with voltage to spare brings it to rounding; then everything is scaled
/// down, by about as much, until no limit is passed.
pub(super) fn polish(axis: &Axis, mut voltages_v: Vec<f64>) -> Option<Reach> {
    let rest = rest_units(axis);
    let columns = end_columns(axis, voltages_v.len(), &rest);
    for _ in 0..N_CORRECTIONS {
        let (end, _) = run(axis, &voltages_v);
        let defect = DVector::from_iterator(
            rest.len(),
            rest.iter().map(|&(state, unit)| -end[state] / unit),
        );
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
    let (_, peak_current_a) = run(axis, &voltages_v);
    let peak_voltage_v = voltages_v.iter().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
    let room = (axis.voltage_max_v / peak_voltage_v)
        .min(axis.current_max_a / peak_current_a)
        .min(axis.residual_max_rad / residual_rad(axis, &voltages_v))
        .min(1.0);
    for voltage in &mut voltages_v {
        *voltage *= room * INSIDE;
    }
    let (end, _) = run(axis, &voltages_v);
    let step_rad = end[0];
    let at_rest = rest.iter().all(|&(state, unit)| end[state].abs() <= REST * step_rad * unit);
    at_rest.then_some(Reach { step_rad, voltages_v })
}

/// States that must be zero at the end, with what of each counts like one radian.
fn rest_units(axis: &Axis) -> Vec<(usize, f64)> {
    let omega = axis.galvo.omega;
    let acceleration = axis.galvo.torque_constant / axis.galvo.inertia();
    let units = [1.0, omega, 1.0, omega, omega * omega / acceleration];
    axis.active.iter().skip(1).map(|&state| (state, units[state])).collect()
}

/// How each voltage changes the states that must be zero, in their units.
fn end_columns(axis: &Axis, n_ticks: usize, rest: &[(usize, f64)]) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(rest.len(), n_ticks);
    let mut effect = axis.step.b;
    for tick in (0..n_ticks).rev() {
        for (row, &(state, unit)) in rest.iter().enumerate() {
            columns[(row, tick)] = effect[state] / unit;
        }
        effect = axis.step.a * effect;
    }
    columns
}

/// End state and greatest current, from rest at zero.
fn run(axis: &Axis, voltages_v: &[f64]) -> (State, f64) {
    let mut state = State::zeros();
    let mut peak_current_a = 0.0_f64;
    for &voltage in voltages_v {
        peak_current_a = peak_current_a.max(axis.peak_current_a(&state, voltage));
        state = axis.advance(&state, voltage);
    }
    (state, peak_current_a)
}

/// Greatest residual vibration of the uncertain plants, rad.
fn residual_rad(axis: &Axis, voltages_v: &[f64]) -> f64 {
    let residual = |plant: &Plant| {
        let Step { a, b } = plant.step;
        let end = voltages_v.iter().fold(State::zeros(), |state, voltage| a * state + b * *voltage);
        end[2].hypot(end[3] / plant.omega)
    };
    axis.plants.iter().map(residual).fold(0.0, f64::max)
}
