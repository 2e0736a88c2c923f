//! The yardstick: `rsruckig`, jerk-limited laws for the same requests, made to fit the motor.
//!
//! It knows no mode, no voltage and no angle limit. Its laws are taken as the motion of a stiff
//! axis; the voltage that takes is found by inversion, `U = R I + L I' + Kt v`, and for a row of
//! acceleration limits the greatest jerk is searched with which voltage and current keep the limits
//! of our plans. The fastest of these laws counts, as a continuous time, not rounded up to a tick.

use ftheta_model::machine::Scanner;
use ftheta_planner::jump::Route;
use rsruckig::prelude::*;
use std::time::Instant;

/// Acceleration limits tried, as parts of what the greatest current gives.
const ACCELERATIONS: [f64; 5] = [1.0, 0.9, 0.75, 0.6, 0.4];
/// Halvings of the jerk's range, on a logarithmic scale over a factor of 100.
const N_HALVINGS: usize = 10;
/// Rounding that voltage and current may carry.
const ROUNDING: f64 = 1e-9;

/// What one request took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    pub n_solves: f64,
    pub n_failed: f64,
    pub solve_s: f64,
    /// Fastest law that keeps voltage and current, s; `None` if none of those tried does.
    pub duration_s: Option<f64>,
    /// Whether that law leaves the angles on the way.
    pub leaves: bool,
}

/// The fastest law for a route that keeps voltage and current.
pub fn fastest(scanner: &Scanner, route: &Route) -> Outcome {
    let inertia = scanner.rotor_inertia_kg_m2 + scanner.mirror_inertia_kg_m2;
    let kt = scanner.torque_constant_n_m_a;
    let acceleration_max = kt * scanner.current_max_a / inertia;
    let jerk_max = kt * scanner.voltage_max_v / (scanner.inductance_h * inertia);
    let mut outcome = Outcome::default();
    for part in ACCELERATIONS {
        let (mut low, mut high) = (0.01_f64, 1.0_f64);
        for _ in 0..N_HALVINGS {
            let middle = (low * high).sqrt();
            let limits = [part * acceleration_max, middle * jerk_max];
            match law(scanner, route, limits, &mut outcome) {
                Some((duration_s, leaves)) => {
                    low = middle;
                    if outcome.duration_s.is_none_or(|best| duration_s < best) {
                        (outcome.duration_s, outcome.leaves) = (Some(duration_s), leaves);
                    }
                }
                None => high = middle,
            }
        }
    }
    outcome
}

/// Duration of a law, and whether it leaves the angles; `None` if voltage or current pass.
fn law(
    scanner: &Scanner,
    route: &Route,
    [acceleration, jerk]: [f64; 2],
    outcome: &mut Outcome,
) -> Option<(f64, bool)> {
    // Degrees and milliseconds: with radians and seconds its thresholds do not fit the jerks.
    let unit = |value: f64, order: i32| value.to_degrees() * 1e-3_f64.powi(order);
    let mut input = InputParameter::<1>::new(None);
    input.current_position[0] = unit(route.from_rad, 0);
    input.target_position[0] = unit(route.to_rad, 0);
    input.current_velocity[0] = unit(route.from_rad_s, 1);
    input.target_velocity[0] = unit(route.to_rad_s, 1);
    input.max_velocity[0] = unit(scanner.speed_max_rad_s, 1);
    input.max_acceleration[0] = unit(acceleration, 2);
    input.max_jerk[0] = unit(jerk, 3);
    let mut solver = Ruckig::<1, ThrowErrorHandler>::new(None, 0.01);
    let mut trajectory = Trajectory::<1>::new(None);
    let started = Instant::now();
    let result = solver.calculate(&input, &mut trajectory);
    outcome.solve_s += started.elapsed().as_secs_f64();
    outcome.n_solves += 1.0;
    if !matches!(result, Ok(RuckigResult::Working | RuckigResult::Finished)) {
        outcome.n_failed += 1.0;
        return None;
    }
    let profile = &trajectory.profiles[0][0];
    if !keeps(scanner, profile) {
        return None;
    }
    let extrema = profile.get_position_extrema();
    let limit_deg = scanner.angle_max_rad.to_degrees();
    let leaves = extrema.min.abs().max(extrema.max.abs()) > limit_deg * (1.0 + ROUNDING);
    Some((trajectory.get_duration() * 1e-3, leaves))
}

/// Whether the stiff axis needs no more than all voltage and current for a law.
fn keeps(scanner: &Scanner, profile: &Profile) -> bool {
    let inertia = scanner.rotor_inertia_kg_m2 + scanner.mirror_inertia_kg_m2;
    let (kt, resistance) = (scanner.torque_constant_n_m_a, scanner.resistance_ohm);
    let amperes = inertia / kt;
    (0..7).filter(|&piece| profile.t[piece] > 0.0).all(|piece| {
        let [a, v, j] = [
            profile.a[piece].to_radians() * 1e6,
            profile.v[piece].to_radians() * 1e3,
            profile.j[piece].to_radians() * 1e9,
        ];
        let time_s = profile.t[piece] * 1e-3;
        // The voltage is a parabola in each piece: its ends and its summit.
        let summit_s = -(resistance * amperes * j + kt * a) / (kt * j);
        let inside = if (0.0..=time_s).contains(&summit_s) { summit_s } else { 0.0 };
        [0.0, inside, time_s].into_iter().all(|t| {
            let (current_a, rate) = (amperes * (a + j * t), amperes * j);
            let speed = v + a * t + 0.5 * j * t * t;
            let voltage_v = resistance * current_a + scanner.inductance_h * rate + kt * speed;
            current_a.abs() <= scanner.current_max_a * (1.0 + ROUNDING)
                && voltage_v.abs() <= scanner.voltage_max_v * (1.0 + ROUNDING)
        })
    })
}
