//! Archimedean spirals at constant speed: a track without averaging, so that nothing of its radius
//! is lost, between a run-in and a run-out.

use super::{Builder, CircleDraft, CircleOptions, HELD_SHARE, Passages, REST, no_room, rests};
use crate::PlanError;
use crate::jump::Model;
use crate::render::track::angles_around;
use ftheta_model::machine::Machine;
use ftheta_model::plan::{Knot, Motion, PlanDraft, PlannedMark, Planner, Segment, Station};
use ftheta_model::recipe::Pen;
use ftheta_physics::audit::CORRECTION_RESERVE;
use ftheta_physics::follow::Inverse;
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::optics::{angles_from_field, scale_mm_per_rad};
use ftheta_physics::servo::Gains;
use kurbo::{BezPath, Point, Vec2};
use std::f64::consts::TAU;

/// Angle between two vertices, rad: the cubic between is then within 1e-9 of the radius.
const STEP_RAD: f64 = 0.02;
/// How far past its ends distances are measured to it, rad.
const END_RAD: f64 = 0.1;
/// Most turns.
const N_TURNS_MAX: f64 = 1e4;
/// Fewest and most ticks of the innermost turn.
const N_TICKS: (f64, f64) = (10.0, 1e7);
/// Ticks on the spiral before light and after it, so that the motor's answer to the way there is
/// over; and as many again for what the weights look at.
const N_AROUND: f64 = 8.0;
/// Part of the radius that the spiral keeps before light begins or after it ends.
const RADIUS_LEFT: f64 = 0.5;

/// A spiral from a radius on, against the clock, at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    /// Its centre, field mm.
    pub centre: Point,
    /// Radius at the start, which is farthest in x, mm.
    pub radius_mm: f64,
    /// By how much the radius grows every turn, mm; below 0 it falls.
    pub pitch_mm: f64,
    /// Turns, whole or not.
    pub turns: f64,
    /// Speed of the beam, mm/s.
    pub speed_mm_s: f64,
}

impl Spiral {
    /// Its length, mm, to rounding.
    pub fn length_mm(&self) -> f64 {
        self.arc_mm(TAU * self.turns)
    }

    /// Distance of a place from its nearest turn, mm; outside is positive.
    ///
    /// # Accuracy
    /// Of a small distance d, `d / r` of it.
    pub fn distance_mm(&self, place: Point) -> f64 {
        let off = place - self.centre;
        let (radius_mm, angle_rad) = (off.hypot(), off.y.atan2(off.x));
        let first_mm = self.radius_at_mm(angle_rad);
        // Turns of which there is one at this angle.
        let first = ((-END_RAD - angle_rad) / TAU).ceil();
        let last = (self.turns + (END_RAD - angle_rad) / TAU).floor().max(first);
        let turn = match self.pitch_mm == 0.0 {
            true => first,
            false => ((radius_mm - first_mm) / self.pitch_mm).round().clamp(first, last),
        };
        let nearest_mm = first_mm + turn * self.pitch_mm;
        // The turn is crossed at a slant.
        (radius_mm - nearest_mm) * nearest_mm / nearest_mm.hypot(self.pitch_mm / TAU)
    }

    fn radius_at_mm(&self, angle_rad: f64) -> f64 {
        self.radius_mm + self.pitch_mm * angle_rad / TAU
    }

    /// Place and direction at an angle from the start.
    fn at(&self, angle_rad: f64) -> (Point, Vec2) {
        let (sin, cos) = angle_rad.sin_cos();
        let (out, around) = (Vec2::new(cos, sin), Vec2::new(-sin, cos));
        let radius_mm = self.radius_at_mm(angle_rad);
        let direction = out * (self.pitch_mm / TAU) + around * radius_mm;
        (self.centre + out * radius_mm, direction.normalize())
    }

    /// Length from the start to an angle, mm.
    fn arc_mm(&self, angle_rad: f64) -> f64 {
        // Of sqrt(r² + k²) over the angle, with r = r₀ + k φ, as a difference without cancellation.
        let k = self.pitch_mm / TAU;
        let (from, to) = (self.radius_mm, self.radius_at_mm(angle_rad));
        if k == 0.0 {
            return from * angle_rad;
        }
        let (a, b) = (from.hypot(k), to.hypot(k));
        // r changes by k φ, and so does what hangs on it: no part is divided by a small k.
        let squares = (to + from) / (a + b);
        let mean = 0.5 * (b + from * squares);
        let log = ((to - from) * (1.0 + squares) / (from + a)).ln_1p();
        angle_rad * mean + 0.5 * k * log
    }

