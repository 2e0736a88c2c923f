//! Jumps of a machine with losses: the voltages that are played make up for them.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine::preset;
use ftheta::jump::{JumpOptions, Law, compare, drive, motion};
use ftheta::model::machine::Losses;
use ftheta::physics::galvo::Galvo;
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::open_loop::arrival;

#[test]
fn a_corrected_jump_arrives_where_the_plain_one_does_not() {
    let mut machine = preset("S10").unwrap().unwrap();
    machine.scanner.losses = Losses {
        torque_falloff: 0.06,
        friction_coulomb_n_m: 2e-4,
        friction_viscous_n_m_s_rad: 2e-7,
    };
    let (step_rad, tolerance_rad) = (2_f64.to_radians(), 0.002_f64.to_radians());
    let options = JumpOptions {
        steps_rad: vec![step_rad],
        laws: vec![Law::Optimal],
        from_rad_s: 0.0,
        to_rad_s: 0.0,
        tolerance_rad,
        reserve: 0.12,
        period_s: 1e-5,
        mismatch: Mismatch::default(),
    };
    let found = compare(&machine, &options).unwrap();
    let corrected = found[0].laws[0].outcome.as_ref().unwrap().arrival;
    // The same without its losses in mind, played on the axis that has them.
    let lossless = preset("S10").unwrap().unwrap();
    let motion = motion(&lossless, &options, step_rad, Law::Optimal).unwrap();
    let played = drive(&machine.scanner, &options, step_rad, &motion);
    let plain = arrival(&Galvo::new(&machine.scanner), &played, tolerance_rad);
    assert!(corrected.residual_rad < tolerance_rad, "{corrected:?}");
    assert_eq!(corrected.settle_s, Some(0.0), "{corrected:?}");
    assert_ne!(plain.settle_s, Some(0.0), "{plain:?}");
}
