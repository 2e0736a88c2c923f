//! Lines over time as inline SVG: labelled axes, limits dashed, thinned without losing peaks.

use crate::text::{escaped, put, tick, tick_step, ticks};

/// Most points of one line.
const N_POINTS_MAX: usize = 2000;
const WIDTH: f64 = 960.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;

/// Colours of the two axes' lines.
pub const AXIS_COLORS: [&str; 2] = ["#1d6fb8", "#d9541e"];

/// One line.
pub struct Series {
    /// Points in order of x.
    pub points: Vec<(f64, f64)>,
    /// Any CSS colour.
    pub color: &'static str,
}

/// A chart of lines over one x axis.
pub struct Chart<'a> {
    /// The lines.
    pub series: &'a [Series],
    /// What is on the y axis, with its unit.
    pub y_label: &'a str,
    /// What is on the x axis, with its unit; empty leaves its labels to the chart below.
    pub x_label: &'a str,
    /// First and last x.
    pub x_range: (f64, f64),
    /// A limit drawn at plus and minus this value where the lines come near it.
    pub limit: Option<f64>,
}

/// From values to places in the picture.
struct Scale {
    x: (f64, f64),
    y: (f64, f64),
    bottom: f64,
}

impl Scale {
    fn px(&self, x: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * (x - self.x.0) / (self.x.1 - self.x.0)
    }

    fn py(&self, y: f64) -> f64 {
        TOP + (self.bottom - TOP) * (self.y.1 - y) / (self.y.1 - self.y.0)
    }
}

impl Chart<'_> {
    /// The chart as an `svg` element.
    pub fn svg(&self) -> String {
        let foot = if self.x_label.is_empty() { 8.0 } else { 40.0 };
        let scale = Scale { x: self.x_range, y: self.y_range(), bottom: 118.0 };
        let mut out =
            format!("<svg class=chart viewBox='0 0 {WIDTH} {}' role=img>", scale.bottom + foot);
        self.draw_grid(&mut out, &scale);
        for series in self.series {
            put(&mut out, format_args!("<path class=line stroke='{}' d='", series.color));
            for (i, (x, y)) in thinned(&series.points).into_iter().enumerate() {
                let letter = if i == 0 { 'M' } else { 'L' };
                put(&mut out, format_args!("{letter}{:.1} {:.1}", scale.px(x), scale.py(y)));
            }
            out.push_str("'/>");
        }
        let bottom = scale.bottom;
        let (mid_x, mid_y) = (0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (TOP + bottom));
        let (x_label, y_label) = (escaped(self.x_label), escaped(self.y_label));
        put(
            &mut out,
            format_args!(
                "<path class=axis d='M{LEFT} {TOP}V{bottom}H{}'/>\
                 <text class=label transform='translate(13 {mid_y}) rotate(-90)' \
                 text-anchor=middle>{y_label}</text>\
                 <text class=label x='{mid_x}' y='{}' text-anchor=middle>{x_label}</text></svg>",
                WIDTH - RIGHT,
                bottom + 34.0
            ),
        );
        out
    }

    fn draw_grid(&self, out: &mut String, scale: &Scale) {
        let (bottom, right) = (scale.bottom, WIDTH - RIGHT);
        let (y0, y1) = scale.y;
        let y_step = tick_step(y1 - y0, 5.0);
        for y in ticks(y0, y1, y_step) {
            let (at, label) = (scale.py(y), tick(y, y_step));
            put(
                out,
                format_args!(
                    "<path class=grid d='M{LEFT} {at:.1}H{right}'/>\
                     <text x='{}' y='{:.1}' text-anchor=end>{label}</text>",
                    LEFT - 7.0,
                    at + 4.0
                ),
            );
        }
        let (x0, x1) = scale.x;
        let x_step = tick_step(x1 - x0, 10.0);
        for x in ticks(x0, x1, x_step) {
            let at = scale.px(x);
            put(out, format_args!("<path class=grid d='M{at:.1} {TOP}V{bottom}'/>"));
            if !self.x_label.is_empty() {
                let (y, label) = (bottom + 16.0, tick(x, x_step));
                put(
                    out,
                    format_args!("<text x='{at:.1}' y='{y}' text-anchor=middle>{label}</text>"),
                );
            }
        }
        let limits = self.limit.into_iter().flat_map(|limit| [-limit, limit]);
        for limit in limits.filter(|limit| y0 <= *limit && *limit <= y1) {
            let at = scale.py(limit);
            put(out, format_args!("<path class=limit d='M{LEFT} {at:.1}H{right}'/>"));
        }
    }

    /// Symmetric about zero where the lines are on both sides, with a little room.
    fn y_range(&self) -> (f64, f64) {
        let values = self.series.iter().flat_map(|series| &series.points);
        let (mut lo, mut hi) =
            values.fold((0.0f64, 0.0f64), |(lo, hi), point| (lo.min(point.1), hi.max(point.1)));
        // Symmetric lines have a limit below zero too.
        if let Some(limit) = self.limit.filter(|limit| lo.abs().max(hi) > 0.6 * limit) {
            (lo, hi) = (if lo < 0.0 { lo.min(-limit) } else { lo }, hi.max(limit));
        }
        let room = 0.06 * (hi - lo).max(1e-12);
        (lo - room, hi + room)
    }
}

/// At most 2 000 points: of each stretch the smallest and the largest, in their order.
pub fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= N_POINTS_MAX {
        return points.to_vec();
    }
    let n_stretch = points.len().div_ceil(N_POINTS_MAX / 2);
    let mut kept = Vec::with_capacity(N_POINTS_MAX);
    for stretch in points.chunks(n_stretch) {
        let (mut lo, mut hi) = (0, 0);
        for (i, point) in stretch.iter().enumerate() {
            if point.1 < stretch[lo].1 {
                lo = i;
            }
            if point.1 > stretch[hi].1 {
                hi = i;
            }
        }
        kept.push(stretch[lo.min(hi)]);
        if lo != hi {
            kept.push(stretch[lo.max(hi)]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_and_order() {
        let mut points: Vec<_> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[12_345].1 = 7.0;
        points[77_777].1 = -3.0;
        let kept = thinned(&points);
        assert!(kept.len() <= N_POINTS_MAX);
        assert!(kept.contains(&(12_345.0, 7.0)) && kept.contains(&(77_777.0, -3.0)));
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
