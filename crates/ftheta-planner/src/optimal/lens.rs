//! The focusing lens: how fast marks may be for it, and how long motion between marks has to be.

use super::fly_by::States;
use super::path::Path;
use super::relief::Strain;
use super::smoothing::{Smoothing, shares};
use crate::PlanError;
use ftheta_model::machine::{Focus, Lens, Machine, Optics};
use ftheta_model::space::MirrorAngles;
use ftheta_model::toolpath::Mark;
use ftheta_physics::focus::{lens_gradient, lens_travel_mm, travel_max_mm};
use ftheta_physics::follow::TAPS_BEFORE;
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::optics::field_from_angles;
use kurbo::Point;

/// Part of the lens' limits that plans use.
const SHARE: f64 = 0.9;
/// Parts of its acceleration for a change of velocity, along the path, and for the field's bend.
const CHANGE_SHARE: f64 = 0.5;
const ALONG_SHARE: f64 = 0.3;
const BEND_SHARE: f64 = 0.1;
/// Most ticks that motion between marks takes for the lens.
const N_TICKS_MAX: usize = 1_000_000;

/// Travel, mm, and speed, mm/s.
pub(crate) type LensState = (f64, f64);

/// What the lens allows along a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct LensLimits {
    /// Greatest speed of the beam, mm/s.
    pub(super) speed_mm_s: f64,
    /// Greatest acceleration of the beam along the path, mm/s².
    pub(super) acceleration_mm_s2: f64,
    /// Greatest change of the beam's velocity at once, before averaging, mm/s.
    pub(super) change_mm_s: f64,
}

/// The lens and its axis.
pub(crate) struct LensAxis<'a> {
    optics: &'a Optics,
    focus: &'a Focus,
    mirror_row: State,
    speed_row: State,
    tick_s: f64,
}

impl<'a> LensAxis<'a> {
    /// `None` for a machine without such a lens.
    pub(crate) fn new(machine: &'a Machine) -> Option<Self> {
        let galvo = Galvo::new(&machine.scanner);
        Some(Self {
            optics: &machine.optics,
            focus: machine.optics.focus.as_ref()?,
            mirror_row: galvo.mirror_row(),
            speed_row: galvo.mirror_speed_row(),
            tick_s: machine.output.period_s(),
        })
    }

    /// Samples by which its commands are ahead.
    pub(crate) fn n_lag_ticks(&self) -> u32 {
        (self.focus.lag_s / self.tick_s).ceil() as u32
    }

    /// Where the lens has to be for the mirrors' states, and how fast.
    pub(crate) fn state(&self, states: &States) -> LensState {
        let after = |time_s: f64| {
            let [x_rad, y_rad] = [0, 1].map(|axis| {
                let state = &states[axis];
                self.mirror_row.dot(state) + time_s * self.speed_row.dot(state)
            });
            self.travel_mm(field_from_angles(self.optics, MirrorAngles { x_rad, y_rad }).into())
        };
        let speed_mm_s = (after(self.tick_s) - after(-self.tick_s)) / (2.0 * self.tick_s);
        (after(0.0), speed_mm_s)
    }

    fn travel_mm(&self, place: Point) -> f64 {
        lens_travel_mm(self.optics, place.into()).unwrap_or(0.0)
    }

    /// Checks that the lens can put the focus on the places of all marks and on the centre, where
    /// the mirrors wait.
    ///
    /// * `tolerance_mm`: by which the beam may be off a place
    ///
    /// # Errors
    /// The first place that it cannot.
    pub(super) fn check(&self, marks: &[Mark], tolerance_mm: f64) -> Result<(), PlanError> {
        let most_mm = travel_max_mm(self.focus, tolerance_mm);
        let check = |place: &dyn Fn() -> String, at: Point| {
            let travel_mm = self.travel_mm(at);
            if travel_mm.abs() <= most_mm {
                return Ok(());
            }
            let (x_mm, y_mm, limit_mm) = (at.x, at.y, self.focus.travel_mm);
            Err(PlanError::Focus { place: place(), x_mm, y_mm, travel_mm, limit_mm })
        };
        check(&|| "field centre".into(), Point::ZERO)?;
        marks.iter().enumerate().try_for_each(|(index, mark)| {
            let place = || format!("mark {index} ({})", mark.source);
            mark.points.iter().try_for_each(|&at| check(&place, at))
        })
    }

