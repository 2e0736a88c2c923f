//! Walks a plan's segments sample by sample, from their definition alone.

use super::track::TrackWalk;
use crate::follow::{Inverse, Taps, dot};
use crate::galvo::{Galvo, State, Step};
use crate::optics::angles_from_field;
use crate::servo::{Gains, Memory, Seen};
use ftheta_model::plan::{Motion, PlanDraft};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use kurbo::Point;

/// What a sample commands.
pub enum Command {
    /// The angles of a place.
    Place(FieldPoint),
    /// Angles themselves.
    Angles(MirrorAngles),
}

/// Yields the command of every sample, and the segment it belongs to.
pub struct Walk<'a> {
    draft: &'a PlanDraft,
    gains: Gains,
    step: Step,
    mirror_row: State,
    inverse: Option<&'a Inverse>,
    tick_s: f64,
    /// Whether commands are computed from voltages, or are the wanted angles.
    by_voltage: bool,
    segment_index: usize,
    /// Samples of the segment already given.
    n_given: u32,
    /// Vertex before the place last given, and the path length up to it.
    leg: usize,
    leg_start_mm: f64,
    track: Option<Result<TrackWalk<'a>, FieldPoint>>,
    /// Both axes at the tick of the sample that comes next, and the voltages acting from it on;
    /// `None` while they follow words that were not computed from voltages.
    axes: Option<[(State, f64); 2]>,
    /// Both axes a tick later, where a track has just ended: what follows goes on from there.
    later: Option<[State; 2]>,
    /// How far the axes are from where a segment begins, rad.
    gap_rad: f64,
}

impl<'a> Walk<'a> {
    /// Starts at the first sample.
    ///
    /// * `inverse`: that of the nominal axis, which plans with tracks need
    /// * `by_voltage`: whether commands of tracks and drives are computed from voltages
    pub fn new(
        draft: &'a PlanDraft,
        gains: Gains,
        inverse: Option<&'a Inverse>,
        by_voltage: bool,
    ) -> Self {
        let tick_s = draft.machine.output.period_s();
        let galvo = Galvo::new(&draft.machine.scanner);
        let mut walk = Self {
            draft,
            gains,
            step: galvo.step(tick_s),
            mirror_row: galvo.mirror_row(),
            inverse,
            tick_s,
            by_voltage,
            segment_index: 0,
            n_given: 0,
            leg: 0,
            leg_start_mm: 0.0,
            track: None,
            axes: None,
            later: None,
            gap_rad: 0.0,
        };
        walk.enter();
        walk
    }

    /// How far the mirrors are from where a segment begins, rad: after its first sample was given.
    pub fn gap_rad(&self) -> f64 {
        self.gap_rad
    }

    /// The next sample, or `None` after the last.
    pub fn next(&mut self) -> Option<(Command, usize)> {
        let segment = self.draft.segments.get(self.segment_index)?;
        let index = self.segment_index;
        self.n_given += 1;
        let command = match segment.motion {
            Motion::Track { .. } => self.track(),
            Motion::Drive { first } => {
                let pair = self.draft.drives[(first + self.n_given - 1) as usize];
                self.driven(pair.map(f64::from))
            }
            Motion::Hold { vertex } => {
                let place: FieldPoint = self.draft.vertices[vertex as usize].into();
                match self.by_voltage && self.axes.is_some() && self.n_given == 1 {
                    true => self.driven([0.0; 2]),
                    false => Command::Place(place),
                }
            }
            Motion::Travel { .. } => {
                let last = self.n_given == segment.n_ticks;
                Command::Place(self.place(&segment.motion, last).into())
            }
        };
        self.gap_rad = if self.n_given == 1 { self.gap(&segment.motion) } else { 0.0 };
        if self.n_given == segment.n_ticks {
            self.leave(&segment.motion);
            self.segment_index += 1;
            self.n_given = 0;
            self.enter();
        }
        Some((command, index))
    }

    fn enter(&mut self) {
        self.leg_start_mm = 0.0;
        if let Some(segment) = self.draft.segments.get(self.segment_index) {
            if let Some((first, _)) = segment.motion.ends() {
                self.leg = first;
            }
            self.track = TrackWalk::new(self.draft, &segment.motion);
        }
    }

    /// Distance between the mirrors, when the voltages before have acted, and where `motion`
    /// begins.
    fn gap(&self, motion: &Motion) -> f64 {
        let wanted = match (motion, &self.track) {
            (&Motion::Hold { vertex }, _) => {
                let place = self.draft.vertices[vertex as usize].into();
                angles_from_field(&self.draft.machine.optics, place)
                    .map(|angles| [angles.x_rad, angles.y_rad])
            }
            (Motion::Track { .. }, Some(Ok(track))) => Some(track.now()),
            _ => None,
        };
        let (Some(axes), Some(wanted), true) = (&self.axes, wanted, self.by_voltage) else {
            return 0.0;
        };
        let off = |axis: usize| (self.mirror_row.dot(&axes[axis].0) - wanted[axis]).abs();
        off(0).max(off(1))
    }

