//! Voltages that make an axis follow a profile exactly, the mode's back-EMF included.

use super::Motion;
use super::profile::Profile;
use ftheta_physics::envelope::mode_rad;
use ftheta_physics::galvo::{CURRENT, Galvo, State};

/// Longest time between two voltages, s: an analogue drive, for a 10 µs controller.
const HOLD_S: f64 = 0.5e-6;
/// Time in which rounding of the current is made up for, s.
const CORRECTION_S: f64 = 20e-6;
/// The drive holds the current at zero until the mode is at this part of the tolerance, or for
/// this long, s.
const QUIET: f64 = 0.05;
const QUIET_MAX_S: f64 = 0.25;

/// The voltages of a profile on the nominal axis.
///
/// Every voltage is the one that brings the current to the law's value at the end of its hold,
/// so that the current follows the law although rotor speed, mode included, pushes back. After
/// the law's end the current is held at zero until the mode has faded.
pub(super) fn motion(profile: &Profile, galvo: &Galvo, tolerance_rad: f64) -> Motion {
    let plan_s = profile.duration_s();
    let n_plan = (plan_s / HOLD_S).ceil().max(1.0) as usize;
    let hold_s = plan_s / n_plan as f64;
    let step = galvo.step(hold_s);
    let amperes = galvo.inertia() / galvo.torque_constant;
    let n_most = n_plan + (QUIET_MAX_S / hold_s) as usize;
    let mut state = State::zeros();
    let (mut angle, mut speed, mut before) = (0.0, 0.0, 0.0);
    let mut voltages_v = Vec::with_capacity(n_plan);
    while voltages_v.len() < n_plan
        || voltages_v.len() < n_most && mode_rad(galvo, &state) > QUIET * tolerance_rad
    {
        let acceleration = profile.acceleration((voltages_v.len() + 1) as f64 * hold_s);
        let lag = angle - state[0] + 2.0 * CORRECTION_S * (speed - state[1]);
        let target_a = amperes * (acceleration + lag / (CORRECTION_S * CORRECTION_S));
        let free_a = step.a.row(CURRENT).transpose().dot(&state);
        let voltage_v = (target_a - free_a) / step.b[CURRENT];
        state = step.a * state + step.b * voltage_v;
        voltages_v.push(voltage_v);
        angle += hold_s * (speed + hold_s * (2.0 * before + acceleration) / 6.0);
        speed += 0.5 * hold_s * (before + acceleration);
        before = acceleration;
    }
    Motion { plan_s, hold_s, voltages_v }
}
