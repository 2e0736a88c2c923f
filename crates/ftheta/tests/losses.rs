//! Jumps of a machine with losses: the voltages that are played make up for them.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine::preset;
use ftheta::jump::{JumpOptions, Law, compare};
use ftheta::model::machine::Losses;
use ftheta::physics::galvo::Galvo;
use ftheta::planner::jump::{Atlas, AtlasOptions, AxisOptions, CurrentBound, Model};
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::open_loop::{Played, arrival_with_losses};

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
        tolerance_rad,
        reserve: 0.12,
        period_s: 1e-5,
        mismatch: Mismatch::default(),
    };
    let found = compare(&machine, &options).unwrap();
    let corrected = found[0].laws[0].arrival.unwrap();
    let axis = AxisOptions {
        model: Model::Flexible,
        tick_s: 1e-5,
        voltage_reserve: 0.12,
        current_bound: CurrentBound::Always,
    };
    let scanner = &machine.scanner;
    let atlas = Atlas::build(scanner, AtlasOptions { axis, range_rad: step_rad }).unwrap();
    let voltages_v: Vec<f64> = atlas.jump(step_rad).unwrap().voltages_v().collect();
    let played =
        Played { voltages_v: &voltages_v, tick_s: 1e-5, target_rad: step_rad, tolerance_rad };
    let plain = arrival_with_losses(&Galvo::new(scanner), scanner, &played);
    println!("corrected {corrected:?}, plain {plain:?}");
    assert!(corrected.residual_rad < tolerance_rad && corrected.settle_s == 0.0, "{corrected:?}");
    assert!(plain.is_none_or(|plain| plain.settle_s > 0.0), "{plain:?}");
}
