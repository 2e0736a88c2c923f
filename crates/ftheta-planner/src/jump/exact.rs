//! Transitions by a program for each: the fewest ticks there are, for one axis or two together.

use super::program::{Ends, Way};
use super::{Axis, AxisOptions, JumpError, Route};
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, State};

/// From here on one tick more or less is less than a hundredth, and not every number is tried.
const N_TICKS_EACH: usize = 200;
/// Most ticks that are tried.
const N_TICKS_MAX: usize = 2000;

/// States at both ends of a motion of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// State at the start.
    pub from: State,
    /// State at the end.
    pub to: State,
}

/// The voltages of each axis that take all of them along their routes in the fewest common ticks,
/// within the angles; `None` if no number of ticks up to 2000 does.
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
    let passages: Vec<Passage> = routes.iter().map(Passage::from).collect();
    fewest_ticks_of_passages(scanner, options, &passages, 1)
}

/// The same from any state to any other, twist and current included.
///
/// Feasible numbers have gaps when ends move, so they are tried one by one, from the fewest that
/// the greatest torque allows.
///
/// * `n_ticks_min`: fewer are not tried
///
/// # Errors
/// As [`fewest_ticks_between`].
///
/// # Accuracy
/// As [`fewest_ticks_between`]; every state at the end is met.
pub fn fewest_ticks_of_passages(
    scanner: &Scanner,
    options: AxisOptions,
    passages: &[Passage],
    n_ticks_min: usize,
) -> Result<Option<Vec<Vec<f64>>>, JumpError> {
    let axis = Axis::new(scanner, options)?;
    for passage in passages {
        passage.check(scanner)?;
    }
    let angle_max_rad = scanner.angle_max_rad;
    let mut n_ticks = n_ticks_min.max(1);
    while n_ticks <= N_TICKS_MAX {
        if passages.iter().all(|passage| passage.is_within_torque(&axis, n_ticks)) {
            let found: Result<Option<Vec<_>>, _> = passages
                .iter()
                .map(|passage| passage.voltages_v(&axis, angle_max_rad, n_ticks))
                .collect();
            if let Some(voltages_v) = found? {
                return Ok(Some(voltages_v));
            }
        }
        n_ticks += 1 + n_ticks.saturating_sub(N_TICKS_EACH) / 100;
    }
    Ok(None)
}

impl From<&Route> for Passage {
    fn from(route: &Route) -> Self {
        let state = |angle_rad, speed_rad_s| State::new(angle_rad, speed_rad_s, 0.0, 0.0, 0.0);
        Self {
            from: state(route.from_rad, route.from_rad_s),
            to: state(route.to_rad, route.to_rad_s),
        }
    }
}

impl Passage {
    fn check(&self, scanner: &Scanner) -> Result<(), JumpError> {
        for (quantity, index, high) in [
            ("angle rad", 0, scanner.angle_max_rad),
            ("speed rad/s", 1, scanner.speed_max_rad_s),
            ("twist rad", 2, scanner.angle_max_rad),
            ("speed of twist rad/s", 3, scanner.speed_max_rad_s),
            ("current A", CURRENT, scanner.current_max_a),
        ] {
            for value in [self.from[index], self.to[index]] {
                if !(-high..=high).contains(&value) {
                    return Err(JumpError::Parameter { quantity, value, low: -high, high });
                }
            }
        }
        Ok(())
    }

    /// Whether the greatest torque could do it, without resonance, coil or voltage.
    fn is_within_torque(&self, axis: &Axis, n_ticks: usize) -> bool {
        let duration_s = n_ticks as f64 * axis.tick_s;
        let gain_max_rad_s = axis.acceleration_max_rad_s2() * duration_s;
        let mean_rad_s = 0.5 * (self.from[1] + self.to[1]);
        let distance_rad = (self.to[0] - self.from[0] - mean_rad_s * duration_s).abs();
        let slack_rad = if axis.creeps() { 2.0 * axis.residual_max_rad } else { 0.0 };
        (self.to[1] - self.from[1]).abs() <= gain_max_rad_s
            && distance_rad <= 0.25 * gain_max_rad_s * duration_s + slack_rad
    }

    /// The voltages of one axis in this many ticks.
    fn voltages_v(
        &self,
        axis: &Axis,
        angle_max_rad: f64,
        n_ticks: usize,
    ) -> Result<Option<Vec<f64>>, JumpError> {
        let origin = State::new(self.from[0], 0.0, 0.0, 0.0, 0.0);
        let ends = Ends { start: self.from - origin, end: self.to - origin, place: true };
        if ends.start == State::zeros() && ends.end == State::zeros() {
            return Ok(Some(vec![0.0; n_ticks]));
        }
        let way = Way::Within(-angle_max_rad - origin[0], angle_max_rad - origin[0]);
        axis.pass(ends, way, n_ticks)
    }
}
