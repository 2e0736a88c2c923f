//! Moving ends in a given number of ticks: rays to the longest transitions in several directions,
//! and what lies between them.
//!
//! Seen from a frame that coasts at the mean of both end speeds, a transition is a displacement and
//! a gain in speed, equal and opposite at both ends. What can be reached in a number of ticks is
//! convex and symmetric in these two, so between two neighbouring rays everything up to their chord
//! is reached by adding their voltages in shares. Coasting itself costs its back-EMF alone.

use super::program::{Ends, Goal, Request, Way};
use super::{Axis, JumpError};
use ftheta_physics::galvo::State;

/// Rays in the upper half plane; the lower half is its mirror image.
const N_RAYS: usize = 8;

/// What one axis is asked to do: from a moving state to a moving state, both without twist and
/// current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ask {
    /// How far, rad.
    pub distance_rad: f64,
    /// Speed at the start, rad/s.
    pub from_rad_s: f64,
    /// Speed at the end, rad/s.
    pub to_rad_s: f64,
}

/// Voltages as a sum of at most two sequences in shares, and a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sum<'a> {
    /// Duration, ticks.
    pub n_ticks: usize,
    /// Sequences and their shares.
    pub terms: [Term<'a>; 2],
    /// Voltage that coasting at the mean speed takes, V.
    pub coast_v: f64,
}

/// A sequence in a sum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Term<'a> {
    /// Voltages, V; before and after them it adds nothing.
    pub sequence_v: &'a [f64],
    /// Factor on them.
    pub share: f64,
    /// Ticks before it begins.
    pub delay: usize,
}

impl<'a> Term<'a> {
    /// A sequence that begins at once.
    pub fn new(sequence_v: &'a [f64], share: f64) -> Self {
        Self { sequence_v, share, delay: 0 }
    }

    #[inline]
    fn voltage_v(&self, tick: usize) -> f64 {
        let index = tick.wrapping_sub(self.delay);
        self.sequence_v.get(index).map_or(0.0, |voltage| voltage * self.share)
    }
}

impl Sum<'_> {
    /// Voltage of a tick, V.
    #[inline]
    pub fn voltage_v(&self, tick: usize) -> f64 {
        self.coast_v + self.terms[0].voltage_v(tick) + self.terms[1].voltage_v(tick)
    }
}

/// The rays of one number of ticks.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    n_ticks: usize,
    duration_s: f64,
    voltage_max_v: f64,
    torque_constant: f64,
    /// Displacement and gain in speed that count like one.
    units: [f64; 2],
    rays: Vec<Ray>,
}

/// The longest transition in one direction.
#[derive(Clone, Debug)]
struct Ray {
    /// Displacement and half the gain in speed, in units.
    tip: [f64; 2],
    voltages_v: Vec<f64>,
}

impl Fan {
    /// Solves the rays.
    ///
    /// # Errors
    /// If the parameters of the axis are impossible; a ray that is not solved is left out.
    pub(super) fn build(axis: &Axis, n_ticks: usize) -> Result<Self, JumpError> {
        let size = |displacement: f64, gain: f64| {
            Ok::<_, JumpError>(
                ray(axis, n_ticks, displacement, gain)?.map_or(0.0, |(size, _)| size),
            )
        };
        let units = [size(1.0, 0.0)?, size(0.0, 1.0)?];
        let mut fan = Self {
            n_ticks,
            duration_s: n_ticks as f64 * axis.tick_s,
            voltage_max_v: axis.voltage_max_v,
            torque_constant: axis.galvo.torque_constant,
            units,
            rays: Vec::new(),
        };
        if units[0] <= 0.0 || units[1] <= 0.0 {
            return Ok(fan);
        }
        for index in 0..N_RAYS {
            let angle = std::f64::consts::PI * index as f64 / N_RAYS as f64;
            // Exact on the axes, so that rest to rest stays so.
            let (sine, cosine) = match index {
                0 => (0.0, 1.0),
                _ if 2 * index == N_RAYS => (1.0, 0.0),
                _ => angle.sin_cos(),
            };
            let found = ray(axis, n_ticks, cosine * units[0], sine * units[1]);
            if let Ok(Some((size, voltages_v))) = found {
                fan.rays.push(Ray { tip: [size * cosine, size * sine], voltages_v });
            }
        }
        Ok(fan)
    }

    /// The voltages for what is asked; `None` if it lies beyond the rays.
    ///
    /// Current and end error are within their limits because shares sum up to at most one; the
    /// voltage is looked at where coasting leaves less than all of it.
    pub(super) fn meet(&self, ask: &Ask) -> Option<Sum<'_>> {
        let mean_rad_s = 0.5 * (ask.from_rad_s + ask.to_rad_s);
        let displacement = (ask.distance_rad - mean_rad_s * self.duration_s) / self.units[0];
        let gain = 0.5 * (ask.to_rad_s - ask.from_rad_s) / self.units[1];
        let sign = if gain < 0.0 { -1.0 } else { 1.0 };
        let point = [sign * displacement, sign * gain];
        if !point[0].is_finite() || !point[1].is_finite() {
            return None;
        }
        let coast_v = self.torque_constant * mean_rad_s;
        let n_rays = self.rays.len();
        for index in 0..n_rays {
            // The ray after the last is the first one backwards.
            let (next, turn) = if index + 1 < n_rays { (index + 1, 1.0) } else { (0, -1.0) };
            let first = self.rays[index].tip;
            let second = self.rays[next].tip.map(|value| turn * value);
            let area = cross(first, second);
            let shares = [cross(point, second) / area, cross(first, point) / area];
            if area <= 0.0 || shares[0] < 0.0 || shares[1] < 0.0 {
                continue;
            }
            if shares[0] + shares[1] > 1.0 {
                return None;
            }
            let sum = Sum {
                n_ticks: self.n_ticks,
                terms: [
                    Term::new(&self.rays[index].voltages_v, sign * shares[0]),
                    Term::new(&self.rays[next].voltages_v, sign * turn * shares[1]),
                ],
                coast_v,
            };
            let safe = (shares[0] + shares[1]) * self.voltage_max_v + coast_v.abs();
            let keeps =
                || (0..self.n_ticks).all(|tick| sum.voltage_v(tick).abs() <= self.voltage_max_v);
            return (safe <= self.voltage_max_v || keeps()).then_some(sum);
        }
        None
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The greatest multiple of a displacement and half gain in speed, and its voltages.
fn ray(
    axis: &Axis,
    n_ticks: usize,
    displacement_rad: f64,
    gain_rad_s: f64,
) -> Result<Option<(f64, Vec<f64>)>, JumpError> {
    let start = State::new(0.0, -gain_rad_s, 0.0, 0.0, 0.0);
    let end = State::new(displacement_rad, gain_rad_s, 0.0, 0.0, 0.0);
    let ends = Ends { start, end, place: true };
    axis.best(&Request { n_ticks, ends, goal: Goal::Farthest, way: Way::Free })
}
