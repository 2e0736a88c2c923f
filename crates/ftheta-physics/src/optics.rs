//! Two-mirror optics: where the beam lands for given mirror angles, and the inverse.
//!
//! Frame: the beam meets mirror 1, then mirror 2 at distance e, then the lens or the work plane.
//! With optical angles t = 2·(mechanical angle) the direction after both mirrors is
//! `(sin t1, cos t1 · sin t2, -cos t1 · cos t2)`. Which coordinate mirror 1 moves is the
//! machine's choice; the formulas below are written for x.

use ftheta_model::machine::{Axis, Lens, Optics};
use ftheta_model::space::{FieldPoint, MirrorAngles};

/// Beyond this angle to the optical axis no lens polynomial is trusted, optical rad.
const MAX_THETA_RAD: f64 = 1.2;

/// Where the beam lands.
///
/// * `angles`: mechanical, rad
/// * returns the place in the work plane, mm
///
/// # Accuracy
/// Closed form, 1e-13 mm against a ray trace of the ideal head.
///
/// Source: thesis 3.1 (F-theta) and chapter 2 (post-objective), rebuilt in `design/optics.md` A.
pub fn field_from_angles(optics: &Optics, angles: MirrorAngles) -> FieldPoint {
    let (first, second) = match optics.first_mirror {
        Axis::X => (angles.x_rad, angles.y_rad),
        Axis::Y => (angles.y_rad, angles.x_rad),
    };
    let (u, v) = match &optics.lens {
        Lens::FTheta { coefficients_mm } => ftheta_forward(coefficients_mm, first, second),
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            post_forward(*mirror_distance_mm, working_distance_mm - optics.plane_mm, first, second)
        }
    };
    match optics.first_mirror {
        Axis::X => FieldPoint::new(u, v),
        Axis::Y => FieldPoint::new(v, u),
    }
}

/// Mirror angles that put the beam on a place of the field, mechanical rad.
///
/// Returns `None` where the optics cannot reach.
///
/// # Accuracy
/// Round trip to 1e-14 rad.
pub fn angles_from_field(optics: &Optics, place: FieldPoint) -> Option<MirrorAngles> {
    let (u, v) = match optics.first_mirror {
        Axis::X => (place.x_mm, place.y_mm),
        Axis::Y => (place.y_mm, place.x_mm),
    };
    let (first, second) = match &optics.lens {
        Lens::FTheta { coefficients_mm } => ftheta_inverse(coefficients_mm, u, v)?,
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            post_inverse(*mirror_distance_mm, working_distance_mm - optics.plane_mm, u, v)
        }
    };
    Some(match optics.first_mirror {
        Axis::X => MirrorAngles::new(first, second),
        Axis::Y => MirrorAngles::new(second, first),
    })
}

/// Millimetres in the field per mechanical radian in its centre, one value for both axes:
/// the smaller one where they differ.
pub fn scale_mm_per_rad(optics: &Optics) -> f64 {
    match &optics.lens {
        Lens::FTheta { coefficients_mm } => 2.0 * coefficients_mm[0],
        Lens::PostObjective { working_distance_mm, .. } => {
            2.0 * (working_distance_mm - optics.plane_mm)
        }
    }
}

/// Image height of the lens polynomial and its slope at `theta_rad`: (mm, mm/rad).
pub(crate) fn height(coefficients_mm: &[f64], theta_rad: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for &coefficient in coefficients_mm.iter().rev() {
        // Horner for p(T) = c1 + c2 T + ..., so that h = T · p.
        slope = slope * theta_rad + value;
        value = value * theta_rad + coefficient;
    }
    (value * theta_rad, value + slope * theta_rad)
}

fn ftheta_forward(coefficients_mm: &[f64], first: f64, second: f64) -> (f64, f64) {
    let ((sin1, cos1), (sin2, cos2)) = ((2.0 * first).sin_cos(), (2.0 * second).sin_cos());
    let (dx, dy, dz) = (sin1, cos1 * sin2, cos1 * cos2);
    let sin_theta = dx.hypot(dy);
    if sin_theta == 0.0 {
        return (0.0, 0.0);
    }
    let (h, _) = height(coefficients_mm, sin_theta.atan2(dz));
    let scale = h / sin_theta;
    (scale * dx, scale * dy)
}

fn ftheta_inverse(coefficients_mm: &[f64], u: f64, v: f64) -> Option<(f64, f64)> {
    let target_mm = u.hypot(v);
    if target_mm == 0.0 {
        return Some((0.0, 0.0));
    }
    let mut theta = target_mm / coefficients_mm[0];
    let mut converged = false;
    for _ in 0..30 {
        let (h, slope) = height(coefficients_mm, theta);
        let step = (h - target_mm) / slope;
        theta -= step;
        // The negated form also leaves on NaN.
        if !(0.0 < theta && theta < MAX_THETA_RAD && slope > 0.0) {
            return None;
        }
        // Newton doubles its digits, so the step after one below 1e-9 is below rounding.
        if step.abs() <= 1e-9 * theta {
            converged = true;
            break;
        }
    }
    if !converged {
        return None;
    }
    let (h, slope) = height(coefficients_mm, theta);
    theta -= (h - target_mm) / slope;
    let (sin_theta, cos_theta) = theta.sin_cos();
    let (dx, dy) = (sin_theta * u / target_mm, sin_theta * v / target_mm);
    Some((0.5 * dx.asin(), 0.5 * dy.atan2(cos_theta)))
}

fn post_forward(e_mm: f64, d_mm: f64, first: f64, second: f64) -> (f64, f64) {
    let (sin2, cos2) = (2.0 * second).sin_cos();
    ((e_mm + d_mm / cos2) * (2.0 * first).tan(), d_mm * sin2 / cos2)
}

fn post_inverse(e_mm: f64, d_mm: f64, u: f64, v: f64) -> (f64, f64) {
    (0.5 * (u / (e_mm + d_mm.hypot(v))).atan(), 0.5 * (v / d_mm).atan())
}

/// Length of the beam from mirror 1 to the work plane, less that to the centre, mm.
///
/// Only a post-objective head has to make up for it by moving its focus; zero for a lens.
pub fn path_difference_mm(optics: &Optics, place: FieldPoint) -> f64 {
    let (u, v) = match optics.first_mirror {
        Axis::X => (place.x_mm, place.y_mm),
        Axis::Y => (place.y_mm, place.x_mm),
    };
    match &optics.lens {
        Lens::FTheta { .. } => 0.0,
        Lens::PostObjective { mirror_distance_mm: e, working_distance_mm } => {
            let d = working_distance_mm - optics.plane_mm;
            (e + d.hypot(v)).hypot(u) - (e + d)
        }
    }
}
