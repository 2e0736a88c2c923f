//! The focus of a laser beam: spot, Rayleigh range, truncation; and the lens that keeps it in the
//! work plane of a head that focuses before its mirrors.
//!
//! Source: thesis 3.1.1 and chapter 2, rebuilt in `design/optics.md` A.2 and A.4b.

use crate::optics::path_difference_mm;
use ftheta_model::machine::{Axis, Focus, Lens, Optics};
use ftheta_model::space::FieldPoint;
use kurbo::Vec2;

/// 1/e² diameter of the focus, mm.
///
/// * `wavelength_nm`, `beam_quality_m2` >= 1
/// * `focal_length_mm` of the focusing lens
/// * `beam_diameter_mm`: 1/e², collimated, in front of the lens
///
/// # Limits
/// No truncation at the mirror ([`truncated_share`]), no shift of a waist far from the lens.
///
/// Source: w0 = M²·λ·f / (π·w), thesis 3.1.1, in diameters.
pub fn spot_diameter_mm(
    wavelength_nm: f64,
    beam_quality_m2: f64,
    focal_length_mm: f64,
    beam_diameter_mm: f64,
) -> f64 {
    4.0 * beam_quality_m2 * wavelength_nm * 1e-6 * focal_length_mm
        / (std::f64::consts::PI * beam_diameter_mm)
}

/// Distance from the focus at which the spot's area has doubled, mm: z_R = π·w0² / (M²·λ).
pub fn rayleigh_range_mm(wavelength_nm: f64, beam_quality_m2: f64, spot_diameter_mm: f64) -> f64 {
    let radius_mm = 0.5 * spot_diameter_mm;
    std::f64::consts::PI * radius_mm * radius_mm / (beam_quality_m2 * wavelength_nm * 1e-6)
}

/// Length around the focus in which the spot's diameter grows by no more than √2, mm: 2·z_R.
pub fn depth_of_focus_mm(rayleigh_range_mm: f64) -> f64 {
    2.0 * rayleigh_range_mm
}

/// 1/e² diameter of the beam at a distance from its focus, mm, either sign.
///
/// * `spot_diameter_mm` of the focus itself
pub fn defocused_diameter_mm(
    spot_diameter_mm: f64,
    rayleigh_range_mm: f64,
    defocus_mm: f64,
) -> f64 {
    spot_diameter_mm * 1.0_f64.hypot(defocus_mm / rayleigh_range_mm)
}

/// Part of a Gaussian beam's power that a round aperture cuts off: exp(-2·(D/d)²), 0.03 % at twice
/// the beam's 1/e² diameter, 1.1 % at one and a half times, 13.5 % at its diameter.
pub fn truncated_share(beam_diameter_mm: f64, aperture_mm: f64) -> f64 {
    (-2.0 * (aperture_mm / beam_diameter_mm).powi(2)).exp()
}

/// Distance from the centre at which a fixed focus is first off by `range_mm`, mm; `None` where it
/// is nowhere in the field, or behind an F-theta lens.
///
/// Along the second mirror's coordinate, where the way grows fastest, as far as the field goes;
/// then along the field's edge. Exact.
pub fn sharp_radius_mm(optics: &Optics, range_mm: f64) -> Option<f64> {
    let Lens::PostObjective { mirror_distance_mm: e, working_distance_mm } = optics.lens else {
        return None;
    };
    let d = working_distance_mm - optics.plane_mm;
    let half_mm = 0.5 * optics.field_mm;
    let straight_mm = (range_mm * (2.0 * d + range_mm)).sqrt();
    if straight_mm <= half_mm {
        return Some(straight_mm);
    }
    let (arm_mm, path_mm) = (e + d.hypot(half_mm), e + d + range_mm);
    let along_mm = (path_mm * path_mm - arm_mm * arm_mm).max(0.0).sqrt();
    (along_mm <= half_mm).then(|| along_mm.hypot(half_mm))
}

/// Focus shift at which the lens stands in the middle of its travel, mm: with a balanced lens half
/// of what the corners of the nominal work plane need.
pub fn middle_shift_mm(optics: &Optics, focus: &Focus) -> f64 {
    let Lens::PostObjective { mirror_distance_mm: e, working_distance_mm: d } = optics.lens else {
        return 0.0;
    };
    let half_mm = 0.5 * optics.field_mm;
    let corner_mm = || (e + d.hypot(half_mm)).hypot(half_mm) - (e + d);
    if focus.balanced { 0.5 * corner_mm() } else { 0.0 }
}

/// Travel of the lens, from the middle of its range, that moves the focus away from the head by
/// `shift_mm` from the centre of the nominal work plane, mm.
pub fn travel_of_shift_mm(optics: &Optics, focus: &Focus, shift_mm: f64) -> f64 {
    (shift_mm - middle_shift_mm(optics, focus)) / focus.magnification
}

/// Travel of the lens, from the middle of its range, that puts the focus on a place of the work
/// plane, mm; `None` for a machine without such a lens.
///
/// # Accuracy
/// Closed form, 1e-12 mm against a ray trace of the ideal head.
pub fn lens_travel_mm(optics: &Optics, place: FieldPoint) -> Option<f64> {
    let focus = optics.focus.as_ref()?;
    let shift_mm = path_difference_mm(optics, place) - optics.plane_mm;
    Some(travel_of_shift_mm(optics, focus, shift_mm))
}

/// Greatest travel of the lens that a plan may ask for, mm: the beam may be off its mark by the
/// tolerance, and so off the field.
pub fn travel_max_mm(focus: &Focus, tolerance_mm: f64) -> f64 {
    focus.travel_mm + tolerance_mm / focus.magnification.abs()
}

/// How [`lens_travel_mm`] changes with the place, mm per mm in x and y.
pub fn lens_gradient(optics: &Optics, place: FieldPoint) -> Option<Vec2> {
    let focus = optics.focus.as_ref()?;
    let Lens::PostObjective { mirror_distance_mm: e, working_distance_mm } = optics.lens else {
        return Some(Vec2::ZERO);
    };
    let d = working_distance_mm - optics.plane_mm;
    let (u, v) = match optics.first_mirror {
        Axis::X => (place.x_mm, place.y_mm),
        Axis::Y => (place.y_mm, place.x_mm),
    };
    // L = √((e + r)² + u²) with r = √(d² + v²).
    let r = d.hypot(v);
    let path_mm = (e + r).hypot(u);
    let (by_u, by_v) = (u / path_mm, (e + r) / path_mm * v / r);
    let gradient = match optics.first_mirror {
        Axis::X => Vec2::new(by_u, by_v),
        Axis::Y => Vec2::new(by_v, by_u),
    };
    Some(gradient / focus.magnification)
}

/// Greatest travel that the field needs, mm, either side of the middle.
pub fn field_travel_mm(optics: &Optics, focus: &Focus) -> f64 {
    let half_mm = 0.5 * optics.field_mm;
    let corner_mm = path_difference_mm(optics, FieldPoint::new(half_mm, half_mm));
    [0.0, corner_mm]
        .into_iter()
        .map(|shift_mm| travel_of_shift_mm(optics, focus, shift_mm - optics.plane_mm).abs())
        .fold(0.0, f64::max)
}
