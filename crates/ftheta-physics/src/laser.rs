//! The focused spot of a laser beam.

/// 1/e² diameter of the focus, mm.
///
/// * `wavelength_nm`, `beam_quality_m2` >= 1
/// * `focal_length_mm` of the focusing lens
/// * `beam_diameter_mm`: 1/e², collimated, in front of the lens
///
/// # Limits
/// No truncation at the mirror; a mirror of twice the beam's diameter cuts 0.03 %.
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

/// Distance from the focus at which the spot's area has doubled, mm.
pub fn rayleigh_range_mm(wavelength_nm: f64, beam_quality_m2: f64, spot_diameter_mm: f64) -> f64 {
    let radius_mm = 0.5 * spot_diameter_mm;
    std::f64::consts::PI * radius_mm * radius_mm / (beam_quality_m2 * wavelength_nm * 1e-6)
}
