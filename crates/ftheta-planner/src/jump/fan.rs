//! Moving ends in a given number of ticks: rays to the longest transitions in several directions,
//! and what lies between them.
//!
//! Seen from a frame that coasts at the mean of both end speeds, a transition is a displacement and
//! a gain in speed, equal and opposite at both ends. What can be reached in a number of ticks is
//! convex and symmetric in these two, so between two neighbouring rays everything up to their chord
//! is reached by adding their voltages in shares. Coasting itself costs its back-EMF alone.

use super::program::{Ends, Goal, Request, Way};
use super::{Atlas, Axis};
use ftheta_physics::galvo::State;
use std::sync::{LazyLock, OnceLock};

/// Rays in the upper half plane; the lower half is its mirror image.
const N_RAYS: usize = 8;
/// Powers of time that displacement and gain grow with at most.
const GROWTH: [i32; 2] = [5, 4];
/// The ray of displacement alone, from rest to rest.
const DISPLACEMENT: usize = 0;
/// The ray of gain in speed alone.
const GAIN: usize = N_RAYS / 2;

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

/// The rays of one number of ticks; a ray is solved when it is first needed, and depends on no
/// other but the two along the axes, which are the units of the rest.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    n_ticks: usize,
    rays: [OnceLock<Option<Ray>>; N_RAYS],
}

/// The longest transition in one direction of a fan.
#[derive(Clone, Debug)]
struct Ray {
    /// Along the axes the displacement (rad) or half the gain in speed (rad/s), in other
    /// directions a factor on both of them.
    size: f64,
    /// Voltage of each tick, V.
    voltages_v: Vec<f64>,
}

impl Fan {
    /// A fan of which at most what the atlas has solved is solved.
    pub(super) fn new(atlas: &Atlas, n_ticks: usize) -> Self {
        let mut fan = Self { n_ticks, rays: Default::default() };
        if let Some((size, voltages_v)) = atlas.solved(n_ticks) {
            let voltages_v = voltages_v.to_vec();
            fan.rays[DISPLACEMENT] = Some(Ray { size, voltages_v }).into();
        }
        fan
    }

    pub(super) fn n_ticks(&self) -> usize {
        self.n_ticks
    }

    /// The rays solved so far by their index, but for that of the atlas: size and voltages, `None`
    /// where there is none.
    pub(super) fn solved(&self, atlas: &Atlas) -> impl Iterator<Item = (usize, Option<Vec<f64>>)> {
        let n_atlas = usize::from(atlas.solved(self.n_ticks).is_some());
        let numbers = |ray: &Ray| [&[ray.size], &ray.voltages_v[..]].concat();
        let solved = move |(index, ray): (usize, &OnceLock<Option<Ray>>)| {
            Some((index, ray.get()?.as_ref().map(numbers)))
        };
        self.rays.iter().enumerate().skip(n_atlas).filter_map(solved)
    }

    /// Takes back a ray of [`Self::solved`]; one that does not fit is left out.
    pub(super) fn restore(&self, index: usize, numbers: Option<&[f64]>) {
        let fits = |numbers: &[f64]| {
            numbers.len() == 1 + self.n_ticks
                && numbers[0] > 0.0
                && numbers.iter().all(|number| number.is_finite())
        };
        if let Some(slot) = self.rays.get(index)
            && numbers.is_none_or(fits)
        {
            let ray = |numbers: &[f64]| Ray { size: numbers[0], voltages_v: numbers[1..].to_vec() };
            // What is solved already is the same.
            slot.get_or_init(|| numbers.map(ray));
        }
    }

