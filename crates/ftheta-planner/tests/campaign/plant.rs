//! An axis of its own, for checks: rotor and mirror as two masses on a spring, no planner's code.
#![allow(dead_code, reason = "tests, bench and example each use a part of it")]

use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
use serde_json::Value;

/// Substeps of a tick in the checks: 2 µs of 10.
pub const N_SUBSTEPS: usize = 5;
/// Period, s.
pub const TICK_S: f64 = 1e-5;

/// Mirror angle and speed, twist and its speed, current.
pub type Motion = [f64; 5];

/// The reference scanner of this name, from the fixture.
pub fn scanner(set: &str) -> Scanner {
    let text = include_str!("../fixtures/limits.json");
    let reference: Value = serde_json::from_str(text).unwrap_or_default();
    // A missing number stays not a number, which the planner refuses.
    let number = |key: &str| reference["sets"][set][key].as_f64().unwrap_or(f64::NAN);
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
        servo: Servo::StateFeedback { velocity_weight_s: 1e-4, lag_s: 1.64e-4 },
        sensor: Sensor::default(),
    }
}

/// Motion over a stretch of time with the voltage held.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flow {
    pub motion: [[f64; 5]; 5],
    pub voltage: Motion,
}

impl Flow {
    /// Taylor series of the two-mass equations; the time must be short against the mode.
    pub fn new(scanner: &Scanner, duration_s: f64) -> Self {
        let (rotor, mirror) = (scanner.rotor_inertia_kg_m2, scanner.mirror_inertia_kg_m2);
        let omega = std::f64::consts::TAU * scanner.torsional_mode_hz;
        let reduced = (rotor.recip() + mirror.recip()).recip();
        let stiffness = omega * omega * reduced;
        let damping = 2.0 * scanner.damping_ratio * omega * reduced;
        let (kt, l) = (scanner.torque_constant_n_m_a, scanner.inductance_h);
        let rate = [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, stiffness / mirror, damping / mirror, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, -stiffness / reduced, -damping / reduced, kt / rotor],
            [0.0, -kt / l, 0.0, -kt / l, -scanner.resistance_ohm / l],
        ];
        // Columns: where each unit state goes, and what one volt adds.
        let series = |start: Motion, input: Motion| {
            let (mut sum, mut term) = (start, start);
            for order in 1..40 {
                let forced = if order == 1 { input } else { [0.0; 5] };
                let next = product(&rate, &term);
                let factor = duration_s / f64::from(order);
                term = std::array::from_fn(|i| factor * (next[i] + forced[i]));
                sum = std::array::from_fn(|i| sum[i] + term[i]);
            }
            sum
        };
        let unit = |column: usize| std::array::from_fn(|i| if i == column { 1.0 } else { 0.0 });
        let columns: [Motion; 5] = std::array::from_fn(|column| series(unit(column), [0.0; 5]));
        let motion = std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]));
        Self { motion, voltage: series([0.0; 5], [0.0, 0.0, 0.0, 0.0, l.recip()]) }
    }

    /// The state after that time.
    pub fn after(&self, state: &Motion, voltage_v: f64) -> Motion {
        let free = product(&self.motion, state);
        std::array::from_fn(|i| free[i] + self.voltage[i] * voltage_v)
    }
}

fn product(matrix: &[[f64; 5]; 5], state: &Motion) -> Motion {
    matrix.map(|row| row.iter().zip(state).map(|(a, b)| a * b).sum())
}
