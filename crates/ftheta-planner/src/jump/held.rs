//! Plants that are not the nominal one, held by the servo while its commands are made for the
//! nominal one: how far they are beside it.

use super::JumpError;
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{Galvo, State, Step};
use ftheta_physics::servo::Gains;
use nalgebra::{SMatrix, SVector};

/// Difference of a plant from the nominal axis: its states, and the voltage under way.
pub(super) type Deviation = SVector<f64, N_DEVIATIONS>;
/// Number of these differences.
pub(super) const N_DEVIATIONS: usize = 6;

/// When one looks at a plant after the end, in lags of the servo.
const LOOKS: [f64; 12] = [0.0, 0.06, 0.12, 0.25, 0.37, 0.5, 0.7, 0.9, 1.1, 1.4, 1.8, 2.4];

/// A plant under its servo, beside the nominal axis that the commands are made for.
#[derive(Clone, Debug)]
pub(super) struct Held {
    motion: SMatrix<f64, N_DEVIATIONS, N_DEVIATIONS>,
    from_state: SMatrix<f64, N_DEVIATIONS, 5>,
    from_voltage: Deviation,
    /// Part of the bound that programs keep; none where the plant before stands for this one.
    pub(super) share: Option<f64>,
    /// Weights, at the end, of how far the mirror is beside the nominal one at each look, rad.
    pub(super) looks: Vec<Deviation>,
}

impl Held {
    /// The plants at the borders of what is known: the mode, and the torque.
    ///
    /// # Errors
    /// If the servo cannot be built, or has a memory of its own.
    pub(super) fn plants(scanner: &Scanner, tick_s: f64) -> Result<Vec<Self>, JumpError> {
        let nominal = Galvo::new(scanner);
        let unknown = || JumpError::NoServo;
        let gains = Gains::design(scanner, tick_s).map_err(|_| unknown())?;
        let Gains::StateFeedback { k, .. } = gains else {
            return Err(unknown());
        };
        let lag_ticks = gains.lag_s(&nominal) / tick_s;
        let (f1, kt) = (scanner.f1_uncertainty, scanner.kt_uncertainty);
        let mode = |part: f64| Galvo { omega: nominal.omega * (1.0 + part), ..nominal };
        let torque = |part: f64| Galvo {
            torque_constant: nominal.torque_constant * (1.0 + part),
            ..nominal
        };
        // More torque and less deviate the same way with opposite signs, but for their square.
        let borders = [
            (f1, mode(f1), Some(1.0)),
            (f1, mode(-f1), Some(1.0)),
            (kt, torque(-kt), Some(1.0 - kt)),
            (kt, torque(kt), None),
        ];
        let plants = borders.into_iter().filter(|(uncertainty, ..)| *uncertainty > 0.0);
        let held = |(_, plant, share): (f64, Galvo, Option<f64>)| {
            Self::new(&nominal, &plant, share, k.as_slice(), tick_s, lag_ticks)
        };
        Ok(plants.map(held).collect())
    }

    fn new(
        nominal: &Galvo,
        plant: &Galvo,
        share: Option<f64>,
        k: &[f64],
        tick_s: f64,
        lag_ticks: f64,
    ) -> Self {
        let (Step { a, b }, one) = (nominal.step(tick_s), plant.step(tick_s));
        let mut motion = SMatrix::<f64, N_DEVIATIONS, N_DEVIATIONS>::zeros();
        let mut from_state = SMatrix::<f64, N_DEVIATIONS, 5>::zeros();
        let mut from_voltage = Deviation::zeros();
        for row in 0..5 {
            for column in 0..5 {
                motion[(row, column)] = one.a[(row, column)];
                from_state[(row, column)] = one.a[(row, column)] - a[(row, column)];
            }
            motion[(row, 5)] = one.b[row];
            from_voltage[row] = one.b[row] - b[row];
        }
        // What the servo makes of the difference acts a tick later.
        for (column, gain) in k.iter().enumerate() {
            motion[(5, column)] = -gain;
        }
        let row = plant.mirror_row();
        let mut weights = Deviation::zeros();
        weights.fixed_rows_mut::<5>(0).copy_from(&row);
        let mut looks = Vec::with_capacity(LOOKS.len());
        let mut tick = 0;
        for look in LOOKS {
            while tick < (look * lag_ticks).round() as usize {
                weights = motion.transpose() * weights;
                tick += 1;
            }
            looks.push(weights);
        }
        Self { motion, from_state, from_voltage, share, looks }
    }

    /// How a difference at the end depends on the nominal states and the voltage of each tick.
    pub(super) fn deviation(&self, index: usize, n_ticks: usize) -> Vec<(State, f64)> {
        let mut weights = Deviation::zeros();
        weights[index] = 1.0;
        let mut ticks = vec![(State::zeros(), 0.0); n_ticks];
        for tick in ticks.iter_mut().rev() {
            *tick = (self.from_state.transpose() * weights, weights.dot(&self.from_voltage));
            weights = self.motion.transpose() * weights;
        }
        ticks
    }

    /// The difference a tick later.
    pub(super) fn advance(
        &self,
        deviation: &Deviation,
        state: &State,
        voltage_v: f64,
    ) -> Deviation {
        self.motion * deviation + self.from_state * state + self.from_voltage * voltage_v
    }
}
