//! A camera's lens, from several pictures of a sheet taken from different directions.
//!
//! One picture of a plane does not tell the focal length, and its distortion only as well as signs
//! around the field allow. Several do (Z. Zhang 2000, A flexible new technique for camera
//! calibration), and the field's picture then has to give no more than where the camera stood.

use super::view_fit::{CENTRE, FittedView, RADIAL, SIGHTING_PX, TANGENTIAL, fit_view};
use crate::levenberg::minimise;
use ftheta_model::picture::{PixelPoint, Sighting};
use ftheta_physics::camera::{CameraLens, View};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Fewest pictures.
pub const N_PICTURES_MIN: usize = 3;
/// Parameters of the lens, and of where the camera stands.
const N_LENS: usize = 7;
const N_STAND: usize = 6;
/// Focal lengths that cameras have, by the longer side of their pictures.
const FOCAL: [f64; 2] = [0.2, 20.0];

/// A camera as several pictures show it.
#[derive(Clone, Debug)]
pub struct CameraFit {
    /// Its lens.
    pub lens: CameraLens,
    /// How it saw the plane in each picture.
    pub views: Vec<View>,
    /// What signs are off, px rms along one axis.
    pub rms_px: f64,
    /// Relative deviation of the focal length.
    pub focal_sd: f64,
}

