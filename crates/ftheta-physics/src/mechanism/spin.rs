//! Motion of a mechanism through angles of any size: elastic modes in a frame that turns.
//!
//! The frame's angle `Θ` is the rotation as a mode; the other modes `η` have no part in it. With
//! `Ω = Θ'` the kinetic energy is `½η'² + Ω·ηᵀGη' + ½Ω²·(J + 2rᵀη - ηᵀSη)`: `G` couples motions
//! across the shaft (Coriolis, Euler), `r` is the pull on what is off the axis, `S` the stiffening
//! by tension less the softening by displacement. The equations of motion follow by Lagrange:
//!
//! `η'' - 2ΩGη' - Ω'Gη + 2ζωη' + (ω² + Ω²S)η = Ω²r + p·torque`
//! `d/dt[(J + 2rᵀη - ηᵀSη)Ω + ηᵀGη'] = torque`
//!
//! Source: floating frame of reference with mean-axis conditions (Canavin and Likins 1977).

use super::rotation::Rotation;
use super::samples::{check_samples, spline_accelerations};
use super::{MechanismError, Modes};
use nalgebra::DVector;
use std::f64::consts::TAU;

/// A mechanism's equations of motion in its modes.
///
/// Displacements are small, the angle is not. Left out are the gyroscopic moments of the shaft's
/// sections, `Ω/ω` times the square of diameter by length against what is kept, and shear in the
/// mirror's tension, which is that of free strips across the shaft.
#[derive(Clone, Debug)]
pub struct Spin {
    inertia: f64,
    squares: DVector<f64>,
    damping: DVector<f64>,
    rotation: Rotation,
    rotor: DVector<f64>,
    mirror: DVector<f64>,
    tilt: DVector<f64>,
    step_s: f64,
}

/// Where a mechanism is.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinState {
    /// Angle of the frame, rad.
    pub angle_rad: f64,
    /// Its speed, rad/s.
    pub speed_rad_s: f64,
    /// Modal displacements.
    pub twist: DVector<f64>,
    /// Their speeds, 1/s.
    pub twist_speed: DVector<f64>,
}

/// What drives a mechanism, at the times of the samples.
#[derive(Clone, Copy, Debug)]
pub enum Driven<'a> {
    /// Torque on the rotor, N·m; straight between samples.
    Torque(&'a [f64]),
    /// Angle of the rotor, rad, whatever torque that takes; a cubic spline through the samples
    /// that starts and ends at rest.
    Angle(&'a [f64]),
}

/// Where rotor and mirror are at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionSample {
    /// Angle of the rotor, rad.
    pub rotor_rad: f64,
    /// Angle of the mirror about the shaft, rad.
    pub mirror_rad: f64,
    /// Angle of the mirror about x, rad.
    pub tilt_rad: f64,
    /// Torque on the rotor, N·m.
    pub torque_n_m: f64,
}

/// Input at a moment.
#[derive(Clone, Copy)]
enum Input {
    Torque(f64),
    Acceleration(f64),
}

/// Most steps of a computation.
const STEPS_MAX: f64 = 2e7;

/// Steps are this part of the fastest mode's radian.
const STEP_RADIANS: f64 = 0.1;

impl Spin {
    /// Equations of motion in these modes.
    pub fn new(modes: &Modes) -> Self {
        let n = modes.shapes.len();
        let each = |value: &dyn Fn(usize) -> f64| DVector::from_fn(n, |i, _| value(i));
        let omega = each(&|i| TAU * modes.shapes[i].frequency_hz);
        Self {
            inertia: modes.inertia_kg_m2,
            squares: omega.component_mul(&omega),
            damping: &omega * (2.0 * modes.damping_ratio),
            rotation: modes.rotation.clone(),
            rotor: each(&|i| modes.shapes[i].rotor),
            mirror: each(&|i| modes.shapes[i].mirror),
            tilt: each(&|i| modes.shapes[i].tilt),
            step_s: STEP_RADIANS / omega.max(),
        }
    }

    /// A mechanism at rest at an angle.
    pub fn rest(&self, angle_rad: f64) -> SpinState {
        let n = self.squares.len();
        SpinState {
            angle_rad,
            speed_rad_s: 0.0,
            twist: DVector::zeros(n),
            twist_speed: DVector::zeros(n),
        }
    }

    /// Kinetic and elastic energy, J.
    pub fn energy_j(&self, state: &SpinState) -> f64 {
        let (twist, speed) = (&state.twist, &state.twist_speed);
        let omega = state.speed_rad_s;
        0.5 * speed.norm_squared()
            + omega * twist.dot(&(&self.rotation.coupling * speed))
            + 0.5 * omega * omega * self.inertia_at(twist)
            + 0.5 * twist.component_mul(twist).dot(&self.squares)
    }

    /// Angular momentum about the shaft, N·m·s.
    pub fn momentum_n_m_s(&self, state: &SpinState) -> f64 {
        state.speed_rad_s * self.inertia_at(&state.twist)
            + state.twist.dot(&(&self.rotation.coupling * &state.twist_speed))
    }

    fn inertia_at(&self, twist: &DVector<f64>) -> f64 {
        self.inertia + 2.0 * self.rotation.pull.dot(twist)
            - twist.dot(&(&self.rotation.stiffening * twist))
    }

    /// Moves a state on by a time under a constant torque, N·m.
    ///
    /// # Errors
    /// If the time needs too many steps.
    pub fn advance(
        &self,
        state: &SpinState,
        torque_n_m: f64,
        duration_s: f64,
    ) -> Result<SpinState, MechanismError> {
        let n_steps = self.n_steps(duration_s, 0)?;
        let h = duration_s / n_steps as f64;
        Ok((0..n_steps)
            .fold(state.clone(), |now, _| self.step(&now, h, |_| Input::Torque(torque_n_m))))
    }

