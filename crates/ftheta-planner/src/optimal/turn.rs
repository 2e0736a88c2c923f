//! Corners between two straight legs, taken without stopping, from programs of their own.

use super::path::{Path, angle};
use super::smoothing::Smoothing;
use crate::PlanError;
use crate::corner::{Corners, End, Side};
use ftheta_model::machine::Machine;
use ftheta_physics::optics::angles_from_field;
use kurbo::{Point, Vec2};

/// A leg that turns by less is straight, rad.
const STRAIGHT_RAD: f64 = 1e-6;
/// Distance over which the optics' direction is taken, mm: what a turn needs, about.
const PROBE_MM: f64 = 0.02;
/// A vertex is missed by less than this part of what may be missed at mark speed: not a corner.
const GENTLE: f64 = 1.0;

/// By how much a corner may be missed, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    /// Distance of the beam from both legs.
    pub(super) contour_mm: f64,
    /// Distance of the corner itself from the beam.
    pub(super) coverage_mm: f64,
}

/// A corner with both its sides, of a speed that may still be lowered.
#[derive(Clone, Debug)]
pub(super) struct Turn {
    /// Index of the vertex.
    pub(super) vertex: usize,
    sides: [TurnSide; 2],
    n_ticks: usize,
    tick_s: f64,
    /// Cosine of the turning angle.
    cosine: f64,
}

/// One side, for a speed of one of what it was asked for.
#[derive(Clone, Debug)]
struct TurnSide {
    end: End,
    side: Side,
    tick_s: f64,
    /// Direction in mirror angles, length 1.
    direction: Vec2,
    /// Field distance per mirror angle along the leg, mm/rad.
    mm_per_rad: f64,
    /// Ticks of coasting before it (arriving) or after it (departing).
    n_coasting: usize,
    /// Ticks of rest after it or before it.
    n_resting: usize,
    coast_v: f64,
}

impl Turn {
    /// The turn at a vertex, or `None` if no voltages keep the allowance.
    ///
    /// # Errors
    /// If the optics do not reach it, or a program fails.
    pub(super) fn new(
        corners: &Corners,
        machine: &Machine,
        path: &Path,
        vertex: usize,
        (speed_mm_s, allowance): (f64, Allowance),
    ) -> Result<Option<Self>, PlanError> {
        let at = path.vertices[vertex];
        let [arriving, leaving] = path.directions(vertex);
        let theta = angle(arriving, leaving).abs();
        // Past a right angle the nearest point of the other leg is the corner.
        let sine = if theta < std::f64::consts::FRAC_PI_2 { theta.sin() } else { 1.0 };
        let band_mm =
            (allowance.contour_mm / sine).min(allowance.coverage_mm / (2.0 * (0.5 * theta).sin()));
        let mut sides = Vec::with_capacity(2);
        for (end, direction) in [(End::Arrive, arriving), (End::Depart, leaving)] {
            let (unit, mm_per_rad) = mirror_direction(machine, at, direction)?;
            let speed_rad_s = speed_mm_s / mm_per_rad;
            let Some(side) = corners.side(end, speed_rad_s, band_mm / mm_per_rad)? else {
                return Ok(None);
            };
            let coast_v = machine.scanner.torque_constant_n_m_a * speed_rad_s;
            sides.push(TurnSide {
                end,
                side,
                tick_s: machine.output.period_s(),
                direction: unit,
                mm_per_rad,
                n_coasting: 0,
                n_resting: 0,
                coast_v,
            });
        }
        let [mut arrive, mut depart]: [TurnSide; 2] = match sides.try_into() {
            Ok(sides) => sides,
            Err(_) => return Ok(None),
        };
        // Both on common ticks: what is shorter coasts or rests meanwhile.
        let after = |one: &TurnSide| one.side.voltages_v.len() - one.side.n_before;
        let n_before = arrive.side.n_before.max(depart.side.n_before);
        let n_after = after(&arrive).max(after(&depart));
        arrive.n_coasting = n_before - arrive.side.n_before;
        arrive.n_resting = n_after - after(&arrive);
        depart.n_resting = n_before - depart.side.n_before;
        depart.n_coasting = n_after - after(&depart);
        let n_ticks = n_before + n_after;
        let tick_s = machine.output.period_s();
        let cosine = theta.cos();
        Ok(Some(Self { vertex, sides: [arrive, depart], n_ticks, tick_s, cosine }))
    }

    /// Time at the speed of the leg from where it begins to the corner, and from the corner to
    /// where it ends, s: the same at every speed.
    pub(super) fn runs_s(&self) -> [f64; 2] {
        [0, 1].map(|index: usize| {
            let TurnSide { side, n_coasting, .. } = &self.sides[index];
            side.run_rad / side.speed_rad_s + *n_coasting as f64 * self.tick_s
        })
    }

