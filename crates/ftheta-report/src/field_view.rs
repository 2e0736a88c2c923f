//! The field seen from above as inline SVG: marks and jumps, and where the errors are.

use crate::score::{ErrorSample, Score};
use crate::text::{escaped, number, put, tick, tick_step, ticks};
use ftheta_model::plan::PlanDraft;
use kurbo::{ParamCurve, PathEl, Point, Rect, Shape};

/// Most line segments of marks, and most jumps, that are drawn.
const N_SEGMENTS_MAX: usize = 20_000;
/// Most samples of the error map that are drawn.
const N_SAMPLES_MAX: usize = 12_000;
const SIDE: f64 = 460.0;
const LEFT: f64 = 44.0;
const BOTTOM: f64 = 38.0;
const ROOM: f64 = 8.0;
/// Colours of pens, in turn.
const PEN_COLORS: [&str; 6] = ["#17202a", "#1d6fb8", "#2e8b57", "#b8511d", "#7b4fa3", "#8a6d1f"];
/// Small to large errors.
const ERROR_COLORS: [&str; 7] =
    ["#c3d4e6", "#86b6d9", "#4a98c9", "#3aa888", "#e3b23c", "#e8772e", "#c81d25"];

/// A square window of the field with its scale.
struct Frame {
    left_mm: f64,
    top_mm: f64,
    width_mm: f64,
    height_mm: f64,
    px_per_mm: f64,
    out: String,
}

impl Frame {
    fn new(area: Rect) -> Self {
        let longest_mm = area.width().max(area.height()).max(1e-3);
        let area = area.inflate(0.03 * longest_mm, 0.03 * longest_mm);
        let px_per_mm = (SIDE - LEFT - ROOM) / area.width().max(area.height());
        let mut frame = Self {
            left_mm: area.x0,
            top_mm: area.y1,
            width_mm: area.width(),
            height_mm: area.height(),
            px_per_mm,
            out: String::new(),
        };
        frame.draw_scale(longest_mm);
        frame
    }

    fn place(&self, p: Point) -> (f64, f64) {
        (LEFT + self.px_per_mm * (p.x - self.left_mm), ROOM + self.px_per_mm * (self.top_mm - p.y))
    }

    fn draw_scale(&mut self, longest_mm: f64) {
        let right = LEFT + self.px_per_mm * self.width_mm;
        let bottom = ROOM + self.px_per_mm * self.height_mm;
        let (w, h) = (right + ROOM, bottom + BOTTOM);
        let mut out = format!("<svg class=field viewBox='0 0 {w:.0} {h:.0}' role=img>");
        let step = tick_step(longest_mm, 6.0);
        for x_mm in ticks(self.left_mm, self.left_mm + self.width_mm, step) {
            let x = self.place(Point::new(x_mm, 0.0)).0;
            let (y, label) = (bottom + 15.0, tick(x_mm, step));
            put(
                &mut out,
                format_args!(
                    "<path class=grid d='M{x:.1} {ROOM}V{bottom:.1}'/>\
                     <text x='{x:.1}' y='{y:.1}' text-anchor=middle>{label}</text>"
                ),
            );
        }
        for y_mm in ticks(self.top_mm - self.height_mm, self.top_mm, step) {
            let y = self.place(Point::new(0.0, y_mm)).1;
            let (x, y_text, label) = (LEFT - 6.0, y + 4.0, tick(y_mm, step));
            put(
                &mut out,
                format_args!(
                    "<path class=grid d='M{LEFT} {y:.1}H{right:.1}'/>\
                     <text x='{x}' y='{y_text:.1}' text-anchor=end>{label}</text>"
                ),
            );
        }
        let (mid_x, mid_y) = (0.5 * (LEFT + right), 0.5 * (ROOM + bottom));
        put(
            &mut out,
            format_args!(
                "<path class=axis d='M{LEFT} {ROOM}V{bottom:.1}H{right:.1}'/>\
                 <text class=label x='{mid_x:.1}' y='{:.1}' text-anchor=middle>x, mm</text>\
                 <text class=label transform='translate(11 {mid_y:.1}) rotate(-90)' \
                 text-anchor=middle>y, mm</text>",
                bottom + 31.0
            ),
        );
        self.out = out;
    }

    fn finish(mut self) -> String {
        self.out.push_str("</svg>");
        self.out
    }
}

/// The marks by pen and the jumps between them; every n-th only where there are too many.
pub fn marks_svg(plan: &PlanDraft) -> String {
    let mut frame = Frame::new(shown_area(plan));
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

fn draw_jumps(frame: &mut Frame, plan: &PlanDraft) {
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
    let mut frame = Frame::new(shown_area(plan));
    let top_um = error_scale_um(score);
    let every = score.error_samples.len().div_ceil(N_SAMPLES_MAX).max(1);
    let mut classes = vec![String::new(); ERROR_COLORS.len()];
    for group in score.error_samples.chunks(every) {
        let Some(sample) = group.iter().copied().reduce(worse) else {
            continue;
        };
        let class = (sample.error_um / top_um * ERROR_COLORS.len() as f64) as usize;
        let (x, y) = frame.place(Point::new(sample.x_mm, sample.y_mm));
        put(&mut classes[class.min(ERROR_COLORS.len() - 1)], format_args!("M{x:.1} {y:.1}h0"));
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
    let top_um = error_scale_um(score);
    let n = ERROR_COLORS.len() as f64;
    let (left, right) = (LEFT, SIDE - ROOM);
    let width = (right - left) / n;
    let mut out = String::from("<svg class=legend viewBox='0 0 460 34' role=img>");
    for (i, color) in ERROR_COLORS.iter().enumerate() {
        let x = left + width * i as f64;
        let label = number(top_um * i as f64 / n);
        put(
            &mut out,
            format_args!(
                "<rect x='{x:.1}' y='2' width='{width:.1}' height='9' fill='{color}'/>\
                 <text x='{x:.1}' y='26' text-anchor=middle>{label}</text>"
            ),
        );
    }
    let label = number(top_um);
    put(&mut out, format_args!("<text x='457' y='26' text-anchor=end>{label} µm</text></svg>"));
    out
}

/// The upper end of the colour scale: a round number that gives seven round classes.
fn error_scale_um(score: &Score) -> f64 {
    let n = ERROR_COLORS.len() as f64;
    let rough = score.contour_error_um.max.max(1e-3) / n;
    let power = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let step = steps.into_iter().find(|step| step * power >= rough);
    n * power * step.unwrap_or(10.0)
}

fn worse(a: ErrorSample, b: ErrorSample) -> ErrorSample {
    if b.error_um > a.error_um { b } else { a }
}

fn shown_area(plan: &PlanDraft) -> Rect {
    let boxes = plan.marks.iter().map(|mark| mark.curve.bounding_box());
    boxes.reduce(|a, b| a.union(b)).unwrap_or(Rect::new(-10.0, -10.0, 10.0, 10.0))
}
