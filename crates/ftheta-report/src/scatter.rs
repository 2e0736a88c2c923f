//! Dots and lines over two axes as inline SVG.

use crate::text::{escaped, put, tick, tick_step, ticks};

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = HEIGHT - 44.0;

/// Dots and the line through them.
pub struct Cloud<'a> {
    /// What it is.
    pub name: &'a str,
    /// Any CSS colour.
    pub color: &'static str,
    /// Dots.
    pub dots: Vec<(f64, f64)>,
    /// Points of the line.
    pub line: Vec<(f64, f64)>,
}

/// From values to places in the picture.
struct Scale {
    x: (f64, f64),
    y: (f64, f64),
}

impl Scale {
    fn px(&self, x: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * (x - self.x.0) / (self.x.1 - self.x.0)
    }

    fn py(&self, y: f64) -> f64 {
        BOTTOM - (BOTTOM - TOP) * (y - self.y.0) / (self.y.1 - self.y.0)
    }
}

fn grid(out: &mut String, scale: &Scale) {
    let step = tick_step(scale.y.1 - scale.y.0, 6.0);
    for y in ticks(scale.y.0, scale.y.1, step) {
        let (at, label) = (scale.py(y), tick(y, step));
        put(
            out,
            format_args!(
                "<path class=grid d='M{LEFT} {at:.1}H{}'/><text x='{}' y='{:.1}' \
                 text-anchor=end>{label}</text>",
                WIDTH - RIGHT,
                LEFT - 7.0,
                at + 4.0
            ),
        );
    }
    let step = tick_step(scale.x.1 - scale.x.0, 10.0);
    for x in ticks(scale.x.0, scale.x.1, step) {
        let (at, label) = (scale.px(x), tick(x, step));
        put(
            out,
            format_args!(
                "<path class=grid d='M{at:.1} {TOP}V{BOTTOM}'/><text x='{at:.1}' y='{}' \
                 text-anchor=middle>{label}</text>",
                BOTTOM + 16.0
            ),
        );
    }
}

/// A chart of clouds over the same axes; not finite values are left out.
pub fn svg(clouds: &[Cloud<'_>], labels: [&str; 2]) -> String {
    let all = || {
        let points = clouds.iter().flat_map(|cloud| cloud.dots.iter().chain(&cloud.line));
        points.copied().filter(|(x, y)| x.is_finite() && y.is_finite())
    };
    let range = |of: fn((f64, f64)) -> f64| {
        let (low, high) = all().fold((0.0_f64, 0.0_f64), |(low, high), point| {
            (low.min(of(point)), high.max(of(point)))
        });
        let room = 0.06 * (high - low).max(1e-9);
        (low - room, high + room)
    };
    let scale = Scale { x: range(|point| point.0), y: range(|point| point.1) };
    let mut out = format!("<svg class=chart viewBox='0 0 {WIDTH} {HEIGHT}' role=img>");
    grid(&mut out, &scale);
    let (px, py) = (|x: f64| scale.px(x), |y: f64| scale.py(y));
    for cloud in clouds {
        put(&mut out, format_args!("<path class=line stroke='{}' d='", cloud.color));
        for (index, (x, y)) in cloud.line.iter().enumerate() {
            let letter = if index == 0 { 'M' } else { 'L' };
            put(&mut out, format_args!("{letter}{:.1} {:.1}", px(*x), py(*y)));
        }
        put(&mut out, format_args!("'/><g fill='{}' fill-opacity='.75'>", cloud.color));
        for (x, y) in cloud.dots.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
            put(&mut out, format_args!("<circle cx='{:.1}' cy='{:.1}' r='2.6'/>", px(*x), py(*y)));
        }
        out.push_str("</g>");
    }
    let (mid_x, mid_y) = (0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (TOP + BOTTOM));
    let [x_label, y_label] = labels.map(escaped);
    put(
        &mut out,
        format_args!(
            "<path class=axis d='M{LEFT} {TOP}V{BOTTOM}H{}'/><text class=label \
             transform='translate(14 {mid_y}) rotate(-90)' text-anchor=middle>{y_label}</text>\
             <text class=label x='{mid_x}' y='{}' text-anchor=middle>{x_label}</text></svg>",
            WIDTH - RIGHT,
            BOTTOM + 36.0
        ),
    );
    out.push_str("<div class=key>");
    for cloud in clouds {
        put(
            &mut out,
            format_args!(
                "<span><i style='border-color:{}'></i>{}</span>",
                cloud.color,
                escaped(cloud.name)
            ),
        );
    }
    out.push_str("</div>");
    out
}
