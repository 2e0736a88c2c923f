//! Jumps against reference limits, an independent propagator and plants off the nominal.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

#[path = "campaign/plant.rs"]
mod plant;

use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_planner::jump::{
    Atlas, AtlasOptions, Axis, AxisOptions, CurrentBound, Jump, JumpError, Model, fewest_ticks,
    limit_s, settle_limit_s,
};
use plant::{TICK_S, scanner};
use proptest::prelude::*;
use serde_json::Value;
use std::sync::OnceLock;

const SETS: [&str; 3] = ["S10", "S14", "S25"];
const STEPS_DEG: [&str; 6] = ["0.01", "0.1", "1", "5", "10", "20"];

fn reference() -> &'static Value {
    static REFERENCE: OnceLock<Value> = OnceLock::new();
    REFERENCE.get_or_init(|| serde_json::from_str(include_str!("fixtures/limits.json")).unwrap())
}

fn epsilon_rad() -> f64 {
    reference()["epsilon_rad"].as_f64().unwrap()
}

fn step_rad(step_deg: &str) -> f64 {
    step_deg.parse::<f64>().unwrap().to_radians()
}

fn options(model: Model, current_bound: CurrentBound) -> AxisOptions {
    AxisOptions { model, tick_s: TICK_S, voltage_reserve: 0.0, current_bound }
}

fn atlas(set: &str, axis: AxisOptions) -> Atlas {
    let range_rad = 20_f64.to_radians();
    Atlas::build(&scanner(set), AtlasOptions { axis, range_rad }).unwrap()
}

/// End state and greatest current, A, of these voltages from rest, in steps of 1 µs.
fn propagate(plant: &Galvo, voltages_v: impl Iterator<Item = f64>) -> (State, f64) {
    let step = plant.step(TICK_S / 10.0);
    let (mut state, mut peak_a) = (State::zeros(), 0.0_f64);
    for voltage in voltages_v {
        for _ in 0..10 {
            state = step.a * state + step.b * voltage;
            peak_a = peak_a.max(state[CURRENT].abs());
        }
    }
    (state, peak_a)
}

/// Worst distance from rest at the step, relative to the step, each state weighed as an angle.
fn unrest(plant: &Galvo, end: &State, step_rad: f64, states: &[usize]) -> f64 {
    let acceleration = plant.torque_constant / plant.inertia();
    let omega = plant.omega;
    let units = [1.0, omega, 1.0, omega, omega * omega / acceleration];
    let target = State::new(step_rad, 0.0, 0.0, 0.0, 0.0);
    let part = |&state: &usize| ((end - target)[state] / (units[state] * step_rad)).abs();
    states.iter().map(part).fold(0.0, f64::max)
}

/// Checks limits and rest of a nominal jump.
fn assert_exact(scanner: &Scanner, jump: &Jump, step_rad: f64) {
    let plant = Galvo::new(scanner);
    let (end, peak_a) = propagate(&plant, jump.voltages_v());
    let n_ticks = jump.n_ticks;
    let peak_v = jump.voltages_v().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
    assert!(peak_v <= scanner.voltage_max_v, "{n_ticks} ticks: {peak_v} V");
    assert!(peak_a <= scanner.current_max_a, "{n_ticks} ticks: {peak_a} A");
    let unrest = unrest(&plant, &end, step_rad, &[0, 1, 2, 3, 4]);
    assert!(unrest < 1e-9, "{n_ticks} ticks, {step_rad} rad: {unrest}");
}

#[test]
fn limits_match_the_reference() {
    for set in SETS {
        for step_deg in STEPS_DEG {
            let limits = &reference()["limits"][set][step_deg];
            let models =
                [(Model::Rigid, "rigid_min_time_s"), (Model::Flexible, "flex_rest_min_time_s")];
            for (model, key) in models {
                let time_s = limit_s(&scanner(set), step_rad(step_deg), model).unwrap();
                let ratio = time_s / limits[key].as_f64().unwrap();
                assert!((ratio - 1.0).abs() < 2e-4, "{set} {step_deg} {model:?}: {ratio}");
            }
        }
    }
}

#[test]
fn settle_limits_match_the_reference() {
    for (set, step_deg) in [("S10", "0.01"), ("S14", "0.1"), ("S25", "5"), ("S10", "20")] {
        let limits = &reference()["limits"][set][step_deg];
        let time_s = settle_limit_s(&scanner(set), step_rad(step_deg), epsilon_rad()).unwrap();
        let ratio = time_s / limits["flex_settle_limit_s"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-3, "{set} {step_deg}: {ratio}");
    }
}

#[test]
fn nominal_atlas_needs_the_reference_ticks() {
    for set in SETS {
        let atlas = atlas(set, options(Model::Flexible, CurrentBound::AtTicks));
        for step_deg in STEPS_DEG {
            let tick_s = reference()["limits"][set][step_deg]["tick10us_rest_s"].as_f64().unwrap();
            let n_ticks = atlas.jump(step_rad(step_deg)).unwrap().n_ticks;
            assert_eq!(n_ticks, (tick_s / TICK_S).round() as usize, "{set} {step_deg}");
        }
    }
}

#[test]
fn every_nominal_sequence_is_exact() {
    for set in SETS {
        let scanner = scanner(set);
        let atlas = atlas(set, options(Model::Flexible, CurrentBound::Always));
        assert!(atlas.steps_rad().is_sorted());
        for &step_rad in atlas.steps_rad().iter().filter(|&&step_rad| step_rad > 0.0) {
            assert_exact(&scanner, &atlas.jump(step_rad).unwrap(), step_rad);
        }
    }
}

