//! Walks a plan's segments sample by sample, from their definition alone.

use super::AuditError;
use super::jump::JumpWalk;
use crate::galvo::Galvo;
use crate::servo::Gains;
use ftheta_model::plan::{Motion, PlanDraft, Segment};
use ftheta_model::recipe::Interpolation;
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
    galvo: Galvo,
    jump: Option<JumpWalk<'a>>,
    segment_index: usize,
    /// Samples of the segment already given.
    n_given: u32,
    /// Vertex before the place last given, and the path length up to it.
    leg: usize,
    leg_start_mm: f64,
}

impl<'a> Walk<'a> {
    /// Starts at the first sample.
    pub fn new(draft: &'a PlanDraft, gains: Gains) -> Self {
        let galvo = Galvo::new(&draft.machine.scanner);
        let (segment_index, n_given, leg, leg_start_mm) = (0, 0, 0, 0.0);
        let mut walk =
            Self { draft, gains, galvo, jump: None, segment_index, n_given, leg, leg_start_mm };
        walk.enter();
        walk
    }

    /// The next sample, or `None` after the last.
    pub fn next(&mut self) -> Option<(Command, usize)> {
        let segment = self.draft.segments.get(self.segment_index)?;
        let index = self.segment_index;
        self.n_given += 1;
        let command = match &mut self.jump {
            Some(jump) => Command::Angles(jump.next()),
            None => {
                let last = self.n_given == segment.n_ticks;
                Command::Place(self.place(&segment.motion, last).into())
            }
        };
        if self.n_given == segment.n_ticks {
            self.segment_index += 1;
            self.n_given = 0;
            self.enter();
        }
        Some((command, index))
    }

    fn enter(&mut self) {
        self.leg_start_mm = 0.0;
        if let Some(segment) = self.draft.segments.get(self.segment_index) {
            self.leg = segment.motion.first_vertex();
            self.jump = JumpWalk::new(self.draft, &segment.motion, &self.gains, &self.galvo);
        }
    }

    fn place(&mut self, motion: &Motion, last: bool) -> Point {
        let vertices = &self.draft.vertices;
        let &Motion::Travel { profile, .. } = motion else {
            return vertices[self.leg];
        };
        let end = motion.last_vertex();
        if last {
            return vertices[end];
        }
        let time_s = f64::from(self.n_given) * self.draft.machine.output.period_s();
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

/// Checks that indices exist, numbers are finite and segments join end to end from the centre.
pub fn check_structure(draft: &PlanDraft) -> Result<(), AuditError> {
    let malformed = |place: String, what: &str| AuditError::Malformed { place, what: what.into() };
    if draft.segments.is_empty() {
        return Err(malformed("the plan".into(), "no segments"));
    }
    if let Some(index) = draft.vertices.iter().position(|vertex| !vertex.is_finite()) {
        return Err(malformed(format!("vertex {index}"), "a coordinate is not finite"));
    }
    if let Some(index) = draft.marks.iter().position(|mark| mark.pen_index >= draft.pens.len()) {
        return Err(malformed(format!("mark {index}"), "its pen does not exist"));
    }
    let mut at = Point::ZERO;
    for (index, segment) in draft.segments.iter().enumerate() {
        let place = || format!("segment {index}");
        if segment.n_ticks == 0 {
            return Err(malformed(place(), "no samples"));
        }
        if segment.mark_index.is_some_and(|mark| mark as usize >= draft.marks.len()) {
            return Err(malformed(place(), "its mark does not exist"));
        }
        if segment.motion.last_vertex() >= draft.vertices.len() {
            return Err(malformed(place(), "its vertices do not exist"));
        }
        check_profile(draft, &segment.motion).map_err(|what| malformed(place(), what))?;
        if let Motion::Jump { sequence, .. } = segment.motion {
            check_sequence(draft, sequence, segment).map_err(|what| malformed(place(), what))?;
        }
        if draft.vertices[segment.motion.first_vertex()] != at {
            return Err(malformed(place(), "it does not start where the one before ends"));
        }
        at = draft.vertices[segment.motion.last_vertex()];
    }
    Ok(())
}

/// Checks that a jump's sequence is there, as long as the segment, and leads somewhere.
fn check_sequence(draft: &PlanDraft, index: u32, segment: &Segment) -> Result<(), &'static str> {
    let Some(sequence_v) = draft.sequences_v.get(index as usize) else {
        return Err("its sequence does not exist");
    };
    if sequence_v.len() != segment.n_ticks as usize {
        return Err("its sequence is not as long as its samples");
    }
    let sum_v: f64 = sequence_v.iter().sum();
    if !sum_v.is_finite() || sum_v == 0.0 {
        return Err("its sequence leads nowhere");
    }
    if segment.mark_index.is_some() {
        return Err("a jump cannot belong to a mark");
    }
    Ok(())
}

/// Checks a travel's speed profile against its vertices: `render` trusts the length.
fn check_profile(draft: &PlanDraft, motion: &Motion) -> Result<(), &'static str> {
    let &Motion::Travel { n_vertices, profile, interpolation, .. } = motion else {
        return Ok(());
    };
    let positive = |value: f64| value > 0.0;
    if n_vertices < 2
        || !(profile.length_mm.is_finite() && profile.speed_mm_s.is_finite())
        || !(positive(profile.length_mm) && positive(profile.speed_mm_s))
        || !(positive(profile.acceleration_mm_s2) && positive(profile.deceleration_mm_s2))
    {
        return Err("its speed profile is impossible");
    }
    if interpolation == Interpolation::Dda && n_vertices != 2 {
        return Err("a DDA takes one vector at a time");
    }
    let vertices = &draft.vertices[motion.first_vertex()..=motion.last_vertex()];
    let length_mm: f64 = vertices.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    if (length_mm - profile.length_mm).abs() > 1e-9 * (1.0 + length_mm) {
        return Err("its profile is not as long as its vertices");
    }
    Ok(())
}
