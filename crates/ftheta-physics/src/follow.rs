//! The inverse of servo and motor: from wanted mirror angles to commands, states and voltages.
//!
//! A flexible axis has no stable exact inverse for any motion, but it has one for every polynomial.
//! The weights here are those that are right for polynomials as long as there are weights, so that
//! motion which bends little within a few ticks is followed to nanometres.

use crate::galvo::{Galvo, State};
use crate::servo::Gains;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// Wanted angles from this many ticks before to [`TAPS_AFTER`] ticks after have weights.
pub const TAPS_BEFORE: usize = 4;
/// See [`TAPS_BEFORE`].
pub const TAPS_AFTER: usize = 5;
/// Number of weights.
pub const N_TAPS: usize = TAPS_BEFORE + 1 + TAPS_AFTER;

/// Weights of wanted mirror angles, ticks -4 to 5.
pub type Taps = [f64; N_TAPS];

/// What follows from wanted mirror angles at a tick.
#[derive(Clone, Debug)]
pub struct Inverse {
    /// Command sent at the tick, rad; `None` for a servo with a memory of its own.
    pub reference: Option<Taps>,
    /// State at the tick.
    pub state: [Taps; 5],
    /// Voltage acting from the tick to the next, V.
    pub voltage: Taps,
}

impl Inverse {
    /// Weights for an axis; `None` if it is so degenerate that it cannot be moved.
    ///
    /// # Accuracy
    /// Commands of an S10 at 10 µs: a sine of 637 Hz is followed within 1e-9 of its amplitude, one
    /// of 2 kHz within 1e-7.
    pub fn new(galvo: &Galvo, gains: &Gains, tick_s: f64) -> Option<Self> {
        let step = galvo.step(tick_s);
        let row = galvo.mirror_row();
        // (A - 1) z + b u = what higher powers leave, c z = 1 or 0.
        let mut bordered = Matrix6::zeros();
        for i in 0..5 {
            for j in 0..5 {
                bordered[(i, j)] = step.a[(i, j)] - f64::from(u8::from(i == j));
            }
            bordered[(i, 5)] = step.b[i];
            bordered[(5, i)] = row[i];
        }
        let bordered = bordered.try_inverse()?;
        let nodes = DMatrix::from_fn(N_TAPS, N_TAPS, |power, tap| {
            // Scaled to about one, so that the powers stay comparable.
            ((tap as f64 - TAPS_BEFORE as f64) / TAPS_AFTER as f64).powi(power as i32)
        });
        let nodes = nodes.lu();
        let powers: Vec<(State, f64, f64)> =
            (0..N_TAPS).map(|degree| at_power(&bordered, degree)).collect();
        let taps = |value: &dyn Fn(&(State, f64, f64)) -> f64| {
            let scaled = powers
                .iter()
                .enumerate()
                .map(|(degree, answer)| value(answer) / (TAPS_AFTER as f64).powi(degree as i32));
            let weights = nodes.solve(&DVector::from_iterator(N_TAPS, scaled))?;
            weights.as_slice().try_into().ok()
        };
        let reference = match gains.reference_rad(&State::zeros(), 0.0, 0.0) {
            Some(_) => Some(taps(&|(state, now_v, next_v)| {
                gains.reference_rad(state, *now_v, *next_v).unwrap_or(f64::NAN)
            })?),
            None => None,
        };
        let state = [0, 1, 2, 3, 4].map(|index| taps(&|(state, ..)| state[index]));
        let [Some(x), Some(dx), Some(q), Some(dq), Some(current)] = state else {
            return None;
        };
        let voltage = taps(&|(_, now_v, _)| *now_v)?;
        Some(Self { reference, state: [x, dx, q, dq, current], voltage })
    }

    /// State at the tick and voltage from it on, from the wanted angles around it.
    pub fn state(&self, angles_rad: &Taps) -> (State, f64) {
        let state = State::from_fn(|index, _| dot(&self.state[index], angles_rad));
        (state, dot(&self.voltage, angles_rad))
    }
}

/// Sum of weighted angles, of which there are as many as weights.
#[inline]
pub fn dot(weights: &Taps, angles_rad: &[f64]) -> f64 {
    weights.iter().zip(angles_rad).map(|(weight, angle)| weight * angle).sum()
}

/// State and voltage at tick 0, and the voltage at tick 1, of the motion whose mirror angle is
/// `tick^degree`: states and voltage are polynomials too, found from the highest power down.
fn at_power(bordered: &Matrix6<f64>, degree: usize) -> (State, f64, f64) {
    let mut powers = vec![Vector6::zeros(); degree + 1];
    for power in (0..=degree).rev() {
        let mut left = Vector6::zeros();
        let mut choose = 1.0;
        for (higher, coefficients) in powers.iter().enumerate().skip(power + 1) {
            choose *= higher as f64 / (higher - power) as f64;
            for i in 0..5 {
                left[i] += choose * coefficients[i];
            }
        }
        left[5] = f64::from(u8::from(power == degree));
        powers[power] = bordered * left;
    }
    let voltages_v = powers.iter().map(|coefficients| coefficients[5]);
    let now = powers[0];
    (State::from_fn(|index, _| now[index]), now[5], voltages_v.sum())
}
