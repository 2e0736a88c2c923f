//! The camera: where it stands, and a lens that is not quite what its model says.

use super::print::uniform;
use ftheta_model::picture::PixelPoint;
use ftheta_model::space::FieldPoint;
use ftheta_physics::camera::{CameraLens, Seen, View};
use kurbo::{Point, Rect};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Focal length in sides of the sensor, and the sensor's longest side at least, px: as of a phone.
const FOCAL_SIDES: f64 = 0.8;
const SIDE_MIN_PX: f64 = 4000.0;
/// Greatest radial distortion k1, and tilt if none is asked for, degrees.
const RADIAL: f64 = 0.1;
const TILT_DEG: f64 = 4.0;
/// Steps of half a percent by which a camera goes back at most until it shows all.
const N_STEPS_BACK: usize = 800;
/// By how much the lens differs from its model at the picture's corner, px.
const BEYOND_PX: f64 = 0.05;

/// How a camera looks at the plate; what is `None` comes from the seed or the plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraOptions {
    /// Side of a pixel on the plate, in the picture's middle, mm.
    pub pixel_mm: Option<f64>,
    /// Pixels of a 4:3 picture; `None` with `pixel_mm` takes what shows the whole plate, alone
    /// 12 megapixels.
    pub megapixels: Option<f64>,
    /// Angle between the axis and the plate's normal, degrees.
    pub tilt_deg: Option<f64>,
    /// Turn around the axis, degrees, anticlockwise in the picture.
    pub turn_deg: f64,
    /// Whether the picture is mirrored, as through a mirror.
    pub mirrored: bool,
    /// Strength of the lens' distortion over that of a phone; 0 is a perfect lens.
    pub distortion: f64,
    /// Seed of the lens and of where the camera stands.
    pub seed: u64,
}

/// A camera over a plate.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// What a model of it would be.
    pub view: View,
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    seen: Seen,
    /// What the model does not contain: amplitude at the corner, px.
    beyond_px: f64,
}

impl Camera {
    /// A camera that shows `plate`, mm; `None` if that cannot be, as from edge on.
    pub fn new(options: &CameraOptions, plate: Rect) -> Option<Self> {
        let pixel_mm = options.pixel_mm.unwrap_or(0.02);
        let fits = options.pixel_mm.is_none();
        if fits || options.megapixels.is_some() {
            let height = (options.megapixels.unwrap_or(12.0) * 1e6 * 0.75).sqrt();
            let size =
                [(height / 0.75).round(), height.round()].map(|side| side.max(16.0) as usize);
            let mut pixel_mm =
                if fits { plate.width().max(plate.height()) / size[0] as f64 } else { pixel_mm };
            let mut camera = Self::at(options, plate.center(), pixel_mm, size)?;
            for _ in 0..N_STEPS_BACK {
                if !fits || camera.shows(plate) {
                    break;
                }
                pixel_mm *= 1.005;
                camera = Self::at(options, plate.center(), pixel_mm, size)?;
            }
            return Some(camera);
        }
        // As large as what it shows, in a sensor that is larger.
        let size = [plate.width(), plate.height()].map(|mm| (mm / pixel_mm) as usize + 2);
        let wide = [size[0].max(size[1]) * 2; 2];
        let camera = Self::at(options, plate.center(), pixel_mm, wide)?;
        let middle = camera.pixel(plate.center())?;
        let mut half = [0.0f64; 2];
        for corner in corners(plate) {
            let pixel = camera.pixel(corner)?;
            half[0] = half[0].max((pixel.x_px - middle.x_px).abs());
            half[1] = half[1].max((pixel.y_px - middle.y_px).abs());
        }
        Self::at(options, plate.center(), pixel_mm, half.map(|half| 2 * half.ceil() as usize + 1))
    }

