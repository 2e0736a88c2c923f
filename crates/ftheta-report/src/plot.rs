//! Lines over two free axes as inline SVG: linear with one scale, or logarithmic.

use crate::chart::Series;
use crate::text::{escaped, number, put, tick, tick_step, ticks};

const WIDTH: f64 = 960.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 150.0;
const TOP: f64 = 12.0;
const FOOT: f64 = 44.0;
/// Least distance between the names at the lines' ends.
const NAME_PX: f64 = 13.0;

/// A plot of named lines.
pub struct Plot<'a> {
    /// Lines and their names, which stand at their ends; a dashed line is a limit.
    pub lines: &'a [Named],
    /// What is on the axes, with units.
    pub labels: [&'a str; 2],
    /// Both axes logarithmic; else both linear with the same scale.
    pub logarithmic: bool,
    /// Height, px of a width of 960.
    pub height: f64,
}

/// One line and its name.
pub struct Named {
    /// Its points; a single one is drawn as a dot.
    pub series: Series,
    /// Its name.
    pub name: String,
    /// Whether it is drawn dashed.
    pub dashed: bool,
}

/// Range of both axes, in logarithms if so, and the picture's inside.
struct Frame {
    low: [f64; 2],
    high: [f64; 2],
    bottom: f64,
    logarithmic: bool,
}

impl Frame {
    fn place(&self, point: (f64, f64)) -> [f64; 2] {
        let value = |v: f64| if self.logarithmic { v.log10() } else { v };
        let part =
            |axis: usize, v: f64| (value(v) - self.low[axis]) / (self.high[axis] - self.low[axis]);
        [
            LEFT + (WIDTH - LEFT - RIGHT) * part(0, point.0),
            self.bottom - (self.bottom - TOP) * part(1, point.1),
        ]
    }
}

impl Plot<'_> {
    /// The plot as an `svg` element.
    pub fn svg(&self) -> String {
        let frame = self.frame();
        let mut out =
            format!("<svg class=chart viewBox='0 0 {WIDTH} {}' role=img>", frame.bottom + FOOT);
        self.draw_grid(&mut out, &frame);
        let mut names: Vec<(f64, usize)> = Vec::new();
        for (index, line) in self.lines.iter().enumerate() {
            let dash = if line.dashed { " stroke-dasharray='6 4'" } else { "" };
            put(
                &mut out,
                format_args!("<path class=line stroke='{}'{dash} d='", line.series.color),
            );
            for (i, point) in line.series.points.iter().enumerate() {
                let [x, y] = frame.place(*point);
                put(&mut out, format_args!("{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' }));
            }
            out.push_str("'/>");
            let Some(last) = line.series.points.last() else { continue };
            if self.logarithmic && !line.dashed {
                for [x, y] in line.series.points.iter().map(|point| frame.place(*point)) {
                    put(
                        &mut out,
                        format_args!(
                            "<circle cx='{x:.1}' cy='{y:.1}' r=2.6 fill='{}'/>",
                            line.series.color
                        ),
                    );
                }
            }
            if self.logarithmic {
                names.push((frame.place(*last)[1], index));
            }
        }
        self.draw_names(&mut out, &frame, names);
        let bottom = frame.bottom;
        let (mid_x, mid_y) = (0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (TOP + bottom));
        let [x_label, y_label] = self.labels.map(escaped);
        put(
            &mut out,
            format_args!(
                "<path class=axis d='M{LEFT} {TOP}V{bottom}H{}'/>\
                 <text class=label transform='translate(13 {mid_y}) rotate(-90)' \
                 text-anchor=middle>{y_label}</text>\
                 <text class=label x='{mid_x}' y='{}' text-anchor=middle>{x_label}</text></svg>",
                WIDTH - RIGHT,
                bottom + 36.0
            ),
        );
        out
    }

    fn frame(&self) -> Frame {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &(x, y) in self.lines.iter().flat_map(|line| &line.series.points) {
            for (axis, value) in [x, y].into_iter().enumerate() {
                let value = if self.logarithmic { value.log10() } else { value };
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let bottom = TOP + self.height;
        if self.logarithmic {
            for axis in [0, 1] {
                let room = 0.04 * (high[axis] - low[axis]).max(1.0);
                (low[axis], high[axis]) = (low[axis] - room, high[axis] + room);
            }
        } else {
            // One unit is as long on both axes, so that a straight path looks as steep as it is.
            let size = [WIDTH - LEFT - RIGHT, self.height];
            let per_px = (0..2).map(|axis| 1.1 * (high[axis] - low[axis]).max(1e-12) / size[axis]);
            let per_px = per_px.fold(0.0, f64::max);
            for axis in [0, 1] {
                let middle = 0.5 * (low[axis] + high[axis]);
                low[axis] = middle - 0.5 * per_px * size[axis];
                high[axis] = middle + 0.5 * per_px * size[axis];
            }
        }
        Frame { low, high, bottom, logarithmic: self.logarithmic }
    }

    fn draw_grid(&self, out: &mut String, frame: &Frame) {
        for axis in [0, 1] {
            let (low, high) = (frame.low[axis], frame.high[axis]);
            let marks: Vec<(f64, String)> = if self.logarithmic {
                let decades = low.floor() as i32..=high.ceil() as i32;
                let parts =
                    decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|n| n * 10_f64.powi(decade)));
                let inside = parts.filter(|v| (low..=high).contains(&v.log10()));
                inside.map(|value| (value, number(value))).collect()
            } else {
                let step = tick_step(high - low, if axis == 0 { 10.0 } else { 5.0 });
                ticks(low, high, step).map(|value| (value, tick(value, step))).collect()
            };
            for (value, label) in marks {
                let [x, y] = frame.place((value, value));
                let (bottom, right) = (frame.bottom, WIDTH - RIGHT);
                match axis {
                    0 => put(
                        out,
                        format_args!(
                            "<path class=grid d='M{x:.1} {TOP}V{bottom}'/><text x='{x:.1}' \
                             y='{:.1}' text-anchor=middle>{label}</text>",
                            bottom + 17.0
                        ),
                    ),
                    _ => put(
                        out,
                        format_args!(
                            "<path class=grid d='M{LEFT} {y:.1}H{right}'/><text x='{}' \
                             y='{:.1}' text-anchor=end>{label}</text>",
                            LEFT - 7.0,
                            y + 4.0
                        ),
                    ),
                }
            }
        }
    }

    /// The names at the right, moved apart where they would cover each other.
    fn draw_names(&self, out: &mut String, frame: &Frame, mut names: Vec<(f64, usize)>) {
        // Down from the top, each at its line's end or below the one before, then up from the foot.
        names.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = TOP;
        for (y, _) in &mut names {
            *y = y.max(free);
            free = *y + NAME_PX;
        }
        let mut free = frame.bottom;
        for (y, _) in names.iter_mut().rev() {
            *y = y.min(free);
            free = *y - NAME_PX;
        }
        for (y, index) in names {
            let line = &self.lines[index];
            put(
                out,
                format_args!(
                    "<text x='{}' y='{:.1}' style='fill:{}'>{}</text>",
                    WIDTH - RIGHT + 8.0,
                    y + 4.0,
                    line.series.color,
                    escaped(&line.name)
                ),
            );
        }
    }
}
