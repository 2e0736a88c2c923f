//! The ends of every line of a delay pattern in a picture, to a small part of a pixel.

use super::layout::Layout;
use super::placement::Located;
use super::profile::{Edge, Strip, centre_px, edge};
use super::view::FittedView;
use ftheta_model::picture::{Picture, PixelPoint};

/// Places along a line at which its middle is looked for.
const N_PLACES: usize = 24;
/// Half of the window at an end: by the line's width, and more, px; by its length.
const WINDOW_WIDTHS: f64 = 2.0;
const WINDOW_PX: f64 = 4.0;
const WINDOW_LENGTH: f64 = 0.25;
/// Half of the rows that are averaged at an end, by the line's width.
const ROWS_WIDTHS: f64 = 0.35;
/// A line stands out by this part of the picture's contrast.
const CONTRAST: f64 = 0.3;
/// Brightness that counts as cut off.
const WHITE: f64 = 0.985;
/// Ends come no nearer to a reference than this, by their width.
const CLEAR_WIDTHS: f64 = 1.5;

/// Why an end is of no use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reject {
    /// Its line was not found.
    NotFound,
    /// There is no clear edge.
    NoEdge,
    /// The ground is cut off at white.
    Saturated,
    /// A reference line is in the way.
    AtReference,
    /// It does not fit the others.
    Outlier,
}

impl Reject {
    /// The reason in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::NotFound => "the line was not found",
            Self::NoEdge => "there is no clear edge",
            Self::Saturated => "the ground is cut off at white",
            Self::AtReference => "it reaches a reference line",
            Self::Outlier => "it does not fit the others",
        }
    }
}

/// An end in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenEnd {
    /// Where it is in the picture.
    pub pixel: PixelPoint,
    /// Where it is along the pattern, mm.
    pub along_mm: f64,
    /// The edge.
    pub edge: Edge,
}

/// A line as it was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenLine {
    /// Index of its row in the layout.
    pub row: usize,
    /// Its start and its stop.
    pub ends: [Result<SeenEnd, Reject>; 2],
    /// Mean brightness across it, every half pixel; empty if it was not seen.
    pub profile: Vec<f64>,
}

/// What is measured in.
pub struct Scene<'a> {
    /// The picture.
    pub picture: &'a Picture,
    /// Whether lines are bright.
    pub bright: bool,
    /// How much they stand out, of full scale.
    pub contrast: f64,
    /// The pattern.
    pub layout: &'a Layout,
    /// How the camera sees it.
    pub view: &'a FittedView,
}

