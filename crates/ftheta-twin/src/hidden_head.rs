//! Heads as a workshop builds them: every mounting error drawn from a seed.
//!
//! The table of tolerances is that of `reference/head_model.py`, so the heads of an f = 420 mm lens
//! are the reference's own, seed by seed. The planner and the calibration never see this.

use crate::draw::Draw;
use ftheta_model::machine::{Lens, Optics};
use ftheta_physics::head::{Frame, Head, HeadLens, Plane, Response};
use nalgebra::{DMatrix, DVector};

/// Errors are even up to this many of their tolerances, either way.
const SPREAD: f64 = 1.7;
/// Focal length for which the tolerances of the lens' higher terms hold, mm.
const LENS_MM: f64 = 420.456;
/// The lens as it is has these terms; the data sheet's polynomial is followed to some 10 µm.
const LENS_ORDERS: [i32; 4] = [1, 3, 5, 7];
/// Lens angles over which it is followed, optical rad, and how many of them.
const LENS_RAD: [f64; 2] = [0.01, 0.50];
const N_LENS: usize = 400;
/// Distance of the mirrors in a head whose lens hides it, mm.
const MIRROR_DISTANCE_MM: f64 = 30.0;
/// Distance of mirror 2 to the work plane that goes unused behind a lens, mm.
const WORKING_DISTANCE_MM: f64 = 500.0;

/// The head of a seed, for a machine that should have these optics. Mirror 1 moves x in it,
/// whatever the machine's first mirror is.
pub fn hidden_head(optics: &Optics, seed: u64) -> Head {
    let mut draw = Draw::new(seed);
    let mut off = |tolerance: f64| SPREAD * tolerance * draw.within(1.0);
    // The order of the draws is the reference's.
    let scale = 1.0 + off(0.003);
    let higher_mm = [off(1.0), off(2.0)];
    let (coefficients_mm, e_mm, d_mm) = match &optics.lens {
        Lens::FTheta { coefficients_mm } => {
            let lens = true_lens(coefficients_mm, scale, higher_mm);
            (Some(lens), MIRROR_DISTANCE_MM, WORKING_DISTANCE_MM)
        }
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            (None, *mirror_distance_mm, working_distance_mm * scale)
        }
    };
    let mut pair = |first: f64, second: f64| [off(first), off(second)];
    let [mirror_distance, surface] = pair(2.0, 1.0);
    let [second_surface, beam_y] = pair(1.0, 0.3);
    let [beam_z, tilt_y] = pair(0.3, 1e-3);
    let [tilt_z, axis1_x] = pair(1e-3, 1e-3);
    let [axis1_y, axis2_y] = pair(1.5e-3, 1e-3);
    let [axis2_z, cone1] = pair(1e-3, 7e-4);
    let [cone2, zero_x] = pair(7e-4, 1e-3);
    let [zero_y, gain_x] = pair(1e-3, 0.003);
    let [gain_y, square_x] = pair(0.003, 2e-4);
    let [square_y, cube_x] = pair(2e-4, 3e-4);
    let [cube_y, fifth_x] = pair(3e-4, 1e-4);
    let [fifth_y, ripple_x] = pair(1e-4, 2e-5);
    let [ripple_y, lens_tilt_x] = pair(2e-5, 2e-3);
    let [lens_tilt_y, decentre_x] = pair(2e-3, 0.3);
    let [decentre_y, tangential_x] = pair(0.3, 5e-5);
    let [tangential_y, ripple_mm] = pair(5e-5, 0.005);
    let [pupil_walk_mm, stretch_x] = pair(0.01, 1e-4);
    let [stretch_y, height_mm] = pair(1e-4, 0.5);
    let slope = pair(1.5e-3, 1.5e-3);
    let shift_mm = pair(0.3, 0.3);
    let [rotation_rad, _] = pair(3e-3, 0.0);
    let lens = coefficients_mm.map(|coefficients_mm| HeadLens {
        coefficients_mm,
        tilt_rad: [lens_tilt_x, lens_tilt_y],
        decentre_mm: [decentre_x, decentre_y],
        tangential: [tangential_x, tangential_y],
        ripple_mm,
        pupil_walk_mm,
        stretch_per_mm: [0.00165 + stretch_x, 0.0015 + stretch_y],
    });
    let response = |zero_rad, gain, square, cube, fifth, ripple| Response {
        zero_rad,
        gain: 1.0 + gain,
        square,
        cube,
        fifth,
        ripple,
    };
    Head {
        mirror_distance_mm: e_mm + mirror_distance,
        working_distance_mm: d_mm,
        surface_mm: [surface.abs(), second_surface.abs()],
        aligned: true,
        beam_offset_mm: [beam_y, beam_z],
        beam_tilt_rad: [tilt_y, tilt_z],
        axis1_tilt_rad: [axis1_x, axis1_y],
        axis2_tilt_rad: [axis2_y, axis2_z],
        cone_rad: [cone1, cone2],
        response: [
            response(zero_x, gain_x, square_x, cube_x, fifth_x, ripple_x),
            response(zero_y, gain_y, square_y, cube_y, fifth_y, ripple_y),
        ],
        lens,
        // Over the work plane at hand, wherever the nominal one is.
        plane: Plane { height_mm: height_mm - optics.plane_mm, slope },
        frame: Frame { shift_mm, rotation_rad },
    }
}