    /// Voltages of both axes with the legs' speeds as parts of the one asked for.
    pub(super) fn voltages_v(&self, parts: [f64; 2]) -> Vec<[f64; 2]> {
        let mut voltages = vec![[0.0; 2]; self.n_ticks];
        for (index, (one, part)) in self.sides.iter().zip(parts).enumerate() {
            let coasting = std::iter::repeat_n(one.coast_v, one.n_coasting);
            let own = one.side.voltages_v.iter().copied();
            let resting = std::iter::repeat_n(0.0, one.n_resting);
            let all: Vec<f64> = if index == 0 {
                coasting.chain(own).chain(resting).collect()
            } else {
                resting.chain(own).chain(coasting).collect()
            };
            for (pair, voltage) in voltages.iter_mut().zip(all) {
                pair[0] += voltage * part * one.direction.x;
                pair[1] += voltage * part * one.direction.y;
            }
        }
        voltages
    }

    /// Place along the path of the point nearest to the beam, from the corner, at each tick from
    /// the first to the end, mm. At the corner's tick it passes from one leg to the other.
    pub(super) fn progress_mm(&self, parts: [f64; 2]) -> Vec<f64> {
        let [arrive, depart] = [0, 1].map(|index: usize| self.sides[index].places_mm(parts[index]));
        let n_before = self.sides[0].n_coasting + self.sides[0].side.n_before;
        let cosine = self.cosine;
        let progress = |(tick, (alpha, beta)): (usize, (f64, f64))| match tick.cmp(&n_before) {
            std::cmp::Ordering::Less => (alpha + beta * cosine).min(0.0),
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => (beta + alpha * cosine).max(0.0),
        };
        arrive.into_iter().zip(depart).enumerate().map(progress).collect()
    }
}

impl TurnSide {
    /// Place of this side's motion along its leg at each tick, from the corner, mm.
    fn places_mm(&self, part: f64) -> Vec<f64> {
        let Self { side, mm_per_rad, n_coasting, n_resting, tick_s, .. } = self;
        let step_rad = side.speed_rad_s * tick_s;
        let first = side.mirror_rad[0];
        let last = side.mirror_rad[side.mirror_rad.len() - 1];
        let own = side.mirror_rad.iter().copied();
        let places_rad: Vec<f64> = match self.end {
            End::Arrive => (0..*n_coasting)
                .rev()
                .map(|tick| first - (tick + 1) as f64 * step_rad)
                .chain(own)
                .chain(std::iter::repeat_n(last, *n_resting))
                .collect(),
            End::Depart => std::iter::repeat_n(first, *n_resting)
                .chain(own)
                .chain((0..*n_coasting).map(|tick| last + (tick + 1) as f64 * step_rad))
                .collect(),
        };
        places_rad.into_iter().map(|place_rad| place_rad * part * mm_per_rad).collect()
    }
}

/// Direction of the mirrors for a direction in the field, and field distance per mirror angle.
fn mirror_direction(
    machine: &Machine,
    at: Point,
    direction: Vec2,
) -> Result<(Vec2, f64), PlanError> {
    let angles = |place: Point| {
        angles_from_field(&machine.optics, place.into())
            .map(|angles| Vec2::new(angles.x_rad, angles.y_rad))
            .ok_or(PlanError::Unreachable { x_mm: place.x, y_mm: place.y })
    };
    let probe = direction * PROBE_MM;
    let change = angles(at + probe)? - angles(at - probe)?;
    let length_rad = change.hypot();
    Ok((change / length_rad, 2.0 * PROBE_MM / length_rad))
}

/// Vertices at which a path turns too sharply for its speed, with straight legs on both sides that
/// are at least so long.
pub(super) fn candidates(
    path: &Path,
    speed_mm_s: f64,
    smoothing: &Smoothing,
    (miss_mm, change_mm_s): (f64, f64),
) -> Vec<usize> {
    // Twice the sine of half the angle, which both have.
    let most =
        (2.0 * GENTLE * miss_mm / (speed_mm_s * smoothing.mean_s)).min(change_mm_s / speed_mm_s);
    let sharp = |vertex: usize| {
        let [arriving, leaving] = path.ways(vertex);
        // The tangent of the angle, which is more, costs nothing.
        let dot = arriving.dot(leaving);
        let slight = dot > 0.0 && arriving.cross(leaving).abs() <= most * dot;
        !slight && {
            let [arriving, leaving] = path.directions(vertex);
            (leaving - arriving).hypot() > most
        }
    };
    (1..path.vertices.len() - 1).filter(|&vertex| sharp(vertex)).collect()
}

/// How far a path is straight before or after a vertex, mm, up to `enough_mm`; past its ends it is.
pub(super) fn straight_mm(path: &Path, vertex: usize, forwards: bool, enough_mm: f64) -> f64 {
    let at_mm = path.distances_mm[vertex];
    let direction = path.ways(vertex)[usize::from(forwards)];
    let mut here = vertex;
    loop {
        let way_mm = (path.distances_mm[here] - at_mm).abs();
        let last = if forwards { here + 1 == path.vertices.len() } else { here == 0 };
        if last || way_mm >= enough_mm {
            return way_mm.max(enough_mm);
        }
        let next = if forwards { here + 1 } else { here - 1 };
        let leg = if forwards { here } else { next };
        let bends = angle(direction, path.ways(leg)[1]).abs() > STRAIGHT_RAD
            || angle(direction, path.ways(leg + 1)[0]).abs() > STRAIGHT_RAD;
        if bends {
            return way_mm;
        }
        here = next;
    }
}
