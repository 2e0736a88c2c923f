//! The camera's view of a delay pattern, fitted to the lines that the delays do not move.
//!
//! Wherever a line begins and ends, its row stays where it is, and so do the references across the
//! rows. Both together fix perspective, scale and the lens; rows alone all but how much wider than
//! high the picture is.

use super::layout::Layout;
use super::placement::Placement;
use crate::levenberg::minimise;
use crate::raster::strip::{Strip, centre_px};
use ftheta_model::picture::{Picture, PixelPoint};
use ftheta_model::space::FieldPoint;
use ftheta_physics::camera::{CameraLens, Seen, View};
use nalgebra::{Matrix3, Vector3};

/// Distance of places at which rows and columns are looked at, px; most of them a line.
const STEP_PX: f64 = 5.0;
const N_PLACES_MAX: usize = 250;
/// What is looked at on each side of a line, by its width, and by the distance of rows.
const REACH_WIDTHS: f64 = 2.5;
const REACH_PITCH: f64 = 0.45;
/// Ends that are left out, by the width.
const INSET_WIDTHS: f64 = 2.0;
/// Places that are off by more than so many deviations are left out.
const GATE: f64 = 4.0;
/// How much a lens may bend, as a prior: weak.
const BENDING: f64 = 0.3;

/// The fitted view; its plane is (along, across) of the layout, mm.
#[derive(Clone, Debug)]
pub struct FittedView {
    /// From the plane to pixels.
    pub view: View,
    /// And back.
    pub seen: Seen,
    /// What is left of rows and columns, px rms.
    pub rms_px: f64,
    /// Scale in the middle, mm/px.
    pub mm_per_px: f64,
    /// Whether columns fix the scale along the lines.
    pub columns: bool,
    /// Relative uncertainty of the scale along the lines.
    pub scale_sd: f64,
}

/// A place that lies on a row or a column.
struct Sample {
    pixel: PixelPoint,
    /// 0 if its place along is known, 1 if that across.
    axis: usize,
    known_mm: f64,
}

/// Fits the view; `None` if there is too little to see.
pub fn fit_view(
    picture: &Picture,
    bright: bool,
    layout: &Layout,
    placement: &Placement,
) -> Option<FittedView> {
    let mut samples = samples(picture, bright, layout, placement);
    let columns = placement.columns.len() > 1;
    let scale = placement.mm_per_px;
    let centre =
        PixelPoint::new(0.5 * (picture.width() - 1) as f64, 0.5 * (picture.height() - 1) as f64);
    let focal_px = picture.width().max(picture.height()) as f64;
    let lens = CameraLens::plain(focal_px, centre);
    let first = first_guess(layout, placement, &lens);
    let (first, steps): (Vec<f64>, Vec<f64>) = match columns {
        true => first
            .into_iter()
            .chain([0.0, 0.0, 0.0])
            .zip([1e-4; 6].into_iter().chain([1e-6, 1e-6, 1e-4]))
            .unzip(),
        // Nothing fixes the scale along: it is that across, and where the rows lie is left open.
        false => ([first[3], first[4], first[5], 0.0, 0.0, 0.0].into_iter())
            .zip([1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-4])
            .unzip(),
    };
    let mut parameters = first;
    let mut fitted = None;
    for _ in 0..3 {
        let found = minimise(&parameters, &steps, |p, out| {
            out.clear();
            let seen = seen(&lens, p);
            out.extend(samples.iter().map(|s| left_px(&seen, s, scale)));
            out.push(p[p.len() - 1] / BENDING);
        })?;
        parameters.clone_from(&found.parameters);
        let seen = seen(&lens, &parameters);
        let mut sizes: Vec<f64> = samples.iter().map(|s| left_px(&seen, s, scale).abs()).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        fitted = Some(found);
        samples.retain(|s| left_px(&seen, s, scale).abs() < GATE * (1.5 * median).max(0.02));
        if samples.len() <= steps.len() {
            return None;
        }
    }
    let found = fitted?;
    let seen = seen(&lens, &parameters);
    let sum: f64 = samples.iter().map(|s| left_px(&seen, s, scale).powi(2)).sum();
    let rms_px = (sum / samples.len() as f64).sqrt();
    // Of the entries of the map, the first two are the scale along.
    let size = parameters[0].hypot(parameters[1]);
    let scale_sd = found.covariance.map_or(f64::INFINITY, |covariance| {
        rms_px * (covariance[(0, 0)] + covariance[(1, 1)]).max(0.0).sqrt() / size
    });
    let rows = &layout.rows;
    let middle = rows.iter().map(|row| row.across_mm).sum::<f64>() / rows.len() as f64;
    let view = view(&lens, &parameters, middle)?;
    let (middle, beside) = (FieldPoint::new(0.0, middle), FieldPoint::new(1.0, middle));
    let px_per_mm = view.pixel(middle)?.distance(view.pixel(beside)?);
    let seen = view.inverse()?;
    Some(FittedView { view, seen, rms_px, mm_per_px: 1.0 / px_per_mm, columns, scale_sd })
}

/// The view of the parameters, with what lies at this place across before the camera.
fn view(lens: &CameraLens, parameters: &[f64], across_mm: f64) -> Option<View> {
    let (lens, plane_from_ray) = unpacked(lens, parameters);
    let homography = plane_from_ray.try_inverse()?;
    let before = (homography * Vector3::new(0.0, across_mm, 1.0)).z > 0.0;
    Some(View { lens, homography: if before { homography } else { -homography } })
}