    /// The voltages for what is asked; `None` if it lies beyond the rays.
    ///
    /// Current and end error are within their limits because shares sum up to at most one; the
    /// voltage is looked at where coasting leaves less than all of it.
    pub(super) fn meet(&self, axis: &Axis, ask: &Ask) -> Option<Sum<'_>> {
        let terms = self.terms(axis, ask, self.n_ticks)?;
        let shares = terms[0].share.abs() + terms[1].share.abs();
        if shares > 1.0 {
            return None;
        }
        let coast_v = axis.galvo.torque_constant * ask.mean_rad_s();
        let sum = Sum { n_ticks: self.n_ticks, terms, coast_v };
        let safe = shares * axis.voltage_max_v + coast_v.abs();
        let keeps =
            || (0..self.n_ticks).all(|tick| sum.voltage_v(tick).abs() <= axis.voltage_max_v);
        (safe <= axis.voltage_max_v || keeps()).then_some(sum)
    }

    /// Whether so many ticks, more than this fan's, might meet what is asked, as far as this fan
    /// tells.
    pub(super) fn may_grow_to(&self, axis: &Axis, ask: &Ask, n_ticks: usize) -> bool {
        let terms = self.terms(axis, ask, n_ticks);
        terms.is_none_or(|[first, second]| first.share.abs() + second.share.abs() <= 1.0)
    }

    /// The two rays next to what is asked, in the shares that make it; `None` if the axis cannot be
    /// moved in so many ticks.
    ///
    /// * `n_ticks`: of what is asked; with more than the fan's own the rays are taken as longer
    fn terms(&self, axis: &Axis, ask: &Ask, n_ticks: usize) -> Option<[Term<'_>; 2]> {
        let units = [self.ray(axis, DISPLACEMENT)?.size, self.ray(axis, GAIN)?.size];
        let longer = n_ticks as f64 / self.n_ticks as f64;
        let displacement = ask.displacement_rad(n_ticks as f64 * axis.tick_s)
            / (units[0] * longer.powi(GROWTH[0]));
        let gain = 0.5 * ask.gain_rad_s() / (units[1] * longer.powi(GROWTH[1]));
        let sign = if gain < 0.0 { -1.0 } else { 1.0 };
        let point = [sign * displacement, sign * gain];
        if !point[0].is_finite() || !point[1].is_finite() {
            return None;
        }
        let between =
            |pair: &[[f64; 2]]| cross(pair[0], point) >= 0.0 && cross(point, pair[1]) >= 0.0;
        let index = DIRECTIONS.windows(2).position(between)?;
        // A ray that could not be solved is left out.
        let (first, from) = (0..=index).rev().find_map(|index| self.tip(axis, index))?;
        let (second, to) = (index + 1..=N_RAYS).find_map(|index| self.tip(axis, index))?;
        let area = cross(from, to);
        // Beside a ray rounding may leave a share below zero.
        let shares = [cross(point, to) / area, cross(from, point) / area].map(|s| s.max(0.0));
        // The ray after the last is the first one backwards.
        let turn = if second == N_RAYS { -1.0 } else { 1.0 };
        let term = |index: usize, share: f64| {
            Some(Term::new(&self.ray(axis, index % N_RAYS)?.voltages_v, share))
        };
        Some([term(first, sign * shares[0])?, term(second, sign * turn * shares[1])?])
    }

    /// A ray and where it ends, in units.
    fn tip(&self, axis: &Axis, index: usize) -> Option<(usize, [f64; 2])> {
        let size = match index % N_RAYS {
            DISPLACEMENT | GAIN => 1.0,
            other => self.ray(axis, other)?.size,
        };
        Some((index, DIRECTIONS[index].map(|part| part * size)))
    }

    fn ray(&self, axis: &Axis, index: usize) -> Option<&Ray> {
        let solve = || match index {
            DISPLACEMENT => ray(axis, self.n_ticks, [1.0, 0.0]),
            GAIN => ray(axis, self.n_ticks, [0.0, 1.0]),
            _ => {
                let units = [self.ray(axis, DISPLACEMENT)?.size, self.ray(axis, GAIN)?.size];
                let parts = DIRECTIONS[index];
                ray(axis, self.n_ticks, [parts[0] * units[0], parts[1] * units[1]])
            }
        };
        self.rays[index].get_or_init(solve).as_ref()
    }
}

impl Ask {
    fn mean_rad_s(&self) -> f64 {
        0.5 * (self.from_rad_s + self.to_rad_s)
    }

    /// Displacement in the frame that coasts at the mean speed, rad.
    pub(super) fn displacement_rad(&self, duration_s: f64) -> f64 {
        self.distance_rad - self.mean_rad_s() * duration_s
    }

    /// Gain in speed, rad/s.
    pub(super) fn gain_rad_s(&self) -> f64 {
        self.to_rad_s - self.from_rad_s
    }
}

/// Directions of the rays and of the first one backwards, exact on the axes, so that rest to rest
/// stays so.
static DIRECTIONS: LazyLock<[[f64; 2]; N_RAYS + 1]> = LazyLock::new(|| {
    std::array::from_fn(|index| match index {
        DISPLACEMENT => [1.0, 0.0],
        GAIN => [0.0, 1.0],
        N_RAYS => [-1.0, 0.0],
        _ => {
            let (sine, cosine) = (std::f64::consts::PI * index as f64 / N_RAYS as f64).sin_cos();
            [cosine, sine]
        }
    })
});

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The greatest multiple of a displacement and half gain in speed, and its voltages; one that the
/// solver fails at counts as none.
fn ray(axis: &Axis, n_ticks: usize, [displacement_rad, gain_rad_s]: [f64; 2]) -> Option<Ray> {
    let start = State::new(0.0, -gain_rad_s, 0.0, 0.0, 0.0);
    let end = State::new(displacement_rad, gain_rad_s, 0.0, 0.0, 0.0);
    let ends = Ends { start, end, place: true };
    let request = Request { n_ticks, ends, goal: Goal::Farthest, way: Way::Free };
    let (size, voltages_v) = axis.best(&request).ok()??;
    (size > 0.0).then_some(Ray { size, voltages_v })
}