    /// Vertices from one angle to another, with arc lengths from the start.
    fn stations(&self, from_rad: f64, to_rad: f64) -> (Vec<Point>, Vec<Station>) {
        let n_legs = ((to_rad - from_rad) / STEP_RAD).ceil().max(1.0) as usize;
        let station = |index: usize| {
            let angle_rad = from_rad + (to_rad - from_rad) * index as f64 / n_legs as f64;
            let (place, direction) = self.at(angle_rad);
            let distance_mm = self.arc_mm(angle_rad);
            (place, Station { arriving: direction, leaving: direction, distance_mm })
        };
        (0..=n_legs).map(station).unzip()
    }

    /// Whether the mirrors reach its widest turn.
    fn check_reach(&self, machine: &Machine) -> Result<(), PlanError> {
        let limit_rad = (1.0 - CORRECTION_RESERVE) * machine.scanner.angle_max_rad;
        let last_rad = TAU * self.turns;
        let (from_rad, to_rad) = match self.pitch_mm < 0.0 {
            true => (0.0, last_rad.min(TAU)),
            false => ((last_rad - TAU).max(0.0), last_rad),
        };
        for place in self.stations(from_rad, to_rad).0 {
            let angles = angles_from_field(&machine.optics, place.into())
                .ok_or(PlanError::Unreachable { x_mm: place.x, y_mm: place.y })?;
            for value in [angles.x_rad, angles.y_rad] {
                if value.abs() > limit_rad {
                    return Err(PlanError::Setting {
                        place: "spiral".into(),
                        quantity: "mirror angle",
                        value,
                        low: -limit_rad,
                        high: limit_rad,
                        unit: "rad",
                    });
                }
            }
        }
        Ok(())
    }

    fn check(&self, period_s: f64) -> Result<(), PlanError> {
        let last_mm = self.radius_at_mm(TAU * self.turns);
        let least_mm = self.radius_mm.min(last_mm);
        let (low, high) = N_TICKS;
        let turn_ticks = TAU * least_mm / self.speed_mm_s / period_s;
        // What is run through before and after light, on the smaller side.
        let around_rad = 2.0 * N_AROUND * TAU / turn_ticks;
        let left = 1.0 - self.pitch_mm.abs() * around_rad / TAU / least_mm;
        let settings = [
            ("turns", self.turns, (1e-3, N_TURNS_MAX), ""),
            ("smallest radius", least_mm, (1e-6, f64::INFINITY), "mm"),
            ("samples of the smallest turn", turn_ticks, (low, high), ""),
            ("radius left before light over radius", left, (RADIUS_LEFT, 1.0), ""),
        ];
        for (quantity, value, (low, high), unit) in settings {
            if !(low..=high).contains(&value) {
                let place = "spiral".into();
                return Err(PlanError::Setting { place, quantity, value, low, high, unit });
            }
        }
        Ok(())
    }
}

/// Plans a spiral.
///
/// # Errors
/// If its radius falls to nothing, a turn takes less than ten ticks, the optics do not reach it,
/// the axes cannot get into it, or a program fails.
///
/// # Accuracy
/// The nominal mirror is on the spiral within a nanometre as long as a turn takes 100 ticks.
pub fn spiral(
    machine: &Machine,
    spiral: &Spiral,
    options: &CircleOptions,
) -> Result<CircleDraft, PlanError> {
    let period_s = machine.output.period_s();
    spiral.check(period_s)?;
    spiral.check_reach(machine)?;
    let turn_s = spiral.length_mm() / spiral.speed_mm_s;
    let n_track = ((turn_s / period_s - 1e-9).ceil() + 2.0 * N_AROUND) as u32;
    let (mut draft, motion) = tables(machine, spiral, options);
    let gains = Gains::design(&machine.scanner, period_s)?;
    let inverse = Inverse::new(&Galvo::new(&machine.scanner), &gains, period_s);
    let inverse = inverse.ok_or(PlanError::Immovable)?;
    let states = |tick: u32| states_at(&inverse, &draft, &motion, tick);
    let (starts, ends) = (states(0)?, states(n_track)?);
    let passages = Passages::new(machine, options);
    let epsilon_rad = HELD_SHARE * options.tolerance_mm / scale_mm_per_rad(&machine.optics);
    let run_in = passages.between(Model::Held { epsilon_rad }, [REST, starts], 1)?;
    let run_in = run_in.ok_or_else(no_room)?;
    let run_out = passages.between(Model::Flexible, [ends, REST], 1)?.ok_or_else(no_room)?;
    let laser = &machine.laser;
    let [n_first, n_last] = rests(machine, [(&run_in, [REST, starts]), (&run_out, [ends, REST])])?;
    let mut builder = Builder { drives: Vec::new(), segments: Vec::new() };
    builder.hold(n_first);
    builder.drive(None, &run_in);
    builder.segments.push(Segment { mark_index: Some(0), n_ticks: n_track, motion });
    builder.drive(None, &run_out);
    builder.hold(n_last);
    // Computed voltages act a tick after their sample.
    let n_before = f64::from(n_first) + run_in.len() as f64 + 1.0 + N_AROUND;
    let on_s = n_before * period_s;
    let edge_ns =
        |light_s: f64, latency_ns: i64| ((light_s * 1e9).round() as i64 - latency_ns) as u64;
    draft.marks.push(PlannedMark {
        curve: curve(spiral),
        pen_index: 0,
        source: "spiral".into(),
        on_ns: edge_ns(on_s, laser.on_latency_ns),
        off_ns: edge_ns(on_s + turn_s, laser.off_latency_ns),
        power_w: options.pen.power_w,
        steps: Vec::new(),
    });
    (draft.drives, draft.segments) = (builder.drives, builder.segments);
    let run_in_s = (run_in.len() as f64 + N_AROUND) * period_s;
    let run_out_s = (run_out.len() as f64 + N_AROUND) * period_s;
    Ok(CircleDraft { draft, run_in_s, run_out_s, turn_s })
}

