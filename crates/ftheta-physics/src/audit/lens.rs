//! The focusing lens in the audit: where there is light it keeps the focus on the beam's place in
//! the work plane; in the dark it may take any path that its limits allow.

use super::{AuditError, ROUNDING, six_digits};
use crate::focus::lens_travel_mm;
use crate::optics::field_from_angles;
use ftheta_model::machine::Focus;
use ftheta_model::plan::PlanDraft;
use ftheta_model::space::{FieldPoint, MirrorAngles};

/// The lens at a time.
#[derive(Clone, Copy, Debug)]
struct Moving {
    time_s: f64,
    at_mm: f64,
    speed_mm_s: f64,
}

/// Follows the lens through a plan, tick by tick.
pub struct LensWalk<'a> {
    draft: &'a PlanDraft,
    /// `None` for a head without such a lens.
    focus: Option<&'a Focus>,
    tick_s: f64,
    mark_index: usize,
    /// Travel at the ticks before this one in the same light, newest first.
    before_mm: [f64; 2],
    n_before: u32,
    /// The lens when it was last bound to a place.
    left: Moving,
}

impl<'a> LensWalk<'a> {
    /// Before the first sample: the lens stands where the field's centre needs it, and moves a lag
    /// after the first sample at the earliest.
    pub fn new(draft: &'a PlanDraft) -> Self {
        let optics = &draft.machine.optics;
        let focus = optics.focus.as_ref();
        let left = Moving {
            time_s: focus.map_or(0.0, |focus| focus.lag_s),
            at_mm: lens_travel_mm(optics, FieldPoint::default()).unwrap_or(0.0),
            speed_mm_s: 0.0,
        };
        let tick_s = draft.machine.output.period_s();
        Self { draft, focus, tick_s, mark_index: 0, before_mm: [0.0; 2], n_before: 0, left }
    }

    /// Takes the mirrors' nominal angles at tick `tick`.
    ///
    /// # Errors
    /// If the lens cannot be where the lit beam needs it.
    pub fn sample(&mut self, tick: u64, angles: MirrorAngles) -> Result<(), AuditError> {
        let Some(focus) = self.focus else {
            return Ok(());
        };
        while let Some((first, last)) = self.bound() {
            if tick < first {
                break;
            }
            if tick <= last {
                return self.lit(focus, tick, angles);
            }
            self.mark_index += 1;
            let goes_on = self.bound().is_some_and(|(next, _)| next <= tick);
            self.n_before = if goes_on { self.n_before } else { 0 };
        }
        Ok(())
    }

    /// After the last sample the lens stands where it stood before the first.
    ///
    /// # Errors
    /// If it cannot be back.
    pub fn finish(&self, n_ticks: u64) -> Result<(), AuditError> {
        let (Some(focus), Some(at_mm)) =
            (self.focus, lens_travel_mm(&self.draft.machine.optics, FieldPoint::default()))
        else {
            return Ok(());
        };
        let time_s = n_ticks as f64 * self.tick_s;
        self.check_dark(focus, Moving { time_s, at_mm, speed_mm_s: 0.0 }, "end of the plan")
    }

    /// First and last tick of the light of the mark at hand; two ticks or more.
    fn bound(&self) -> Option<(u64, u64)> {
        let mark = self.draft.marks.get(self.mark_index)?;
        let laser = &self.draft.machine.laser;
        let period_ns = i128::from(self.draft.machine.output.period_ns);
        let on_ns = i128::from(mark.on_ns) + i128::from(laser.on_latency_ns);
        let off_ns = i128::from(mark.off_ns) + i128::from(laser.off_latency_ns);
        // An edge is rounded to a nanosecond.
        let (first, last) = ((on_ns - 1).div_euclid(period_ns) + 1, off_ns.div_euclid(period_ns));
        let (first, last) = match last > first {
            true => (first, last),
            false => (on_ns.div_euclid(period_ns), last.max(on_ns.div_euclid(period_ns) + 1)),
        };
        Some((first.max(0) as u64, last.max(1) as u64))
    }

