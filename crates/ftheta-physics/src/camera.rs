//! How a camera sees a plane: a projective map, and a lens that bends what it draws.
//!
//! Plane (mm) → homography → undistorted ray (x/z, y/z) → distortion → focal length and centre →
//! pixel. Distortion is the Brown-Conrady model with the coefficients that OpenCV prints, so that
//! a calibration from there can be used as it is. A flatbed scanner is the same with a homography
//! that is affine and no distortion.

use ftheta_model::picture::PixelPoint;
use ftheta_model::space::FieldPoint;
use nalgebra::{Matrix3, Vector3};

/// Iterations that undo distortion at most, and the step at which they end.
const N_UNDISTORT: usize = 30;
const UNDISTORT_END: f64 = 1e-13;

/// What is inside the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraLens {
    /// Focal length, px along x and y.
    pub focal_px: [f64; 2],
    /// Where the optical axis meets the picture.
    pub centre_px: PixelPoint,
    /// Radial distortion k1, k2, k3.
    pub radial: [f64; 3],
    /// Tangential distortion p1, p2.
    pub tangential: [f64; 2],
}

/// A plane as a camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub lens: CameraLens,
    /// From (x mm, y mm, 1) on the plane to a ray.
    pub homography: Matrix3<f64>,
}

impl CameraLens {
    /// A lens that does not distort.
    ///
    /// * `focal_px`: any length above 0 will do where it is not known; the longer side of the
    ///   picture is a good one
    pub fn plain(focal_px: f64, centre_px: PixelPoint) -> Self {
        Self { focal_px: [focal_px; 2], centre_px, radial: [0.0; 3], tangential: [0.0; 2] }
    }

    /// The pixel at which an undistorted ray is seen.
    pub fn pixel(&self, ray: [f64; 2]) -> PixelPoint {
        let [x, y] = self.distorted(ray);
        let [fx, fy] = self.focal_px;
        PixelPoint::new(self.centre_px.x_px + fx * x, self.centre_px.y_px + fy * y)
    }

    /// The undistorted ray of a pixel; `None` where the lens model folds over.
    pub fn ray(&self, pixel: PixelPoint) -> Option<[f64; 2]> {
        let seen = [
            (pixel.x_px - self.centre_px.x_px) / self.focal_px[0],
            (pixel.y_px - self.centre_px.y_px) / self.focal_px[1],
        ];
        let mut ray = seen;
        for _ in 0..N_UNDISTORT {
            let there = self.distorted(ray);
            // Newton with the derivative of the radial part alone, which is nearly all of it.
            let r2 = ray[0] * ray[0] + ray[1] * ray[1];
            let [k1, k2, k3] = self.radial;
            let gain = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            if gain < 0.2 {
                return None;
            }
            let step = [(seen[0] - there[0]) / gain, (seen[1] - there[1]) / gain];
            ray = [ray[0] + step[0], ray[1] + step[1]];
            if step[0].abs().max(step[1].abs()) < UNDISTORT_END {
                return Some(ray);
            }
        }
        None
    }

    fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, k3] = self.radial;
        let [p1, p2] = self.tangential;
        let r2 = x * x + y * y;
        let gain = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * gain + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * gain + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }
}

impl View {
    /// The pixel at which a place on the plane is seen; `None` behind the camera.
    pub fn pixel(&self, place: FieldPoint) -> Option<PixelPoint> {
        let ray = self.homography * Vector3::new(place.x_mm, place.y_mm, 1.0);
        (ray.z > 0.0).then(|| self.lens.pixel([ray.x / ray.z, ray.y / ray.z]))
    }

    /// The way back, prepared once.
    ///
    /// `None` if the plane is seen edge on.
    pub fn inverse(&self) -> Option<Seen> {
        Some(Seen { lens: self.lens, plane_from_ray: self.homography.try_inverse()? })
    }
}

/// Places on the plane from pixels.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    lens: CameraLens,
    plane_from_ray: Matrix3<f64>,
}

impl Seen {
    /// The place on the plane that a pixel shows; `None` beyond the horizon or where the lens
    /// model folds over.
    pub fn place(&self, pixel: PixelPoint) -> Option<FieldPoint> {
        let [x, y] = self.lens.ray(pixel)?;
        let place = self.plane_from_ray * Vector3::new(x, y, 1.0);
        (place.z > 0.0).then(|| FieldPoint::new(place.x / place.z, place.y / place.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The camera of `reference/ref_crosses.png`, and pixels that OpenCV projects to.
    fn reference() -> View {
        let lens = CameraLens {
            radial: [-0.1, 0.02, 0.0],
            tangential: [0.0005, -0.0003],
            ..CameraLens::plain(1760.0, PixelPoint::new(806.5, 594.5))
        };
        let turn = [0.141_046_591_946_082_5, 0.084_681_860_461_127, 0.040_920_171_891_789_78];
        let turn = nalgebra::Rotation3::from_scaled_axis(Vector3::from(turn));
        let r = turn.matrix();
        // The reference draws y downwards.
        let homography = Matrix3::from_columns(&[
            r.column(0).into(),
            -r.column(1),
            Vector3::new(0.0, 0.0, 195.555_555_555_555_57),
        ]);
        View { lens, homography }
    }

    #[test]
    fn pixels_are_those_of_opencv() {
        let view = reference();
        let known = [
            (-50.0, -50.0, 372.566_985_866, 991.503_403_234),
            (0.0, 0.0, 806.5, 594.5),
            (50.0, 50.0, 1_291.127_409_247, 151.224_022_786),
            (50.0, -50.0, 1_226.992_392_613, 1_048.043_568_438),
        ];
        let back = view.inverse().unwrap();
        for (x, y, x_px, y_px) in known {
            let pixel = view.pixel(FieldPoint::new(x, y)).unwrap();
            assert!(pixel.distance(PixelPoint::new(x_px, y_px)) < 1e-6, "{x} {y}: {pixel:?}");
            let place = back.place(pixel).unwrap();
            assert!((place.x_mm - x).hypot(place.y_mm - y) < 1e-9, "{place:?}");
        }
    }

    #[test]
    fn folded_lenses_and_horizons_show_nothing() {
        let mut view = reference();
        view.lens.radial = [-30.0, 0.0, 0.0];
        let back = view.inverse().unwrap();
        assert!(back.place(PixelPoint::new(0.0, 0.0)).is_none());
        view.homography.set_column(2, &Vector3::zeros());
        assert!(view.inverse().is_none());
    }
}
