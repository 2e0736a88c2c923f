//! The position loop in the scanner's driver: state feedback, or PID with a current loop.

use crate::galvo::{Galvo, State};
use ftheta_model::machine::{Scanner, Servo};
use nalgebra::{Matrix6, Vector6};
use thiserror::Error;

/// Why a servo cannot be built.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ServoError {
    /// No weight gives the lag.
    #[error(
        "servo lag {lag_us:.1} µs cannot be reached, the range is {low_us:.1} to {high_us:.1} µs"
    )]
    Lag {
        /// Lag asked for, µs.
        lag_us: f64,
        /// Shortest possible, µs.
        low_us: f64,
        /// Longest possible, µs.
        high_us: f64,
    },
    /// The mode is too fast for the tick.
    #[error("torsional mode of {mode_hz:.0} Hz is too high for ticks, limit {nyquist_hz:.0} Hz")]
    Aliased {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Half the rate of the ticks, Hz.
        nyquist_hz: f64,
    },
    /// The closed loop grows.
    #[error(
        "servo is unstable: the closed loop's greatest factor per tick is {radius:.4}, limit 1"
    )]
    Unstable {
        /// Spectral radius of the closed loop.
        radius: f64,
    },
}

impl ServoError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Lag { lag_us, low_us, high_us } => (
                "scanner.servo.lag_us".into(),
                format!("{lag_us:.1} µs"),
                format!("{low_us:.1} to {high_us:.1} µs"),
            ),
            Self::Aliased { mode_hz, nyquist_hz } => (
                "scanner.torsional_mode_hz".into(),
                format!("{mode_hz:.0} Hz"),
                format!("{nyquist_hz:.0} Hz"),
            ),
            Self::Unstable { radius } => {
                ("scanner.servo".into(), format!("{radius:.4} per tick"), "1 per tick".into())
            }
        }
    }
}

/// Gains of a servo, computed once for the nominal axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gains {
    /// `u = k0 · reference - k · (state, last voltage)`.
    StateFeedback {
        /// Weight of the reference, V/rad.
        k0: f64,
        /// Weights of x, x', q, q', I and the voltage one tick before.
        k: Vector6<f64>,
        /// Weight of the voltage in the cost that gave the lag, mrad²/V².
        rho: f64,
    },
    /// PID on the sensor's angle, current loop inside.
    Pid(PidGains),
}

/// Gains of the PID servo with its inner current loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// Current per angle error, A/rad.
    pub proportional: f64,
    /// Current per integrated angle error, A/(rad·s).
    pub integral: f64,
    /// Current per speed of the rotor, A·s/rad.
    pub derivative: f64,
    /// Voltage per current error, V/A.
    pub current_proportional: f64,
    /// Voltage per integrated current error, V/(A·s).
    pub current_integral: f64,
}

/// Memory of a servo between ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory {
    last_angle: f64,
    current_integral: f64,
    position_integral: f64,
}

/// What a servo sees at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The axis; only state feedback looks at more than the current.
    pub state: State,
    /// Angle of the rotor as the sensor gives it, rad.
    pub sensor_rad: f64,
    /// Error of the sensor, measured minus true, rad.
    pub sensor_error_rad: f64,
    /// Voltage acting during the tick that now begins, V.
    pub voltage_v: f64,
}

impl Gains {
    /// Gains for a scanner's nominal axis at a tick.
    ///
    /// # Errors
    /// If the mode lies above half the rate of the ticks, the lag asked for is out of reach, or the
    /// loop would be unstable.
    pub fn design(scanner: &Scanner, tick_s: f64) -> Result<Self, ServoError> {
        let (mode_hz, nyquist_hz) = (scanner.torsional_mode_hz, 0.5 / tick_s);
        if mode_hz >= nyquist_hz {
            return Err(ServoError::Aliased { mode_hz, nyquist_hz });
        }
        let galvo = Galvo::new(scanner);
        match scanner.servo {
            Servo::StateFeedback { velocity_weight_s, lag_s } => {
                state_feedback(&galvo, tick_s, velocity_weight_s, lag_s)
            }
            Servo::Pid { .. } => {
                let gains = Self::Pid(pid(&galvo, &scanner.servo));
                let radius = crate::axis_loop::spectral_radius(&galvo, &gains, tick_s);
                if radius < 1.0 { Ok(gains) } else { Err(ServoError::Unstable { radius }) }
            }
        }
    }