impl Scene<'_> {
    /// Measures a line.
    ///
    /// * `width_px`: of all lines
    pub fn measure(&self, located: &Located, width_px: f64) -> SeenLine {
        let row = &self.layout.rows[located.row];
        let nothing = |reject| SeenLine { row: located.row, ends: [Err(reject); 2], profile: vec![] };
        let pitch_px = self.layout.pitch_mm() / self.view.mm_per_px;
        let reach_px = (2.5 * width_px + 2.0).min(0.45 * pitch_px);
        let Some((from, direction)) = self.middle_line(located, width_px, reach_px) else {
            return nothing(Reject::NotFound);
        };
        let length_px = located.ends[0].distance(located.ends[1]);
        let at = |t: f64| PixelPoint::new(from.x_px + t * direction[0], from.y_px + t * direction[1]);
        let window_px = (WINDOW_WIDTHS * width_px + WINDOW_PX).min(WINDOW_LENGTH * length_px);
        let low = self.end(at(0.0), direction.map(|d| -d), [window_px, width_px]);
        let high = self.end(at(length_px), direction, [window_px, width_px]);
        let ends = if row.sense() > 0.0 { [low, high] } else { [high, low] };
        let strip = Strip {
            middle: at(0.5 * length_px),
            direction,
            half_length_px: 0.35 * length_px,
            reach_px,
        };
        SeenLine { row: located.row, ends, profile: strip.across(self.picture) }
    }

    /// Where the middle of a line runs: the place beside its first coarse end, and its direction.
    fn middle_line(
        &self,
        located: &Located,
        width_px: f64,
        reach_px: f64,
    ) -> Option<(PixelPoint, [f64; 2])> {
        let [from, to] = located.ends;
        let length = from.distance(to);
        let [x, y] = [(to.x_px - from.x_px) / length, (to.y_px - from.y_px) / length];
        let inset = width_px.min(0.2 * length);
        let half_length_px = 0.5 * (length - 2.0 * inset) / N_PLACES as f64;
        let mut points: Vec<(f64, f64)> = Vec::with_capacity(N_PLACES);
        for index in 0..N_PLACES {
            let t = inset + half_length_px * (2 * index + 1) as f64;
            let middle = PixelPoint::new(from.x_px + t * x, from.y_px + t * y);
            let strip = Strip { middle, direction: [x, y], half_length_px, reach_px };
            if let Some(at) = centre_px(self.picture, self.bright, &strip) {
                points.push((t, (at.y_px - from.y_px) * x - (at.x_px - from.x_px) * y));
            }
        }
        if points.len() < N_PLACES / 2 {
            return None;
        }
        let (height, slope) = straight(&points);
        let from = PixelPoint::new(from.x_px - y * height, from.y_px + x * height);
        let norm = slope.hypot(1.0);
        Some((from, [(x - y * slope) / norm, (y + x * slope) / norm]))
    }

    fn end(
        &self,
        middle: PixelPoint,
        outward: [f64; 2],
        [window_px, width_px]: [f64; 2],
    ) -> Result<SeenEnd, Reject> {
        let rows_px = ROWS_WIDTHS * width_px;
        let mut here = middle;
        let mut found = None;
        // Again about the end itself, so that the window lies the same at every one.
        for _ in 0..2 {
            let edge = edge(self.picture, here, outward, [window_px, rows_px]);
            let edge = edge.ok_or(Reject::NoEdge)?;
            here = PixelPoint::new(
                here.x_px + edge.at_px * outward[0],
                here.y_px + edge.at_px * outward[1],
            );
            found = Some(edge);
        }
        let edge = found.ok_or(Reject::NoEdge)?;
        let sign = if self.bright { 1.0 } else { -1.0 };
        if !self.picture.contains(here) || sign * (edge.line - edge.ground) < CONTRAST * self.contrast
        {
            return Err(Reject::NoEdge);
        }
        if edge.ground.max(edge.line) > WHITE {
            return Err(Reject::Saturated);
        }
        let along_mm = self.view.seen.place(here).ok_or(Reject::NoEdge)?.x_mm;
        let clear_mm = CLEAR_WIDTHS * width_px * self.view.mm_per_px;
        if self.layout.columns_mm.iter().any(|column| (column - along_mm).abs() < clear_mm) {
            return Err(Reject::AtReference);
        }
        Ok(SeenEnd { pixel: here, along_mm, edge })
    }
}

/// The straight line through points, those far off left out: height at 0 and slope.
fn straight(points: &[(f64, f64)]) -> (f64, f64) {
    let mut used: Vec<(f64, f64)> = points.to_vec();
    let mut line = (0.0, 0.0);
    for _ in 0..3 {
        let n = used.len() as f64;
        let (mean_t, mean_n) =
            (used.iter().map(|p| p.0).sum::<f64>() / n, used.iter().map(|p| p.1).sum::<f64>() / n);
        let (tt, tn) = used.iter().fold((0.0, 0.0), |(tt, tn), p| {
            let t = p.0 - mean_t;
            (tt + t * t, tn + t * (p.1 - mean_n))
        });
        let slope = if tt > 0.0 { tn / tt } else { 0.0 };
        line = (mean_n - slope * mean_t, slope);
        let off = |p: &(f64, f64)| (p.1 - line.0 - line.1 * p.0).abs();
        let mut sizes: Vec<f64> = points.iter().map(off).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        used = points.iter().filter(|p| off(p) < 4.0 * (1.5 * median).max(0.05)).copied().collect();
    }
    line
}
