//! A window of the field in inline SVG, and the colours of errors in it.

use crate::text::{number, put, tick, tick_step, ticks};
use kurbo::{Point, Rect};

/// Longest side of the picture, px.
pub const SIDE: f64 = 460.0;
const LEFT: f64 = 44.0;
const BOTTOM: f64 = 38.0;
const ROOM: f64 = 8.0;
/// Small to large errors.
pub const ERROR_COLORS: [&str; 7] =
    ["#c3d4e6", "#86b6d9", "#4a98c9", "#3aa888", "#e3b23c", "#e8772e", "#c81d25"];

/// A window of the field with its scale, as the beginning of an `svg` element.
pub struct FieldFrame {
    left_mm: f64,
    top_mm: f64,
    width_mm: f64,
    height_mm: f64,
    /// Pixels per mm.
    pub px_per_mm: f64,
    /// The element so far; what is drawn goes to its end.
    pub out: String,
}

impl FieldFrame {
    /// A frame around an area of the field, mm.
    pub fn new(area: Rect) -> Self {
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

    /// Where a place of the field is, px.
    pub fn place(&self, p: Point) -> (f64, f64) {
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

    /// The whole element.
    pub fn finish(mut self) -> String {
        self.out.push_str("</svg>");
        self.out
    }
}

/// The colours of a map of errors with their errors in µm.
///
/// * `top_um`: upper end of the scale, from [`scale_um`]
pub fn legend_svg(top_um: f64) -> String {
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
pub fn scale_um(max_um: f64) -> f64 {
    let n = ERROR_COLORS.len() as f64;
    let rough = max_um.clamp(1e-3, 1e9) / n;
    let power = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let step = steps.into_iter().find(|step| step * power >= rough);
    n * power * step.unwrap_or(10.0)
}

/// Which of the colours an error has.
pub fn class(error_um: f64, top_um: f64) -> usize {
    let n = ERROR_COLORS.len();
    // Negative and NaN become the first.
    ((error_um / top_um * n as f64) as usize).min(n - 1)
}