    /// Lag behind a ramp, s: in the steady state, and for a PID servo before its integral acts.
    pub fn lag_s(&self, galvo: &Galvo) -> f64 {
        match self {
            // At constant speed v: I = 0, q = 0, u = Kt·v = k0·(v·lag) - k1·v - k5·Kt·v.
            Self::StateFeedback { k0, k, .. } => (galvo.torque_constant * (1.0 + k[5]) + k[1]) / k0,
            Self::Pid(gains) => gains.derivative / gains.proportional,
        }
    }

    /// The reference for which the servo applies a voltage in the next tick, rad: the servo's law,
    /// solved for it. `None` for a servo whose memory would outlast the motion.
    ///
    /// * `state`: the axis now
    /// * `acting_v`: voltage acting until the next tick, V
    /// * `next_v`: voltage wanted then, V
    pub fn reference_rad(&self, state: &State, acting_v: f64, next_v: f64) -> Option<f64> {
        let Self::StateFeedback { k0, k, .. } = self else {
            return None;
        };
        let feedback_v: f64 = state.iter().zip(k.iter()).map(|(value, gain)| value * gain).sum();
        Some((next_v + feedback_v + k[5] * acting_v) / k0)
    }

    /// How many values of a [`Memory`] the servo uses; a value it does not use would stand in the
    /// closed loop as a state that never decays.
    pub(crate) fn n_memories(&self) -> usize {
        match self {
            Self::StateFeedback { .. } => 0,
            Self::Pid(gains) if gains.integral == 0.0 => 2,
            Self::Pid(_) => 3,
        }
    }

    /// Voltage for the tick after the one that now begins, before limits, V.
    pub fn voltage(&self, memory: &mut Memory, reference: f64, seen: &Seen, tick_s: f64) -> f64 {
        match self {
            Self::StateFeedback { k0, k, .. } => {
                let z = &seen.state;
                k0 * reference
                    - k[0] * (z[0] + seen.sensor_error_rad)
                    - k[1] * z[1]
                    - k[2] * z[2]
                    - k[3] * z[3]
                    - k[4] * z[4]
                    - k[5] * seen.voltage_v
            }
            Self::Pid(gains) => gains.voltage(memory, reference, seen, tick_s),
        }
    }
}

impl Memory {
    pub(crate) fn from_array([last_angle, current_integral, position_integral]: [f64; 3]) -> Self {
        Self { last_angle, current_integral, position_integral }
    }

    pub(crate) fn to_array(self) -> [f64; 3] {
        [self.last_angle, self.current_integral, self.position_integral]
    }
}

impl PidGains {
    fn voltage(&self, memory: &mut Memory, reference: f64, seen: &Seen, tick_s: f64) -> f64 {
        let error = reference - seen.sensor_rad;
        let speed = (seen.sensor_rad - memory.last_angle) / tick_s;
        memory.last_angle = seen.sensor_rad;
        memory.position_integral += error * tick_s;
        let wanted = self.proportional * error + self.integral * memory.position_integral
            - self.derivative * speed;
        let current_error = wanted - seen.state[crate::galvo::CURRENT];
        memory.current_integral += current_error * tick_s;
        self.current_proportional * current_error + self.current_integral * memory.current_integral
    }
}

/// Rigid-body design: the current loop's zero cancels the coil's pole, the position loop is a
/// second-order system with the derivative on the measured angle.
fn pid(galvo: &Galvo, servo: &Servo) -> PidGains {
    let &Servo::Pid { bandwidth_hz, damping, integral_time_s, current_bandwidth_hz } = servo else {
        return PidGains {
            proportional: 0.0,
            integral: 0.0,
            derivative: 0.0,
            current_proportional: 0.0,
            current_integral: 0.0,
        };
    };
    let position = std::f64::consts::TAU * bandwidth_hz;
    let current = std::f64::consts::TAU * current_bandwidth_hz;
    let stiffness = galvo.inertia() / galvo.torque_constant;
    PidGains {
        proportional: stiffness * position * position,
        integral: stiffness * position * position / integral_time_s,
        derivative: stiffness * 2.0 * damping * position,
        current_proportional: galvo.inductance * current,
        current_integral: galvo.resistance * current,
    }
}

