//! Motion laws on the twin against the reference table, their limits, and moving ends.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine;
use ftheta::jump::{JumpOptions, Law, LawError, Outcome, StepResult, compare, motion};
use ftheta::model::machine::Machine;
use ftheta::physics::galvo::{CURRENT, Galvo, State};
use ftheta::twin::mismatch::Mismatch;
use proptest::prelude::*;
use serde_json::Value;
use std::sync::OnceLock;

const SETS: [&str; 3] = ["S10", "S14", "S25"];
const STEPS_DEG: [&str; 6] = ["0.01", "0.1", "1", "5", "10", "20"];

fn reference() -> Value {
    serde_json::from_str(include_str!("fixtures/laws.json")).unwrap()
}

fn preset(set: &str) -> Machine {
    machine::preset(set).unwrap().unwrap()
}

fn options(laws: &[&str], steps_deg: &[&str]) -> JumpOptions {
    JumpOptions {
        steps_rad: steps_deg.iter().map(|s| s.parse::<f64>().unwrap().to_radians()).collect(),
        laws: laws.iter().map(|law| law.parse().unwrap()).collect(),
        from_rad_s: 0.0,
        to_rad_s: 0.0,
        tolerance_rad: 0.002_f64.to_radians(),
        reserve: 0.0,
        period_s: 1e-5,
        mismatch: Mismatch::default(),
    }
}

fn outcome(step: &StepResult, law: usize) -> &Outcome {
    step.laws[law].outcome.as_ref().unwrap()
}

/// Laws that the reference has on all 18 cases, and some more.
const TABLE: [&str; 17] = [
    "s-curve",
    "asymmetric",
    "residual",
    "quintic",
    "cycloid",
    "zv",
    "zvd",
    "s-curve:fastest",
    "quintic:fastest",
    "cycloid:fastest",
    "bisection:1",
    "bisection:3",
    "bisection:5",
    "bisection:8",
    "bisection:20",
    "bisection:120",
    "bisection:120:current",
];

/// Gives the reference, limit and outcome of these laws in all 18 cases, computed once.
fn all(laws: &[&str], check: impl Fn(&str, &Value, f64, &Outcome)) {
    static STEPS: OnceLock<Vec<Vec<StepResult>>> = OnceLock::new();
    let steps = STEPS.get_or_init(|| {
        SETS.iter()
            .map(|set| compare(&preset(set), &options(&TABLE, &STEPS_DEG)).unwrap())
            .collect()
    });
    let reference = reference();
    for (set, steps) in SETS.iter().zip(steps) {
        for (step, step_deg) in steps.iter().zip(STEPS_DEG) {
            let case = &reference[set][step_deg];
            let limit_us = case["limit_us"].as_f64().unwrap();
            assert!((step.limit_s * 1e6 / limit_us - 1.0).abs() < 1e-3);
            for law in laws {
                let index = TABLE.iter().position(|known| known == law).unwrap();
                check(law, case, step.limit_s, outcome(step, index));
            }
        }
    }
}

#[test]
fn tuned_laws_are_as_fast_as_the_reference() {
    let laws = ["s-curve", "quintic", "cycloid", "zv", "zvd", "residual"];
    all(&laws, |law, case, _, outcome| {
        let ratio = outcome.total_s().unwrap() * 1e6 / case["laws_us"][law][1].as_f64().unwrap();
        // The reference's S-curves come from a coarse grid, and rang on the shortest step.
        assert!(ratio < 1.03, "{law} {case}: {ratio}");
        assert!(ratio > 0.8 || law == "s-curve" && ratio > 0.07, "{law} {case}: {ratio}");
        assert!(outcome.peak_voltage_ratio <= 1.0 + 1e-6, "{law} {case}");
        assert!(outcome.arrival.peak_current_a < 20.0, "{law} {case}");
    });
}

#[test]
fn fastest_laws_are_as_short_and_ring_as_long_as_the_reference() {
    let laws = ["s-curve:fastest", "quintic:fastest", "cycloid:fastest"];
    all(&laws, |law, case, _, outcome| {
        let expected = [0, 1].map(|column| case["laws_us"][law][column].as_f64().unwrap());
        let plan = outcome.motion.plan_s * 1e6 / expected[0];
        assert!((plan - 1.0).abs() < 0.03, "{law} {case}: {plan}");
        // How much a law leaves in the mode swings within a period; the time knows its logarithm.
        let total = outcome.total_s().unwrap() * 1e6 / expected[1];
        assert!((total - 1.0).abs() < 0.3, "{law} {case}: {total}");
    });
}

#[test]
fn a_jerk_of_its_own_for_braking_never_costs_time() {
    all(&["asymmetric"], |law, case, limit_s, outcome| {
        let ratio =
            outcome.total_s().unwrap() * 1e6 / case["laws_us"]["s-curve"][1].as_f64().unwrap();
        assert!(ratio < 1.0, "{law} {case}: {ratio}");
        assert!(outcome.total_s().unwrap() > limit_s, "{law} {case}");
    });
}

#[test]
fn bisection_finds_the_times_of_the_reference() {
    let laws = ["bisection:3", "bisection:5", "bisection:8", "bisection:20", "bisection:120"];
    all(&laws, |law, case, _, outcome| {
        let n_segments = &law["bisection:".len()..];
        let ratio =
            outcome.motion.plan_s * 1e6 / case["bisection_us"][n_segments].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 2e-3, "{law} {case}: {ratio}");
        assert!(outcome.peak_voltage_ratio <= 1.0);
        if n_segments != "3" {
            assert_eq!(outcome.arrival.settle_s, Some(0.0), "{law} {case}");
            assert!(outcome.arrival.residual_rad < 1e-9, "{law} {case}");
        }
    });
}

