//! The camera's view of a plane, fitted to places that are known.

use crate::levenberg::minimise;
use ftheta_model::picture::{PixelPoint, Sighting};
use ftheta_physics::camera::{CameraLens, Seen, View};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// Size of places that keeps numbers near one, mm.
const SCALE_MM: f64 = 100.0;
/// What a sighting is off, px rms: what priors are weighed against. Printed signs are off as a
/// whole, so the four corners of one say no more than one of them would.
pub const SIGHTING_PX: f64 = 0.2;
/// What lenses are like, as priors: radial, tangential, centre off the middle by the focal length.
pub const RADIAL: f64 = 0.2;
/// See there.
pub const TANGENTIAL: f64 = 0.001;
/// See there.
pub const CENTRE: f64 = 0.01;
/// With fewer sightings a lens' higher terms are left alone.
const N_FREE: usize = 48;
/// A group is left out if it is so many times as far off as the usual one, and by this much, px.
const GATE: f64 = 4.0;
const GATE_PX: f64 = 0.25;
const N_ROUNDS: usize = 4;

/// A fitted view.
#[derive(Clone, Debug)]
pub struct FittedView {
    /// From the plane to pixels.
    pub view: View,
    /// And back.
    pub seen: Seen,
    /// What is left, px rms along one axis.
    pub rms_px: f64,
    /// Which groups were used.
    pub kept: Vec<bool>,
}

/// Fits a view to groups of sightings, each as good as another; `None` if they do not fix it.
///
/// * `size_px`: width and height of the picture
/// * `lens`: a lens that is known; else it is fitted
pub fn fit_view(
    groups: &[Vec<Sighting>],
    size_px: [usize; 2],
    lens: Option<CameraLens>,
) -> Option<FittedView> {
    let mut kept = vec![true; groups.len()];
    let mut found = None;
    for _ in 0..N_ROUNDS {
        let used = groups.iter().zip(&kept).filter(|(_, kept)| **kept);
        let used: Vec<Sighting> = used.flat_map(|(group, _)| group.clone()).collect();
        let view = fit_once(&used, size_px, lens)?;
        let off: Vec<f64> = groups.iter().map(|group| rms_px(&view, group)).collect();
        let mut sizes: Vec<f64> =
            off.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(off, _)| *off).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        let limit = (GATE * median).max(GATE_PX);
        let now: Vec<bool> = off.iter().map(|off| *off < limit).collect();
        found = Some((view, rms_px(&view, &used)));
        if now == kept {
            break;
        }
        kept = now;
    }
    let (view, rms_px) = found?;
    Some(FittedView { view, seen: view.inverse()?, rms_px, kept })
}

/// What a view leaves of sightings, px rms along one axis.
pub fn rms_px(view: &View, sightings: &[Sighting]) -> f64 {
    let squares = sightings.iter().map(|sighting| {
        let pixel = view.pixel(sighting.place_mm);
        pixel.map_or(f64::INFINITY, |pixel| 0.5 * pixel.distance(sighting.pixel).powi(2))
    });
    (squares.sum::<f64>() / sightings.len().max(1) as f64).sqrt()
}

fn fit_once(
    sightings: &[Sighting],
    [width, height]: [usize; 2],
    lens: Option<CameraLens>,
) -> Option<View> {
    let middle = PixelPoint::new(0.5 * (width - 1) as f64, 0.5 * (height - 1) as f64);
    // Scale and focal length cannot be told apart in one view of a plane.
    let start = lens.unwrap_or_else(|| CameraLens::plain(width.max(height) as f64, middle));
    let homography = homography(sightings, &start)?;
    let mut first: Vec<f64> = homography.transpose().iter().take(8).copied().collect();
    let mut steps = vec![1e-6; 8];
    if lens.is_none() {
        first.extend([0.0; 6]);
        steps.extend([1e-5, 1e-5, 1e-6, 1e-6, 1e-4, 1e-4]);
    }
    let free = sightings.len() >= N_FREE;
    let unpacked = |p: &[f64]| {
        let mut lens = start;
        if let [k1, k2, p1, p2, x, y] = p[8..] {
            lens.radial = [k1, if free { k2 } else { 0.0 }, 0.0];
            if free {
                lens.tangential = [p1, p2];
                let [fx, fy] = lens.focal_px;
                lens.centre_px = PixelPoint::new(middle.x_px + fx * x, middle.y_px + fy * y);
            }
        }
        let h = Matrix3::new(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], 1.0);
        View { lens, homography: h * Matrix3::from_diagonal(&scaling()) }
    };
    let found = minimise(&first, &steps, |p, out| {
        out.clear();
        let view = unpacked(p);
        for sighting in sightings {
            let pixel = view.pixel(sighting.place_mm);
            let off = pixel.map_or([f64::NAN; 2], |pixel| {
                [pixel.x_px - sighting.pixel.x_px, pixel.y_px - sighting.pixel.y_px]
            });
            out.extend(off.map(|px| px / SIGHTING_PX));
        }
        if let [k1, k2, p1, p2, x, y] = p[8..] {
            out.extend([k1 / RADIAL, k2 / RADIAL, p1 / TANGENTIAL, p2 / TANGENTIAL]);
            out.extend([x / CENTRE, y / CENTRE]);
        }
    })?;
    let view = unpacked(&found.parameters);
    found.cost.is_finite().then_some(view)
}