    /// A camera over `middle` with a picture of this size.
    fn at(
        options: &CameraOptions,
        middle: Point,
        pixel_mm: f64,
        [width, height]: [usize; 2],
    ) -> Option<Self> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(options.seed ^ 0x6361_6d65_7261);
        let mut within = |half: f64| half * (2.0 * uniform(&mut random) - 1.0);
        let drawn_tilt_deg = TILT_DEG * (0.65 + within(0.35));
        let direction_rad = within(std::f64::consts::PI);
        let strength = options.distortion;
        let k1 = strength * within(RADIAL);
        let lens = CameraLens {
            radial: [k1, -0.2 * k1 + strength * within(0.02), strength * within(0.005)],
            tangential: [strength * within(5e-4), strength * within(5e-4)],
            focal_px: [FOCAL_SIDES * (width.max(height) as f64).max(SIDE_MIN_PX); 2],
            centre_px: PixelPoint::new(
                0.5 * (width as f64 - 1.0) + strength * within(20.0),
                0.5 * (height as f64 - 1.0) + strength * within(20.0),
            ),
        };
        let tilt_rad = options.tilt_deg.unwrap_or(drawn_tilt_deg).to_radians();
        let tilt = Vector3::new(direction_rad.cos(), direction_rad.sin(), 0.0) * tilt_rad;
        // The picture's y goes down, so that anticlockwise is negative.
        let turn = Vector3::new(0.0, 0.0, -options.turn_deg.to_radians());
        let r = Rotation3::new(tilt).matrix() * Rotation3::new(turn).matrix();
        let flip = if options.mirrored { -1.0 } else { 1.0 };
        let distance_mm = lens.focal_px[0] * pixel_mm;
        let (x, y) = (flip * r.column(0), -r.column(1));
        let home = Vector3::new(0.0, 0.0, distance_mm) - x * middle.x - y * middle.y;
        let view = View { lens, homography: Matrix3::from_columns(&[x, y, home]) };
        let seen = view.inverse()?;
        Some(Self { view, width, height, seen, beyond_px: strength * BEYOND_PX })
    }

    /// The pixel at which a place is seen; `None` behind the camera.
    pub fn pixel(&self, place: Point) -> Option<PixelPoint> {
        let modelled = self.view.pixel(place.into())?;
        let mut pixel = modelled;
        for _ in 0..3 {
            let [x_px, y_px] = self.beyond(pixel);
            pixel = PixelPoint::new(modelled.x_px + x_px, modelled.y_px + y_px);
        }
        Some(pixel)
    }

    /// The place that a pixel shows; `None` beyond the horizon.
    pub fn place(&self, pixel: PixelPoint) -> Option<Point> {
        let [x_px, y_px] = self.beyond(pixel);
        let modelled = PixelPoint::new(pixel.x_px - x_px, pixel.y_px - y_px);
        self.seen.place(modelled).map(|FieldPoint { x_mm, y_mm }| Point::new(x_mm, y_mm))
    }

    /// What the lens does that no coefficient of the model says: an eighth order and a prism.
    fn beyond(&self, pixel: PixelPoint) -> [f64; 2] {
        let radius_px = 0.5 * (self.width as f64).hypot(self.height as f64);
        let x = (pixel.x_px - 0.5 * self.width as f64) / radius_px;
        let y = (pixel.y_px - 0.5 * self.height as f64) / radius_px;
        let r2 = x * x + y * y;
        let order = r2 * r2 * r2;
        [self.beyond_px * (x * order + 0.5 * r2), self.beyond_px * (y * order - 0.3 * r2)]
    }

    fn shows(&self, plate: Rect) -> bool {
        let (width, height) = (self.width as f64, self.height as f64);
        corners(plate).into_iter().filter_map(|corner| self.pixel(corner)).all(|pixel| {
            (0.01 * width..0.99 * width).contains(&pixel.x_px)
                && (0.01 * height..0.99 * height).contains(&pixel.y_px)
        })
    }
}

/// Corners of a rectangle, and the middles of its sides.
fn corners(rect: Rect) -> [Point; 8] {
    let (middle, half) = (rect.center(), rect.size() * 0.5);
    let steps = [(-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0)];
    steps.map(|(i, j)| {
        Point::new(middle.x + f64::from(i) * half.width, middle.y + f64::from(j) * half.height)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATE: Rect = Rect { x0: -20.0, y0: 10.0, x1: 60.0, y1: 70.0 };

    fn options() -> CameraOptions {
        CameraOptions {
            pixel_mm: None,
            megapixels: Some(2.0),
            tilt_deg: None,
            turn_deg: 0.0,
            mirrored: false,
            distortion: 1.0,
            seed: 3,
        }
    }

    #[test]
    fn all_of_the_plate_is_seen_and_pixels_lead_back() {
        for (tilt_deg, megapixels) in [(None, 2.0), (Some(0.0), 0.3), (Some(50.0), 1.0)] {
            let asked = CameraOptions { tilt_deg, megapixels: Some(megapixels), ..options() };
            let camera = Camera::new(&asked, PLATE).unwrap();
            let n_pixels = (camera.width * camera.height) as f64;
            assert!((n_pixels * 1e-6 / megapixels - 1.0).abs() < 0.01);
            for corner in corners(PLATE) {
                let pixel = camera.pixel(corner).unwrap();
                assert!(pixel.x_px > 0.0 && pixel.x_px < camera.width as f64, "{pixel:?}");
                assert!(pixel.y_px > 0.0 && pixel.y_px < camera.height as f64, "{pixel:?}");
                assert!(camera.place(pixel).unwrap().distance(corner) < 1e-6);
                let modelled = camera.view.pixel(corner.into()).unwrap();
                assert!((1e-4..0.2).contains(&pixel.distance(modelled)));
            }
        }
    }

    /// Where +x and +y of the plate go in the picture.
    #[test]
    fn turns_and_mirrors_are_as_asked() {
        for (turn_deg, mirrored, [right, up]) in [
            (0.0, false, [(1.0, 0.0), (0.0, -1.0)]),
            (90.0, false, [(0.0, -1.0), (-1.0, 0.0)]),
            (0.0, true, [(-1.0, 0.0), (0.0, -1.0)]),
        ] {
            let pixel_mm = Some(0.05);
            let plain = CameraOptions { tilt_deg: Some(0.0), distortion: 0.0, ..options() };
            let asked = CameraOptions { turn_deg, mirrored, pixel_mm, megapixels: None, ..plain };
            let camera = Camera::new(&asked, PLATE).unwrap();
            let at =
                |x: f64, y: f64| camera.pixel(PLATE.center() + kurbo::Vec2::new(x, y)).unwrap();
            let home = at(0.0, 0.0);
            for (pixel, (x, y)) in [(at(1.0, 0.0), right), (at(0.0, 1.0), up)] {
                let expected = PixelPoint::new(home.x_px + 20.0 * x, home.y_px + 20.0 * y);
                assert!(pixel.distance(expected) < 1e-9, "{turn_deg} {mirrored}: {pixel:?}");
            }
        }
    }
}
