//! The nominal beam in the audit: light stays on its mark, and every millimetre gets its energy.

use super::AuditError;
use crate::optics::field_from_angles;
use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::space::MirrorAngles;
use kurbo::{PathEl, Point};

/// Curves are flattened to this part of the tolerance.
const FLATTEN_SHARE: f64 = 0.02;
/// How far from the expected arc length a nearest point is looked for, in tolerances.
const AHEAD: f64 = 3.0;
/// What being away from the expected arc length counts, against being off the curve.
const AWAY: f64 = 0.005;
/// Part of the dose that may be missing for good, besides what a spot and two tolerances make of it
/// at any place.
const DOSE_SHARE: f64 = 0.005;
/// Rounding of times and powers.
const ROUNDING: f64 = 1e-6;

/// Follows the nominal beam along the marks.
pub struct Beam<'a> {
    draft: &'a PlanDraft,
    /// Whether the plan promises to stay on its marks.
    strict: bool,
    mark_index: usize,
    points: Vec<Point>,
    /// Arc length at each point, mm.
    lengths_mm: Vec<f64>,
    leg: usize,
    /// Arc length that the beam has come to, and what has been given the pen's energy, mm.
    at_mm: f64,
    given_mm: f64,
    /// Arc length where the beam should be by the way it has made, mm, and its last place.
    expected_mm: f64,
    last: Option<Point>,
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
            points: Vec::new(),
            lengths_mm: Vec::new(),
            leg: 0,
            at_mm: 0.0,
            given_mm: 0.0,
            expected_mm: 0.0,
            last: None,
            step: 0,
            counted_ns: 0.0,
        };
        beam.enter();
        beam
    }

    /// Prepares for the mark that comes next.
    fn enter(&mut self) {
        (self.leg, self.at_mm, self.given_mm, self.step) = (0, 0.0, 0.0, 0);
        (self.expected_mm, self.last) = (0.0, None);
        let Some(mark) = self.draft.marks.get(self.mark_index).filter(|_| self.strict) else {
            return;
        };
        let mut points: Vec<Point> = Vec::new();
        kurbo::flatten(
            &mark.curve,
            FLATTEN_SHARE * self.draft.tolerance_mm,
            |element| match element {
                PathEl::MoveTo(point) | PathEl::LineTo(point) => points.push(point),
                PathEl::ClosePath => points.extend(points.first().copied()),
                PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
            },
        );
        let mut length_mm = 0.0;
        self.lengths_mm.clear();
        for (index, point) in points.iter().enumerate() {
            length_mm += index.checked_sub(1).map_or(0.0, |before| points[before].distance(*point));
            self.lengths_mm.push(length_mm);
        }
        self.points = points;
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
            self.at_mm = self.lengths_mm.last().copied().unwrap_or(0.0);
            self.check_dose(mark)?;
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
        let (value, limit) = (self.nearest_mm(place), self.draft.tolerance_mm * (1.0 + ROUNDING));
        if value.is_nan() || value > limit {
            let quantity = "distance of the lit beam from its mark";
            let place = format!("mark {} ({})", self.mark_index, mark.source);
            return Err(AuditError::Limit { place, quantity, value, limit, unit: "mm" });
        }
        self.count(mark, time_ns);
        self.check_dose(mark)
    }

    /// Distance of a place from the curve, near where the beam has been.
    ///
    /// Where the curve comes back to a place, the beam is where its way so far says.
    fn nearest_mm(&mut self, place: Point) -> f64 {
        self.expected_mm += self.last.map_or(0.0, |last| last.distance(place));
        self.last = Some(place);
        let reach_mm = AHEAD * self.draft.tolerance_mm;
        let mut nearest = (f64::INFINITY, f64::INFINITY, self.leg, self.at_mm);
        for index in self.leg..self.points.len() - 1 {
            if index > self.leg && self.lengths_mm[index] > self.expected_mm + reach_mm {
                break;
            }
            let (from, to) = (self.points[index], self.points[index + 1]);
            let square = (to - from).hypot2();
            let share = match square > 0.0 {
                true => ((place - from).dot(to - from) / square).clamp(0.0, 1.0),
                false => 0.0,
            };
            let off_mm = from.lerp(to, share).distance(place);
            let at_mm = self.lengths_mm[index] + share * square.sqrt();
            if (at_mm - self.expected_mm).abs() > reach_mm && nearest.1 < f64::INFINITY {
                continue;
            }
            let cost = off_mm.hypot(AWAY * (at_mm - self.expected_mm));
            if cost < nearest.0 {
                nearest = (cost, off_mm, index, at_mm);
            }
        }
        let (_, off_mm, leg, at_mm) = nearest;
        self.leg = leg;
        if at_mm > self.at_mm {
            (self.at_mm, self.expected_mm) = (at_mm, at_mm);
        }
        off_mm
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

    fn check_dose(&self, mark: &PlannedMark) -> Result<(), AuditError> {
        let pen = &self.draft.pens[mark.pen_index];
        if !self.draft.machine.laser.power_modulated || pen.power_w == 0.0 {
            return Ok(());
        }
        let spot_mm = self.draft.machine.laser.spot_diameter_mm;
        let limit = spot_mm + 2.0 * self.draft.tolerance_mm + DOSE_SHARE * self.at_mm;
        let value = (self.given_mm - self.at_mm).abs();
        if value.is_nan() || value > limit {
            let quantity = "length that has too much or too little energy";
            let place = format!("mark {} ({})", self.mark_index, mark.source);
            return Err(AuditError::Limit { place, quantity, value, limit, unit: "mm" });
        }
        Ok(())
    }
}
