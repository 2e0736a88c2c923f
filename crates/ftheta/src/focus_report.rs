//! What a machine's focus is worth over its field: figures and warnings.

use ftheta_model::machine::{Lens, Machine};
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::Warning;
use ftheta_physics::focus::{
    defocused_diameter_mm, depth_of_focus_mm, field_travel_mm, rayleigh_range_mm, sharp_radius_mm,
    truncated_share,
};
use ftheta_physics::optics::path_difference_mm;

/// Part of the beam that mirrors may cut off without a word.
const TRUNCATED_MAX: f64 = 0.01;

/// Figures by name, the unit last in it, and what is worth a warning.
#[derive(Clone, Debug, PartialEq)]
pub struct FocusReport {
    /// Spot, Rayleigh range, depth of focus; what the way to the field's corners differs by; the
    /// lens.
    pub rows: Vec<(&'static str, f64)>,
    /// What is not in focus, or cut off.
    pub warnings: Vec<Warning>,
}

/// Part by which the spot is larger where the focus is off by this, mm along the beam.
pub fn spot_growth(machine: &Machine, defocus_mm: f64) -> f64 {
    let laser = &machine.laser;
    let spot_mm = laser.spot_diameter_mm;
    let range_mm = rayleigh_range_mm(laser.wavelength_nm, laser.beam_quality_m2, spot_mm);
    defocused_diameter_mm(spot_mm, range_mm, defocus_mm) / spot_mm - 1.0
}

/// Spot and focus over the field of a machine.
pub fn report(machine: &Machine) -> FocusReport {
    let (laser, optics) = (&machine.laser, &machine.optics);
    let spot_mm = laser.spot_diameter_mm;
    let range_mm = rayleigh_range_mm(laser.wavelength_nm, laser.beam_quality_m2, spot_mm);
    let mut rows = vec![
        ("spot_diameter_um", spot_mm * 1e3),
        ("rayleigh_range_mm", range_mm),
        ("depth_of_focus_mm", depth_of_focus_mm(range_mm)),
    ];
    let mut warnings = Vec::new();
    if let Some(aperture_mm) = optics.aperture_mm {
        let share = truncated_share(laser.beam_diameter_mm, aperture_mm);
        rows.push(("truncated_share", share));
        if share > TRUNCATED_MAX {
            let message = format!(
                "the mirrors' {aperture_mm} mm cut off {:.1} % of a beam of {} mm: the spot is \
                 larger than that of the whole beam, and what is cut off heats the head",
                share * 100.0,
                laser.beam_diameter_mm
            );
            warnings.push(Warning::new("optics.aperture_mm", message));
        }
    }
    if matches!(optics.lens, Lens::PostObjective { .. }) {
        let half_mm = 0.5 * optics.field_mm;
        let corner_mm = path_difference_mm(optics, FieldPoint::new(half_mm, half_mm));
        rows.push(("corner_path_difference_mm", corner_mm));
        match &optics.focus {
            Some(focus) => {
                rows.push(("focus_travel_mm", field_travel_mm(optics, focus)));
                rows.push(("focus_travel_max_mm", focus.travel_mm));
            }
            None => {
                let corner_um = 1e3 * defocused_diameter_mm(spot_mm, range_mm, corner_mm);
                rows.push(("corner_spot_diameter_um", corner_um));
                if let Some(radius_mm) = sharp_radius_mm(optics, range_mm) {
                    rows.push(("sharp_radius_mm", radius_mm));
                    let message = format!(
                        "from {radius_mm:.1} mm off the centre the focus is off by more than the \
                         Rayleigh range of {range_mm:.3} mm, in the field's corners by \
                         {corner_mm:.3} mm with a spot of {corner_um:.0} µm: it takes \
                         [optics.focus] or a smaller field"
                    );
                    warnings.push(Warning::new("optics.field_mm", message));
                }
            }
        }
    }
    FocusReport { rows, warnings }
}
