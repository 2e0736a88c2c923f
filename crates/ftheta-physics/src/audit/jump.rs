//! Planned jumps in the audit: the commands that follow from the voltages, and the rest at the end.

use super::AuditError;
use crate::galvo::{CURRENT, Galvo, State, Step};
use crate::optics::{angles_from_field, scale_mm_per_rad};
use crate::servo::{Gains, Memory, Seen};
use ftheta_model::plan::{Motion, PlanDraft};
use ftheta_model::space::MirrorAngles;

/// Current that may be left at the end, of the greatest.
const CURRENT_LEFT: f64 = 5e-5;

/// Yields the commanded angles of one jump: what makes the nominal servo apply the voltages.
pub struct JumpWalk<'a> {
    gains: Gains,
    step: Step,
    tick_s: f64,
    sequence_v: &'a [f64],
    n_given: usize,
    /// The axis for a factor of one, and the voltage acting on it.
    state: State,
    acting_v: f64,
    from: MirrorAngles,
    factors: [f64; 2],
}

impl<'a> JumpWalk<'a> {
    /// Starts before the first sample; `None` for other motion.
    pub fn new(
        draft: &'a PlanDraft,
        motion: &Motion,
        gains: &Gains,
        galvo: &Galvo,
    ) -> Option<Self> {
        let &Motion::Jump { sequence, .. } = motion else {
            return None;
        };
        let tick_s = draft.machine.output.period_s();
        let sequence_v = &draft.sequences_v[sequence as usize];
        let (from, factors) = ends(draft, motion, galvo)?;
        Some(Self {
            gains: *gains,
            step: galvo.step(tick_s),
            tick_s,
            sequence_v,
            n_given: 0,
            state: State::zeros(),
            acting_v: 0.0,
            from,
            factors,
        })
    }

    /// The angles of the next sample.
    pub fn next(&mut self) -> MirrorAngles {
        let next_v = self.sequence_v.get(self.n_given).copied().unwrap_or(0.0);
        let answer_v = |reference_rad: f64| {
            let (state, voltage_v) = (self.state, self.acting_v);
            let seen = Seen { state, sensor_rad: 0.0, sensor_error_rad: 0.0, voltage_v };
            self.gains.voltage(&mut Memory::default(), reference_rad, &seen, self.tick_s)
        };
        // The servo answers linearly.
        let (without_v, with_v) = (answer_v(0.0), answer_v(1.0));
        let reference_rad = (next_v - without_v) / (with_v - without_v);
        self.state = self.step.a * self.state + self.step.b * self.acting_v;
        self.acting_v = next_v;
        self.n_given += 1;
        let [x, y] = self.factors.map(|factor| factor * reference_rad);
        MirrorAngles { x_rad: self.from.x_rad + x, y_rad: self.from.y_rad + y }
    }
}

/// Angles at the start, and the factor on the voltages of each axis.
fn ends(draft: &PlanDraft, motion: &Motion, galvo: &Galvo) -> Option<(MirrorAngles, [f64; 2])> {
    let &Motion::Jump { sequence, .. } = motion else {
        return None;
    };
    let sequence_v = &draft.sequences_v[sequence as usize];
    let angles =
        |vertex: usize| angles_from_field(&draft.machine.optics, draft.vertices[vertex].into());
    let (from, to) = (angles(motion.first_vertex())?, angles(motion.last_vertex())?);
    let step_rad = target_rad(sequence_v, galvo, draft.machine.output.period_s());
    Some((from, [(to.x_rad - from.x_rad) / step_rad, (to.y_rad - from.y_rad) / step_rad]))
}

/// Where an axis comes to rest after these voltages, rad: the coil's equation, integrated over all
/// time, leaves `Kt · angle = ∫ U dt`.
fn target_rad(sequence_v: &[f64], galvo: &Galvo, tick_s: f64) -> f64 {
    sequence_v.iter().sum::<f64>() * tick_s / galvo.torque_constant
}

/// Checks that every jump starts and ends where the optics reach, and ends at rest: no current
/// left, the mirror with its vibration within the job's tolerance of its target.
pub fn check_jumps(draft: &PlanDraft, gains: &Gains) -> Result<(), AuditError> {
    let scanner = &draft.machine.scanner;
    let galvo = Galvo::new(scanner);
    let tick_s = draft.machine.output.period_s();
    let tolerance_rad = draft.tolerance_mm / scale_mm_per_rad(&draft.machine.optics);
    if !draft.sequences_v.is_empty() && gains.reference_rad(&State::zeros(), 0.0, 0.0).is_none() {
        let what = "the memory of its servo outlasts planned jumps".into();
        return Err(AuditError::Malformed { place: "the machine".into(), what });
    }
    let Step { a, b } = galvo.step(tick_s);
    let rest: Vec<(f64, f64)> = draft
        .sequences_v
        .iter()
        .map(|sequence_v| {
            let end = sequence_v.iter().fold(State::zeros(), |state, v| a * state + b * *v);
            let share = galvo.rotor_inertia / galvo.inertia();
            let vibration_rad = share * end[2].hypot(end[3] / galvo.omega);
            let off_rad = (end[0] - target_rad(sequence_v, &galvo, tick_s)).abs();
            (off_rad + vibration_rad, end[CURRENT].abs())
        })
        .collect();
    for (index, segment) in draft.segments.iter().enumerate() {
        let Motion::Jump { sequence, .. } = segment.motion else {
            continue;
        };
        let place = || format!("jump in segment {index}");
        let Some((_, factors)) = ends(draft, &segment.motion, &galvo) else {
            let at = draft.vertices[segment.motion.last_vertex()];
            return Err(AuditError::Unreachable { place: place(), x_mm: at.x, y_mm: at.y });
        };
        let factor = factors[0].abs().max(factors[1].abs());
        let (off_rad, current_a) = rest[sequence as usize];
        let current_limit_a = CURRENT_LEFT * scanner.current_max_a;
        let rows = [
            ("distance from rest at the end", factor * off_rad, tolerance_rad, "rad"),
            ("current at the end", factor * current_a, current_limit_a, "A"),
        ];
        for (quantity, value, limit, unit) in rows {
            // A value that is not a number is over every limit.
            if value.is_nan() || value > limit {
                return Err(AuditError::Limit { place: place(), quantity, value, limit, unit });
            }
        }
    }
    Ok(())
}
