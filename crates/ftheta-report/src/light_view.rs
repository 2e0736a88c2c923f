//! Speed of the beam and power of the light over time, where they change most.

use crate::axes_view::time_ms;
use crate::chart::{AXIS_COLORS, Chart, Series};
use crate::text::{number, put};
use ftheta_model::plan::{PlanDraft, PlannedMark};
use ftheta_model::space::MirrorAngles;
use ftheta_model::trace::AxisStates;
use ftheta_physics::optics::field_from_angles;

/// Length of the stretch that is shown, ns.
const STRETCH_NS: i64 = 5_000_000;
/// Changes of speed below this part of it are what the states' rounding makes.
const EVEN_SHARE: f64 = 1e-3;
/// Time over which a place is differentiated, s.
const STEP_S: f64 = 1e-7;

/// Appends speed and power over 5 ms of light, where speed changes most, if one is known in it.
pub fn light(out: &mut String, plan: &PlanDraft, states: &[AxisStates]) {
    let Some((from_ns, to_ns)) = liveliest_ns(plan, states) else {
        return;
    };
    let begun = plan.marks.partition_point(|mark| lit_ns(plan, mark)[1] <= from_ns);
    let end = plan.marks.partition_point(|mark| lit_ns(plan, mark)[0] < to_ns);
    let marks = plan.marks.get(begun..end).unwrap_or_default();
    let Some(pen) = marks.first().and_then(|mark| plan.pens.get(mark.pen_index)) else {
        return;
    };
    let range_ns = (from_ns, to_ns);
    let speeds: Vec<_> = marks
        .iter()
        .map(|mark| {
            let lit = lit(plan, mark, range_ns, states).iter();
            let points = lit.map(|state| (time_ms(state), speed_m_s(plan, state))).collect();
            Series { points, color: AXIS_COLORS[0] }
        })
        .collect();
    if speeds.iter().all(|speeds| speeds.points.len() < 2) {
        return;
    }
    let [speed, power] = AXIS_COLORS;
    put(
        out,
        format_args!(
            "<section><h2>Speed and power where they change most</h2><p class=note>{} ms of the              job: speed of the beam while the laser is on, and power of the light.</p>\
             <div class=key><span><i style='color:{speed}'></i>speed of the beam</span><span>\
             <i style='color:{power}'></i>power of the light</span><span><i class=dash \
             style='color:#b3261e'></i>as the pen of the first mark shown asks</span></div>",
            number((to_ns - from_ns) as f64 * 1e-6)
        ),
    );
    let x_range = (from_ns as f64 * 1e-6, to_ns as f64 * 1e-6);
    let powers = [Series { points: powers(plan, marks, range_ns), color: power }];
    for (series, y_label, x_label, asked) in [
        (&speeds[..], "speed, m/s", "", pen.mark_speed_mm_s * 1e-3),
        (&powers[..], "power, W", "time, ms", pen.power_w),
    ] {
        out.push_str(&Chart { series, y_label, x_label, x_range, limit: Some(asked) }.svg());
    }
    out.push_str("</section>");
}

/// The stretch of light around the greatest change of speed from one state to the next in a mark,
/// ns; the first one where all is even. `None` without marks.
fn liveliest_ns(plan: &PlanDraft, states: &[AxisStates]) -> Option<(i64, i64)> {
    let [first_ns, _] = lit_ns(plan, plan.marks.first()?);
    let [_, last_ns] = lit_ns(plan, plan.marks.last()?);
    let mut best: Option<(f64, i64)> = None;
    for mark in &plan.marks {
        let lit = lit(plan, mark, (first_ns, last_ns), states);
        let mut before: Option<f64> = None;
        for state in lit {
            let speed = speed_m_s(plan, state);
            let change = before.replace(speed).map_or(0.0, |before| (speed - before).abs());
            if change > EVEN_SHARE * speed && best.is_none_or(|(most, _)| change > most) {
                best = Some((change, state.time_ns as i64));
            }
        }
    }
    let middle_ns = best.map_or(first_ns, |(_, time_ns)| time_ns);
    let latest_ns = (last_ns - STRETCH_NS).max(first_ns);
    let from_ns = (middle_ns - STRETCH_NS / 2).clamp(first_ns, latest_ns);
    Some((from_ns, last_ns.min(from_ns + STRETCH_NS)))
}

/// First and last light of a mark, ns from the first sample.
fn lit_ns(plan: &PlanDraft, mark: &PlannedMark) -> [i64; 2] {
    let laser = &plan.machine.laser;
    [mark.on_ns as i64 + laser.on_latency_ns, mark.off_ns as i64 + laser.off_latency_ns]
}

/// States in the light of a mark, within a range of time, ns.
fn lit<'a>(
    plan: &PlanDraft,
    mark: &PlannedMark,
    (from_ns, to_ns): (i64, i64),
    states: &'a [AxisStates],
) -> &'a [AxisStates] {
    let [on_ns, off_ns] = lit_ns(plan, mark);
    let first = states.partition_point(|state| (state.time_ns as i64) < on_ns.max(from_ns));
    let end = states.partition_point(|state| (state.time_ns as i64) <= off_ns.min(to_ns));
    states.get(first..end).unwrap_or_default()
}

fn speed_m_s(plan: &PlanDraft, state: &AxisStates) -> f64 {
    let place = |after_s: f64| {
        let [x_rad, y_rad] =
            [0, 1].map(|axis| state.angle_rad[axis] + after_s * state.speed_rad_s[axis]);
        field_from_angles(&plan.machine.optics, MirrorAngles { x_rad, y_rad })
    };
    let (from, to) = (place(-0.5 * STEP_S), place(0.5 * STEP_S));
    (to.x_mm - from.x_mm).hypot(to.y_mm - from.y_mm) / STEP_S * 1e-3
}

/// Power of the light within a range of time, ns: W over ms, in steps.
fn powers(
    plan: &PlanDraft,
    marks: &[PlannedMark],
    (from_ns, to_ns): (i64, i64),
) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut power_before_w = 0.0;
    let mut change = |time_ns: i64, power_w: f64| {
        let before_w = std::mem::replace(&mut power_before_w, power_w);
        let time_ms = time_ns.clamp(from_ns, to_ns) as f64 * 1e-6;
        if time_ns >= from_ns {
            points.push((time_ms, before_w));
        } else {
            points.clear();
        }
        points.push((time_ms, power_w));
    };
    for mark in marks {
        let [on_ns, off_ns] = lit_ns(plan, mark);
        change(on_ns, mark.power_w);
        let latency_ns = plan.machine.laser.on_latency_ns;
        let steps = mark.steps.iter().map(|step| (step.time_ns as i64 + latency_ns, step.power_w));
        steps.filter(|&(time_ns, _)| time_ns < to_ns).for_each(|(at, power)| change(at, power));
        change(off_ns, 0.0);
    }
    points
}
