//! Motion laws on machines of any kind: limits at every sample, the end state, no panic.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
use ftheta_physics::envelope::mode_rad;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_planner::law::{Law, LawError, Request, plan};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// The S10 of the presets, scaled.
fn scanner(inertia: f64, frequency: f64, electric: f64, damping_ratio: f64) -> Scanner {
    Scanner {
        rotor_inertia_kg_m2: 1.25e-8 * inertia,
        mirror_inertia_kg_m2: 3e-8 * inertia,
        torque_constant_n_m_a: 0.00617,
        resistance_ohm: 2.79,
        inductance_h: 180e-6 * electric,
        torsional_mode_hz: 5200.0 * frequency,
        damping_ratio,
        voltage_max_v: 24.0,
        current_max_a: 8.0 / electric,
        current_rms_a: 3.9,
        thermal_time_s: 1.0,
        angle_max_rad: 0.3,
        speed_max_rad_s: 1000.0,
        f1_uncertainty: 0.03,
        kt_uncertainty: 0.005,
        servo: Servo::StateFeedback { velocity_weight_s: 1e-4, lag_s: 1.64e-4 },
        sensor: Sensor::default(),
        losses: Losses::default(),
    }
}

fn request(step_rad: f64) -> Request {
    Request {
        step_rad,
        from_rad_s: 0.0,
        to_rad_s: 0.0,
        tolerance_rad: 3.5e-5,
        reserve: 0.1,
        period_s: 1e-5,
    }
}

const SMOOTH: [&str; 9] = [
    "s-curve",
    "s-curve:fastest",
    "asymmetric",
    "cycloid",
    "quintic:fastest",
    "zv",
    "zvd",
    "residual",
    "trapezoid",
];

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 30,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn limits_hold_and_the_end_is_reached_on_any_machine(
        law in prop::sample::select(&SMOOTH[..]),
        (inertia, frequency, electric) in (-2.0..3.0_f64, -1.5..1.5_f64, -1.0..1.0_f64),
        damping_ratio in 0.001..0.05_f64,
        exponent in -6.0..3.5_f64,
        backwards: bool,
    ) {
        let scanner = scanner(inertia.exp2(), frequency.exp2(), electric.exp2(), damping_ratio);
        let sign = if backwards { -1.0 } else { 1.0 };
        let request = request(exponent.exp2().to_radians() * sign);
        let motion = plan(&scanner, law.parse().unwrap(), &request).unwrap();
        let plant = Galvo::new(&scanner);
        let step = plant.step(motion.hold_s);
        let n_plan = (motion.plan_s / motion.hold_s).round() as usize;
        prop_assert!(motion.voltages_v.len() >= n_plan);
        let mut state = State::zeros();
        let mut end = state;
        for (index, voltage_v) in motion.voltages_v.iter().enumerate() {
            prop_assert!(voltage_v.abs() <= 0.9 * scanner.voltage_max_v * (1.0 + 1e-6));
            state = step.a * state + step.b * *voltage_v;
            prop_assert!(state[CURRENT].abs() <= scanner.current_max_a * (1.0 + 1e-3));
            if index + 1 == n_plan {
                end = state;
            }
        }
        // The rigid part is there; what rings is within the tolerance where the law looks at it.
        // The end lies between two holds, while a light axis still brakes hard.
        let off_rad = (end[0] - request.step_rad).abs();
        let most_rad = 0.1 * request.tolerance_rad + 1e-6 * request.step_rad.abs();
        prop_assert!(off_rad < most_rad, "off by {off_rad} rad");
        // Shapers leave no vibration; the other laws may find waiting cheaper than being gentle.
        if law.starts_with("zv") {
            prop_assert!(mode_rad(&plant, &end) <= request.tolerance_rad);
        }
    }

    #[test]
    fn no_request_panics(
        law in prop::sample::select(&Law::ALL[2..]),
        numbers in prop::array::uniform6(prop::num::f64::ANY),
        which in 0..6_usize,
    ) {
        let mut request = request(0.01);
        let fields = [
            &mut request.step_rad,
            &mut request.from_rad_s,
            &mut request.to_rad_s,
            &mut request.tolerance_rad,
            &mut request.reserve,
            &mut request.period_s,
        ];
        for (index, field) in fields.into_iter().enumerate() {
            if index == which {
                *field = numbers[index];
            }
        }
        let result = plan(&scanner(1.0, 1.0, 1.0, 0.01), law, &request);
        let wild = !(numbers[which].is_finite());
        let refused = matches!(result, Err(LawError::Parameter { .. }));
        prop_assert!(!wild || refused);
    }
}