fn scaling() -> Vector3<f64> {
    Vector3::new(1.0 / SCALE_MM, 1.0 / SCALE_MM, 1.0)
}

/// The projective map from places over [`SCALE_MM`] to rays, as far as there is no distortion
/// beyond the lens given; its last entry is 1.
fn homography(sightings: &[Sighting], lens: &CameraLens) -> Option<Matrix3<f64>> {
    if sightings.len() < 4 {
        return None;
    }
    let mut rows = DMatrix::zeros(2 * sightings.len(), 8);
    let mut right = nalgebra::DVector::zeros(2 * sightings.len());
    for (index, sighting) in sightings.iter().enumerate() {
        let [x, y] = lens.ray(sighting.pixel)?;
        let (u, v) = (sighting.place_mm.x_mm / SCALE_MM, sighting.place_mm.y_mm / SCALE_MM);
        let both = [
            [u, v, 1.0, 0.0, 0.0, 0.0, -u * x, -v * x],
            [0.0, 0.0, 0.0, u, v, 1.0, -u * y, -v * y],
        ];
        for (off, row) in both.into_iter().enumerate() {
            for (column, value) in row.into_iter().enumerate() {
                rows[(2 * index + off, column)] = value;
            }
        }
        right[2 * index] = x;
        right[2 * index + 1] = y;
    }
    let normal = rows.tr_mul(&rows);
    let h = normal.lu().solve(&rows.tr_mul(&right))?;
    let map = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
    map.iter().all(|value| value.is_finite()).then_some(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ftheta_model::space::FieldPoint;

    /// A view of a phone, and what it sees of 40 signs around a field.
    fn sightings() -> (View, Vec<Vec<Sighting>>) {
        let lens = CameraLens {
            focal_px: [3600.0; 2],
            centre_px: PixelPoint::new(2010.0, 1490.0),
            radial: [0.06, -0.05, 0.0],
            tangential: [4e-4, -3e-4],
        };
        let homography = Matrix3::new(1.0, 0.03, 4.0, 0.02, -1.0, -3.0, 1e-4, -5e-5, 330.0);
        let view = View { lens, homography };
        let groups = (0..40).map(|index| {
            let along = -140.0 + 28.0 * f64::from(index % 10) + 14.0;
            let (x, y) = match index / 10 {
                0 => (along, 150.0),
                1 => (along, -150.0),
                2 => (150.0, along),
                _ => (-150.0, along),
            };
            let corners = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)];
            let sighting = |(dx, dy): (f64, f64)| {
                let place_mm = FieldPoint::new(x + dx, y + dy);
                Sighting { place_mm, pixel: view.pixel(place_mm).unwrap() }
            };
            corners.map(sighting).to_vec()
        });
        (view, groups.collect())
    }

    #[test]
    fn a_view_comes_back_without_its_focal_length_and_wrong_signs_are_left_out() {
        let (view, mut groups) = sightings();
        for sighting in &mut groups[7] {
            sighting.pixel.x_px += 3.0;
        }
        let found = fit_view(&groups, [4000, 3000], None).unwrap();
        assert!(!found.kept[7] && found.kept.iter().filter(|kept| **kept).count() == 39);
        assert!(found.rms_px < 0.01, "{}", found.rms_px);
        for place in [(0.0, 0.0), (120.0, -120.0), (-60.0, 100.0)] {
            let place = FieldPoint::new(place.0, place.1);
            let back = found.seen.place(view.pixel(place).unwrap()).unwrap();
            let off = (back.x_mm - place.x_mm).hypot(back.y_mm - place.y_mm);
            assert!(off < 4e-3, "{place:?} {off}");
        }
        let known = fit_view(&groups[..6], [4000, 3000], Some(view.lens)).unwrap();
        assert!(known.rms_px < 1e-6, "{}", known.rms_px);
    }

    #[test]
    fn three_places_give_no_view() {
        let (_, groups) = sightings();
        assert!(fit_view(&[groups[0][..3].to_vec()], [4000, 3000], None).is_none());
    }
}