#[test]
fn bisection_with_the_current_bound_converges_to_the_limit() {
    all(&["bisection:120:current"], |_, case, limit_s, outcome| {
        let excess = outcome.motion.plan_s / limit_s - 1.0;
        assert!((-1e-3..2e-3).contains(&excess), "{case}: {excess}");
    });
}

#[test]
fn the_literal_formula_only_passes_the_target() {
    all(&["bisection:1"], |_, case, _, outcome| {
        let expected = |key: &str| case["passing"][key].as_f64().unwrap();
        let plan = outcome.motion.plan_s * 1e6 / expected("plan_us");
        assert!((plan - 1.0).abs() < 1e-3, "{case}: {plan}");
        let speed = outcome.arrival.end_rad_s / expected("end_rad_s");
        // The reference has a stiff shaft.
        assert!((speed - 1.0).abs() < 0.02, "{case}: {speed}");
        assert_eq!(outcome.arrival.settle_s, None, "{case}");
    });
}

/// The trapezoid leaves the mode ringing on all but some steps; equal increments are gentle, slow.
#[test]
fn prior_art_is_slow() {
    let steps = compare(&preset("S10"), &options(&["trapezoid", "fixed-step"], &["0.1", "1"]));
    for step in steps.unwrap() {
        let [trapezoid, fixed] = [0, 1].map(|law| outcome(&step, law));
        for outcome in [trapezoid, fixed] {
            let periods = outcome.motion.plan_s / 1e-5;
            assert!((periods - periods.round()).abs() < 1e-6);
            assert!(outcome.peak_voltage_ratio <= 1.0 + 1e-6);
        }
        assert!(trapezoid.total_s().unwrap() > 10.0 * step.limit_s);
        assert_eq!(fixed.arrival.settle_s, Some(0.0));
        assert!(fixed.motion.plan_s > 10.0 * step.limit_s);
    }
}

#[test]
fn laws_from_rest_to_rest_refuse_speeds() {
    let laws: Vec<String> = Law::ALL.iter().map(ToString::to_string).collect();
    let laws: Vec<&str> = laws.iter().map(String::as_str).collect();
    let options = JumpOptions { to_rad_s: 10.0, ..options(&laws, &["1"]) };
    let step = &compare(&preset("S10"), &options).unwrap()[0];
    for (law, result) in laws.iter().zip(&step.laws) {
        match &result.outcome {
            Ok(outcome) => {
                let moves = ["bisection", "optimal", "robust"];
                assert!(moves.iter().any(|name| law.starts_with(name)), "{law}");
                assert_eq!(outcome.arrival.settle_s, Some(0.0));
            }
            Err(LawError::RestOnly { to_rad_s, .. }) => assert_eq!(*to_rad_s, 10.0),
            Err(error) => panic!("{law}: {error}"),
        }
    }
}

#[test]
fn wrong_names_and_numbers_are_named() {
    for (name, expected) in [
        ("bisection:2", "expected 1 or 3 to 200 segments"),
        ("bisection:1:current", "expected 1 or 3 to 200 segments"),
        ("zv:3", "expected none"),
        ("quintic:slow", "expected fastest or none"),
        ("ruckig", "known are optimal, robust, bisection"),
    ] {
        let error = name.parse::<Law>().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let far = JumpOptions { from_rad_s: 1e9, ..options(&["bisection"], &["1"]) };
    let step = &compare(&preset("S10"), &far).unwrap()[0];
    let error = step.laws[0].outcome.as_ref().unwrap_err().to_string();
    assert!(error.contains("speed at the start rad/s 1000000000 is outside 0 to 1000"), "{error}");
    assert!(compare(&preset("S10"), &options(&["zv"], &["26"])).is_err());
}

#[test]
fn every_law_has_one_name() {
    for law in Law::ALL {
        assert_eq!(law.to_string().parse::<Law>(), Ok(law));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// From any speed to any speed: the end state is exact and the limits hold.
    #[test]
    fn bisection_joins_any_two_speeds(
        exponent in -6.0..4.0_f64,
        from_rad_s in -40.0..40.0_f64,
        to_rad_s in -40.0..40.0_f64,
        n_segments in 5..30_usize,
    ) {
        let machine = preset("S10");
        let law = format!("bisection:{n_segments}{}", if n_segments > 8 { ":current" } else { "" });
        let options = JumpOptions {
            from_rad_s,
            to_rad_s,
            steps_rad: vec![exponent.exp2().to_radians()],
            ..options(&[&law], &[])
        };
        let step_rad = options.steps_rad[0];
        let motion = motion(&machine, &options, step_rad, options.laws[0]).unwrap();
        let plant = Galvo::new(&machine.scanner).step(motion.hold_s);
        let mut state = State::new(0.0, from_rad_s, 0.0, 0.0, 0.0);
        for voltage_v in &motion.voltages_v {
            prop_assert!(voltage_v.abs() <= machine.scanner.voltage_max_v);
            state = plant.a * state + plant.b * *voltage_v;
            if n_segments > 8 {
                prop_assert!(state[CURRENT].abs() <= machine.scanner.current_max_a * (1.0 + 1e-6));
            }
        }
        let lack = state - State::new(step_rad, to_rad_s, 0.0, 0.0, 0.0);
        prop_assert!(lack[0].abs() < 1e-9 && lack[2].abs() < 1e-9 && lack[CURRENT].abs() < 1e-6);
        prop_assert!(lack[1].abs() < 1e-5 && lack[3].abs() < 1e-4, "{lack}");
    }
}
