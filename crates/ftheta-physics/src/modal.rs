//! One axis as a rigid body with any number of torsional modes and a coil, and its discrete form.
//!
//! States: `x` the angle of the whole, its speed, then every mode's twist and its speed, and last
//! the coil current. No mode is the rigid axis of three states; one mode is [`Galvo`].

use crate::galvo::Galvo;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Why an axis cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ModalError {
    /// A parameter that must be positive and finite.
    #[error("{name} = {value} is outside what an axis can have, above 0")]
    NotPositive {
        /// Parameter.
        name: &'static str,
        /// Its value, SI.
        value: f64,
    },
    /// A damping ratio outside 0 to 1, or a participation that is not finite.
    #[error("mode {mode_index}: {name} = {value} is outside {limit}")]
    Mode {
        /// Index of the mode from 0.
        mode_index: usize,
        /// Parameter.
        name: &'static str,
        /// Its value, SI.
        value: f64,
        /// What is allowed.
        limit: &'static str,
    },
    /// A mode that samples of the period cannot carry.
    #[error(
        "mode {mode_index} of {mode_hz:.1} Hz is above half the sample rate, {nyquist_hz:.1} Hz"
    )]
    Aliased {
        /// Index of the mode from 0.
        mode_index: usize,
        /// Its frequency, Hz.
        mode_hz: f64,
        /// Half the rate of the samples, Hz.
        nyquist_hz: f64,
    },
}

/// A torsional mode of rotor, shaft and mirror, free of the coil.
///
/// The twist `η` follows `η'' + 2ζω·η' + ω²·η = rotor/inertia · torque`. Its scale is free: `k`
/// times the participations go with `k²` times the inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Angular frequency, rad/s.
    pub omega: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Inertia of the mode, kg·m²: kinetic energy is half of it times `η'²`.
    pub inertia: f64,
    /// How far the rotor, on which coil and sensor act, turns per unit of twist.
    pub rotor: f64,
    /// How far the mirror turns per unit of twist.
    pub mirror: f64,
}

/// Parameters of an axis with any number of modes, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalAxis {
    /// Inertia of the whole, kg·m².
    pub inertia: f64,
    /// Torque constant, N·m/A, and back-EMF constant, V·s/rad.
    pub torque_constant: f64,
    /// Coil resistance, ohm.
    pub resistance: f64,
    /// Coil inductance, H.
    pub inductance: f64,
    /// The modes; none for a rigid axis.
    pub modes: Vec<Mode>,
}

/// State after a time at constant voltage: `a · state + b · voltage`.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalStep {
    /// Transition of the states.
    pub a: DMatrix<f64>,
    /// Effect of one volt.
    pub b: DVector<f64>,
}

impl From<&Galvo> for ModalAxis {
    /// The same axis with its one mode in a list. A galvo without mirror inertia is rigid.
    fn from(galvo: &Galvo) -> Self {
        let inertia = galvo.inertia();
        let mode = Mode {
            omega: galvo.omega,
            damping_ratio: galvo.damping_ratio,
            inertia: galvo.rotor_inertia * galvo.mirror_inertia / inertia,
            rotor: galvo.mirror_inertia / inertia,
            mirror: -galvo.rotor_inertia / inertia,
        };
        Self {
            inertia,
            torque_constant: galvo.torque_constant,
            resistance: galvo.resistance,
            inductance: galvo.inductance,
            modes: if galvo.mirror_inertia > 0.0 { vec![mode] } else { Vec::new() },
        }
    }
}

impl ModalAxis {
    /// Number of states: three, and two for every mode.
    pub fn n_states(&self) -> usize {
        3 + 2 * self.modes.len()
    }

