//! Falling torque and friction: against a fine Runge-Kutta solution, and what feed-forward leaves.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::lossy::{LossyAxis, feed_forward};

const TICK_S: f64 = 1e-5;

fn scanner(losses: Losses) -> Scanner {
    Scanner {
        rotor_inertia_kg_m2: 1.25e-8,
        mirror_inertia_kg_m2: 3e-8,
        torque_constant_n_m_a: 0.00617,
        resistance_ohm: 2.79,
        inductance_h: 180e-6,
        torsional_mode_hz: 5200.0,
        damping_ratio: 0.01,
        voltage_max_v: 24.0,
        current_max_a: 8.0,
        current_rms_a: 3.9,
        thermal_time_s: 1.0,
        angle_max_rad: 12.5_f64.to_radians(),
        speed_max_rad_s: 1000.0,
        f1_uncertainty: 0.03,
        kt_uncertainty: 0.005,
        losses,
        servo: Servo::StateFeedback { velocity_weight_s: 70e-6, lag_s: 164.19e-6 },
        sensor: Sensor::default(),
    }
}

const SMOOTH: Losses =
    Losses { torque_falloff: 0.06, friction_coulomb_n_m: 0.0, friction_viscous_n_m_s_rad: 2e-7 };
const RUBBING: Losses = Losses { friction_coulomb_n_m: 2e-4, ..SMOOTH };

/// Voltages of a smooth move of `step_rad` on the rigid nominal axis by exact inversion of a
/// ninth-degree polynomial, whose current starts and ends at zero slope.
fn voltages(plant: &Galvo, step_rad: f64, n_ticks: usize) -> Vec<f64> {
    let total_s = n_ticks as f64 * TICK_S;
    let kt = plant.torque_constant;
    // Angle 126 s^5 - 420 s^6 + 540 s^7 - 315 s^8 + 70 s^9 and its derivatives.
    let terms = [(5, 126.0), (6, -420.0), (7, 540.0), (8, -315.0), (9, 70.0)];
    let derivative = |order: i32, s: f64| -> f64 {
        let falling = |power: i32| (0..order).map(|k| f64::from(power - k)).product::<f64>();
        let sum: f64 =
            terms.iter().map(|&(p, c): &(i32, f64)| c * falling(p) * s.powi(p - order)).sum();
        step_rad * sum / total_s.powi(order)
    };
    (0..n_ticks)
        .map(|tick| {
            let s = (tick as f64 + 0.5) / n_ticks as f64;
            let amperes = |order| plant.inertia() / kt * derivative(order, s);
            plant.resistance * amperes(2) + plant.inductance * amperes(3) + kt * derivative(1, s)
        })
        .collect()
}

fn nominal_states(plant: &Galvo, voltages_v: &[f64]) -> Vec<State> {
    let step = plant.step(TICK_S);
    let mut states = vec![State::zeros()];
    for &voltage_v in voltages_v {
        states.push(step.a * states[states.len() - 1] + step.b * voltage_v);
    }
    states
}

fn play(axis: &LossyAxis, voltages_v: &[f64]) -> State {
    voltages_v.iter().fold(State::zeros(), |state, &voltage_v| axis.advance(&state, voltage_v))
}

