//! One axis under its servo: reference angle in, state of mirror and coil out, tick by tick.

use crate::galvo::{CURRENT, Galvo, State, Step};
use crate::lossy::LossyAxis;
use crate::servo::{Gains, Memory, Seen};
use ftheta_model::block::VoltageSample;
use ftheta_model::machine::Scanner;
use nalgebra::{Complex, DMatrix, DVector};

/// An axis with its servo and driver, advanced by one reference angle per tick.
#[derive(Clone, Debug)]
pub struct AxisLoop {
    gains: Gains,
    step: Step,
    /// Takes the place of `step` where the scanner has losses.
    lossy: Option<LossyAxis>,
    rotor_row: State,
    /// Weights of the states in the current one tick later.
    current_row: State,
    tick_s: f64,
    voltage_max_v: f64,
    current_max_a: f64,
    memory: Memory,
    state: State,
    /// Voltage acting during the tick that comes next.
    pending_v: f64,
}

impl AxisLoop {
    /// An axis at rest in its centre.
    ///
    /// * `plant`: the axis as it is; `gains` were designed for the nominal one
    /// * `scanner`: the driver's limits and the axis's losses; servo and driver reckon with neither
    ///   falling torque nor friction
    pub fn new(plant: &Galvo, gains: Gains, scanner: &Scanner, tick_s: f64) -> Self {
        let step = plant.step(tick_s);
        Self {
            gains,
            step,
            lossy: LossyAxis::new(plant, scanner, tick_s),
            rotor_row: plant.rotor_row(),
            current_row: step.a.row(CURRENT).transpose(),
            tick_s,
            voltage_max_v: scanner.voltage_max_v,
            current_max_a: scanner.current_max_a,
            memory: Memory::default(),
            state: State::zeros(),
            pending_v: 0.0,
        }
    }

    /// The states now: at the beginning of the next tick.
    #[inline]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// True angle of the rotor, rad.
    #[inline]
    pub fn rotor_rad(&self) -> f64 {
        self.rotor_row.dot(&self.state)
    }

    /// Takes the reference of this tick and moves on to the next; returns the voltage that acted
    /// meanwhile, V.
    ///
    /// The servo reads state and reference now; what it computes acts one tick later.
    #[inline]
    pub fn tick(&mut self, reference_rad: f64, sensor_error_rad: f64) -> f64 {
        let acting_v = self.limited(self.pending_v);
        let seen = self.seen(acting_v, sensor_error_rad);
        self.pending_v = self.gains.voltage(&mut self.memory, reference_rad, &seen, self.tick_s);
        self.advance(acting_v)
    }

    /// Takes a planned voltage with the planned state, and moves on: the servo, which must be one
    /// of state feedback, adds what it makes of the difference.
    pub fn tick_beside(&mut self, planned: &VoltageSample, sensor_error_rad: f64) -> f64 {
        let acting_v = self.limited(self.pending_v);
        let answer_v =
            |seen: &Seen| self.gains.voltage(&mut Memory::default(), 0.0, seen, self.tick_s);
        let wanted = Seen {
            state: State::from_row_slice(&planned.state),
            sensor_rad: 0.0,
            sensor_error_rad: 0.0,
            voltage_v: planned.acting_v,
        };
        let seen = self.seen(acting_v, sensor_error_rad);
        let next_v = planned.next_v + answer_v(&seen) - answer_v(&wanted);
        self.pending_v = next_v;
        self.advance(acting_v)
    }

    fn seen(&self, acting_v: f64, sensor_error_rad: f64) -> Seen {
        Seen {
            state: self.state,
            sensor_rad: self.rotor_rad() + sensor_error_rad,
            sensor_error_rad,
            voltage_v: acting_v,
        }
    }

    #[inline]
    fn advance(&mut self, acting_v: f64) -> f64 {
        self.state = match &self.lossy {
            None => self.step.a * self.state + self.step.b * acting_v,
            Some(lossy) => lossy.advance(&self.state, acting_v),
        };
        acting_v
    }

