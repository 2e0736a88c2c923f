//! Transitions by a program for each: the fewest ticks there are, for one axis or two together.

use super::program::Way;
use super::transition::ask;
use super::{Ask, Axis, AxisOptions, JumpError, Route};
use ftheta_model::machine::Scanner;

/// From here on one tick more or less is less than a hundredth, and not every number is tried.
const N_TICKS_EACH: usize = 200;
/// Most ticks that are tried.
const N_TICKS_MAX: usize = 2000;

/// The voltages of each axis that take all of them along their routes in the fewest common ticks,
/// within the angles; `None` if no number of ticks up to 2000 does.
///
/// Feasible numbers have gaps when ends move, so they are tried one by one, from the fewest that
/// the greatest torque allows.
///
/// # Errors
/// If a parameter is out of range or a program fails.
///
/// # Accuracy
/// As [`Axis::longest`]. Above 200 ticks up to 1 % more than the fewest.
pub fn fewest_ticks_between(
    scanner: &Scanner,
    options: AxisOptions,
    routes: &[Route],
) -> Result<Option<Vec<Vec<f64>>>, JumpError> {
    let axis = Axis::new(scanner, options)?;
    let (angle_max_rad, speed_max_rad_s) = (scanner.angle_max_rad, scanner.speed_max_rad_s);
    for route in routes {
        check("start angle rad", route.from_rad, angle_max_rad)?;
        check("end angle rad", route.to_rad, angle_max_rad)?;
        check("start speed rad/s", route.from_rad_s, speed_max_rad_s)?;
        check("end speed rad/s", route.to_rad_s, speed_max_rad_s)?;
    }
    let mut n_ticks = 1;
    while n_ticks <= N_TICKS_MAX {
        if routes.iter().all(|route| may_reach(&axis, route, n_ticks)) {
            let found: Result<Option<Vec<_>>, _> =
                routes.iter().map(|route| reach(&axis, route, angle_max_rad, n_ticks)).collect();
            if let Some(voltages_v) = found? {
                return Ok(Some(voltages_v));
            }
        }
        n_ticks += 1 + n_ticks.saturating_sub(N_TICKS_EACH) / 100;
    }
    Ok(None)
}

fn check(quantity: &'static str, value: f64, high: f64) -> Result<(), JumpError> {
    if (-high..=high).contains(&value) {
        return Ok(());
    }
    Err(JumpError::Parameter { quantity, value, low: -high, high })
}

/// Whether the greatest torque could do it, without resonance, coil or voltage.
fn may_reach(axis: &Axis, route: &Route, n_ticks: usize) -> bool {
    let duration_s = n_ticks as f64 * axis.tick_s;
    let speed_rad_s = axis.acceleration_max_rad_s2() * duration_s;
    let mean_rad_s = 0.5 * (route.from_rad_s + route.to_rad_s);
    let distance_rad = (route.to_rad - route.from_rad - mean_rad_s * duration_s).abs();
    let slack_rad = if axis.creeps() { 2.0 * axis.residual_max_rad } else { 0.0 };
    (route.to_rad_s - route.from_rad_s).abs() <= speed_rad_s
        && distance_rad <= 0.25 * speed_rad_s * duration_s + slack_rad
}

/// The voltages of one axis in this many ticks.
fn reach(
    axis: &Axis,
    route: &Route,
    angle_max_rad: f64,
    n_ticks: usize,
) -> Result<Option<Vec<f64>>, JumpError> {
    let ask = ask(route);
    if ask == (Ask { distance_rad: 0.0, from_rad_s: 0.0, to_rad_s: 0.0 }) {
        return Ok(Some(vec![0.0; n_ticks]));
    }
    let way = Way::Within(-angle_max_rad - route.from_rad, angle_max_rad - route.from_rad);
    axis.meet(&ask, way, n_ticks)
}
