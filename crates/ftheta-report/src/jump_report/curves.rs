//! What the axis does under some laws, how it arrives, and the path of two axes.

use super::{COLORS, JumpLaw, JumpReportInput, JumpSample, JumpStep};
use crate::chart::{Chart, Series};
use crate::plot::{Named, Plot};
use crate::text::{escaped, number, put};
use ftheta_model::machine::Machine;

/// The arrival is shown from this part of the limit on.
const ARRIVAL_FROM: f64 = 0.75;
/// Multiples of the tolerance at which the arrival's curves are cut off.
const ARRIVAL_HEIGHT: f64 = 4.0;

/// Appends the curves of one step.
pub(super) fn step(out: &mut String, input: &JumpReportInput<'_>, step: &JumpStep) {
    let shown: Vec<(&JumpLaw, &'static str)> = step
        .laws
        .iter()
        .zip(COLORS.iter().cycle())
        .filter(|(law, _)| law.samples.len() > 1)
        .map(|(law, color)| (law, *color))
        .collect();
    if shown.is_empty() {
        return;
    }
    let step_deg = number(step.step_rad.to_degrees());
    put(out, format_args!("<section><h2>{step_deg}° over time</h2><div class=key>"));
    for (law, color) in &shown {
        let name = escaped(&law.name);
        put(out, format_args!("<span><i style='color:{color}'></i>{name}</span>"));
    }
    out.push_str("<span><i class=dash style='color:#b3261e'></i>limit of the machine</span></div>");
    let samples: Vec<(&[JumpSample], &'static str)> =
        shown.iter().map(|(law, color)| (&law.samples[..], *color)).collect();
    let end_us = quantities(out, input.machine, &samples);
    arrival(out, input, step, &shown, end_us);
    path(out, step, &shown);
    out.push_str("</section>");
}

/// Appends position, speed, acceleration, voltage and current over time; returns the last time, µs.
pub(super) fn quantities(
    out: &mut String,
    machine: &Machine,
    shown: &[(&[JumpSample], &'static str)],
) -> f64 {
    let end_s = shown.iter().filter_map(|(samples, _)| samples.last()).map(|s| s.time_s);
    let end_us = 1e6 * end_s.fold(0.0, f64::max);
    let scanner = &machine.scanner;
    type Quantity = fn(&JumpSample) -> f64;
    let rows: [(&str, Quantity, Option<f64>); 5] = [
        ("position, °", |s| s.angle_rad.to_degrees(), None),
        ("speed, rad/s", |s| s.speed_rad_s, None),
        ("acc., 10⁶ rad/s²", |s| 1e-6 * s.acceleration_rad_s2, None),
        ("voltage, V", |s| s.voltage_v, Some(scanner.voltage_max_v)),
        ("current, A", |s| s.current_a, Some(scanner.current_max_a)),
    ];
    for (i, (y_label, quantity, limit)) in rows.into_iter().enumerate() {
        let line = |(samples, color): &(&[JumpSample], &'static str)| {
            let points = samples.iter().map(|s| (1e6 * s.time_s, quantity(s))).collect();
            Series { points, color }
        };
        let series: Vec<Series> = shown.iter().map(line).collect();
        let x_label = if i == 4 { "time, µs" } else { "" };
        let chart = Chart { series: &series, y_label, x_label, x_range: (0.0, end_us), limit };
        out.push_str(&chart.svg());
    }
    end_us
}

/// The last of the way on the scale of the tolerance.
fn arrival(
    out: &mut String,
    input: &JumpReportInput<'_>,
    step: &JumpStep,
    shown: &[(&JumpLaw, &'static str)],
    end_us: f64,
) {
    let tolerance_urad = 1e6 * input.tolerance_rad;
    let from_us = 1e6 * ARRIVAL_FROM * step.limit_s;
    let high = ARRIVAL_HEIGHT * tolerance_urad;
    let line = |(law, color): &(&JumpLaw, &'static str)| {
        let points = law.samples.iter().map(|s| (1e6 * s.time_s, 1e6 * s.error_rad));
        let points = points.filter(|point| point.0 >= from_us);
        Series { points: points.map(|(x, y)| (x, y.clamp(-high, high))).collect(), color }
    };
    let series: Vec<Series> = shown.iter().map(line).collect();
    put(
        out,
        format_args!(
            "<p class=note>Arrival: distance from the target, cut off at {} times the \
             tolerance, which is dashed.</p>",
            number(ARRIVAL_HEIGHT)
        ),
    );
    let chart = Chart {
        series: &series,
        y_label: "error, µrad",
        x_label: "time, µs",
        x_range: (from_us, end_us),
        limit: Some(tolerance_urad),
    };
    out.push_str(&chart.svg());
}

/// The path of two mirrors.
fn path(out: &mut String, step: &JumpStep, shown: &[(&JumpLaw, &'static str)]) {
    let degrees = |&(x, y): &(f64, f64)| (x.to_degrees(), y.to_degrees());
    let line = |(law, color): &(&JumpLaw, &'static str)| Named {
        series: Series { points: law.path_rad.iter().map(degrees).collect(), color },
        name: law.name.clone(),
        dashed: false,
    };
    let mut lines: Vec<Named> =
        shown.iter().filter(|(law, _)| !law.path_rad.is_empty()).map(line).collect();
    if lines.is_empty() {
        return;
    }
    let end = step.step_rad.to_degrees();
    let points = vec![(0.0, 0.0), (end, 0.5 * end)];
    let series = Series { points, color: "#5c6b7a" };
    lines.push(Named { series, name: "shared time".into(), dashed: true });
    out.push_str(
        "<p class=note>Path of the mirrors for a jump of the step in x and half of it in y: \
         solid with each axis planned by itself, dashed with y sharing the time of x, its \
         voltages scaled, which gives a straight line.</p>",
    );
    let labels = ["x, ° mechanical", "y, ° mechanical"];
    let plot = Plot { lines: &lines, labels, logarithmic: false, height: 340.0 };
    out.push_str(&plot.svg());
}
