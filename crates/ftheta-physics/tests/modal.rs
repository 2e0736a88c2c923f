//! Axes with no, one and many modes: against the galvo, closed forms, and the energy balance.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::modal::{ModalAxis, ModalError, Mode};
use nalgebra::DVector;
use std::f64::consts::TAU;

const S10: Galvo = Galvo {
    rotor_inertia: 1.25e-8,
    mirror_inertia: 3e-8,
    torque_constant: 0.00617,
    resistance: 2.79,
    inductance: 180e-6,
    omega: TAU * 5200.0,
    damping_ratio: 0.01,
};

/// Three modes of made-up participations.
fn three_modes() -> ModalAxis {
    let mut axis = ModalAxis::from(&S10);
    axis.modes.push(Mode { omega: 9e4, inertia: 7e-9, rotor: -0.4, mirror: 0.2, ..axis.modes[0] });
    axis.modes.push(Mode { omega: 2e5, inertia: 2e-9, rotor: 0.1, mirror: -0.6, ..axis.modes[0] });
    axis
}

#[test]
fn one_mode_is_the_galvo() {
    let axis = ModalAxis::from(&S10);
    let (found, expected) = (axis.continuous(), S10.continuous());
    for row in 0..5 {
        for column in 0..5 {
            let (a, b) = (found.a[(row, column)], expected.a[(row, column)]);
            assert!((a - b).abs() <= 4.0 * f64::EPSILON * b.abs(), "{row} {column}: {a} {b}");
        }
    }
    assert_eq!(axis.mirror_row().as_slice(), S10.mirror_row().as_slice());
    assert_eq!(axis.rotor_row().as_slice(), S10.rotor_row().as_slice());
    for duration_s in [1e-7, 1e-5, 9e-5] {
        let (found, expected) = (axis.step(duration_s).unwrap(), S10.step(duration_s));
        let mut state = State::zeros();
        let mut modal = DVector::zeros(5);
        for tick in 0..1000 {
            let voltage_v = f64::from(tick % 7) - 3.0;
            state = expected.a * state + expected.b * voltage_v;
            modal = &found.a * modal + &found.b * voltage_v;
        }
        for row in 0..5 {
            let error = (modal[row] - state[row]).abs();
            assert!(error < 1e-9 * state[row].abs().max(1e-9), "{duration_s} {row}: {error}");
        }
    }
}

/// Without a mode the speed under a held voltage is that of motor and coil, in closed form.
#[test]
fn no_mode_is_the_rigid_axis_of_three_states() {
    let rigid = ModalAxis { modes: Vec::new(), ..ModalAxis::from(&S10) };
    let (j, kt, r, l) = (rigid.inertia, rigid.torque_constant, rigid.resistance, rigid.inductance);
    for duration_s in [1e-6, 1e-4, 1e-2] {
        let step = rigid.step(duration_s).unwrap();
        assert_eq!(step.b.len(), 3);
        // L·J·v'' + R·J·v' + Kt²·v = Kt·U with real roots s1, s2.
        let root = (r * r / (4.0 * l * l) - kt * kt / (l * j)).sqrt();
        let (s1, s2) = (-r / (2.0 * l) + root, -r / (2.0 * l) - root);
        let e = |s: f64| (s * duration_s).exp_m1();
        let speed = (s2 * e(s1) - s1 * e(s2)) / (s1 - s2) / kt;
        assert!((step.b[1] / speed - 1.0).abs() < 1e-8, "{} {speed}", step.b[1]);
    }
}

/// What the supply gives and the coil and the modes' damping do not take is stored.
#[test]
fn energy_balances_with_many_modes() {
    let axis = three_modes();
    let (substep_s, n) = (2e-8, 20_000);
    let step = axis.step(substep_s).unwrap();
    let mut state = DVector::zeros(axis.n_states());
    let current = axis.n_states() - 1;
    let losses = |state: &DVector<f64>| -> f64 {
        let modes = axis.modes.iter().enumerate().map(|(index, mode)| {
            2.0 * mode.damping_ratio * mode.omega * mode.inertia * state[3 + 2 * index].powi(2)
        });
        axis.resistance * state[current].powi(2) + modes.sum::<f64>()
    };
    let (mut given, mut taken) = (0.0, 0.0);
    for index in 0..n {
        let voltage_v = if index < n / 2 { 20.0 } else { -20.0 };
        let next = &step.a * &state + &step.b * voltage_v;
        given += substep_s * voltage_v * 0.5 * (state[current] + next[current]);
        taken += substep_s * 0.5 * (losses(&state) + losses(&next));
        state = next;
    }
    let modes = axis.modes.iter().enumerate().map(|(index, mode)| {
        let (twist, speed) = (state[2 + 2 * index], state[3 + 2 * index]);
        mode.inertia * (speed * speed + (mode.omega * twist).powi(2))
    });
    let stored = 0.5
        * (axis.inertia * state[1] * state[1]
            + axis.inductance * state[current].powi(2)
            + modes.sum::<f64>());
    let error = (given - taken - stored).abs() / given;
    assert!(error < 1e-6, "{error:e} of {given} J");
}

/// Steps of any length agree: n short ones are one long one.
#[test]
fn steps_compose() {
    let axis = three_modes();
    let (long, short) = (axis.step(1e-5).unwrap(), axis.step(1e-6).unwrap());
    let mut state = DVector::from_element(axis.n_states(), 1e-3);
    let expected = &long.a * &state + &long.b * 5.0;
    for _ in 0..10 {
        state = &short.a * &state + &short.b * 5.0;
    }
    for row in 0..axis.n_states() {
        assert!((state[row] - expected[row]).abs() < 1e-10 * expected[row].abs().max(1e-6));
    }
}

#[test]
fn impossible_axes_are_refused_with_value_and_limit() {
    let good = three_modes();
    let message = |axis: &ModalAxis, period_s: f64| axis.step(period_s).unwrap_err().to_string();
    assert_eq!(
        message(&good, 1e-4),
        "mode 0 of 5200.0 Hz is above half the sample rate, 5000.0 Hz"
    );
    assert_eq!(
        message(&ModalAxis { inertia: 0.0, ..good.clone() }, 1e-5),
        "inertia = 0 is outside what an axis can have, above 0"
    );
    let mut bad = good.clone();
    bad.modes[1].damping_ratio = -0.1;
    assert_eq!(message(&bad, 1e-5), "mode 1: damping ratio = -0.1 is outside 0 to 1");
    bad.modes[1].damping_ratio = f64::NAN;
    assert!(matches!(bad.check(), Err(ModalError::Mode { mode_index: 1, .. })));
    assert!(matches!(good.step(0.0), Err(ModalError::NotPositive { name: "period", .. })));
}
