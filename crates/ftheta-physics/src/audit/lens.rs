//! The focusing lens in the audit: where there is light it keeps the focus on the beam's place in
//! the work plane; in the dark it may take any path that its limits allow.

use super::{AuditError, ROUNDING, six_digits};
use crate::focus::{lens_travel_mm, travel_max_mm};
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
        let end = Moving { time_s, at_mm, speed_mm_s: 0.0 };
        check_dark(
            focus,
            travel_max_mm(focus, self.draft.tolerance_mm),
            [self.left, end],
            "end of the plan",
        )
    }

    /// First and last tick of the light of the mark at hand.
    fn bound(&self) -> Option<(u64, u64)> {
        let mark = self.draft.marks.get(self.mark_index)?;
        Some(mark.lit_ticks(&self.draft.machine))
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
        let travel_max_mm = travel_max_mm(focus, self.draft.tolerance_mm);
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
                check_dark(focus, travel_max_mm, [self.left, now], &place())?;
            }
            self.left = now;
        }
        self.before_mm = [at_mm, last_mm];
        self.n_before = (self.n_before + 1).min(2);
        Ok(())
    }
}

/// Checks that the lens gets from one state to another in the time between.
///
/// What it reaches in that time lies between the two ways that speed up at once in either
/// direction. A way with one constant speed in its middle leaves its ends the least.
fn check_dark(
    focus: &Focus,
    travel_max_mm: f64,
    [from, to]: [Moving; 2],
    place: &str,
) -> Result<(), AuditError> {
    let a = focus.acceleration_max_mm_s2;
    let place = || format!("{place}: the dark before it");
    let time_s = to.time_s - from.time_s;
    // Negative where light comes before the lens can be told of it.
    within(&place, "time that the focusing lens lacks", (-time_s).max(0.0), 0.0, "s")?;
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
    for (at_mm, speed) in
        [(from.at_mm + ramps_mm[0], speeds[0]), (to.at_mm - ramps_mm[1], speeds[1])]
    {
        // A lens that does not go on in the direction of this end stops beside it.
        if speed != 0.0 && speed.signum() * cruise <= ROUNDING {
            within(&place, "travel of the focusing lens", at_mm, travel_max_mm, "mm")?;
        }
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at once")]

    use super::{Moving, check_dark};
    use ftheta_model::machine::Focus;
    use proptest::prelude::*;

    const FOCUS: Focus = Focus {
        magnification: 4.0,
        travel_mm: 5.0,
        speed_max_mm_s: 280.0,
        acceleration_max_mm_s2: 2e5,
        lag_s: 0.0,
        balanced: true,
    };

    fn allows(from: [f64; 2], to: [f64; 2], time_s: f64) -> bool {
        let moving = |time_s, [at_mm, speed_mm_s]: [f64; 2]| Moving { time_s, at_mm, speed_mm_s };
        let ends = [moving(0.0, from), moving(time_s, to)];
        check_dark(&FOCUS, FOCUS.travel_mm, ends, "here").is_ok()
    }

    #[test]
    fn the_shortest_times_are_those_of_a_trapezoid() {
        // 0.1 mm without coasting: 2·√(d/a); 9 mm with it: d/v + v/a; both from rest to rest.
        for (way_mm, time_s) in [(0.1, 2.0 * (0.1_f64 / 2e5).sqrt()), (9.0, 9.0 / 280.0 + 1.4e-3)] {
            let from = [-0.5 * way_mm, 0.0];
            let to = [0.5 * way_mm, 0.0];
            assert!(allows(from, to, time_s) && !allows(from, to, 0.999 * time_s), "{way_mm}");
        }
        // At full speed over 2.8 mm: 10 ms; a little later there is no way without a turn, and a
        // turn takes room that there is not before the end of the range.
        assert!(allows([-1.4, 280.0], [1.4, 280.0], 0.01));
        assert!(!allows([-1.4, 280.0], [1.4, 280.0], 0.0099));
        assert!(allows([4.85, 200.0], [4.85, -200.0], 0.002));
        assert!(!allows([4.95, 200.0], [4.95, -200.0], 0.002));
        assert!(!allows([0.0, 0.0], [0.0, 0.0], -0.001));
        assert!(!allows([0.0, 0.0], [f64::NAN, 0.0], 1.0));
    }

    proptest! {
        /// No way that keeps the limits is refused, however it winds.
        #[test]
        fn ways_within_limits_are_allowed(
            start in (-4.0..4.0_f64, -280.0..280.0_f64),
            pushes in prop::collection::vec((-1.3..1.3_f64, 1e-5..2e-3_f64), 1..12),
        ) {
            let from = [start.0, start.1];
            let ([mut at_mm, mut speed], mut time_s) = (from, 0.0);
            for (push, mut duration_s) in pushes {
                let acceleration = FOCUS.acceleration_max_mm_s2 * push.clamp(-1.0, 1.0);
                // As long as the speed allows.
                let room = FOCUS.speed_max_mm_s - speed * acceleration.signum();
                duration_s = duration_s.min(room / acceleration.abs());
                let turn_s = -speed / acceleration;
                let top_mm = at_mm - 0.5 * speed * speed / acceleration;
                prop_assume!(!(0.0..duration_s).contains(&turn_s) || top_mm.abs() <= 5.0);
                at_mm += duration_s * (speed + 0.5 * acceleration * duration_s);
                speed += acceleration * duration_s;
                time_s += duration_s;
                prop_assume!(at_mm.abs() <= FOCUS.travel_mm);
            }
            prop_assert!(allows(from, [at_mm, speed], time_s), "{from:?} {at_mm} {speed} {time_s}");
        }
    }
}