    /// Refuses what cannot be.
    ///
    /// # Errors
    /// An inertia, coil value or frequency that is not positive and finite; a damping ratio outside
    /// 0 to 1; a participation that is not finite.
    pub fn check(&self) -> Result<(), ModalError> {
        for (name, value) in [
            ("inertia", self.inertia),
            ("torque constant", self.torque_constant),
            ("resistance", self.resistance),
            ("inductance", self.inductance),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ModalError::NotPositive { name, value });
            }
        }
        for (mode_index, mode) in self.modes.iter().enumerate() {
            let positive = |value: f64| value > 0.0 && value.is_finite();
            for (name, value, good, limit) in [
                ("omega", mode.omega, positive(mode.omega), "above 0"),
                ("inertia", mode.inertia, positive(mode.inertia), "above 0"),
                (
                    "damping ratio",
                    mode.damping_ratio,
                    (0.0..1.0).contains(&mode.damping_ratio),
                    "0 to 1",
                ),
                ("rotor participation", mode.rotor, mode.rotor.is_finite(), "finite numbers"),
                ("mirror participation", mode.mirror, mode.mirror.is_finite(), "finite numbers"),
            ] {
                if !good {
                    return Err(ModalError::Mode { mode_index, name, value, limit });
                }
            }
        }
        Ok(())
    }

    /// Weights of the states in the mirror's angle, rad.
    pub fn mirror_row(&self) -> DVector<f64> {
        self.row(|mode| mode.mirror)
    }

    /// Weights of the states in the rotor's angle, where the sensor sits, rad.
    pub fn rotor_row(&self) -> DVector<f64> {
        self.row(|mode| mode.rotor)
    }

    fn row(&self, participation: impl Fn(&Mode) -> f64) -> DVector<f64> {
        let mut row = DVector::zeros(self.n_states());
        row[0] = 1.0;
        for (index, mode) in self.modes.iter().enumerate() {
            row[2 + 2 * index] = participation(mode);
        }
        row
    }

    /// Continuous form: `state' = a · state + b · voltage`.
    pub fn continuous(&self) -> ModalStep {
        let n = self.n_states();
        let current = n - 1;
        let mut a = DMatrix::zeros(n, n);
        let emf = self.torque_constant / self.inductance;
        a[(0, 1)] = 1.0;
        a[(1, current)] = self.torque_constant / self.inertia;
        a[(current, 1)] = -emf;
        a[(current, current)] = -self.resistance / self.inductance;
        for (index, mode) in self.modes.iter().enumerate() {
            let twist = 2 + 2 * index;
            a[(twist, twist + 1)] = 1.0;
            a[(twist + 1, twist)] = -mode.omega * mode.omega;
            a[(twist + 1, twist + 1)] = -2.0 * mode.damping_ratio * mode.omega;
            a[(twist + 1, current)] = self.torque_constant * mode.rotor / mode.inertia;
            a[(current, twist + 1)] = -emf * mode.rotor;
        }
        let mut b = DVector::zeros(n);
        b[current] = 1.0 / self.inductance;
        ModalStep { a, b }
    }

    /// Exact step over `duration_s` with the voltage held.
    ///
    /// # Errors
    /// If a parameter cannot be, or a mode lies above half the sample rate `1/duration_s`: it would
    /// move unseen between the samples.
    ///
    /// # Accuracy
    /// Matrix exponential in balanced units, 1e-12 relative.
    pub fn step(&self, duration_s: f64) -> Result<ModalStep, ModalError> {
        self.check()?;
        if !(duration_s > 0.0 && duration_s.is_finite()) {
            return Err(ModalError::NotPositive { name: "period", value: duration_s });
        }
        let nyquist_hz = 0.5 / duration_s;
        for (mode_index, mode) in self.modes.iter().enumerate() {
            let mode_hz = mode.omega / std::f64::consts::TAU;
            if mode_hz >= nyquist_hz {
                return Err(ModalError::Aliased { mode_index, mode_hz, nyquist_hz });
            }
        }
        Ok(self.held(duration_s))
    }

    /// The step without a look at aliasing, for durations between samples.
    fn held(&self, duration_s: f64) -> ModalStep {
        let ModalStep { a, b } = self.continuous();
        let n = self.n_states();
        // Units in which neighbouring entries are alike, so that the exponential loses no digits:
        // a radian, one per period of the fastest part, and the current and voltage to go with it.
        let coil = self.resistance / self.inductance;
        let omega = self.modes.iter().map(|mode| mode.omega).fold(coil, f64::max);
        let current = omega * omega * self.inertia / self.torque_constant;
        let unit = |index: usize| match index {
            _ if index == n => omega * self.inductance * current,
            _ if index == n - 1 => current,
            _ if index % 2 == 1 => omega,
            _ => 1.0,
        };
        let mut m = DMatrix::zeros(n + 1, n + 1);
        for row in 0..n {
            for column in 0..n {
                m[(row, column)] = a[(row, column)] * duration_s * unit(column) / unit(row);
            }
            m[(row, n)] = b[row] * duration_s * unit(n) / unit(row);
        }
        let e = m.exp();
        let scaled = |row: usize, column: usize| e[(row, column)] * unit(row) / unit(column);
        ModalStep {
            a: DMatrix::from_fn(n, n, scaled),
            b: DVector::from_fn(n, |row, _| scaled(row, n)),
        }
    }
}
