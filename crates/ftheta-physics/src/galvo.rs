//! One galvanometer axis as a linear system of five states, and its exact discrete form.
//!
//! States: `x` the angle of the whole (inertia-weighted mean), its speed, `q` the twist of the
//! shaft (rotor minus mirror), its speed, and the coil current. This modal form is well
//! conditioned; the rotor stands at `x + (Jm/J) q`, the mirror at `x - (Jr/J) q`.

use ftheta_model::machine::Scanner;
use nalgebra::{Matrix6, SMatrix, SVector};

/// States of one axis: x rad, x' rad/s, q rad, q' rad/s, current A.
pub type State = SVector<f64, 5>;

/// Index of the coil current in a [`State`].
pub const CURRENT: usize = 4;

/// Parameters of one axis, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Galvo {
    /// Inertia of the rotor, kg·m².
    pub rotor_inertia: f64,
    /// Inertia of the mirror, kg·m².
    pub mirror_inertia: f64,
    /// Torque constant, N·m/A, and back-EMF constant, V·s/rad.
    pub torque_constant: f64,
    /// Coil resistance, ohm.
    pub resistance: f64,
    /// Coil inductance, H.
    pub inductance: f64,
    /// Angular frequency of the torsional mode, rad/s.
    pub omega: f64,
    /// Damping ratio of the torsional mode.
    pub damping_ratio: f64,
}

/// State after a time at constant voltage: `a · state + b · voltage`.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Transition of the states.
    pub a: SMatrix<f64, 5, 5>,
    /// Effect of one volt.
    pub b: State,
}

impl Galvo {
    /// The axis that the machine file describes.
    pub fn new(scanner: &Scanner) -> Self {
        Self {
            rotor_inertia: scanner.rotor_inertia_kg_m2,
            mirror_inertia: scanner.mirror_inertia_kg_m2,
            torque_constant: scanner.torque_constant_n_m_a,
            resistance: scanner.resistance_ohm,
            inductance: scanner.inductance_h,
            omega: std::f64::consts::TAU * scanner.torsional_mode_hz,
            damping_ratio: scanner.damping_ratio,
        }
    }

    /// Inertia of rotor and mirror, kg·m².
    pub fn inertia(&self) -> f64 {
        self.rotor_inertia + self.mirror_inertia
    }

    /// Weights of the states in the mirror's angle, rad.
    pub fn mirror_row(&self) -> State {
        State::new(1.0, 0.0, -self.rotor_inertia / self.inertia(), 0.0, 0.0)
    }

    /// Weights of the states in the mirror's speed, rad/s.
    pub fn mirror_speed_row(&self) -> State {
        State::new(0.0, 1.0, 0.0, -self.rotor_inertia / self.inertia(), 0.0)
    }

    /// Weights of the states in the rotor's angle, where the sensor sits, rad.
    pub fn rotor_row(&self) -> State {
        State::new(1.0, 0.0, self.mirror_inertia / self.inertia(), 0.0, 0.0)
    }

    /// Continuous form: `state' = a · state + b · voltage`.
    ///
    /// Source: patent CN105005322B, "optimised" model, with separate inertias on both sides of
    /// the shaft (`design/control.md` A).
    pub fn continuous(&self) -> Step {
        let (kt, j) = (self.torque_constant, self.inertia());
        let emf = kt / self.inductance;
        let rotor_q = self.mirror_inertia / j;
        #[rustfmt::skip]
        let a = SMatrix::<f64, 5, 5>::from_row_slice(&[
            0.0, 1.0,  0.0, 0.0, 0.0,
            0.0, 0.0,  0.0, 0.0, kt / j,
            0.0, 0.0,  0.0, 1.0, 0.0,
            0.0, 0.0, -self.omega * self.omega, -2.0 * self.damping_ratio * self.omega,
            kt / self.rotor_inertia,
            0.0, -emf, 0.0, -emf * rotor_q, -self.resistance / self.inductance,
        ]);
        Step { a, b: State::new(0.0, 0.0, 0.0, 0.0, 1.0 / self.inductance) }
    }

    /// Exact step over `duration_s` with the voltage held.
    ///
    /// # Accuracy
    /// Matrix exponential in balanced units; 1e-9 relative after 1e5 steps.
    pub fn step(&self, duration_s: f64) -> Step {
        let Step { a, b } = self.continuous();
        // In units of one radian per mode period all entries are of order one, so the
        // exponential needs few squarings and loses no digits.
        let units = [1.0, self.omega, 1.0, self.omega, 1.0, 1.0];
        let mut m = Matrix6::zeros();
        for row in 0..5 {
            for column in 0..5 {
                m[(row, column)] = a[(row, column)] * duration_s * units[column] / units[row];
            }
            m[(row, 5)] = b[row] * duration_s * units[5] / units[row];
        }
        let e = m.exp();
        let scaled = |row: usize, column: usize| e[(row, column)] * units[row] / units[column];
        Step { a: SMatrix::from_fn(scaled), b: State::from_fn(|row, _| scaled(row, 5)) }
    }
}