/// Searches the voltage weight whose regulator has the lag asked for.
fn state_feedback(
    galvo: &Galvo,
    tick_s: f64,
    velocity_weight_s: f64,
    lag_s: f64,
) -> Result<Gains, ServoError> {
    let gains = |log_rho: f64| regulator(galvo, tick_s, velocity_weight_s, log_rho.exp());
    // mrad²/V²: from voltage that costs next to nothing to voltage that is hardly used.
    let (mut low, mut high) = (1e-8_f64.ln(), 1e4_f64.ln());
    let (low_s, high_s) = (gains(low).lag_s(galvo), gains(high).lag_s(galvo));
    if !(low_s < lag_s && lag_s < high_s) {
        return Err(ServoError::Lag {
            lag_us: lag_s * 1e6,
            low_us: low_s * 1e6,
            high_us: high_s * 1e6,
        });
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if gains(middle).lag_s(galvo) < lag_s {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(gains(0.5 * (low + high)))
}

/// Discrete linear-quadratic regulator with one tick of delay.
///
/// Stage cost `φ² + (τ φ')² + ρ u²`, mirror angle φ in mrad, u in V; the control acts one tick
/// after it is computed, so the state is the axis and the voltage under way.
fn regulator(galvo: &Galvo, tick_s: f64, velocity_weight_s: f64, rho: f64) -> Gains {
    // Inside: mrad, so that cost and states are of the same order.
    const RAD_FROM_MRAD: f64 = 1e-3;
    let step = galvo.step(tick_s);
    let unit = [RAD_FROM_MRAD, RAD_FROM_MRAD, RAD_FROM_MRAD, RAD_FROM_MRAD, 1.0];
    let mut a = Matrix6::zeros();
    for row in 0..5 {
        for column in 0..5 {
            a[(row, column)] = step.a[(row, column)] * unit[column] / unit[row];
        }
        a[(row, 5)] = step.b[row] / unit[row];
    }
    let b = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let row = |weights: State| {
        let mut full = Vector6::zeros();
        full.fixed_rows_mut::<5>(0).copy_from(&weights);
        full
    };
    let (angle, speed) = (row(galvo.mirror_row()), row(galvo.mirror_speed_row()));
    let q = angle * angle.transpose()
        + speed * speed.transpose() * (velocity_weight_s * velocity_weight_s);
    let x = riccati(a, b * b.transpose() / rho, q);
    let bx = b.transpose() * x;
    let k = (bx * a).transpose() / (rho + (bx * b)[0]);
    let k = Vector6::from_fn(|i, _| if i < 5 { k[i] / unit[i] } else { k[5] });
    // At rest no current flows and the voltage is zero, so the gain at zero frequency is k/k0.
    Gains::StateFeedback { k0: k[0], k, rho }
}

/// Stabilising solution of the discrete algebraic Riccati equation by structured doubling.
///
/// Source: Chu, Fan, Lin, Wang 2004, "Structure-preserving algorithms for periodic discrete-time
/// algebraic Riccati equations" (the doubling iteration, quadratic convergence).
fn riccati(mut a: Matrix6<f64>, mut g: Matrix6<f64>, mut h: Matrix6<f64>) -> Matrix6<f64> {
    for _ in 0..40 {
        let Some(w) = (Matrix6::identity() + g * h).try_inverse() else {
            break;
        };
        let (wa, change) = (w * a, a.transpose() * h * (w * a));
        g += a * w * g * a.transpose();
        h += change;
        a *= wa;
        g = (g + g.transpose()) * 0.5;
        h = (h + h.transpose()) * 0.5;
        if change.norm() <= 1e-15 * h.norm() {
            break;
        }
    }
    h
}