/// The map from rays to the plane of a picture taken square on: six entries, row by row.
fn first_guess(layout: &Layout, placement: &Placement, lens: &CameraLens) -> [f64; 6] {
    let (sin, cos) = placement.direction_rad.sin_cos();
    let scale = placement.mm_per_px * lens.focal_px[0];
    let ray = |pixel: PixelPoint| {
        [
            (pixel.x_px - lens.centre_px.x_px) / lens.focal_px[0],
            (pixel.y_px - lens.centre_px.y_px) / lens.focal_px[1],
        ]
    };
    let middle = |ends: [PixelPoint; 2]| {
        let [[a, b], [c, d]] = ends.map(ray);
        [0.5 * (a + c), 0.5 * (b + d)]
    };
    let n = placement.rows.len() as f64;
    let across = placement.rows.iter().map(|row| {
        let [x, y] = middle(row.ends);
        layout.rows[row.row].across_mm - scale * (x * sin - y * cos)
    });
    let across = across.sum::<f64>() / n;
    let along = placement.columns.iter().map(|column| {
        let [x, y] = middle(column.ends);
        column.along_mm - scale * (x * cos + y * sin)
    });
    let along = along.sum::<f64>() / placement.columns.len().max(1) as f64;
    [scale * cos, scale * sin, along, scale * sin, -scale * cos, across]
}

/// Lens and map of the parameters: nine of them, or six where only rows are known.
fn unpacked(lens: &CameraLens, p: &[f64]) -> (CameraLens, Matrix3<f64>) {
    let bent = |k1: f64| CameraLens { radial: [k1, 0.0, 0.0], ..*lens };
    match *p {
        [a, b, c, d, e, f, g, h, k1] => (bent(k1), Matrix3::new(a, b, c, d, e, f, g, h, 1.0)),
        // In the picture's middle a millimetre along is as long as one across.
        [d, e, f, g, h, k1] => {
            let (across_x, across_y) = (d - f * g, e - f * h);
            (bent(k1), Matrix3::new(-across_y, across_x, 0.0, d, e, f, g, h, 1.0))
        }
        _ => (*lens, Matrix3::identity()),
    }
}

fn seen(lens: &CameraLens, p: &[f64]) -> impl Fn(PixelPoint) -> Option<[f64; 2]> {
    let (lens, map) = unpacked(lens, p);
    move |pixel| {
        let [x, y] = lens.ray(pixel)?;
        let place = map * Vector3::new(x, y, 1.0);
        Some([place.x / place.z, place.y / place.z])
    }
}

fn left_px(seen: &impl Fn(PixelPoint) -> Option<[f64; 2]>, sample: &Sample, scale: f64) -> f64 {
    seen(sample.pixel).map_or(f64::NAN, |place| (place[sample.axis] - sample.known_mm) / scale)
}

/// Places along all rows and columns.
fn samples(picture: &Picture, bright: bool, layout: &Layout, placement: &Placement) -> Vec<Sample> {
    let pitch_px = layout.pitch_mm() / placement.mm_per_px;
    let mut samples = Vec::new();
    for row in &placement.rows {
        let known_mm = layout.rows[row.row].across_mm;
        let reach = (REACH_WIDTHS * row.width_px + 2.0).min(REACH_PITCH * pitch_px);
        let inset = INSET_WIDTHS * row.width_px;
        add(picture, bright, row.ends, [inset, reach], (1, known_mm), &mut samples);
    }
    let widths = placement.rows.iter().map(|row| row.width_px).sum::<f64>();
    let width_px = widths / placement.rows.len().max(1) as f64;
    for column in &placement.columns {
        let reach = REACH_WIDTHS * width_px + 2.0;
        let inset = INSET_WIDTHS * width_px;
        add(picture, bright, column.ends, [inset, reach], (0, column.along_mm), &mut samples);
    }
    samples
}

fn add(
    picture: &Picture,
    bright: bool,
    ends: [PixelPoint; 2],
    [inset_px, reach_px]: [f64; 2],
    (axis, known_mm): (usize, f64),
    samples: &mut Vec<Sample>,
) {
    let length = ends[0].distance(ends[1]);
    let direction =
        [(ends[1].x_px - ends[0].x_px) / length, (ends[1].y_px - ends[0].y_px) / length];
    let free = length - 2.0 * inset_px;
    let n = ((free / STEP_PX) as usize).min(N_PLACES_MAX);
    for index in 0..n {
        let t = inset_px + free * (index as f64 + 0.5) / n as f64;
        let middle =
            PixelPoint::new(ends[0].x_px + direction[0] * t, ends[0].y_px + direction[1] * t);
        // A bent lens or a slanted row leaves the straight way between coarse ends: twice.
        let mut pixel = Some(middle);
        for _ in 0..2 {
            pixel = pixel.and_then(|middle| {
                let strip = Strip { middle, direction, half_length_px: 0.5 * STEP_PX, reach_px };
                centre_px(picture, bright, &strip)
            });
        }
        samples.extend(pixel.map(|pixel| Sample { pixel, axis, known_mm }));
    }
}
