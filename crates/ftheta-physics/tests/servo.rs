//! Motor and servo against the numbers of `design/measures.md` and `design/control.md`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
use ftheta_physics::axis_loop::{self, AxisLoop, spectral_radius};
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::servo::{Gains, ServoError};
use nalgebra::{Matrix2, Vector2};
use serde_json::Value;
use std::f64::consts::TAU;

const TICK_S: f64 = 1e-5;

/// Set, speed weight, lag, and the voltage weight that the prototype found.
const SETS: [(&str, f64, f64, f64); 3] = [
    ("S10", 70e-6, 164.19e-6, 0.005442),
    ("S14", 95.8e-6, 224.7e-6, 0.009959),
    ("S25", 158.3e-6, 371.2e-6, 0.01405),
];

fn reference() -> Value {
    serde_json::from_str(include_str!("fixtures/control.json")).unwrap()
}

fn scanner(set: &str, servo: Servo) -> Scanner {
    let reference = reference();
    let number = |key: &str| reference["sets"][set][key].as_f64().unwrap();
    Scanner {
        rotor_inertia_kg_m2: number("Jr"),
        mirror_inertia_kg_m2: number("Jm"),
        torque_constant_n_m_a: number("Kt"),
        resistance_ohm: number("R"),
        inductance_h: number("L"),
        torsional_mode_hz: number("f1"),
        damping_ratio: number("zeta"),
        voltage_max_v: number("Umax"),
        current_max_a: number("Imax"),
        current_rms_a: number("Irms"),
        thermal_time_s: 1.0,
        angle_max_rad: 12.5_f64.to_radians(),
        speed_max_rad_s: 1000.0,
        f1_uncertainty: 0.03,
        kt_uncertainty: 0.005,
        losses: Losses::default(),
        servo,
        sensor: Sensor::default(),
    }
}

fn preset(set: &str) -> Scanner {
    let &(_, velocity_weight_s, lag_s, _) = SETS.iter().find(|row| row.0 == set).unwrap();
    scanner(set, Servo::StateFeedback { velocity_weight_s, lag_s })
}

fn axis(scanner: &Scanner) -> (AxisLoop, Galvo) {
    let plant = Galvo::new(scanner);
    let gains = Gains::design(scanner, TICK_S).unwrap();
    (AxisLoop::new(&plant, gains, scanner, TICK_S), plant)
}

#[test]
fn voltage_weight_and_lag_are_the_prototypes() {
    for (set, _, lag_s, rho_found) in SETS {
        let scanner = preset(set);
        let gains = Gains::design(&scanner, TICK_S).unwrap();
        let Gains::StateFeedback { rho, .. } = gains else { panic!("state feedback") };
        assert!((rho / rho_found - 1.0).abs() < 2e-3, "{set}: rho {rho}, prototype {rho_found}");
        assert!((gains.lag_s(&Galvo::new(&scanner)) - lag_s).abs() < 1e-12);
        assert!(spectral_radius(&Galvo::new(&scanner), &gains, TICK_S) < 1.0);
    }
}

#[test]
fn ramp_is_followed_with_the_lag() {
    for (set, _, lag_s, _) in SETS {
        let (mut axis, plant) = axis(&preset(set));
        let speed_rad_s = 3.0;
        for tick in 0..2000 {
            axis.tick(speed_rad_s * f64::from(tick) * TICK_S, 0.0);
        }
        let mirror_rad = plant.mirror_row().dot(axis.state());
        let behind_s = 2000.0 * TICK_S - mirror_rad / speed_rad_s;
        assert!((behind_s - lag_s).abs() < 1e-9, "{set}: {behind_s}");
    }
}

#[test]
fn small_step_overshoots_little() {
    for (set, ..) in SETS {
        let (mut axis, plant) = axis(&preset(set));
        let peak = (0..1000)
            .map(|_| {
                axis.tick(1e-4, 0.0);
                plant.mirror_row().dot(axis.state())
            })
            .fold(0.0, f64::max);
        assert!(peak <= 1.006e-4, "{set}: overshoot {:.3} %", (peak / 1e-4 - 1.0) * 100.0);
    }
}

/// Gain and phase (deg) of the closed loop on a sampled sine, by least squares on its steady state.
fn response(scanner: &Scanner, frequency_hz: f64) -> (f64, f64) {
    let (mut axis, plant) = axis(scanner);
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for tick in 0..4000 {
        let phase = TAU * frequency_hz * f64::from(tick) * TICK_S;
        if tick >= 2000 {
            let row = Vector2::new(phase.sin(), phase.cos());
            normal += row * row.transpose();
            right += row * plant.mirror_row().dot(axis.state());
        }
        axis.tick(1e-3 * phase.sin(), 0.0);
    }
    let [sine, cosine] = (normal.try_inverse().unwrap() * right).into();
    (sine.hypot(cosine) / 1e-3, cosine.atan2(sine).to_degrees())
}

