//! Lines and a few letters drawn into a picture of brightness, for its scale bar.

use kurbo::{Line, ParamCurveNearest, Point};

/// A picture of one brightness per pixel, 0 black to 1 white, row by row from the top.
pub struct Canvas {
    /// Pixels of one row.
    pub width: usize,
    /// Brightness.
    pub pixels: Vec<f32>,
}

impl Canvas {
    /// Draws a line with round ends, softened over one pixel; all lengths in pixels.
    pub fn line(&mut self, line: Line, width_px: f64, brightness: f32) {
        let reach = 0.5 * width_px + 1.0;
        let height = self.pixels.len() / self.width;
        let span = |a: f64, b: f64, n: usize| {
            let lo = (a.min(b) - reach).floor().max(0.0) as usize;
            let hi = (a.max(b) + reach).ceil().max(0.0) as usize;
            lo..hi.min(n)
        };
        for y in span(line.p0.y, line.p1.y, height) {
            for x in span(line.p0.x, line.p1.x, self.width) {
                let centre = Point::new(x as f64 + 0.5, y as f64 + 0.5);
                let distance_px = line.nearest(centre, 1e-3).distance_sq.sqrt();
                let share = (0.5 * width_px + 0.5 - distance_px).clamp(0.0, 1.0) as f32;
                let pixel = &mut self.pixels[y * self.width + x];
                *pixel += share * (brightness - *pixel);
            }
        }
    }

    /// Draws digits, `.`, `m` and spaces centred on `x`, with their feet on `y`.
    pub fn text(&mut self, text: &str, foot: Point, height_px: f64, brightness: f32) {
        let unit_px = height_px / 6.0;
        let width: f64 = text.chars().map(|c| glyph(c).0).sum::<f64>() - GAP;
        let mut x = foot.x - 0.5 * width * unit_px;
        for c in text.chars() {
            let (advance, strokes) = glyph(c);
            for pair in strokes.iter().flat_map(|stroke| stroke.windows(2)) {
                let place = |(px, py): (f64, f64)| {
                    Point::new(x + unit_px * px, foot.y + unit_px * (py - 6.0))
                };
                let line = Line::new(place(pair[0]), place(pair[1]));
                self.line(line, 0.85 * unit_px, brightness);
            }
            x += advance * unit_px;
        }
    }
}

/// Space between two letters, in sixths of the height.
const GAP: f64 = 1.7;

type Stroke = &'static [(f64, f64)];

/// Advance and strokes of a letter in sixths of its height, y down.
fn glyph(c: char) -> (f64, &'static [Stroke]) {
    let strokes: &[Stroke] = match c {
        '0' => &[&[
            (1.2, 0.0),
            (2.8, 0.0),
            (4.0, 1.4),
            (4.0, 4.6),
            (2.8, 6.0),
            (1.2, 6.0),
            (0.0, 4.6),
            (0.0, 1.4),
            (1.2, 0.0),
        ]],
        '1' => &[&[(0.8, 1.2), (2.2, 0.0), (2.2, 6.0)]],
        '2' => {
            &[&[(0.1, 1.4), (1.1, 0.0), (2.9, 0.0), (3.9, 1.2), (3.7, 2.4), (0.0, 6.0), (4.0, 6.0)]]
        }
        '5' => &[&[
            (3.7, 0.0),
            (0.6, 0.0),
            (0.3, 2.7),
            (2.6, 2.3),
            (4.0, 3.3),
            (4.0, 4.8),
            (2.8, 6.0),
            (1.1, 6.0),
            (0.0, 5.2),
        ]],
        'm' => &[
            &[(0.0, 6.0), (0.0, 2.0)],
            &[(0.0, 3.2), (1.0, 2.1), (2.0, 2.2), (2.5, 3.2), (2.5, 6.0)],
            &[(2.5, 3.2), (3.5, 2.1), (4.5, 2.2), (5.0, 3.2), (5.0, 6.0)],
        ],
        '.' => &[&[(0.0, 6.0), (0.1, 6.0)]],
        _ => &[],
    };
    let width = match c {
        'm' => 5.0,
        '.' => 0.1,
        ' ' => 1.0,
        _ => 4.0,
    };
    (width + GAP, strokes)
}