/// The lens from groups of sightings of several pictures; `None` if they do not fix it.
///
/// * `pictures`: the signs of each, each sign a group
/// * `size_px`: width and height of all pictures
pub fn fit_camera(pictures: &[Vec<Vec<Sighting>>], size_px: [usize; 2]) -> Option<CameraFit> {
    let alone: Vec<FittedView> =
        pictures.iter().map(|groups| fit_view(groups, size_px, None)).collect::<Option<_>>()?;
    let used: Vec<Vec<Sighting>> = pictures
        .iter()
        .zip(&alone)
        .map(|(groups, view)| {
            let kept = groups.iter().zip(&view.kept).filter(|(_, kept)| **kept);
            kept.flat_map(|(group, _)| group.clone()).collect()
        })
        .collect();
    let side = size_px[0].max(size_px[1]) as f64;
    let focal_px = focal_px(&alone, side);
    let mut first = vec![focal_px / side, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for view in &alone {
        first.extend(stand(&view.view, focal_px)?);
    }
    let mut steps = vec![1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-6, 1e-6];
    steps.extend([1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3].repeat(pictures.len()));
    let found = minimise(&first, &steps, |p, out| {
        out.clear();
        let lens = lens(p, size_px);
        for (index, sightings) in used.iter().enumerate() {
            let view = view(lens, &p[N_LENS + N_STAND * index..]);
            for sighting in sightings {
                let off = view.pixel(sighting.place_mm).map_or([f64::NAN; 2], |pixel| {
                    [pixel.x_px - sighting.pixel.x_px, pixel.y_px - sighting.pixel.y_px]
                });
                out.extend(off.map(|px| px / SIGHTING_PX));
            }
        }
        out.extend([p[1] / CENTRE, p[2] / CENTRE, p[3] / RADIAL, p[4] / RADIAL]);
        out.extend([p[5] / TANGENTIAL, p[6] / TANGENTIAL]);
    })?;
    let p = &found.parameters;
    let lens = lens(p, size_px);
    let views: Vec<View> =
        (0..pictures.len()).map(|index| view(lens, &p[N_LENS + N_STAND * index..])).collect();
    let n: usize = used.iter().map(Vec::len).sum();
    let squares = views.iter().zip(&used).map(|(view, sightings)| {
        super::view_fit::rms_px(view, sightings).powi(2) * sightings.len() as f64
    });
    let rms_px = (squares.sum::<f64>() / n as f64).sqrt();
    let focal_sd = found.covariance?[(0, 0)].sqrt() / p[0].abs();
    let plausible = (FOCAL[0]..FOCAL[1]).contains(&p[0]) && rms_px.is_finite();
    plausible.then_some(CameraFit { lens, views, rms_px, focal_sd })
}

/// The focal length with which all homographies are those of a camera, px.
fn focal_px(views: &[FittedView], side: f64) -> f64 {
    let (mut ab, mut aa) = (0.0, 0.0);
    for FittedView { view, .. } in views {
        let (u, v) = (view.homography.column(0), view.homography.column(1));
        let size = u.norm_squared();
        // Columns have to be at right angles, and equally long, once rays are scaled right.
        for (a, b) in [
            (u[0] * v[0] + u[1] * v[1], u[2] * v[2]),
            (u[0] * u[0] + u[1] * u[1] - v[0] * v[0] - v[1] * v[1], u[2] * u[2] - v[2] * v[2]),
        ] {
            ab += a * b / (size * size);
            aa += a * a / (size * size);
        }
    }
    let squared = -ab / aa.max(f64::MIN_POSITIVE);
    let focal = views[0].view.lens.focal_px[0] / squared.max(0.0).sqrt();
    if (FOCAL[0]..FOCAL[1]).contains(&(focal / side)) { focal } else { side }
}

/// Turn and place of the camera from a view that was fitted with another focal length.
fn stand(view: &View, focal_px: f64) -> Option<[f64; N_STAND]> {
    let scale = view.lens.focal_px[0] / focal_px;
    let map = Matrix3::from_diagonal(&Vector3::new(scale, scale, 1.0)) * view.homography;
    let (u, v, home): (Vector3<f64>, Vector3<f64>, Vector3<f64>) =
        (map.column(0).into(), map.column(1).into(), map.column(2).into());
    let length = 0.5 * (u.norm() + v.norm()) * home.z.signum();
    let (u, v, home) = (u / length, v / length, home / length);
    let decomposed = Matrix3::from_columns(&[u, v, u.cross(&v)]).svd(true, true);
    let turn = Rotation3::from_matrix_unchecked(decomposed.u? * decomposed.v_t?).scaled_axis();
    Some([turn.x, turn.y, turn.z, home.x, home.y, home.z])
}

fn lens(p: &[f64], [width, height]: [usize; 2]) -> CameraLens {
    let focal_px = p[0] * width.max(height) as f64;
    CameraLens {
        focal_px: [focal_px; 2],
        centre_px: PixelPoint::new(
            0.5 * (width - 1) as f64 + focal_px * p[1],
            0.5 * (height - 1) as f64 + focal_px * p[2],
        ),
        radial: [p[3], p[4], 0.0],
        tangential: [p[5], p[6]],
    }
}

fn view(lens: CameraLens, stand: &[f64]) -> View {
    let turn = Rotation3::from_scaled_axis(Vector3::new(stand[0], stand[1], stand[2]));
    let turn = turn.matrix();
    let home = Vector3::new(stand[3], stand[4], stand[5]);
    let columns = [turn.column(0).into(), turn.column(1).into(), home];
    View { lens, homography: Matrix3::from_columns(&columns) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ftheta_model::space::FieldPoint;

    #[test]
    fn a_lens_comes_back_from_pictures_from_all_sides() {
        let known = CameraLens {
            focal_px: [3400.0; 2],
            centre_px: PixelPoint::new(2015.0, 1490.0),
            radial: [0.08, -0.04, 0.0],
            tangential: [3e-4, -2e-4],
        };
        let stands = [
            [3.0, 0.1, 0.0, 0.0, 0.0, 330.0],
            [2.7, 0.3, 0.1, 10.0, -5.0, 350.0],
            [3.1, -0.3, 0.4, -8.0, 4.0, 340.0],
            [2.9, 0.0, -0.5, 0.0, 10.0, 360.0],
        ];
        let pictures: Vec<Vec<Vec<Sighting>>> = stands
            .iter()
            .map(|stand| {
                let view = view(known, stand);
                let groups = (0..49).map(|index| {
                    let (x, y) = (f64::from(index % 7) * 35.0, f64::from(index / 7) * 35.0);
                    let corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)];
                    let sighting = |(dx, dy): (f64, f64)| {
                        let place_mm = FieldPoint::new(x + dx - 105.0, y + dy - 105.0);
                        Sighting { place_mm, pixel: view.pixel(place_mm).unwrap() }
                    };
                    corners.map(sighting).to_vec()
                });
                groups.collect()
            })
            .collect();
        let found = fit_camera(&pictures, [4000, 3000]).unwrap();
        assert!(found.rms_px < 0.02, "{}", found.rms_px);
        assert!((found.lens.focal_px[0] / 3400.0 - 1.0).abs() < 2e-3, "{:?}", found.lens);
        assert!(found.lens.centre_px.distance(known.centre_px) < 5.0, "{:?}", found.lens);
        assert!(found.focal_sd < 0.02, "{}", found.focal_sd);
    }
}
