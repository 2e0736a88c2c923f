//! The ends of every line of a delay pattern in a picture, to a small part of a pixel.

use super::layout::Layout;
use super::placement::Located;
use super::profile::{Edge, edge};
use super::view::FittedView;
use crate::raster::strip::{Strip, centre_px, straight};
use ftheta_model::picture::{Picture, PixelPoint};

/// Places along a line at which its middle is looked for.
const N_PLACES: usize = 24;
/// Half of the window at an end: by the line's width, and more, px; by its length.
const WINDOW_WIDTHS: f64 = 2.0;
const WINDOW_PX: f64 = 4.0;
const WINDOW_LENGTH: f64 = 0.25;
/// Half of the rows that are averaged at an end, by the line's width.
pub const ROWS_WIDTHS: f64 = 0.35;
/// An end lies no farther beyond the coarse one, and a line breaks for no longer, in widths.
const END_WITHIN_WIDTHS: f64 = 8.0;
const BREAK_WIDTHS: f64 = 2.5;
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

impl SeenLine {
    /// A line of which nothing was seen.
    pub fn nothing(row: usize, reject: Reject) -> Self {
        Self { row, ends: [Err(reject); 2], profile: Vec::new() }
    }
}

impl Scene<'_> {
    /// Measures a line.
    ///
    /// * `width_px`: of all lines
    pub fn measure(&self, located: &Located, width_px: f64) -> SeenLine {
        let row = &self.layout.rows[located.row];
        let pitch_px = self.layout.pitch_mm() / self.view.mm_per_px;
        let reach_px = (2.5 * width_px + 2.0).min(0.45 * pitch_px);
        let Some((from, direction)) = self.middle_line(located, width_px, reach_px) else {
            return SeenLine::nothing(located.row, Reject::NotFound);
        };
        let length_px = located.ends[0].distance(located.ends[1]);
        let at =
            |t: f64| PixelPoint::new(from.x_px + t * direction[0], from.y_px + t * direction[1]);
        let window_px = (WINDOW_WIDTHS * width_px + WINDOW_PX).min(WINDOW_LENGTH * length_px);
        let middle = at(0.5 * length_px);
        let strip = Strip { middle, direction, half_length_px: 0.35 * length_px, reach_px };
        let profile = strip.across(self.picture);
        let ground = 0.5 * (profile[0] + profile[profile.len() - 1]);
        let line = profile[profile.len() / 2];
        let most_px = 0.5 * length_px + END_WITHIN_WIDTHS * width_px;
        let mut both = [direction.map(|d| -d), direction].map(|outward| {
            let end = self.walk(middle, outward, [0.5 * (ground + line), most_px], width_px);
            self.end(end, outward, [window_px, width_px])
        });
        if row.sense() < 0.0 {
            both.reverse();
        }
        SeenLine { row: located.row, ends: both, profile }
    }

    /// Where a line ends, to a pixel, walking outward on its middle.
    ///
    /// * `half`: brightness between line and ground
    /// * `most_px`: how far to walk
    fn walk(
        &self,
        middle: PixelPoint,
        outward: [f64; 2],
        [half, most_px]: [f64; 2],
        width_px: f64,
    ) -> PixelPoint {
        let at =
            |t: f64| PixelPoint::new(middle.x_px + t * outward[0], middle.y_px + t * outward[1]);
        let mut end = 0.0;
        for step in 0..most_px as i32 {
            let t = f64::from(step);
            // Three pixels across, so that a speck does not end the line, nor go on for it.
            let across = [-1.0, 0.0, 1.0].map(|off| {
                let place = at(t);
                let place =
                    PixelPoint::new(place.x_px - off * outward[1], place.y_px + off * outward[0]);
                f64::from(self.picture.at(place))
            });
            let mean = across.iter().sum::<f64>() / 3.0;
            if (mean > half) == self.bright {
                end = t;
            } else if t > end + BREAK_WIDTHS * width_px {
                break;
            }
        }
        at(end)
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
        if !self.picture.contains(here)
            || sign * (edge.line - edge.ground) < CONTRAST * self.contrast
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
