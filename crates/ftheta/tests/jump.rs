//! Jumps on plants off the nominal one, driven open loop on the twin.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_formats::machine::preset;
use ftheta_physics::galvo::Galvo;
use ftheta_planner::jump::{Atlas, AtlasOptions, AxisOptions, CurrentBound, Model};
use ftheta_twin::open_loop::{Drive, arrival};

const TICK_S: f64 = 1e-5;

/// Every plant within the stated uncertainty has arrived when the voltages end.
#[test]
fn robust_jumps_settle_at_once_on_every_plant() {
    let tolerance_rad = 0.002_f64.to_radians();
    let mut failures = Vec::new();
    for name in ["S10", "S14", "S25"] {
        let scanner = preset(name).unwrap().unwrap().scanner;
        let axis = AxisOptions {
            model: Model::Robust { epsilon_rad: tolerance_rad },
            tick_s: TICK_S,
            voltage_reserve: 0.0,
            current_bound: CurrentBound::Always,
        };
        let range_rad = 20_f64.to_radians();
        let atlas = Atlas::build(&scanner, AtlasOptions { axis, range_rad }).unwrap();
        // The longest step of a number of ticks is the hardest: shorter ones are scaled down.
        for (n_ticks, &step_rad) in atlas.steps_rad().iter().enumerate().skip(6).step_by(9) {
            for f1 in [-0.03, -0.025, -0.015, -0.005, 0.0, 0.012, 0.021, 0.03] {
                for damping_ratio in [0.0025, 0.008, 0.02] {
                    let nominal = Galvo::new(&scanner);
                    let omega = nominal.omega * (1.0 + f1);
                    let plant = Galvo { omega, damping_ratio, ..nominal };
                    let drive = Drive {
                        voltages_v: &atlas.sequences_v()[n_ticks],
                        hold_s: TICK_S,
                        rest_v: 0.0,
                        plan_s: n_ticks as f64 * TICK_S,
                        from_rad_s: 0.0,
                        target_rad: step_rad,
                        to_rad_s: 0.0,
                        scanner: None,
                    };
                    let settle_s = arrival(&plant, &drive, tolerance_rad).settle_s;
                    if settle_s != Some(0.0) {
                        failures
                            .push(format!("{name} {n_ticks} {f1} {damping_ratio} {settle_s:?}"));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