    fn lit(&mut self, focus: &Focus, tick: u64, angles: MirrorAngles) -> Result<(), AuditError> {
        let optics = &self.draft.machine.optics;
        let at_mm = lens_travel_mm(optics, field_from_angles(optics, angles)).unwrap_or(f64::NAN);
        let [last_mm, earlier_mm] = self.before_mm;
        let mark = &self.draft.marks[self.mark_index];
        let place = || {
            let time_ms = tick as f64 * self.tick_s * 1e3;
            format!("mark {} ({}) at {time_ms:.3} ms", self.mark_index, mark.source)
        };
        // The beam may be off its mark by the tolerance, and so off the field.
        let travel_max_mm = self.travel_max_mm(focus);
        within(&place, "travel of the focusing lens", at_mm, travel_max_mm, "mm")?;
        if self.n_before > 0 {
            let speed_mm_s = (at_mm - last_mm) / self.tick_s;
            let quantity = "speed of the focusing lens";
            within(&place, quantity, speed_mm_s, focus.speed_max_mm_s, "mm/s")?;
            let time_s = (tick as f64 - 0.5) * self.tick_s;
            let now = Moving { time_s, at_mm: 0.5 * (at_mm + last_mm), speed_mm_s };
            if self.n_before > 1 {
                let acceleration =
                    (at_mm - 2.0 * last_mm + earlier_mm) / (self.tick_s * self.tick_s);
                let quantity = "acceleration of the focusing lens";
                let limit = focus.acceleration_max_mm_s2;
                within(&place, quantity, acceleration, limit, "mm/s²")?;
            } else {
                self.check_dark(focus, now, &place())?;
            }
            self.left = now;
        }
        self.before_mm = [at_mm, last_mm];
        self.n_before = (self.n_before + 1).min(2);
        Ok(())
    }

    fn travel_max_mm(&self, focus: &Focus) -> f64 {
        focus.travel_mm + self.draft.tolerance_mm / focus.magnification.abs()
    }

    /// Checks that the lens gets from where it was left to `to` in the time between.
    ///
    /// What it reaches in that time lies between the two ways that speed up at once in either
    /// direction. A way with one constant speed in its middle leaves its ends the least.
    fn check_dark(&self, focus: &Focus, to: Moving, place: &str) -> Result<(), AuditError> {
        let (from, a) = (self.left, focus.acceleration_max_mm_s2);
        let place = || format!("{place}: the dark before it");
        let time_s = to.time_s - from.time_s;
        let change = to.speed_mm_s - from.speed_mm_s;
        let quantity = "change of speed of the focusing lens";
        within(&place, quantity, change, (a * time_s).max(0.0), "mm/s")?;
        let way_mm = to.at_mm - from.at_mm;
        let speeds = [from.speed_mm_s, to.speed_mm_s];
        let most_mm = longest_mm(focus, speeds, time_s);
        let least_mm = -longest_mm(focus, speeds.map(|speed| -speed), time_s);
        let middle_mm = 0.5 * (most_mm + least_mm);
        let quantity = "way of the focusing lens beside its mean reach";
        within(&place, quantity, way_mm - middle_mm, most_mm - middle_mm, "mm")?;
        let ramps_mm = speeds.map(|speed| 0.5 * speed * speed.abs() / a);
        let can_stop = (speeds[0].abs() + speeds[1].abs()) / a <= time_s;
        let cruise = match can_stop {
            true => way_mm - ramps_mm[0] - ramps_mm[1],
            false => speeds[0] + speeds[1],
        };
        let limit_mm = self.travel_max_mm(focus);
        for (at_mm, speed) in
            [(from.at_mm + ramps_mm[0], speeds[0]), (to.at_mm - ramps_mm[1], speeds[1])]
        {
            if speed * cruise < 0.0 {
                within(&place, "travel of the focusing lens", at_mm, limit_mm, "mm")?;
            }
        }
        Ok(())
    }
}

/// Longest way in a time between speeds, mm.
fn longest_mm(focus: &Focus, speeds_mm_s: [f64; 2], time_s: f64) -> f64 {
    let a = focus.acceleration_max_mm_s2;
    let [from, to] = speeds_mm_s;
    let peak = (0.5 * (from + to + a * time_s)).min(focus.speed_max_mm_s.max(from.max(to)));
    let ramps_mm = (2.0 * peak * peak - from * from - to * to) / (2.0 * a);
    ramps_mm + peak * (time_s - (2.0 * peak - from - to) / a).max(0.0)
}

/// The error for a value, either sign, that is past its limit.
fn within(
    place: &dyn Fn() -> String,
    quantity: &'static str,
    value: f64,
    limit: f64,
    unit: &'static str,
) -> Result<(), AuditError> {
    if value.abs() <= limit * (1.0 + ROUNDING) + ROUNDING {
        return Ok(());
    }
    let (value, limit) = (six_digits(value), six_digits(limit));
    Err(AuditError::Limit { place: place(), quantity, value, limit, unit })
}