    /// What a segment leaves the axes in, for a drive that follows.
    fn leave(&mut self, motion: &Motion) {
        match *motion {
            Motion::Hold { vertex } => {
                let place = self.draft.vertices[vertex as usize].into();
                self.axes = angles_from_field(&self.draft.machine.optics, place).map(|angles| {
                    let rest = |rad: f64| (State::new(rad, 0.0, 0.0, 0.0, 0.0), 0.0);
                    [rest(angles.x_rad), rest(angles.y_rad)]
                });
            }
            Motion::Travel { .. } => self.axes = None,
            Motion::Track { .. } => {
                if let (Some(Ok(track)), Some(inverse)) = (&mut self.track, self.inverse) {
                    self.axes = Some([0, 1].map(|axis| inverse.state(&track.around(axis))));
                    self.later = match track.advance() {
                        Ok(()) => Some([0, 1].map(|axis| inverse.state(&track.around(axis)).0)),
                        Err(_) => None,
                    };
                }
            }
            Motion::Drive { .. } => {}
        }
    }

    /// The command that makes the servo apply these voltages after what acts now; the axes move on.
    fn driven(&mut self, next: [f64; 2]) -> Command {
        if !self.by_voltage {
            return Command::Angles(MirrorAngles { x_rad: next[0], y_rad: next[1] });
        }
        let mut axes = self.axes.unwrap_or([(State::zeros(), 0.0); 2]);
        let later = self.later.take();
        let mut angles = [0.0; 2];
        for (axis, (state, acting_v)) in axes.iter_mut().enumerate() {
            let answer_v = |reference_rad: f64| {
                let seen = Seen {
                    state: *state,
                    sensor_rad: 0.0,
                    sensor_error_rad: 0.0,
                    voltage_v: *acting_v,
                };
                self.gains.voltage(&mut Memory::default(), reference_rad, &seen, self.tick_s)
            };
            // The servo answers linearly.
            let (without_v, with_v) = (answer_v(0.0), answer_v(1.0));
            angles[axis] = (next[axis] - without_v) / (with_v - without_v);
            *state = match later {
                Some(later) => later[axis],
                None => self.step.a * *state + self.step.b * *acting_v,
            };
            *acting_v = next[axis];
        }
        self.axes = Some(axes);
        Command::Angles(MirrorAngles { x_rad: angles[0], y_rad: angles[1] })
    }

    /// The command of the next sample of a track.
    fn track(&mut self) -> Command {
        let track = match &mut self.track {
            Some(Ok(track)) => track,
            Some(Err(place)) => return Command::Place(*place),
            None => return Command::Place(FieldPoint::default()),
        };
        let around: [Taps; 2] = [track.around(0), track.around(1)];
        let after = track.after();
        if let Err(place) = track.advance() {
            let command = Command::Place(place);
            self.track = Some(Err(place));
            return command;
        }
        if !self.by_voltage {
            return Command::Angles(MirrorAngles { x_rad: after[0], y_rad: after[1] });
        }
        let Some(inverse) = self.inverse else {
            return Command::Place(FieldPoint::default());
        };
        let around_next = [track.around(0), track.around(1)];
        match inverse.reference {
            // The first command joins what was before to the first voltage of the track.
            Some(taps) if self.n_given > 1 || self.axes.is_none() => {
                let [x_rad, y_rad] = around.map(|angles| dot(&taps, &angles));
                Command::Angles(MirrorAngles { x_rad, y_rad })
            }
            _ => self.driven(around_next.map(|angles| dot(&inverse.voltage, &angles))),
        }
    }

    fn place(&mut self, motion: &Motion, last: bool) -> Point {
        let vertices = &self.draft.vertices;
        let (&Motion::Travel { profile, .. }, Some((_, end))) = (motion, motion.ends()) else {
            return vertices[self.leg];
        };
        if last {
            return vertices[end];
        }
        let time_s = f64::from(self.n_given) * self.tick_s;
        let distance_mm = profile.distance_mm(time_s);
        loop {
            let (from, to) = (vertices[self.leg], vertices[self.leg + 1]);
            let length_mm = from.distance(to);
            let along_mm = distance_mm - self.leg_start_mm;
            if along_mm <= length_mm || self.leg + 1 == end {
                let share = if length_mm > 0.0 { (along_mm / length_mm).min(1.0) } else { 1.0 };
                return from.lerp(to, share);
            }
            self.leg_start_mm += length_mm;
            self.leg += 1;
        }
    }
}
