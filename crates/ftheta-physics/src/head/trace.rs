//! The ray through a head.

use super::{Frame, Head, HeadLens, Plane, Response};
use crate::optics::height;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use nalgebra::{Matrix2, Matrix3, Rotation3, Unit, Vector2, Vector3};

type Vector = Vector3<f64>;

/// A head prepared for many rays: what does not depend on the commands is computed once.
#[derive(Clone, Debug)]
pub struct Tracer {
    response: [Response; 2],
    laser: Ray,
    mirrors: [Mirror; 2],
    lens: Option<Lens>,
    working_distance_mm: f64,
    plane: Plane,
    frame: Frame,
    sin_cos: (f64, f64),
}

/// Point, direction (a unit vector), and length travelled.
#[derive(Clone, Copy, Debug)]
struct Ray {
    point: Vector,
    direction: Vector,
    length_mm: f64,
}

/// A mirror's normal by its angle a is `fixed + across·cos a + turned·sin a`.
#[derive(Clone, Copy, Debug)]
struct Mirror {
    centre: Vector,
    fixed: Vector,
    across: Vector,
    turned: Vector,
    surface_mm: f64,
}

#[derive(Clone, Debug)]
struct Lens {
    data: HeadLens,
    rotation: Matrix3<f64>,
}

impl Tracer {
    /// Prepares a head.
    pub fn new(head: &Head) -> Self {
        let e = head.mirror_distance_mm;
        let root = std::f64::consts::SQRT_2;
        let moved = if head.aligned { root } else { 0.0 };
        let [offset_y, offset_z] = head.beam_offset_mm;
        let point = Vector::new(
            0.0,
            -e + offset_y + moved * head.surface_mm[0],
            offset_z - moved * head.surface_mm[1],
        );
        let [tilt_y, tilt_z] = head.beam_tilt_rad;
        let direction = Vector::new(1.0, tilt_y, tilt_z).normalize();
        let [about_x, about_y] = head.axis1_tilt_rad;
        let first = Mirror::new(
            Vector::new(0.0, -e, 0.0),
            (-Vector::z(), Vector::new(-1.0, 1.0, 0.0) / root),
            Rotation3::from_scaled_axis(Vector::new(about_x, about_y, 0.0)),
            head.cone_rad[0],
            head.surface_mm[0],
        );
        let [about_y, about_z] = head.axis2_tilt_rad;
        let second = Mirror::new(
            Vector::zeros(),
            (Vector::x(), Vector::new(0.0, -1.0, -1.0) / root),
            Rotation3::from_scaled_axis(Vector::new(0.0, about_y, about_z)),
            head.cone_rad[1],
            head.surface_mm[1],
        );
        Self {
            response: head.response,
            laser: Ray { point, direction, length_mm: 0.0 },
            mirrors: [first, second],
            lens: head.lens.clone().map(Lens::new),
            working_distance_mm: head.working_distance_mm,
            plane: head.plane,
            frame: head.frame,
            sin_cos: head.frame.rotation_rad.sin_cos(),
        }
    }

    /// Where the beam lands, in the measuring frame, mm.
    ///
    /// * `commands`: mechanical, rad; x moves mirror 1
    /// * returns infinity or NaN where no beam reaches the plane
    ///
    /// # Accuracy
    /// 1e-12 mm against the reference's trace.
    #[inline]
    pub fn place(&self, commands: MirrorAngles) -> FieldPoint {
        self.place_and_length(commands).0
    }

    /// The place, and the length of the beam from beside mirror 1, mm: to the work plane for a head
    /// without lens, to mirror 2 for one with it.
    #[inline]
    pub fn place_and_length(&self, commands: MirrorAngles) -> (FieldPoint, f64) {
        let [first, second] = &self.mirrors;
        let [a1, a2] = [
            self.response[0].angle_rad(commands.x_rad),
            self.response[1].angle_rad(commands.y_rad),
        ];
        let ray = second.reflect(&first.reflect(&self.laser, a1), a2);
        let (place, length_mm) = match &self.lens {
            None => self.on_plane(&ray),
            Some(lens) => (self.stretched(lens, lens.image(&ray)), ray.length_mm),
        };
        let (sin, cos) = self.sin_cos;
        let [shift_x, shift_y] = self.frame.shift_mm;
        let place = FieldPoint::new(
            cos * place.x - sin * place.y + shift_x,
            sin * place.x + cos * place.y + shift_y,
        );
        (place, length_mm)
    }

    /// How the place moves with the commands, mm/rad: rows x and y, columns mirror 1 and 2.
    ///
    /// # Accuracy
    /// Central differences over 2e-4 rad: 1e-8 relative.
    pub fn jacobian(&self, commands: MirrorAngles) -> Matrix2<f64> {
        jacobian(commands, |angles| self.place(angles))
    }

    /// The commands that put the beam on a place of the measuring frame, by Newton from `start`.
    ///
    /// Returns `None` where the steps do not settle within 20.
    ///
    /// # Accuracy
    /// 1e-9 mm in the field.
    pub fn commands(&self, place: FieldPoint, start: MirrorAngles) -> Option<MirrorAngles> {
        solve(place, start, |angles| self.place(angles))
    }

    fn on_plane(&self, ray: &Ray) -> (Vector2<f64>, f64) {
        let Plane { height_mm, slope: [px, py] } = self.plane;
        let (p, r) = (ray.point, ray.direction);
        let distance = (-self.working_distance_mm - height_mm - px * p.x - py * p.y - p.z)
            / (r.z + px * r.x + py * r.y);
        let place = Vector2::new(p.x + distance * r.x, p.y + distance * r.y);
        (place, ray.length_mm + distance)
    }

