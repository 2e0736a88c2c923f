//! Errors as arrows from where marks should be, before and after.

use super::{CalibrationReportInput, ReportPoint};
use crate::field_frame::FieldFrame;
use crate::text::{number, put};
use kurbo::{Point, Rect, Vec2};

/// Most arrows of a picture.
const N_ARROWS_MAX: usize = 5_000;
/// Length of the longest arrow, by the distance of neighbouring points.
const LENGTH: f64 = 0.8;
/// Shortest arrow that has a head, px.
const HEAD_PX: f64 = 5.0;

/// Appends the errors before and after side by side, each with its scale.
pub fn before_and_after(out: &mut String, input: &CalibrationReportInput<'_>) {
    let points: Vec<&ReportPoint> = input.points.iter().filter(|point| point.is_finite()).collect();
    if points.is_empty() {
        return;
    }
    let drawn = |error: fn(&ReportPoint) -> [f64; 2]| {
        exaggeration(&points, error).map(|scale| (picture(&points, error, scale), scale))
    };
    let before = drawn(|point| point.error_before_mm);
    let after = drawn(|point| point.error_after_mm);
    out.push_str("<div class=pair>");
    for (name, drawn) in [("Errors before", before), ("Errors after", after)] {
        put(out, format_args!("<section><h2>{name}</h2>"));
        match drawn {
            Some((picture, scale)) => put(
                out,
                format_args!(
                    "<p class=note>Arrows lead from where a mark should be to where it is, {} \
                     times as long as the error. Outliers are ringed, with their line of the \
                     file; their arrows may be cut short.</p>{picture}",
                    number(scale)
                ),
            ),
            None => out.push_str("<p class=note>All errors are zero.</p>"),
        }
        out.push_str("</section>");
    }
    out.push_str("</div>");
}

/// The area that all points fill.
pub fn area(points: &[&ReportPoint]) -> Rect {
    let places = points.iter().map(|point| Point::from(point.target_mm));
    let boxes = places.map(|place| Rect::from_points(place, place));
    boxes.reduce(|a, b| a.union(b)).unwrap_or_default()
}

/// By how much errors are drawn too long: a round number, so that the longest arrow that is no
/// outlier's nearly reaches the next point. `None` if there is no error.
fn exaggeration(points: &[&ReportPoint], error: fn(&ReportPoint) -> [f64; 2]) -> Option<f64> {
    let good = points.iter().filter(|point| !point.outlier);
    let longest_mm = good.map(|point| length(error(point))).fold(0.0, f64::max);
    let area = area(points);
    let pitch_mm = area.width().max(area.height()) / (points.len() as f64).sqrt();
    let most = LENGTH * pitch_mm / longest_mm;
    if !(most.is_finite() && most > 0.0) {
        return None;
    }
    let power = 10f64.powf(most.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * power);
    steps.into_iter().find(|&step| step <= most).or(Some(power))
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

fn picture(points: &[&ReportPoint], error: fn(&ReportPoint) -> [f64; 2], scale: f64) -> String {
    let area = area(points);
    // Arrows at the border need room.
    let side_mm = area.width().max(area.height());
    let room_mm = LENGTH * side_mm / (points.len() as f64).sqrt();
    let mut frame = FieldFrame::new(area.inflate(room_mm, room_mm));
    let every = points.len().div_ceil(N_ARROWS_MAX).max(1);
    let mut d = String::new();
    let shown = points.iter().enumerate();
    for (_, point) in shown.filter(|(index, point)| point.outlier || index % every == 0) {
        let from = frame.place(point.target_mm.into());
        let [x, y] = error(point);
        // y is down in the picture. An outlier's arrow is cut where it would leave it.
        let way = scale * frame.px_per_mm * Vec2::new(x, -y);
        let way = way * (3.0 * room_mm * frame.px_per_mm / way.hypot()).min(1.0);
        arrow(&mut d, Point::new(from.0, from.1), if way.is_finite() { way } else { Vec2::ZERO });
    }
    put(&mut frame.out, format_args!("<path class=mark stroke='#1d6fb8' d='{d}'/>"));
    for point in points.iter().filter(|point| point.outlier).take(super::N_ROWS_MAX) {
        ring(&mut frame, point);
    }
    frame.finish()
}

/// An arrow with a dot at its beginning.
fn arrow(d: &mut String, from: Point, way: Vec2) {
    let to = from + way;
    put(d, format_args!("M{:.1} {:.1}h0", from.x, from.y));
    put(d, format_args!("L{:.1} {:.1}", to.x, to.y));
    let length_px = way.hypot();
    if length_px < HEAD_PX {
        return;
    }
    let back = way * (-0.5 * HEAD_PX / length_px);
    let side = Vec2::new(-back.y, back.x) * 0.7;
    for wing in [to + back + side, to + back - side] {
        put(d, format_args!("M{:.1} {:.1}L{:.1} {:.1}", to.x, to.y, wing.x, wing.y));
    }
}

/// A ring around an outlier, with its line of the file.
pub fn ring(frame: &mut FieldFrame, point: &ReportPoint) {
    let (x, y) = frame.place(point.target_mm.into());
    let (text_x, anchor) = if x > 300.0 { (x - 10.0, "end") } else { (x + 10.0, "start") };
    put(
        &mut frame.out,
        format_args!(
            "<circle class=ring cx='{x:.1}' cy='{y:.1}' r='7'/>\
             <text class=call x='{text_x:.1}' y='{:.1}' text-anchor={anchor}>line {}</text>",
            y + 4.0,
            point.line
        ),
    );
}