/// Numbers of the same regulator by another program (SciPy: Riccati solver, matrix exponential).
#[test]
fn response_at_circle_frequencies_is_the_regulators() {
    let scanner = preset("S10");
    for (radius_mm, speed_mm_s, gain, phase_deg) in
        [(0.5, 1000.0, 0.990_326, -18.7708), (0.5, 2000.0, 0.962_734, -37.2890)]
    {
        let found = response(&scanner, speed_mm_s / (TAU * radius_mm));
        assert!((found.0 - gain).abs() < 2e-6, "gain {}", found.0);
        assert!((found.1 - phase_deg).abs() < 5e-4, "phase {}", found.1);
        let (galvo, gains) = (Galvo::new(&scanner), Gains::design(&scanner, TICK_S).unwrap());
        let hz = speed_mm_s / (TAU * radius_mm);
        let closed = axis_loop::response(&galvo, &gains, TICK_S, hz).unwrap();
        assert!((closed.norm() - found.0).abs() < 1e-9, "{closed}");
        assert!((closed.arg().to_degrees() - found.1).abs() < 1e-6, "{closed}");
    }
}

#[test]
fn derived_figures_are_the_references() {
    let reference = reference();
    for (set, ..) in SETS {
        let number = |key: &str| reference["sets"][set][key].as_f64().unwrap();
        let galvo = Galvo::new(&preset(set));
        assert!((galvo.omega / number("w1") - 1.0).abs() < 1e-12);
        let stiffness =
            galvo.omega.powi(2) * galvo.rotor_inertia * galvo.mirror_inertia / galvo.inertia();
        assert!((stiffness / number("K") - 1.0).abs() < 1e-12);
    }
}

/// Five arcs of full voltage bring the axis exactly to rest at the step: the reference's
/// switching times, found by an independent solver, must do so here.
#[test]
fn reference_bang_bang_arcs_end_at_rest() {
    let reference = reference();
    for (set, ..) in SETS {
        let galvo = Galvo::new(&preset(set));
        let voltage = reference["sets"][set]["Umax"].as_f64().unwrap();
        for (step_deg, case) in reference["flex_bangbang"][set].as_object().unwrap() {
            let Some(durations) = case["durations_s"].as_array() else {
                continue;
            };
            let mut state = State::zeros();
            for (sign, duration_s) in case["signs"].as_array().unwrap().iter().zip(durations) {
                let step = galvo.step(duration_s.as_f64().unwrap());
                state = step.a * state + step.b * (sign.as_f64().unwrap() * voltage);
            }
            let target = step_deg.parse::<f64>().unwrap().to_radians();
            assert!((state[0] - target).abs() < 1e-9, "{set} {step_deg}: ends at {}", state[0]);
            assert!(state[1].abs() < 1e-4 && state[2].abs() < 1e-9, "{set} {step_deg}: {state}");
        }
    }
}

/// 1e5 ticks of stepping against 1 000 exponentials of 1 ms each, at 1e-9 relative.
#[test]
fn a_second_of_steps_keeps_nine_digits() {
    let galvo = Galvo::new(&preset("S10"));
    let (fine, coarse) = (galvo.step(TICK_S), galvo.step(1e-3));
    let (mut stepped, mut direct) = (State::zeros(), State::zeros());
    let mut worst = State::zeros();
    let mut size = State::zeros();
    for block in 0..1000_i32 {
        let voltage = 3.0 * f64::from(block * 7 % 11 - 5) / 5.0;
        for _ in 0..100 {
            stepped = fine.a * stepped + fine.b * voltage;
        }
        direct = coarse.a * direct + coarse.b * voltage;
        worst = worst.sup(&(stepped - direct).abs());
        size = size.sup(&direct.abs());
    }
    let relative = worst.component_div(&size).max();
    assert!(relative < 1e-9, "relative difference {relative:e}");
}

#[test]
fn limits_hold_on_a_wild_command() {
    let scanner = preset("S10");
    let (mut axis, _) = axis(&scanner);
    for tick in 0..20_000_i32 {
        let reference_rad = if tick / 37 % 2 == 0 { 0.2 } else { -0.2 };
        let voltage_v = axis.tick(reference_rad, 0.0);
        assert!(voltage_v.abs() <= 24.0);
        assert!(axis.state()[4].abs() <= 8.0 * (1.0 + 1e-9));
    }
}

#[test]
fn pid_servo_is_stable_and_follows() {
    let pid = Servo::Pid {
        bandwidth_hz: 600.0,
        damping: 0.9,
        integral_time_s: f64::INFINITY,
        current_bandwidth_hz: 5000.0,
    };
    let scanner = scanner("S10", pid);
    let (mut axis, plant) = axis(&scanner);
    for _ in 0..2000 {
        axis.tick(1e-3, 0.0);
    }
    assert!((plant.mirror_row().dot(axis.state()) - 1e-3).abs() < 1e-7);
}

#[test]
fn impossible_servos_are_errors() {
    let fast = Servo::StateFeedback { velocity_weight_s: 70e-6, lag_s: 1e-6 };
    let error = Gains::design(&scanner("S10", fast), TICK_S).unwrap_err();
    assert!(matches!(error, ServoError::Lag { .. }), "{error}");
    let wild = Servo::Pid {
        bandwidth_hz: 20_000.0,
        damping: 0.2,
        integral_time_s: 1e-4,
        current_bandwidth_hz: 30_000.0,
    };
    let error = Gains::design(&scanner("S10", wild), TICK_S).unwrap_err();
    assert!(matches!(error, ServoError::Unstable { .. }), "{error}");
}

#[test]
fn a_mode_above_half_the_tick_rate_is_refused() {
    let error = Gains::design(&preset("S10"), 1e-4).unwrap_err();
    assert_eq!(error.to_string(), "torsional mode of 5200 Hz is too high for ticks, limit 5000 Hz");
}
