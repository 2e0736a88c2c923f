//! Angle, speed, current and voltage of both axes over time.

use crate::chart::{AXIS_COLORS, Chart, Series};
use crate::text::{number, put};
use ftheta_model::plan::PlanDraft;
use ftheta_model::trace::AxisStates;

/// Length of the stretch that the curves are zoomed to, ns, and least number of states in it.
const ZOOM_NS: u64 = 5_000_000;
const ZOOM_STATES: usize = 60;

/// Appends the curves of the whole run, and of its hardest 5 ms.
pub fn curves(out: &mut String, plan: &PlanDraft, states: &[AxisStates]) {
    if states.len() < 2 {
        return;
    }
    let [x, y] = AXIS_COLORS;
    put(
        out,
        format_args!(
            "<section><h2>Axes over time</h2><div class=key><span><i style='color:{x}'></i>x \
             mirror</span><span><i style='color:{y}'></i>y mirror</span><span>\
             <i class=dash style='color:#b3261e'></i>limit of the machine</span></div>"
        ),
    );
    charts(out, plan, states, "time, ms");
    let zoom = zoomed(plan, states);
    if zoom.len() < states.len() {
        let from_ms = time_ms(&zoom[0]);
        let length_ms = time_ms(&zoom[zoom.len() - 1]) - from_ms;
        put(
            out,
            format_args!(
                "</section><section><h2>The hardest {} ms</h2><p class=note>Around the highest \
                 coil current of the whole run, from {} ms on.</p>",
                number(length_ms),
                number(from_ms)
            ),
        );
        charts(out, plan, zoom, "time, ms");
    }
    out.push_str("</section>");
}

/// The stretch around the highest current.
fn zoomed<'a>(plan: &PlanDraft, states: &'a [AxisStates]) -> &'a [AxisStates] {
    // A constant guards against a machine without a limit.
    let current_max_a = plan.machine.scanner.current_max_a.max(1e-9);
    let effort = |state: &AxisStates| {
        let [x, y] = state.current_a;
        x.abs().max(y.abs()) / current_max_a
    };
    let hardest = (0..states.len())
        .max_by(|&a, &b| effort(&states[a]).total_cmp(&effort(&states[b])))
        .unwrap_or(0);
    let at_ns = states[hardest].time_ns;
    let from_ns = at_ns.saturating_sub(ZOOM_NS / 2);
    let first = states.partition_point(|state| state.time_ns < from_ns);
    let end = states.partition_point(|state| state.time_ns <= from_ns + ZOOM_NS);
    if end - first >= ZOOM_STATES {
        return &states[first..end];
    }
    let first = hardest.saturating_sub(ZOOM_STATES / 2);
    &states[first..(first + ZOOM_STATES).min(states.len())]
}

/// When it was, ms.
pub fn time_ms(state: &AxisStates) -> f64 {
    1e-6 * state.time_ns as f64
}

/// Reads one quantity of both axes.
type Quantity = fn(&AxisStates) -> [f64; 2];

fn charts(out: &mut String, plan: &PlanDraft, states: &[AxisStates], x_label: &str) {
    let scanner = &plan.machine.scanner;
    let rows: [(&str, Quantity, f64); 4] = [
        ("angle, °", |s| s.angle_rad.map(f64::to_degrees), scanner.angle_max_rad.to_degrees()),
        ("speed, rad/s", |s| s.speed_rad_s, scanner.speed_max_rad_s),
        ("current, A", |s| s.current_a, scanner.current_max_a),
        ("voltage, V", |s| s.voltage_v, scanner.voltage_max_v),
    ];
    let x_range = (time_ms(&states[0]), time_ms(&states[states.len() - 1]));
    for (i, (y_label, quantity, limit)) in rows.into_iter().enumerate() {
        let line = |axis: usize| Series {
            points: states.iter().map(|state| (time_ms(state), quantity(state)[axis])).collect(),
            color: AXIS_COLORS[axis],
        };
        let chart = Chart {
            series: &[line(0), line(1)],
            y_label,
            x_label: if i == 3 { x_label } else { "" },
            x_range,
            limit: Some(limit),
        };
        out.push_str(&chart.svg());
    }
}