    /// Voltage (V) that the servo asks of the driver for the coming tick, and the current (A) that
    /// it would end with: beyond a limit the driver clips, and the loop is not the designed one.
    #[inline]
    pub fn demand(&self) -> (f64, f64) {
        let voltage_v = self.pending_v.clamp(-self.voltage_max_v, self.voltage_max_v);
        let current_a = self.current_row.dot(&self.state) + self.step.b[CURRENT] * voltage_v;
        (self.pending_v, current_a)
    }

    /// What the driver makes of a voltage: within the supply, and not so much that the current
    /// leaves its limit by the end of the tick.
    #[inline]
    fn limited(&self, voltage_v: f64) -> f64 {
        let voltage_v = voltage_v.clamp(-self.voltage_max_v, self.voltage_max_v);
        let free = self.current_row.dot(&self.state);
        let per_volt = self.step.b[CURRENT];
        if per_volt.is_nan() || per_volt <= 0.0 {
            // The motor runs up within the tick, so that more voltage ends with no more current.
            return voltage_v;
        }
        let (low, high) =
            ((-self.current_max_a - free) / per_volt, (self.current_max_a - free) / per_volt);
        voltage_v.clamp(low, high).clamp(-self.voltage_max_v, self.voltage_max_v)
    }
}

/// Greatest factor by which a state of the closed loop grows per tick, without limits.
pub fn spectral_radius(plant: &Galvo, gains: &Gains, tick_s: f64) -> f64 {
    let values = ClosedLoop::new(plant, gains, tick_s).matrix.complex_eigenvalues();
    values.iter().map(|value| value.norm()).fold(0.0, f64::max)
}

/// The mirror's angle at the ticks per reference of a frequency, in the steady state without
/// limits; `None` where the loop does not answer with one.
///
/// # Accuracy
/// S10 with a lag of 164.19 µs at 10 µs, 318.3 Hz: 0.9903, -18.78° (`design/control.md` E).
pub fn response(plant: &Galvo, gains: &Gains, tick_s: f64, hz: f64) -> Option<Complex<f64>> {
    let ClosedLoop { matrix, input } = ClosedLoop::new(plant, gains, tick_s);
    let ahead = Complex::from_polar(1.0, std::f64::consts::TAU * hz * tick_s);
    let n_states = matrix.nrows();
    let resolvent = DMatrix::from_fn(n_states, n_states, |row, column| {
        let diagonal = if row == column { ahead } else { Complex::ZERO };
        diagonal - matrix[(row, column)]
    });
    let states = resolvent.lu().solve(&input.map(Complex::from))?;
    let row = plant.mirror_row();
    let angle: Complex<f64> = row.iter().zip(states.iter()).map(|(row, state)| state * *row).sum();
    angle.is_finite().then_some(angle)
}

/// The loop without limits: states of the axis, voltage under way, and what the servo remembers.
struct ClosedLoop {
    matrix: DMatrix<f64>,
    /// Effect of a reference of 1 rad.
    input: DVector<f64>,
}

impl ClosedLoop {
    /// The loop is linear, so it is found by playing each unit state, and the reference, for one
    /// tick.
    fn new(plant: &Galvo, gains: &Gains, tick_s: f64) -> Self {
        let step = plant.step(tick_s);
        let n_states = 6 + gains.n_memories();
        let after = |z: [f64; 9], reference_rad: f64| {
            let state = State::from_column_slice(&z[..5]);
            let mut memory = Memory::from_array([z[6], z[7], z[8]]);
            let seen = Seen {
                state,
                sensor_rad: plant.rotor_row().dot(&state),
                sensor_error_rad: 0.0,
                voltage_v: z[5],
            };
            let voltage_v = gains.voltage(&mut memory, reference_rad, &seen, tick_s);
            let next = step.a * state + step.b * z[5];
            let memory = memory.to_array();
            DVector::from_fn(n_states, |row, _| match row {
                0..5 => next[row],
                5 => voltage_v,
                _ => memory[row - 6],
            })
        };
        let columns: Vec<DVector<f64>> = (0..n_states)
            .map(|column| after(std::array::from_fn(|row| f64::from(u8::from(row == column))), 0.0))
            .collect();
        Self { matrix: DMatrix::from_columns(&columns), input: after([0.0; 9], 1.0) }
    }
}