/// A lens that follows a data sheet's polynomial by odd orders alone, as glass does, and is off.
fn true_lens(nominal_mm: &[f64], scale: f64, higher_mm: [f64; 2]) -> Vec<f64> {
    let angles_rad: Vec<f64> = (0..N_LENS)
        .map(|k| LENS_RAD[0] + (LENS_RAD[1] - LENS_RAD[0]) * k as f64 / (N_LENS - 1) as f64)
        .collect();
    let height = |theta: f64| nominal_mm.iter().rev().fold(0.0, |h, c| (h + c) * theta);
    let powers = DMatrix::from_fn(N_LENS, LENS_ORDERS.len(), |row, column| {
        angles_rad[row].powi(LENS_ORDERS[column])
    });
    let heights = DVector::from_iterator(N_LENS, angles_rad.iter().map(|&theta| height(theta)));
    let fitted = powers.svd(true, true).solve(&heights, 1e-12).unwrap_or_default();
    let mut coefficients_mm = vec![0.0; 7];
    for (order, value) in LENS_ORDERS.iter().zip(fitted.iter()) {
        coefficients_mm[*order as usize - 1] = value * scale;
    }
    let by_size = nominal_mm[0] / LENS_MM;
    coefficients_mm[2] += higher_mm[0] * by_size;
    coefficients_mm[4] += higher_mm[1] * by_size;
    coefficients_mm
}

#[cfg(test)]
mod tests {
    use super::hidden_head;
    use ftheta_model::machine::{Axis, Lens, Optics};

    /// `machine(7)` of `reference/head_model.py`.
    #[test]
    fn heads_are_the_references() {
        let lens = Lens::FTheta { coefficients_mm: vec![420.456, -6.051, 37.397, -55.240] };
        let head = hidden_head(&Optics::new(lens, Axis::X, 336.0), 7);
        let near = |found: f64, expected: f64| {
            let error = (found - expected).abs();
            assert!(error < 1e-7 * expected.abs().max(1e-3), "{found} instead of {expected}");
        };
        near(head.mirror_distance_mm, 28.131408891936026);
        near(head.beam_offset_mm[0], -0.5046293893431137);
        near(head.axis1_tilt_rad[1], -0.001130029378286056);
        near(head.cone_rad[1], 0.00012732369793729199);
        near(head.response[1].gain, 1.0049873935063551);
        near(head.response[1].ripple, 2.8367408577113956e-05);
        let lens = head.lens.unwrap();
        let odd = [420.59703641157444, 8.9519587494553, -24.53582183272176, -28.706114235441706];
        let expected = (0..7).map(|k| if k % 2 == 0 { odd[k / 2] } else { 0.0 });
        lens.coefficients_mm.iter().zip(expected).for_each(|(&c, value)| near(c, value));
        near(lens.tilt_rad[1], 9.599999687669447e-05);
        near(lens.pupil_walk_mm, -0.010179371384442163);
        near(lens.stretch_per_mm[1], 0.0013312696422977058);
        near(head.plane.slope[1], -0.0011852435467246943);
        near(head.frame.rotation_rad, 0.0035409325129318672);
    }
}