/// The reference drives every plant with one current. Driven by voltage, another mode changes the
/// current by what it pushes back, and the rigid part then creeps; to keep that within the
/// tolerance too costs the longest jumps these ticks more.
const TICKS_FOR_CREEP: [(&str, &str, u64); 3] =
    [("S14", "20", 1), ("S25", "10", 1), ("S25", "20", 7)];

#[test]
fn robust_atlas_needs_the_reference_ticks() {
    for set in SETS {
        let scanner = scanner(set);
        let model = Model::Robust { epsilon_rad: epsilon_rad() };
        let atlas = atlas(set, options(model, CurrentBound::Always));
        for step_deg in STEPS_DEG {
            let creep = TICKS_FOR_CREEP.iter().find(|(s, d, _)| (*s, *d) == (set, step_deg));
            let most = reference()["robust3_ticks"][set][step_deg].as_u64().unwrap();
            let n_ticks = atlas.jump(step_rad(step_deg)).unwrap().n_ticks as u64;
            let most = most + creep.map_or(0, |(_, _, more)| *more);
            assert!(n_ticks <= most, "{set} {step_deg}: {n_ticks} > {most}");
        }
        for (n_ticks, sequence) in atlas.sequences_v().iter().enumerate().skip(3) {
            let plant = Galvo::new(&scanner);
            let (end, peak_a) = propagate(&plant, sequence.iter().copied());
            assert!(sequence.iter().all(|voltage| voltage.abs() <= scanner.voltage_max_v));
            assert!(peak_a <= scanner.current_max_a, "{set} {n_ticks}: {peak_a} A");
            let unrest = unrest(&plant, &end, atlas.steps_rad()[n_ticks], &[4]);
            assert!(unrest < 1e-9, "{set} {n_ticks}: {unrest}");
        }
    }
}

#[test]
fn single_solves_agree_with_the_atlas() {
    let scanner = scanner("S10");
    let axis_options = options(Model::Flexible, CurrentBound::Always);
    let atlas = atlas("S10", axis_options);
    let axis = Axis::new(&scanner, axis_options).unwrap();
    for n_ticks in [5, 17, 64, 111] {
        // Bit for bit, whatever thread solved it.
        let reach = axis.longest(n_ticks).unwrap().unwrap();
        assert_eq!(reach.step_rad, atlas.steps_rad()[n_ticks]);
        assert_eq!(reach.voltages_v, atlas.sequences_v()[n_ticks]);
    }
    for step_rad in [1e-5, 3.3e-4, 0.0123, 0.17, 0.31] {
        let n_ticks = fewest_ticks(&scanner, axis_options, step_rad).unwrap();
        assert_eq!(atlas.jump(step_rad).unwrap().n_ticks, n_ticks);
    }
}

#[test]
fn other_periods_and_machines_are_solved() {
    for (frequency, tick_s) in [(0.25, 2.5e-6), (1.0, 2e-5), (4.0, 1e-4), (0.5, 5e-5)] {
        let mut scanner = scanner("S14");
        scanner.torsional_mode_hz *= frequency;
        for model in [Model::Flexible, Model::Robust { epsilon_rad: 1e-5 }] {
            let options = AxisOptions { tick_s, ..options(model, CurrentBound::Always) };
            let limit_s = limit_s(&scanner, 0.02, model).unwrap();
            let n_ticks = fewest_ticks(&scanner, options, 0.02).unwrap();
            let excess = n_ticks as f64 - limit_s / tick_s;
            assert!((-0.01..3.0).contains(&excess), "{frequency} {tick_s} {model:?}: {excess}");
        }
    }
}

#[test]
fn impossible_requests_are_refused() {
    let mut broken = scanner("S10");
    broken.rotor_inertia_kg_m2 = 0.0;
    let parameter = |result| matches!(result, Err(JumpError::Parameter { .. }));
    assert!(parameter(limit_s(&broken, 0.1, Model::Rigid)));
    assert!(parameter(limit_s(&scanner("S10"), f64::NAN, Model::Rigid)));
    assert!(parameter(settle_limit_s(&scanner("S10"), 0.1, 0.2)));
    let atlas = s10();
    assert_eq!(atlas.jump(0.0).unwrap().n_ticks, 0);
    assert!(atlas.jump(0.4).is_none());
    assert!(atlas.jump(f64::NAN).is_none());
}

fn s10() -> &'static Atlas {
    static ATLAS: OnceLock<Atlas> = OnceLock::new();
    ATLAS.get_or_init(|| atlas("S10", options(Model::Flexible, CurrentBound::Always)))
}

proptest! {
    #[test]
    fn any_jump_arrives_at_rest(exponent in -13.0..4.32_f64, backwards: bool) {
        let step_rad = exponent.exp2().to_radians() * if backwards { -1.0 } else { 1.0 };
        let jump = s10().jump(step_rad).unwrap();
        assert_exact(&scanner("S10"), &jump, step_rad);
        prop_assert!(s10().steps_rad()[jump.n_ticks - 1] < step_rad.abs());
        let mut samples = [f64::NAN; 200];
        prop_assert_eq!(jump.write(&mut samples), jump.n_ticks);
        prop_assert!(samples[..jump.n_ticks].iter().copied().eq(jump.voltages_v()));
    }
}