/// Classical Runge-Kutta on the full equations, written from the physics: rotor and mirror angle.
fn runge_kutta(scanner: &Scanner, voltages_v: &[f64], n_per_tick: usize) -> State {
    let Losses { torque_falloff, friction_coulomb_n_m, friction_viscous_n_m_s_rad } =
        scanner.losses;
    let (jr, jm) = (scanner.rotor_inertia_kg_m2, scanner.mirror_inertia_kg_m2);
    let j = jr + jm;
    let omega = std::f64::consts::TAU * scanner.torsional_mode_hz;
    let (stiffness, damping) =
        (omega * omega * jr * jm / j, 2.0 * scanner.damping_ratio * omega * jr * jm / j);
    // State: rotor angle and speed, mirror angle and speed, current.
    let slope = |z: &State, voltage_v: f64| {
        let share = z[0] / scanner.angle_max_rad;
        let kt = scanner.torque_constant_n_m_a * (1.0 - torque_falloff * share * share);
        let shaft = stiffness * (z[0] - z[2]) + damping * (z[1] - z[3]);
        let sign = if z[1] == 0.0 { 0.0 } else { z[1].signum() };
        let friction = friction_viscous_n_m_s_rad * z[1] + friction_coulomb_n_m * sign;
        State::new(
            z[1],
            (kt * z[4] - shaft - friction) / jr,
            z[3],
            shaft / jm,
            (voltage_v - scanner.resistance_ohm * z[4] - kt * z[1]) / scanner.inductance_h,
        )
    };
    let h = TICK_S / n_per_tick as f64;
    let mut z = State::zeros();
    for &voltage_v in voltages_v {
        for _ in 0..n_per_tick {
            let k1 = slope(&z, voltage_v);
            let k2 = slope(&(z + k1 * (0.5 * h)), voltage_v);
            let k3 = slope(&(z + k2 * (0.5 * h)), voltage_v);
            let k4 = slope(&(z + k3 * h), voltage_v);
            z += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        }
    }
    let q = z[0] - z[2];
    let q_speed = z[1] - z[3];
    State::new((jr * z[0] + jm * z[2]) / j, (jr * z[1] + jm * z[3]) / j, q, q_speed, z[4])
}

#[test]
fn a_linear_axis_has_no_losses() {
    let linear = scanner(Losses::default());
    assert!(LossyAxis::new(&Galvo::new(&linear), &linear, TICK_S).is_none());
}

#[test]
fn steps_agree_with_a_fine_runge_kutta_solution() {
    for (losses, n_per_tick, tolerance_rad) in [(SMOOTH, 100, 1e-9), (RUBBING, 1000, 2e-8)] {
        let scanner = scanner(losses);
        let plant = Galvo::new(&scanner);
        let voltages_v = voltages(&plant, 10_f64.to_radians(), 120);
        let found = play(&LossyAxis::new(&plant, &scanner, TICK_S).unwrap(), &voltages_v);
        let expected = runge_kutta(&scanner, &voltages_v, n_per_tick);
        for index in [0, 2] {
            let error = (found[index] - expected[index]).abs();
            println!("{losses:?} state {index}: {error:e} rad");
            assert!(error < tolerance_rad, "{losses:?} state {index}: {error:e} rad");
        }
    }
}

/// A rotor at rest stays there as long as the torque is below friction, and breaks loose above.
#[test]
fn friction_holds_up_to_its_limit() {
    let scanner = scanner(RUBBING);
    let plant = Galvo::new(&scanner);
    let axis = LossyAxis::new(&plant, &scanner, TICK_S).unwrap();
    let breakaway_v = RUBBING.friction_coulomb_n_m / plant.torque_constant * plant.resistance;
    let rotor_rad = |share: f64| {
        let state = play(&axis, &[breakaway_v * share; 200]);
        assert!((state[CURRENT] * plant.resistance / breakaway_v - share).abs() < 0.2);
        plant.rotor_row().dot(&state)
    };
    assert!(rotor_rad(0.99).abs() < 1e-8);
    assert!(rotor_rad(1.05) > 1e-5);
}

/// Residual of an open-loop move of 10 degrees with and without the correction.
#[test]
fn feed_forward_gives_back_the_nominal_motion() {
    let target_rad = 10_f64.to_radians();
    for losses in [SMOOTH, RUBBING] {
        let scanner = scanner(losses);
        let plant = Galvo::new(&scanner);
        let voltages_v = voltages(&plant, target_rad, 120);
        let states = nominal_states(&plant, &voltages_v);
        let corrected_v = feed_forward(&plant, &scanner, &states, &voltages_v, TICK_S);
        let axis = LossyAxis::new(&plant, &scanner, TICK_S).unwrap();
        // Greatest error of the mirror at any tick.
        let error_rad = |voltages_v: &[f64]| {
            let mut state = State::zeros();
            voltages_v.iter().zip(&states[1..]).fold(0.0_f64, |error_rad, (&voltage_v, wanted)| {
                state = axis.advance(&state, voltage_v);
                error_rad.max(plant.mirror_row().dot(&(state - wanted)).abs())
            })
        };
        let (without, with) = (error_rad(&voltages_v), error_rad(&corrected_v));
        println!("{losses:?}: {without:e} rad without, {with:e} with");
        assert!(without > 1.5e-3 && with < 5e-6, "{without:e} {with:e} rad");
    }
}
