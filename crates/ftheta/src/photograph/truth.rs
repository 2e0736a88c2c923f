//! Where everything truly is in a photograph, for tests and for the curious.

use super::strokes::Strokes;
use ftheta_model::pattern::{FeatureShape, MarkStyle, Pattern};
use ftheta_model::picture::PixelPoint;
use ftheta_model::space::FieldPoint;
use ftheta_twin::photograph::{Burn, Camera, Printer, Segment};
use kurbo::{Line, Point, Rect, Vec2};

/// A place on the plate and in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruePlace {
    /// In the field.
    pub place_mm: FieldPoint,
    /// In the picture, distortion and all.
    pub pixel: PixelPoint,
}

/// Where the features of a pattern are, by their ids.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Centres of crosses, dots and signs.
    pub centres: Vec<(String, TruePlace)>,
    /// Both ends of lines and reference lines: where light began and ended, or the print does.
    pub ends: Vec<(String, [TruePlace; 2])>,
    /// Printed over true length, along x and y.
    pub print_scale: [f64; 2],
    /// The camera.
    pub camera: Camera,
}

impl Truth {
    pub(super) fn new(
        pattern: &Pattern,
        strokes: &Strokes,
        burned: &Burn,
        printed: &[(usize, Point)],
        printer: &Printer,
        camera: Camera,
    ) -> Self {
        let mut by_feature: Vec<Vec<&[Segment]>> = vec![Vec::new(); pattern.features.len()];
        for run in burned.iter().filter(|run| !run.segments.is_empty()) {
            let stroke = strokes.all.get(run.light);
            if let Some(feature) = stroke.and_then(|stroke| stroke.feature) {
                by_feature[feature].push(&run.segments);
            }
        }
        let seen = |place: Point| {
            camera.pixel(place).map(|pixel| TruePlace { place_mm: place.into(), pixel })
        };
        let (mut centres, mut ends) = (Vec::new(), Vec::new());
        for (index, feature) in pattern.features.iter().enumerate() {
            let runs = &by_feature[index];
            let both = match &feature.shape {
                FeatureShape::Line { .. } | FeatureShape::Reference { burned: true, .. } => {
                    runs.first().map(|run| [run[0].from, run[run.len() - 1].to])
                }
                FeatureShape::Reference { from_mm, to_mm, .. } => {
                    Some([*from_mm, *to_mm].map(|end| printer.place(end.into())))
                }
                _ => None,
            };
            let centre = match &feature.shape {
                FeatureShape::Mark(mark) if mark.style == MarkStyle::Cross => crossing(runs),
                FeatureShape::Mark(_) => middle(runs),
                FeatureShape::Fiducial { burned: true, .. } => bounds(runs).map(|all| all.center()),
                _ => printed.iter().find(|(of, _)| *of == index).map(|(_, centre)| *centre),
            };
            let id = || feature.id.clone();
            centres.extend(centre.and_then(seen).map(|place| (id(), place)));
            if let Some([Some(from), Some(to)]) = both.map(|both| both.map(seen)) {
                ends.push((id(), [from, to]));
            }
        }
        Self { centres, ends, print_scale: printer.scale, camera }
    }
}

/// Where two arms cross.
fn crossing(runs: &[&[Segment]]) -> Option<Point> {
    let [first, second] = runs else {
        return None;
    };
    let chord = |run: &[Segment]| Line::new(run[0].from, run[run.len() - 1].to);
    chord(first).crossing_point(chord(second))
}

/// The middle of all that was burned.
fn middle(runs: &[&[Segment]]) -> Option<Point> {
    let (mut sum, mut energy_j) = (Vec2::ZERO, 0.0);
    for segment in runs.iter().flat_map(|run| run.iter()) {
        sum += segment.from.midpoint(segment.to).to_vec2() * segment.energy_j;
        energy_j += segment.energy_j;
    }
    (energy_j > 0.0).then(|| (sum / energy_j).to_point())
}

/// Bounds of all that was burned.
fn bounds(runs: &[&[Segment]]) -> Option<Rect> {
    let segments = runs.iter().flat_map(|run| run.iter());
    segments.map(|segment| Rect::from_points(segment.from, segment.to)).reduce(|a, b| a.union(b))
}

/// Side of a pixel at a place, mm.
pub(super) fn pixel_mm(camera: &Camera, place: Point) -> f64 {
    let pixel = camera.pixel(place);
    let beside =
        pixel.and_then(|pixel| camera.place(PixelPoint::new(pixel.x_px + 1.0, pixel.y_px)));
    beside.map_or(0.0, |beside| beside.distance(place))
}