    /// What the lens allows along a path, all of it as slow as its worst vertex.
    pub(super) fn limits(&self, path: &Path, smoothing: &Smoothing) -> LensLimits {
        let (mut along, mut steepest) = (0.0_f64, 0.0_f64);
        for (index, &vertex) in path.vertices.iter().enumerate() {
            let slope = lens_gradient(self.optics, vertex.into()).unwrap_or_default();
            let ways = path.directions(index).map(|way| slope.dot(way).abs());
            along = along.max(ways[0].max(ways[1]));
            steepest = steepest.max(slope.hypot());
        }
        let most_mm_s2 = SHARE * self.focus.acceleration_max_mm_s2;
        // The way bends no faster than along the second mirror's coordinate, in its centre.
        let bend_mm = match self.optics.lens {
            Lens::PostObjective { working_distance_mm, .. } => {
                let distance_mm = working_distance_mm - self.optics.plane_mm;
                distance_mm * self.focus.magnification.abs()
            }
            Lens::FTheta { .. } => f64::INFINITY,
        };
        let peak = shares(smoothing.n_ticks).into_iter().fold(0.0, f64::max) / self.tick_s;
        LensLimits {
            speed_mm_s: (SHARE * self.focus.speed_max_mm_s / along)
                .min((BEND_SHARE * most_mm_s2 * bend_mm).sqrt()),
            acceleration_mm_s2: ALONG_SHARE * most_mm_s2 / steepest,
            change_mm_s: CHANGE_SHARE * most_mm_s2 / (steepest * peak),
        }
    }

    /// Greatest speed or acceleration of the lens around the middle one of three ticks, by what it
    /// may have.
    fn ratio(&self, places: [Point; 3]) -> f64 {
        let [before, at, after] = places.map(|place| self.travel_mm(place));
        let speed = (after - before).abs() / (2.0 * self.tick_s);
        let acceleration = (after - 2.0 * at + before).abs() / (self.tick_s * self.tick_s);
        let most = self.focus.acceleration_max_mm_s2;
        (speed / self.focus.speed_max_mm_s).max(acceleration / most) / SHARE
    }

    /// Ticks at which a track asks the lens for too much.
    ///
    /// * `places`: with those that weights need
    pub(super) fn strains(&self, places: &[Point], n_ticks: u32) -> Vec<Strain> {
        let strain = |tick: usize| {
            let middle = tick + TAPS_BEFORE;
            let around = [places[middle - 1], places[middle], places[middle + 1]];
            let ratio = self.ratio(around);
            let steps = [around[1] - around[0], around[2] - around[1]];
            let along = (steps[1].hypot() - steps[0].hypot()).abs() * steps[0].hypot();
            let along = along > steps[0].cross(steps[1]).abs();
            (ratio > 1.0).then_some(Strain { tick, ratio, along })
        };
        (0..=n_ticks as usize).filter_map(strain).collect()
    }

    /// Whether the lens follows the mirrors through these states, one a tick.
    pub(super) fn follows(&self, states: &[States]) -> bool {
        let places: Vec<Point> = states
            .iter()
            .map(|states| {
                let [x_rad, y_rad] = [0, 1].map(|axis| self.mirror_row.dot(&states[axis]));
                field_from_angles(self.optics, MirrorAngles { x_rad, y_rad }).into()
            })
            .collect();
        places.windows(3).all(|around| self.ratio([around[0], around[1], around[2]]) <= 1.0)
    }

    /// Fewest ticks, but `n_least` or more, in which the lens gets from state to state, whichever
    /// way; `None` if there are too many.
    pub(crate) fn n_ticks(&self, ends: [LensState; 2], n_least: usize) -> Option<usize> {
        (n_least.max(1)..=N_TICKS_MAX).find(|&n_ticks| self.reaches(ends, n_ticks))
    }

    /// Whether the lens gets from state to state in exactly so many ticks.
    pub(super) fn reaches(&self, [from, to]: [LensState; 2], n_ticks: usize) -> bool {
        let time_s = n_ticks as f64 * self.tick_s;
        let most_mm_s2 = SHARE * self.focus.acceleration_max_mm_s2;
        if (to.1 - from.1).abs() > most_mm_s2 * time_s {
            return false;
        }
        // Relative to a frame that turns the way round, the shortest way is the longest.
        let farthest_mm = |sign: f64| {
            let (start, end) = (sign * from.1, sign * to.1);
            let top = (SHARE * self.focus.speed_max_mm_s).max(start).max(end);
            let peak = top.min(0.5 * (start + end + most_mm_s2 * time_s));
            let (up_s, down_s) = ((peak - start) / most_mm_s2, (peak - end) / most_mm_s2);
            0.5 * (start + peak) * up_s
                + peak * (time_s - up_s - down_s)
                + 0.5 * (peak + end) * down_s
        };
        let way_mm = to.0 - from.0;
        way_mm <= farthest_mm(1.0) && -way_mm <= farthest_mm(-1.0) && self.has_room([from, to])
    }

    /// Whether there is room to stop after the first state and to start before the second.
    fn has_room(&self, [from, to]: [LensState; 2]) -> bool {
        let goes_on = from.1 * to.1 > 0.0 && (to.0 - from.0) * from.1 > 0.0;
        goes_on || (self.can_stop(from) && self.can_stop((to.0, -to.1)))
    }

    /// Whether there is room to stop the lens.
    pub(super) fn can_stop(&self, (at_mm, speed_mm_s): LensState) -> bool {
        let most_mm_s2 = SHARE * self.focus.acceleration_max_mm_s2;
        let stop_mm = 0.5 * speed_mm_s * speed_mm_s.abs() / most_mm_s2;
        (at_mm + stop_mm).abs() <= self.focus.travel_mm
    }
}
