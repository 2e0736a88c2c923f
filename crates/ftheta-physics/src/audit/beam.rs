//! The nominal beam in the audit: light stays on its mark, and every millimetre gets its energy.

use super::AuditError;
use crate::along::Along;
use crate::optics::field_from_angles;
use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::space::MirrorAngles;
use kurbo::Point;

/// Part of the dose that may be missing for good, besides what a spot and two tolerances make of it
/// at any place.
const DOSE_SHARE: f64 = 0.005;
/// What is called so in messages.
const OFF_MARK: &str = "distance of the lit beam from its mark";
const WRONG_DOSE: &str = "length that has too much or too little energy";
/// Both of them.
pub const MISSES: [&str; 2] = [OFF_MARK, WRONG_DOSE];
/// Rounding of times and powers.
const ROUNDING: f64 = 1e-6;

/// Follows the nominal beam along the marks.
pub struct Beam<'a> {
    draft: &'a PlanDraft,
    /// Whether the plan promises to stay on its marks.
    strict: bool,
    mark_index: usize,
    along: Along,
    /// Length that has been given the pen's energy, mm.
    given_mm: f64,
    /// Greatest distance of the lit beam from its mark so far, mm.
    worst_mm: f64,
    /// Step of power that acts, and until when energy has been counted, ns.
    step: usize,
    counted_ns: f64,
}

impl<'a> Beam<'a> {
    /// Before the first sample.
    ///
    /// * `known`: whether the nominal servo is that of the machine
    pub fn new(draft: &'a PlanDraft, known: bool) -> Self {
        let mut beam = Self {
            draft,
            strict: known && draft.planner == Planner::Optimal,
            mark_index: 0,
            along: Along::default(),
            given_mm: 0.0,
            worst_mm: 0.0,
            step: 0,
            counted_ns: 0.0,
        };
        beam.enter();
        beam
    }

    /// Greatest distance of the lit beam from its mark, mm, of a plan that promises one.
    pub fn worst_mm(&self) -> Option<f64> {
        self.strict.then_some(self.worst_mm)
    }

    /// Prepares for the mark that comes next.
    fn enter(&mut self) {
        (self.given_mm, self.step) = (0.0, 0);
        let Some(mark) = self.draft.marks.get(self.mark_index).filter(|_| self.strict) else {
            return;
        };
        self.along = Along::new(&mark.curve, self.draft.tolerance_mm);
        self.counted_ns = self.light_ns(mark).0;
    }

    /// When light begins and ends, ns.
    fn light_ns(&self, mark: &PlannedMark) -> (f64, f64) {
        let laser = &self.draft.machine.laser;
        let on_ns = mark.on_ns as f64 + laser.on_latency_ns as f64;
        (on_ns, mark.off_ns as f64 + laser.off_latency_ns as f64)
    }

    /// Takes the mirrors' nominal angles at a time.
    ///
    /// # Errors
    /// If the lit beam is off its mark, or the energy is not what the pen says.
    pub fn sample(&mut self, time_ns: f64, angles: MirrorAngles) -> Result<(), AuditError> {
        if !self.strict {
            return Ok(());
        }
        while let Some(mark) = self.draft.marks.get(self.mark_index) {
            let (on_ns, off_ns) = self.light_ns(mark);
            if time_ns < on_ns {
                return Ok(());
            }
            if time_ns <= off_ns {
                return self.lit(mark, time_ns, angles);
            }
            self.count(mark, off_ns);
            self.check_dose(mark, self.along.length_mm())?;
            self.mark_index += 1;
            self.enter();
        }
        Ok(())
    }

    fn lit(
        &mut self,
        mark: &PlannedMark,
        time_ns: f64,
        angles: MirrorAngles,
    ) -> Result<(), AuditError> {
        let place: Point = field_from_angles(&self.draft.machine.optics, angles).into();
        let (value, limit) =
            (self.along.distance_mm(place), self.draft.tolerance_mm * (1.0 + ROUNDING));
        self.worst_mm = self.worst_mm.max(value);
        if value.is_nan() || value > limit {
            let quantity = OFF_MARK;
            let place = format!("mark {} ({})", self.mark_index, mark.source);
            return Err(AuditError::Limit { place, quantity, value, limit, unit: "mm" });
        }
        self.count(mark, time_ns);
        self.check_dose(mark, self.along.at_mm())
    }

    /// Counts energy until a time, as the length that the pen would give it to.
    fn count(&mut self, mark: &PlannedMark, until_ns: f64) {
        let pen = &self.draft.pens[mark.pen_index];
        let latency_ns = self.draft.machine.laser.on_latency_ns as f64;
        while self.counted_ns < until_ns {
            let power_w = match self.step {
                0 => mark.power_w,
                step => mark.steps[step - 1].power_w,
            };
            let next_ns = match mark.steps.get(self.step) {
                Some(next) => next.time_ns as f64 + latency_ns,
                None => f64::INFINITY,
            };
            let end_ns = next_ns.min(until_ns);
            let duration_s = 1e-9 * (end_ns - self.counted_ns).max(0.0);
            if pen.power_w > 0.0 {
                self.given_mm += power_w * duration_s * pen.mark_speed_mm_s / pen.power_w;
            }
            self.counted_ns = end_ns.max(self.counted_ns);
            self.step += usize::from(next_ns <= until_ns);
        }
    }

    fn check_dose(&self, mark: &PlannedMark, at_mm: f64) -> Result<(), AuditError> {
        let pen = &self.draft.pens[mark.pen_index];
        if !self.draft.machine.laser.follows_speed() || pen.power_w == 0.0 {
            return Ok(());
        }
        let spot_mm = self.draft.machine.laser.spot_diameter_mm;
        let limit = spot_mm + 2.0 * self.draft.tolerance_mm + DOSE_SHARE * at_mm;
        let value = (self.given_mm - at_mm).abs();
        if value.is_nan() || value > limit {
            let quantity = WRONG_DOSE;
            let place = format!("mark {} ({})", self.mark_index, mark.source);
            return Err(AuditError::Limit { place, quantity, value, limit, unit: "mm" });
        }
        Ok(())
    }
}
