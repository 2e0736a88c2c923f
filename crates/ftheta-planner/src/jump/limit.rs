//! The shortest time of a step: in continuous time, and in whole ticks.

use super::program::{Tube, Way};
use super::{Axis, AxisOptions, CurrentBound, JumpError, Model};
use ftheta_model::machine::Scanner;

/// Segments of constant voltage that stand for continuous time.
const N_SEGMENTS: usize = 300;
/// After the arrival the motor has this many periods of the torsional mode to come to rest.
const TAIL_PERIODS: f64 = 1.0;
/// Greatest number of segments after the arrival.
const N_TAIL_MAX: f64 = 1500.0;
/// The logarithm of the reached distance is matched to this.
const MATCH: f64 = 1e-5;
/// What is good enough where rounding leaves no better.
const MATCH_LEAST: f64 = 1e-3;
/// Secant steps; a handful is usual.
const N_TRIES: usize = 40;
/// Greatest number of ticks that are tried.
const N_TICKS_MAX: usize = 20_000;

/// Shortest time of this step from rest to rest in continuous time, s.
///
/// The inverse of the longest distance in a time, which always has a solution.
///
/// # Errors
/// If a parameter is out of range or a linear program fails.
///
/// # Accuracy
/// 300 segments: at most 0.03 % above the exact switching times.
pub fn limit_s(scanner: &Scanner, step_rad: f64, model: Model) -> Result<f64, JumpError> {
    let step_rad = step_rad.abs();
    check_step(step_rad)?;
    invert(scanner, step_rad, |time_s| {
        segmented(scanner, model, time_s)?.longest_rad(N_SEGMENTS, Way::Free)
    })
}

/// Shortest time until the mirror is within `epsilon_rad` of this step for good, s.
///
/// The motors are still at work then: the pulse that stops them ends while the mirror is near.
///
/// # Errors
/// If a parameter is out of range or a linear program fails.
///
/// # Accuracy
/// 300 segments until the arrival: 0.1 %.
pub fn settle_limit_s(
    scanner: &Scanner,
    step_rad: f64,
    epsilon_rad: f64,
) -> Result<f64, JumpError> {
    let step_rad = step_rad.abs();
    check_step(step_rad)?;
    let (low, high) = (1e-6 * step_rad, 0.5 * step_rad);
    if !(low..=high).contains(&epsilon_rad) {
        let quantity = "allowed end error rad";
        return Err(JumpError::Parameter { quantity, value: epsilon_rad, low, high });
    }
    let tube = Tube { arrival: N_SEGMENTS, epsilon_rad };
    let tail_s = TAIL_PERIODS / scanner.torsional_mode_hz;
    invert(scanner, step_rad, |time_s| {
        let n_tail = (tail_s / time_s * N_SEGMENTS as f64).ceil().clamp(2.0, N_TAIL_MAX) as usize;
        segmented(scanner, Model::Flexible, time_s)?
            .longest_rad(N_SEGMENTS + n_tail, Way::Near(tube))
    })
}

/// The axis with this time cut into segments.
fn segmented(scanner: &Scanner, model: Model, time_s: f64) -> Result<Axis, JumpError> {
    let options = AxisOptions {
        model,
        tick_s: time_s / N_SEGMENTS as f64,
        voltage_reserve: 0.0,
        // What the current bends inside ticks vanishes with the tick.
        current_bound: CurrentBound::AtTicks,
    };
    Axis::new(scanner, options)
}

/// The time, s, in which this step is reached.
fn invert(
    scanner: &Scanner,
    step_rad: f64,
    reached_rad: impl Fn(f64) -> Result<f64, JumpError>,
) -> Result<f64, JumpError> {
    let excess = |log_time: f64| {
        let reached = reached_rad(log_time.exp())?;
        Ok((reached.max(f64::MIN_POSITIVE) / step_rad).ln())
    };
    let mut time = guess_s(scanner, step_rad).ln();
    let mut error = excess(time)?;
    // The distance grows like a power of the time: 2 for long steps, 5 for short ones.
    let mut power = 3.0;
    for _ in 0..N_TRIES {
        if error.abs() < MATCH {
            return Ok(time.exp());
        }
        let next = time - error / power;
        let next_error: f64 = excess(next)?;
        let slope = (next_error - error) / (next - time);
        if slope.is_finite() {
            power = slope.clamp(0.2, 8.0);
        }
        (time, error) = (next, next_error);
    }
    if error.abs() < MATCH_LEAST {
        return Ok(time.exp());
    }
    Err(JumpError::Unsolved {
        n_ticks: N_SEGMENTS,
        tick_us: time.exp() / N_SEGMENTS as f64 * 1e6,
        status: format!("distance off by {:.1e} of the step", error.exp_m1()),
    })
}

/// Fewest ticks that reach this step from rest to rest.
///
/// # Errors
/// If a parameter is out of range, a linear program fails, or no allowed number suffices.
pub fn fewest_ticks(
    scanner: &Scanner,
    options: AxisOptions,
    step_rad: f64,
) -> Result<usize, JumpError> {
    let step_rad = step_rad.abs();
    check_step(step_rad)?;
    let axis = Axis::new(scanner, options)?;
    let reaches =
        |n_ticks| Ok(axis.longest(n_ticks)?.is_some_and(|reach| reach.step_rad >= step_rad));
    let mut low = 0;
    let mut high = (guess_s(scanner, step_rad) / options.tick_s).ceil().max(4.0) as usize;
    while !reaches(high)? {
        low = high;
        high += 1 + high / 4;
        if high > N_TICKS_MAX {
            let tick_us = options.tick_s * 1e6;
            return Err(JumpError::TooLong { step_rad, limit: N_TICKS_MAX, tick_us });
        }
    }
    while high - low > 1 {
        let middle = low.midpoint(high);
        if reaches(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(high)
}

fn check_step(step_rad: f64) -> Result<(), JumpError> {
    let (low, high) = (1e-12, 10.0);
    if (low..=high).contains(&step_rad) {
        Ok(())
    } else {
        Err(JumpError::Parameter { quantity: "step rad", value: step_rad, low, high })
    }
}

/// Rough time of a step, s: the greater of what current and voltage alone allow
/// (`design/control.md` D3).
pub(crate) fn guess_s(scanner: &Scanner, step_rad: f64) -> f64 {
    let gain = scanner.torque_constant_n_m_a / scanner.inertia_kg_m2();
    let by_current = 2.0 * (step_rad / (gain * scanner.current_max_a)).sqrt();
    let jerk = gain * scanner.voltage_max_v / scanner.inductance_h;
    by_current.max((32.0 * step_rad / jerk).cbrt())
}
