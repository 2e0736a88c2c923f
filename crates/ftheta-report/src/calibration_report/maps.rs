//! Errors as colours: what is left at the points, and what to expect everywhere.

use super::arrows::{area, ring};
use super::{CalibrationReportInput, ErrorMap, N_ROWS_MAX, ReportPoint};
use crate::field_frame::{ERROR_COLORS, FieldFrame, class, legend_svg, scale_um};
use crate::text::{number, put};
use kurbo::{Point, Rect};

/// Most points of a map.
const N_POINTS_MAX: usize = 12_000;

/// Appends both maps side by side, with one scale of colours.
pub fn residual_and_expected(out: &mut String, input: &CalibrationReportInput<'_>) {
    let points: Vec<&ReportPoint> = input.points.iter().filter(|point| point.is_finite()).collect();
    let good = points.iter().filter(|point| !point.outlier);
    let left_um = good.map(|point| left_um(point)).fold(0.0, f64::max);
    let finite = input.expected_map.errors_um.iter().copied().filter(|error| error.is_finite());
    let expected_um = finite.fold(0.0, f64::max);
    let top_um = scale_um(left_um.max(expected_um));
    let legend = legend_svg(top_um);
    out.push_str("<div class=pair>");
    if !points.is_empty() {
        put(
            out,
            format_args!(
                "<section><h2>What is left at the points</h2><p class=note>Length of the error \
                 that the table leaves; outliers are ringed.</p>{}{legend}</section>",
                residuals(&points, top_um)
            ),
        );
    }
    if let Some(map) = expected(&input.expected_map, top_um) {
        put(
            out,
            format_args!(
                "<section><h2>What to expect elsewhere</h2><p class=note>Error to expect at each \
                 place, at most {} µm. Without points near by it grows.</p>{map}{legend}</section>",
                number(expected_um)
            ),
        );
    }
    out.push_str("</div>");
}

/// Length of what a correction leaves, µm.
fn left_um(point: &ReportPoint) -> f64 {
    let [x_mm, y_mm] = point.error_after_mm;
    1e3 * x_mm.hypot(y_mm)
}

fn residuals(points: &[&ReportPoint], top_um: f64) -> String {
    let mut frame = FieldFrame::new(area(points));
    let every = points.len().div_ceil(N_POINTS_MAX).max(1);
    let mut classes = vec![String::new(); ERROR_COLORS.len()];
    for point in points.iter().step_by(every) {
        let (x, y) = frame.place(point.target_mm.into());
        put(&mut classes[class(left_um(point), top_um)], format_args!("M{x:.1} {y:.1}h0"));
    }
    let width_px = (160.0 / (points.len() as f64).sqrt()).clamp(2.0, 12.0);
    for (d, color) in classes.iter().zip(ERROR_COLORS) {
        put(
            &mut frame.out,
            format_args!(
                "<path class=dots stroke='{color}' stroke-width='{width_px:.1}' d='{d}'/>"
            ),
        );
    }
    for point in points.iter().filter(|point| point.outlier).take(N_ROWS_MAX) {
        ring(&mut frame, point);
    }
    frame.finish()
}

/// The map in squares; `None` if it is not one.
fn expected(map: &ErrorMap<'_>, top_um: f64) -> Option<String> {
    let n_side = map.errors_um.len().isqrt();
    let half_mm = map.half_width_mm;
    let is_square = n_side > 0 && n_side * n_side == map.errors_um.len();
    if !is_square || !half_mm.is_finite() || half_mm <= 0.0 {
        return None;
    }
    let cell_mm = 2.0 * half_mm / n_side as f64;
    let mut frame = FieldFrame::new(Rect::new(-half_mm, -half_mm, half_mm, half_mm));
    let side_px = cell_mm * frame.px_per_mm;
    let mut classes = vec![String::new(); ERROR_COLORS.len()];
    for (index, &error_um) in map.errors_um.iter().enumerate() {
        let (row, column) = ((index / n_side) as f64, (index % n_side) as f64);
        let corner = Point::new(cell_mm * column - half_mm, cell_mm * (row + 1.0) - half_mm);
        let (x, y) = frame.place(corner);
        // What is not a number is as bad as it gets.
        let error_um = if error_um.is_finite() { error_um } else { f64::INFINITY };
        put(
            &mut classes[class(error_um, top_um)],
            // Squares overlap by a hair, so that no line shows between them.
            format_args!(
                "M{x:.1} {y:.1}h{:.1}v{:.1}h-{:.1}z",
                side_px + 0.2,
                side_px + 0.2,
                side_px + 0.2
            ),
        );
    }
    for (d, color) in classes.iter().zip(ERROR_COLORS) {
        put(&mut frame.out, format_args!("<path fill='{color}' d='{d}'/>"));
    }
    Some(frame.finish())
}