/// A draft with the tables of the spiral and what is run through around it, and its track.
fn tables(machine: &Machine, spiral: &Spiral, options: &CircleOptions) -> (PlanDraft, Motion) {
    let around_mm = N_AROUND * spiral.speed_mm_s * machine.output.period_s();
    let last_rad = TAU * spiral.turns;
    let rad_per_mm = |angle_rad: f64| spiral.radius_at_mm(angle_rad).recip();
    let from_rad = -2.0 * around_mm * rad_per_mm(0.0) / RADIUS_LEFT;
    let to_rad = last_rad + 2.0 * around_mm * rad_per_mm(last_rad) / RADIUS_LEFT;
    let (mut vertices, stations) = spiral.stations(from_rad, to_rad);
    // The last one is where the plan holds: in the centre.
    let n_vertices = vertices.len() as u32;
    vertices.insert(0, Point::ZERO);
    let start_mm = stations[0].distance_mm;
    let stations: Vec<Station> = stations
        .into_iter()
        .map(|station| Station { distance_mm: station.distance_mm - start_mm, ..station })
        .collect();
    let knot =
        Knot { time_s: 0.0, distance_mm: -start_mm - around_mm, speed_mm_s: spiral.speed_mm_s };
    let motion = Motion::Track {
        first_vertex: 1,
        n_vertices,
        first_station: Some(0),
        first_knot: 0,
        n_knots: 1,
        smoothing_ticks: 1,
    };
    let draft = PlanDraft {
        machine: machine.clone(),
        planner: Planner::Optimal,
        tolerance_mm: options.tolerance_mm,
        pens: vec![Pen { mark_speed_mm_s: spiral.speed_mm_s, ..options.pen.clone() }],
        marks: Vec::new(),
        vertices,
        stations,
        knots: vec![knot],
        drives: Vec::new(),
        segments: Vec::new(),
    };
    (draft, motion)
}

/// The states of both axes at a tick of the track.
fn states_at(
    inverse: &Inverse,
    draft: &PlanDraft,
    motion: &Motion,
    tick: u32,
) -> Result<[State; 2], PlanError> {
    let angles = |place: Point| {
        angles_from_field(&draft.machine.optics, place.into())
            .map(|angles| [angles.x_rad, angles.y_rad])
    };
    let around = angles_around(draft, motion, tick, angles)
        .map_err(|place| PlanError::Unreachable { x_mm: place.x, y_mm: place.y })?;
    Ok(around.map(|angles| inverse.state(&angles).0))
}

/// The spiral's curve as far as it is lit.
fn curve(spiral: &Spiral) -> BezPath {
    let (places, stations) = spiral.stations(0.0, TAU * spiral.turns);
    let mut curve = BezPath::new();
    curve.move_to(places[0]);
    for (ends, pair) in places.windows(2).zip(stations.windows(2)) {
        let third_mm = (pair[1].distance_mm - pair[0].distance_mm) / 3.0;
        let (leaving, arriving) = (pair[0].leaving * third_mm, pair[1].arriving * third_mm);
        curve.curve_to(ends[0] + leaving, ends[1] - arriving, ends[1]);
    }
    curve
}
