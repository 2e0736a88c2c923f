//! Time against step size, all laws and the limits.

use super::{COLORS, JumpReportInput};
use crate::chart::Series;
use crate::plot::{Named, Plot};

/// Times above this multiple of the limit are left out: they would squeeze the others.
const MOST: f64 = 10.0;
/// Colour of the limits.
const LIMIT: &str = "#b3261e";

/// Appends the chart.
pub(super) fn chart(out: &mut String, input: &JumpReportInput<'_>) {
    let mut steps: Vec<_> = input.steps.iter().collect();
    steps.sort_by(|a, b| a.step_rad.abs().total_cmp(&b.step_rad.abs()));
    let Some(first) = steps.first() else { return };
    let deg = |rad: f64| rad.abs().to_degrees();
    let mut lines = Vec::new();
    for (index, law) in first.laws.iter().enumerate() {
        let total = |step: &&super::JumpStep| {
            let figures = step.laws.get(index)?.figures.as_ref().ok()?;
            let total_s = figures.total_s.filter(|total_s| *total_s < MOST * step.limit_s)?;
            Some((deg(step.step_rad), 1e6 * total_s))
        };
        let points: Vec<_> = steps.iter().filter_map(total).filter(|point| point.1 > 0.0).collect();
        let series = Series { points, color: COLORS[index % COLORS.len()] };
        lines.push(Named { series, name: law.name.clone(), dashed: false });
    }
    let rigid = steps.iter().map(|step| (deg(step.step_rad), 1e6 * step.limit_rigid_s)).collect();
    let limit = steps.iter().map(|step| (deg(step.step_rad), 1e6 * step.limit_s)).collect();
    for (points, name) in [(limit, "limit"), (rigid, "limit, stiff shaft")] {
        let series = Series { points, color: LIMIT };
        lines.push(Named { series, name: name.into(), dashed: true });
    }
    out.push_str(
        "<section><h2>Time against step size</h2><p class=note>Until the mirror is within the \
         tolerance for good. Dashed: the shortest time to exact rest, with the torsional mode \
         and with a stiff shaft. Times above ten limits are in the table only.</p>",
    );
    let plot = Plot {
        lines: &lines,
        labels: ["step, ° mechanical", "time, µs"],
        logarithmic: true,
        height: 440.0,
    };
    out.push_str(&plot.svg());
    out.push_str("</section>");
}
