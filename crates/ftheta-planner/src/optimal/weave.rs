//! Weaves marks and the motion between them into one flowing plan.

use super::fly_by::{FlyBy, States, Voltages};
use super::glide::Glide;
use super::heat::Heat;
use super::lens::LensAxis;
use super::path::Path;
use super::relief::Strain;
use super::smoothing::Smoothing;
use crate::PlanError;
use crate::render::track::{angles_around, places, places_around};
use ftheta_model::block::LaserEdge;
use ftheta_model::machine::Machine;
use ftheta_model::plan::{Knot, Motion, PlanDraft, PlannedMark, Segment};
use ftheta_physics::follow::{Inverse, N_TAPS, TAPS_AFTER, TAPS_BEFORE, dot};
use ftheta_physics::galvo::{CURRENT, State};
use ftheta_physics::optics::{angles_from_field, scale_mm_per_rad};
use kurbo::Point;
use std::borrow::Cow;

/// Changes of power below this part of it are left out.
const POWER_STEP: f64 = 2e-3;

/// Part of what driver and coils stand up to which no track needs a closer look.
const NO_STRAIN: f64 = 0.8;

/// What moves the mirrors between marks.
pub(super) enum Mover<'a> {
    /// Voltages, by a servo that is known.
    Voltage(Box<FlyBy<'a>>),
    /// Angles, followed by any servo after its lag, s.
    Angle(Glide, f64),
}

/// Shortest wait in the centre, ticks.
const N_WAIT_MIN: usize = 2;

/// Motion between marks.
enum Flight {
    /// At once.
    Direct(Voltages),
    /// To the centre, a wait there of so many ticks for the focusing lens, and on.
    Waiting(Voltages, usize, Voltages),
}

/// A plan that grows.
pub(super) struct Weave<'a> {
    pub(super) machine: &'a Machine,
    pub(super) inverse: &'a Inverse,
    pub(super) smoothing: &'a Smoothing,
    pub(super) mover: &'a Mover<'a>,
    pub(super) draft: PlanDraft,
    /// The focusing lens, if there is one.
    pub(super) lens: Option<LensAxis<'a>>,
    n_samples: u64,
    heat: Heat,
    /// Where the axes are at the end of what is planned; `None` as long as they may be anywhere.
    states: Option<States>,
    period_s: f64,
}

/// A stretch of a mark, as a track.
#[derive(Clone, Debug)]
pub(super) struct Stretch<'a> {
    pub(super) path: Cow<'a, Path>,
    pub(super) knots: Vec<Knot>,
    /// Ticks from its first place on; it may go on past the path's end.
    pub(super) n_ticks: u32,
}

/// A track that is in the draft's tables, but not yet in its segments.
#[derive(Clone, Copy)]
pub(super) struct Laid {
    motion: Motion,
    n_ticks: u32,
    starts: States,
    ends: States,
}

impl<'a> Weave<'a> {
    pub(super) fn new(
        machine: &'a Machine,
        inverse: &'a Inverse,
        smoothing: &'a Smoothing,
        mover: &'a Mover<'a>,
        heat: Heat,
        draft: PlanDraft,
    ) -> Self {
        let period_s = machine.output.period_s();
        let (n_samples, states) = (0, None);
        let lens = LensAxis::new(machine);
        Self { machine, inverse, smoothing, mover, draft, lens, n_samples, heat, states, period_s }
    }

    /// Stays in the centre for so many ticks.
    pub(super) fn rest_in_centre(&mut self, n_ticks: u32) {
        self.draft.vertices.push(Point::ZERO);
        let vertex = (self.draft.vertices.len() - 1) as u32;
        self.push(None, n_ticks, Motion::Hold { vertex });
        self.heat.cool(n_ticks);
        self.states = Some([State::zeros(); 2]);
    }

    /// From here on the axes may be anywhere.
    pub(super) fn forget_place(&mut self) {
        self.states = None;
    }

    /// Time of the mirrors at the end of what is planned, s: computed voltages act a tick after
    /// their sample, angles that are sent are reached after the lag.
    pub(super) fn now_s(&self) -> f64 {
        match self.mover {
            Mover::Voltage(_) => (self.n_samples + 1) as f64 * self.period_s,
            Mover::Angle(_, lag_s) => (self.n_samples as f64 - 1.0) * self.period_s + lag_s,
        }
    }

