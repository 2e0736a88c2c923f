//! The field seen from above as inline SVG: marks and jumps, and where the errors are.

use crate::field_frame::{ERROR_COLORS, FieldFrame, SIDE, class, legend_svg, scale_um};
use crate::score::{ErrorSample, Score};
use crate::text::{escaped, number, put};
use ftheta_model::plan::PlanDraft;
use kurbo::{ParamCurve, PathEl, Point, Rect, Shape};

/// Most line segments of marks, and most jumps, that are drawn.
const N_SEGMENTS_MAX: usize = 20_000;
/// Most samples of the error map that are drawn.
const N_SAMPLES_MAX: usize = 12_000;
/// Colours of pens, in turn.
const PEN_COLORS: [&str; 6] = ["#17202a", "#1d6fb8", "#2e8b57", "#b8511d", "#7b4fa3", "#8a6d1f"];

/// The marks by pen and the jumps between them; every n-th only where there are too many.
pub fn marks_svg(plan: &PlanDraft) -> String {
    let mut frame = FieldFrame::new(shown_area(plan));
    let tolerance_mm = 0.2 / frame.px_per_mm;
    let n_elements: usize = plan.marks.iter().map(|m| m.curve.elements().len()).sum();
    // A curved element becomes some five segments.
    let every = (4 * n_elements).div_ceil(5 * N_SEGMENTS_MAX).max(1);
    draw_jumps(&mut frame, plan);
    for (pen_index, color) in (0..plan.pens.len()).zip(PEN_COLORS.iter().cycle()) {
        let mut d = String::new();
        let mut n_left = N_SEGMENTS_MAX;
        let marks = plan.marks.iter().filter(|m| m.pen_index == pen_index);
        for mark in marks.step_by(every) {
            let mut last = (f64::NAN, f64::NAN);
            kurbo::flatten(mark.curve.iter(), tolerance_mm, |el| {
                let (letter, p) = match el {
                    PathEl::MoveTo(p) => ('M', p),
                    PathEl::LineTo(p) => ('L', p),
                    _ => return,
                };
                let at = frame.place(p);
                let moved = (at.0 - last.0).abs() + (at.1 - last.1).abs();
                if n_left > 0 && (letter == 'M' || moved >= 0.15) {
                    put(&mut d, format_args!("{letter}{:.1} {:.1}", at.0, at.1));
                    last = at;
                    n_left -= 1;
                }
            });
        }
        put(&mut frame.out, format_args!("<path class=mark stroke='{color}' d='{d}'/>"));
    }
    frame.finish()
}

/// The pens with their colours, speeds and powers.
pub fn pens_html(plan: &PlanDraft) -> String {
    let mut out = String::from("<div class=key>");
    for (pen, color) in plan.pens.iter().zip(PEN_COLORS.iter().cycle()).take(8) {
        put(
            &mut out,
            format_args!(
                "<span><i style='color:{color}'></i>{}, {} mm/s, {} W</span>",
                escaped(&pen.name),
                number(pen.mark_speed_mm_s),
                number(pen.power_w)
            ),
        );
    }
    out.push_str("</div>");
    out
}

fn draw_jumps(frame: &mut FieldFrame, plan: &PlanDraft) {
    let every = plan.marks.len().div_ceil(N_SEGMENTS_MAX / 2).max(1);
    let mut d = String::new();
    for pair in plan.marks.windows(2).step_by(every) {
        let from = pair[0].curve.segments().last().map(|s| s.end());
        let to = pair[1].curve.segments().next().map(|s| s.start());
        let (Some(from), Some(to)) = (from, to) else {
            continue;
        };
        let (a, b) = (frame.place(from), frame.place(to));
        if (a.0 - b.0).hypot(a.1 - b.1) > 1.0 {
            put(&mut d, format_args!("M{:.1} {:.1}L{:.1} {:.1}", a.0, a.1, b.0, b.1));
        }
    }
    put(&mut frame.out, format_args!("<path class=jump d='{d}'/>"));
}

/// The lit beam coloured by its distance from the curve, the worst place ringed.
pub fn errors_svg(plan: &PlanDraft, score: &Score) -> String {
    let mut frame = FieldFrame::new(shown_area(plan));
    let top_um = error_scale_um(score);
    let every = score.error_samples.len().div_ceil(N_SAMPLES_MAX).max(1);
    let mut classes = vec![String::new(); ERROR_COLORS.len()];
    for group in score.error_samples.chunks(every) {
        let Some(sample) = group.iter().copied().reduce(worse) else {
            continue;
        };
        let (x, y) = frame.place(Point::new(sample.x_mm, sample.y_mm));
        let class = class(sample.error_um, top_um);
        put(&mut classes[class], format_args!("M{x:.1} {y:.1}h0"));
    }
    for (i, (d, color)) in classes.iter().zip(ERROR_COLORS).enumerate() {
        let width = 2.0 + 0.4 * i as f64;
        put(
            &mut frame.out,
            format_args!("<path class=dots stroke='{color}' stroke-width='{width:.1}' d='{d}'/>"),
        );
    }
    if let Some(worst) = score.worst_marks.first() {
        let (x, y) = frame.place(Point::new(worst.x_mm, worst.y_mm));
        let left = x > 0.7 * SIDE;
        let (text_x, anchor) = if left { (x - 11.0, "end") } else { (x + 11.0, "start") };
        put(
            &mut frame.out,
            format_args!(
                "<circle class=ring cx='{x:.1}' cy='{y:.1}' r='7'/>\
                 <text class=call x='{text_x:.1}' y='{:.1}' text-anchor={anchor}>{} µm</text>",
                y + 4.0,
                number(worst.error_um)
            ),
        );
    }
    frame.finish()
}

/// The colours of the error map with their errors in µm.
pub fn error_legend_svg(score: &Score) -> String {
    legend_svg(error_scale_um(score))
}

fn error_scale_um(score: &Score) -> f64 {
    scale_um(score.contour_error_um.max)
}

fn worse(a: ErrorSample, b: ErrorSample) -> ErrorSample {
    if b.error_um > a.error_um { b } else { a }
}

fn shown_area(plan: &PlanDraft) -> Rect {
    let boxes = plan.marks.iter().map(|mark| mark.curve.bounding_box());
    boxes.reduce(|a, b| a.union(b)).unwrap_or(Rect::new(-10.0, -10.0, 10.0, 10.0))
}