    /// Plays samples on a mechanism at rest; one sample of motion for each.
    ///
    /// * `times_s`: rising, as many as the samples of the drive
    ///
    /// # Errors
    /// Samples that are not finite or not in order, or a time that needs too many steps.
    ///
    /// # Accuracy
    /// Fourth-order Runge-Kutta in steps of a tenth of the fastest mode's radian: in one of its
    /// periods 5e-7 of its amplitude and 5e-6 rad of its phase, far less for slower modes.
    pub fn play(
        &self,
        times_s: &[f64],
        drive: Driven<'_>,
    ) -> Result<Vec<MotionSample>, MechanismError> {
        let (Driven::Torque(values) | Driven::Angle(values)) = drive;
        check_samples(times_s, values)?;
        let accelerations = match drive {
            Driven::Angle(angles) => spline_accelerations(times_s, angles),
            Driven::Torque(_) => Vec::new(),
        };
        let knots = if accelerations.is_empty() { values } else { &accelerations };
        let is_torque = accelerations.is_empty();
        let input = |value: f64| {
            if is_torque { Input::Torque(value) } else { Input::Acceleration(value) }
        };
        let mut state = self.rest(if is_torque { 0.0 } else { values[0] });
        let mut motion = Vec::with_capacity(times_s.len());
        motion.push(self.sample(&state, input(knots[0])));
        for (index, pair) in times_s.windows(2).enumerate() {
            let n_steps = self.n_steps(pair[1] - pair[0], index)?;
            let h = (pair[1] - pair[0]) / n_steps as f64;
            for step in 0..n_steps {
                state = self.step(&state, h, |share| {
                    let at = (step as f64 + share) / n_steps as f64;
                    input(knots[index] + at * (knots[index + 1] - knots[index]))
                });
            }
            motion.push(self.sample(&state, input(knots[index + 1])));
        }
        Ok(motion)
    }

    fn n_steps(&self, duration_s: f64, index: usize) -> Result<usize, MechanismError> {
        let n_steps = (duration_s / self.step_s).ceil().max(1.0);
        if n_steps <= STEPS_MAX {
            return Ok(n_steps as usize);
        }
        Err(MechanismError::Samples { index, what: "needs more than 2e7 steps to the next" })
    }

    fn sample(&self, state: &SpinState, input: Input) -> MotionSample {
        MotionSample {
            rotor_rad: state.angle_rad + self.rotor.dot(&state.twist),
            mirror_rad: state.angle_rad + self.mirror.dot(&state.twist),
            tilt_rad: self.tilt.dot(&state.twist),
            torque_n_m: self.accelerations(state, input).2,
        }
    }

    /// Accelerations of frame and modes, and the torque.
    fn accelerations(&self, state: &SpinState, input: Input) -> (f64, DVector<f64>, f64) {
        let (omega, twist, speed) = (state.speed_rad_s, &state.twist, &state.twist_speed);
        let across = &self.rotation.coupling * twist;
        let stiffened = &self.rotation.stiffening * twist;
        let forces = &self.rotation.coupling * speed * (2.0 * omega)
            - twist.component_mul(&self.squares)
            - speed.component_mul(&self.damping)
            + (&self.rotation.pull - &stiffened) * (omega * omega);
        // The modes' accelerations are forces + Ω'·across + torque·rotor; twistᵀG is -acrossᵀ.
        let inertia = self.inertia_at(twist) - across.norm_squared();
        let lever = 1.0 + across.dot(&self.rotor);
        let lost = 2.0 * omega * (self.rotation.pull.dot(speed) - stiffened.dot(speed))
            - across.dot(&forces);
        let torque = match input {
            Input::Torque(torque) => torque,
            // The rotor's acceleration Ω' + rotorᵀη'' is given.
            Input::Acceleration(acceleration) => {
                (acceleration - self.rotor.dot(&forces) + lever * lost / inertia)
                    / (self.rotor.norm_squared() + lever * lever / inertia)
            }
        };
        let turning = (torque * lever - lost) / inertia;
        (turning, forces + across * turning + &self.rotor * torque, torque)
    }

    /// One Runge-Kutta step; `input` at shares 0, ½ and 1 of it.
    fn step(&self, state: &SpinState, h: f64, input: impl Fn(f64) -> Input) -> SpinState {
        let slope = |at: &SpinState, share: f64| {
            let (turning, twisting, _) = self.accelerations(at, input(share));
            SpinState {
                angle_rad: at.speed_rad_s,
                speed_rad_s: turning,
                twist: at.twist_speed.clone(),
                twist_speed: twisting,
            }
        };
        let k1 = slope(state, 0.0);
        let k2 = slope(&state.moved(&k1, 0.5 * h), 0.5);
        let k3 = slope(&state.moved(&k2, 0.5 * h), 0.5);
        let k4 = slope(&state.moved(&k3, h), 1.0);
        state.moved(&k1, h / 6.0).moved(&k2, h / 3.0).moved(&k3, h / 3.0).moved(&k4, h / 6.0)
    }
}

impl SpinState {
    fn moved(&self, slope: &Self, h: f64) -> Self {
        Self {
            angle_rad: self.angle_rad + h * slope.angle_rad,
            speed_rad_s: self.speed_rad_s + h * slope.speed_rad_s,
            twist: &self.twist + &slope.twist * h,
            twist_speed: &self.twist_speed + &slope.twist_speed * h,
        }
    }
}