    pub(super) fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Whether the motors stand these voltages from a state, with the heat they have, and the
    /// focusing lens follows them.
    pub(super) fn allows(&self, voltages: &[[f64; 2]], from: &States) -> bool {
        match self.mover {
            Mover::Voltage(fly_by) => {
                let follows = |lens: &LensAxis<'_>| {
                    let mut states = vec![*from];
                    for pair in voltages {
                        let last = states[states.len() - 1];
                        states.push([0, 1].map(|axis| fly_by.advance(&last[axis], pair[axis])));
                    }
                    lens.follows(&states)
                };
                fly_by.allows(voltages, from, &self.heat) && self.lens.as_ref().is_none_or(follows)
            }
            Mover::Angle(..) => false,
        }
    }

    /// Voltages that join states exactly, near the ones given.
    pub(super) fn corrected(
        &self,
        voltages: Voltages,
        from: &States,
        to: &States,
    ) -> Option<Voltages> {
        match self.mover {
            Mover::Voltage(fly_by) => fly_by.corrected(voltages, from, to),
            Mover::Angle(..) => None,
        }
    }

    /// Puts a stretch into the tables.
    ///
    /// # Errors
    /// If the optics do not reach a place of it.
    pub(super) fn lay(&mut self, stretch: &Stretch<'_>) -> Result<Laid, PlanError> {
        let draft = &mut self.draft;
        let first_vertex = draft.vertices.len() as u32;
        draft.vertices.extend(&stretch.path.vertices);
        let first_station = stretch.path.is_curved().then_some(draft.stations.len() as u32);
        if stretch.path.is_curved() {
            draft.stations.extend(stretch.path.stations());
        }
        let first_knot = draft.knots.len() as u32;
        draft.knots.extend(&stretch.knots);
        let motion = Motion::Track {
            first_vertex,
            n_vertices: stretch.path.vertices.len() as u32,
            first_station,
            first_knot,
            n_knots: stretch.knots.len() as u32,
            smoothing_ticks: self.smoothing.n_ticks,
        };
        let n_ticks = stretch.n_ticks;
        let starts = self.states_at(&motion, 0)?;
        let ends = self.states_at(&motion, n_ticks)?;
        Ok(Laid { motion, n_ticks, starts, ends })
    }

    /// How full the tables are, for [`Self::take_back`].
    pub(super) fn tables(&self) -> [usize; 3] {
        [self.draft.vertices.len(), self.draft.stations.len(), self.draft.knots.len()]
    }

    /// Takes out of the tables what has been put into them since.
    pub(super) fn take_back(&mut self, [n_vertices, n_stations, n_knots]: [usize; 3]) {
        self.draft.vertices.truncate(n_vertices);
        self.draft.stations.truncate(n_stations);
        self.draft.knots.truncate(n_knots);
    }

    /// The states of both axes at a tick of a track.
    fn states_at(&self, motion: &Motion, tick: u32) -> Result<States, PlanError> {
        let optics = &self.machine.optics;
        let angles = |place: Point| {
            angles_from_field(optics, place.into()).map(|angles| [angles.x_rad, angles.y_rad])
        };
        let around = angles_around(&self.draft, motion, tick, angles)
            .map_err(|place| PlanError::Unreachable { x_mm: place.x, y_mm: place.y })?;
        Ok(around.map(|angles| self.inverse.state(&angles).0))
    }

    /// Flies to where a track begins; `false` if there is no room for it.
    ///
    /// # Errors
    /// If a program fails.
    pub(super) fn fly_to(&mut self, laid: &Laid) -> Result<bool, PlanError> {
        self.fly(laid.starts)
    }

    /// Whether there is room to stop after a track, at any heat.
    ///
    /// # Errors
    /// If a program fails.
    pub(super) fn can_leave(&self, laid: &Laid) -> Result<bool, PlanError> {
        let rest = [State::zeros(); 2];
        if self.lens.as_ref().is_some_and(|lens| !lens.can_stop(lens.state(&laid.ends))) {
            return Ok(false);
        }
        match self.mover {
            Mover::Voltage(fly_by) if !fly_by.has_room(&laid.ends) => {
                let cold = self.heat.cold();
                Ok(fly_by.between([&laid.ends, &rest], &cold, 0)?.is_some())
            }
            Mover::Voltage(_) => Ok(true),
            Mover::Angle(glide, _) => Ok(glide.between(&laid.ends, &rest, 0).is_some()),
        }
    }

    /// Flies to rest in the centre.
    ///
    /// # Errors
    /// If a program fails.
    pub(super) fn fly_home(&mut self) -> Result<bool, PlanError> {
        self.fly([State::zeros(); 2])
    }

    fn fly(&mut self, to: States) -> Result<bool, PlanError> {
        if let Some(from) = &self.states {
            match self.flight([from, &to], self.n_dark_ticks())? {
                None => return Ok(false),
                Some(Flight::Direct(pairs)) => self.drive(None, &pairs),
                Some(Flight::Waiting(out, n_wait, back)) => {
                    self.drive(None, &out);
                    self.rest_in_centre(n_wait as u32);
                    self.drive(None, &back);
                }
            }
        }
        self.states = Some(to);
        Ok(true)
    }

    /// Motion between states that the focusing lens is ready after; `None` if there is no room.
    fn flight(&self, [from, to]: [&States; 2], n_dark: usize) -> Result<Option<Flight>, PlanError> {
        let direct = self.between([from, to], n_dark)?;
        let Some(lens) = &self.lens else {
            return Ok(direct.map(Flight::Direct));
        };
        let ends = [lens.state(from), lens.state(to)];
        let ready = |pairs: &Voltages| lens.reaches(ends, pairs.len());
        if let Some(pairs) = direct.filter(ready) {
            return Ok(Some(Flight::Direct(pairs)));
        }
        let rest = [State::zeros(); 2];
        let (Some(n_lens), Some(out), Some(back)) = (
            lens.n_ticks(ends, n_dark),
            self.between([from, &rest], n_dark)?,
            self.between([&rest, to], 0)?,
        ) else {
            return Ok(None);
        };
        // Mirrors that take longer swing wide, so where there is time for it they stop.
        let n_ways = out.len() + back.len() + N_WAIT_MIN;
        if n_lens < n_ways
            && let Some(pairs) = self.between([from, to], n_lens)?.filter(ready)
            && pairs.len() < n_ways
        {
            return Ok(Some(Flight::Direct(pairs)));
        }
        let wait = |n_ticks: usize| Flight::Waiting(out, n_ticks - n_ways + N_WAIT_MIN, back);
        Ok(lens.n_ticks(ends, n_ways).map(wait))
    }

    fn between(&self, ends: [&States; 2], n_least: usize) -> Result<Option<Voltages>, PlanError> {
        Ok(match self.mover {
            Mover::Voltage(fly_by) => fly_by.between(ends, &self.heat, n_least)?,
            Mover::Angle(glide, _) => glide.between(ends[0], ends[1], n_least),
        })
    }

    /// Fewest ticks until a mark may begin, so that the laser is not told of it before it is told
    /// that the last one ends.
    fn n_dark_ticks(&self) -> usize {
        let free_ns = self.draft.marks.last().map_or(0, |mark| mark.off_ns);
        let light_ns = free_ns as f64 + self.machine.laser.on_latency_ns as f64;
        let wait_s = light_ns * 1e-9 - self.now_s();
        (wait_s / self.period_s).ceil().max(0.0) as usize
    }

    /// Appends voltages, or angles.
    pub(super) fn drive(&mut self, mark_index: Option<u32>, pairs: &Voltages) {
        let first = self.draft.drives.len() as u32;
        self.draft.drives.extend(pairs.iter().map(|pair| pair.map(|value| value as f32)));
        self.push(mark_index, pairs.len() as u32, Motion::Drive { first });
        let (Mover::Voltage(fly_by), Some(states)) = (self.mover, &mut self.states) else {
            return;
        };
        for pair in pairs {
            for (state, &voltage_v) in states.iter_mut().zip(pair) {
                *state = fly_by.advance(state, voltage_v);
            }
            self.heat.tick([states[0][CURRENT], states[1][CURRENT]]);
        }
    }

    /// Appends a track that the axes are at the beginning of.
    pub(super) fn follow(&mut self, mark_index: u32, laid: &Laid) {
        self.push(Some(mark_index), laid.n_ticks, laid.motion);
        self.heat.cool(laid.n_ticks);
        self.states = Some(laid.ends);
    }

    fn push(&mut self, mark_index: Option<u32>, n_ticks: u32, motion: Motion) {
        self.draft.segments.push(Segment { mark_index, n_ticks, motion });
        self.n_samples += u64::from(n_ticks);
    }

    /// Adds a mark with its light.
    ///
    /// * `light_s`: when light is to begin and end, s
    /// * `powers`: power from times on, after the first one, s and W
    pub(super) fn light(
        &mut self,
        mut mark: PlannedMark,
        light_s: [f64; 2],
        powers: &[(f64, f64)],
    ) -> Result<(), PlanError> {
        let laser = &self.machine.laser;
        let edge = |time_s: f64, latency_ns: i64| (time_s * 1e9).round() as i64 - latency_ns;
        let on_ns = edge(light_s[0], laser.on_latency_ns);
        let off_ns = edge(light_s[1], laser.off_latency_ns);
        if on_ns < 0 || off_ns < on_ns {
            return Err(PlanError::EdgesReversed {
                mark: self.draft.marks.len(),
                origin: mark.source,
                on_us: on_ns as f64 * 1e-3,
                off_us: off_ns as f64 * 1e-3,
            });
        }
        (mark.on_ns, mark.off_ns) = (on_ns as u64, off_ns as u64);
        let mut power_w = mark.power_w;
        for &(time_s, next_w) in powers {
            let time_ns = edge(time_s, laser.on_latency_ns);
            let changes = (next_w - power_w).abs() > POWER_STEP * power_w;
            if changes && time_ns > on_ns && time_ns < off_ns {
                power_w = next_w;
                mark.steps.push(LaserEdge { time_ns: time_ns as u64, power_w });
            }
        }
        self.draft.marks.push(mark);
        Ok(())
    }

    /// Places of the beam at every tick of a track, with what weights need before and after them.
    pub(super) fn places_around(&self, laid: &Laid) -> Vec<Point> {
        places_around(&self.draft, &laid.motion, laid.n_ticks)
    }

    /// Without what weights need.
    pub(super) fn without_taps(&self, mut places: Vec<Point>) -> Vec<Point> {
        places.truncate(places.len() - TAPS_AFTER);
        places.drain(..TAPS_BEFORE);
        places
    }

    /// Ticks at which a track asks driver, coils or focusing lens for more than they stand.
    ///
    /// * `places`: with those that weights need
    pub(super) fn strains(&self, places: &[Point], n_ticks: u32) -> Vec<Strain> {
        let mut strains = self.motor_strains(places, n_ticks);
        if let Some(lens) = &self.lens {
            strains.extend(lens.strains(places, n_ticks));
        }
        strains
    }

    fn motor_strains(&self, places: &[Point], n_ticks: u32) -> Vec<Strain> {
        let Mover::Voltage(fly_by) = self.mover else {
            return Vec::new();
        };
        let (voltage_max_v, current_max_a) = fly_by.most();
        let optics = &self.machine.optics;
        let per_mm = scale_mm_per_rad(optics).recip();
        let mut x: Vec<f64> = places.iter().map(|place| place.x * per_mm).collect();
        let mut y: Vec<f64> = places.iter().map(|place| place.y * per_mm).collect();
        let (voltage, current) = (&self.inverse.voltage, &self.inverse.state[CURRENT]);
        let ratio_at = |x: &[f64], y: &[f64]| {
            let volts = dot(voltage, x).abs().max(dot(voltage, y).abs());
            let amperes = dot(current, x).abs().max(dot(current, y).abs());
            (volts / voltage_max_v).max(amperes / current_max_a)
        };
        let windows = || x.windows(N_TAPS).zip(y.windows(N_TAPS));
        // The optics are not what their scale says, by a few per cent; most tracks need no more.
        if windows().all(|(x, y)| ratio_at(x, y) < NO_STRAIN) {
            return Vec::new();
        }
        for ((x, y), &place) in x.iter_mut().zip(&mut y).zip(places) {
            if let Some(angles) = angles_from_field(optics, place.into()) {
                (*x, *y) = (angles.x_rad, angles.y_rad);
            }
        }
        let strain = |(tick, (x, y)): (usize, (&[f64], &[f64]))| {
            let ratio = ratio_at(x, y);
            (ratio > 1.0).then(|| {
                let way = [x, y].map(|one| one[TAPS_BEFORE + 1] - one[TAPS_BEFORE - 1]);
                let volts = [dot(voltage, x), dot(voltage, y)];
                let along = (volts[0] * way[0] + volts[1] * way[1]).abs();
                let across = (volts[0] * way[1] - volts[1] * way[0]).abs();
                Strain { tick, ratio, along: along > across }
            })
        };
        let ticks = n_ticks as usize + 1;
        x.windows(N_TAPS)
            .zip(y.windows(N_TAPS))
            .take(ticks)
            .enumerate()
            .filter_map(strain)
            .collect()
    }

    /// Places of the beam at every tick of a track, from the first to the end.
    pub(super) fn places(&self, laid: &Laid) -> Vec<Point> {
        places(&self.draft, &laid.motion, laid.n_ticks)
    }
}

impl Laid {
    pub(super) fn n_ticks(&self) -> u32 {
        self.n_ticks
    }

    pub(super) fn starts(&self) -> &States {
        &self.starts
    }

    pub(super) fn ends(&self) -> &States {
        &self.ends
    }
}