    /// Image places on a plane at another height, where the rays are not parallel to the axis.
    fn stretched(&self, lens: &Lens, image: Vector2<f64>) -> Vector2<f64> {
        let Plane { height_mm, slope: [px, py] } = self.plane;
        let [sx, sy] = lens.data.stretch_per_mm;
        let mut place = image;
        // The height is that of the place itself; two rounds leave 1e-12 mm.
        for _ in 0..2 {
            let z = height_mm + px * place.x + py * place.y;
            place = Vector2::new(image.x * (1.0 + sx * z), image.y * (1.0 + sy * z));
        }
        place
    }
}

/// How a place moves with commands, mm/rad: rows x and y, columns mirror 1 and 2, by central
/// differences over 2e-4 rad.
fn jacobian(commands: MirrorAngles, forward: impl Fn(MirrorAngles) -> FieldPoint) -> Matrix2<f64> {
    const STEP_RAD: f64 = 1e-4;
    let MirrorAngles { x_rad, y_rad } = commands;
    let at = |dx: f64, dy: f64| {
        let place = forward(MirrorAngles::new(x_rad + dx, y_rad + dy));
        Vector2::new(place.x_mm, place.y_mm)
    };
    let columns = [at(STEP_RAD, 0.0) - at(-STEP_RAD, 0.0), at(0.0, STEP_RAD) - at(0.0, -STEP_RAD)];
    Matrix2::from_columns(&columns.map(|column| column / (2.0 * STEP_RAD)))
}

/// The commands that put a beam on a place, by Newton; `None` where 20 steps do not settle.
///
/// * `place`: mm, to be reached
/// * `forward`: where commands put the beam
pub fn solve(
    place: FieldPoint,
    start: MirrorAngles,
    forward: impl Fn(MirrorAngles) -> FieldPoint,
) -> Option<MirrorAngles> {
    // Well below any word of a controller, above the rounding of the trace.
    const SETTLED_RAD: f64 = 1e-13;
    let mut angles = start;
    for _ in 0..20 {
        let now = forward(angles);
        let missing = Vector2::new(place.x_mm - now.x_mm, place.y_mm - now.y_mm);
        let step = jacobian(angles, &forward).try_inverse()? * missing;
        angles = MirrorAngles::new(angles.x_rad + step.x, angles.y_rad + step.y);
        let size = step.amax();
        if !size.is_finite() || size > 1.0 {
            return None;
        }
        if size <= SETTLED_RAD {
            return Some(angles);
        }
    }
    // Rounding may keep the last digit in motion.
    let now = forward(angles);
    let missing_mm = (place.x_mm - now.x_mm).hypot(place.y_mm - now.y_mm);
    (missing_mm <= 1e-9).then_some(angles)
}

impl Mirror {
    fn new(
        centre: Vector,
        (axis, normal): (Vector, Vector),
        tilt: Rotation3<f64>,
        cone_rad: f64,
        surface_mm: f64,
    ) -> Self {
        let axis = Unit::new_normalize(tilt * axis);
        let normal = (tilt * normal + cone_rad * axis.into_inner()).normalize();
        let fixed = axis.into_inner() * axis.dot(&normal);
        Self { centre, fixed, across: normal - fixed, turned: axis.cross(&normal), surface_mm }
    }

    #[inline]
    fn reflect(&self, ray: &Ray, angle_rad: f64) -> Ray {
        let (sin, cos) = angle_rad.sin_cos();
        let normal = self.fixed + self.across * cos + self.turned * sin;
        let along = ray.direction.dot(&normal);
        let distance = ((self.centre - ray.point).dot(&normal) + self.surface_mm) / along;
        Ray {
            point: ray.point + distance * ray.direction,
            direction: ray.direction - 2.0 * along * normal,
            length_mm: ray.length_mm + distance,
        }
    }
}

impl Lens {
    fn new(data: HeadLens) -> Self {
        let [about_x, about_y] = data.tilt_rad;
        let rotation = Rotation3::from_axis_angle(&Vector::x_axis(), about_x)
            * Rotation3::from_axis_angle(&Vector::y_axis(), about_y);
        Self { data, rotation: rotation.into_inner() }
    }

    /// Where a ray's image is, in the lens' focal plane.
    #[inline]
    fn image(&self, ray: &Ray) -> Vector2<f64> {
        const R: f64 = HeadLens::RADIUS_MM;
        let v = self.rotation * ray.direction;
        let sin_theta = v.x.hypot(v.y);
        let (mut h, _) = height(&self.data.coefficients_mm, sin_theta.atan2(-v.z));
        if self.data.ripple_mm != 0.0 {
            h += self.data.ripple_mm * (2.2 * std::f64::consts::PI * h / R).sin();
        }
        // At the axis the polynomial is its first term.
        let scale = if sin_theta > 1e-12 { h / sin_theta } else { self.data.coefficients_mm[0] };
        let (mut x, mut y) = (scale * v.x, scale * v.y);
        let [p1, p2] = self.data.tangential;
        if p1 != 0.0 || p2 != 0.0 {
            let (u, v) = (x / R, y / R);
            let square = u * u + v * v;
            x += R * (p1 * (square + 2.0 * u * u) + 2.0 * p2 * u * v);
            y += R * (p2 * (square + 2.0 * v * v) + 2.0 * p1 * u * v);
        }
        if self.data.pupil_walk_mm != 0.0 {
            let walk = self.data.pupil_walk_mm / (R * R) * ray.point.x / 10.0;
            (x, y) = (x + walk * (x * x - 0.5 * y * y), y + walk * x * y);
        }
        let [shift_x, shift_y] = self.data.decentre_mm;
        Vector2::new(x + shift_x, y + shift_y)
    }
}
