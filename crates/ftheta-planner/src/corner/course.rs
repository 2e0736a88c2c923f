//! What voltages make of an axis and of plants off the nominal one, under the servo of the nominal.

use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{Galvo, State, Step};
use ftheta_physics::servo::Gains;
use nalgebra::Vector6;

/// Lags after which a plant coasts steadily.
const N_LAGS: f64 = 60.0;

/// The nominal axis and plants that differ from it.
#[derive(Clone, Debug)]
pub(super) struct Plants {
    /// The nominal one first.
    plants: Vec<Plant>,
    /// Weights of the servo in states and last voltage.
    feedback: Vector6<f64>,
}

#[derive(Clone, Debug)]
struct Plant {
    step: Step,
    /// Mirror's angle at each look in a tick.
    angles: Vec<Weights>,
    /// Mirror's speed at each look in a tick.
    speeds: Vec<Weights>,
}

/// A quantity inside a tick: weights of the states before it, and of its voltage.
type Weights = (State, f64);

/// How far a plant is from the nominal one at the start of a tick: states and voltage.
type Deviation = (State, f64);

/// Where a motion begins.
#[derive(Clone, Debug)]
pub(super) struct Start {
    state: State,
    deviations: Vec<Deviation>,
}

/// A motion: linear in its start and its voltages.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// Nominal state at each tick, the end included.
    pub(super) states: Vec<State>,
    /// Nominal speed of the mirror at each look, rad/s.
    pub(super) speeds_rad_s: Vec<f64>,
    /// The mirror's angle of each plant, the nominal first, at each look, rad.
    pub(super) mirrors_rad: Vec<Vec<f64>>,
}

impl Plant {
    fn new(galvo: &Galvo, tick_s: f64, n_looks: usize) -> Self {
        let looks = |row: State| {
            let at = |look: usize| {
                let step = galvo.step(tick_s * (look + 1) as f64 / n_looks as f64);
                (step.a.transpose() * row, row.dot(&step.b))
            };
            (0..n_looks).map(at).collect()
        };
        Self {
            step: galvo.step(tick_s),
            angles: looks(galvo.mirror_row()),
            speeds: looks(galvo.mirror_speed_row()),
        }
    }

    fn advance(&self, state: &State, voltage_v: f64) -> State {
        self.step.a * state + self.step.b * voltage_v
    }
}

impl Plants {
    /// The nominal plant, and with state feedback the four at the ends of what the machine file is
    /// uncertain of: mode and torque constant, either way.
    ///
    /// * `n_looks`: in a tick, the last at its end
    pub(super) fn new(
        scanner: &Scanner,
        tick_s: f64,
        servo: Option<&Gains>,
        n_looks: usize,
    ) -> Self {
        let galvo = Galvo::new(scanner);
        let (mut galvos, mut feedback) = (vec![galvo], Vector6::zeros());
        if let Some(Gains::StateFeedback { k, .. }) = servo {
            feedback = *k;
            for sign in [-1.0, 1.0] {
                let omega = galvo.omega * (1.0 + sign * scanner.f1_uncertainty);
                let torque_constant = galvo.torque_constant * (1.0 + sign * scanner.kt_uncertainty);
                galvos.extend([Galvo { omega, ..galvo }, Galvo { torque_constant, ..galvo }]);
            }
        }
        let plants = galvos.iter().map(|galvo| Plant::new(galvo, tick_s, n_looks)).collect();
        Self { plants, feedback }
    }

    /// Looks in a tick.
    pub(super) fn n_looks(&self) -> usize {
        self.plants[0].angles.len()
    }

    /// At rest in the centre.
    pub(super) fn rest(&self) -> Start {
        let deviations = vec![(State::zeros(), 0.0); self.plants.len()];
        Start { state: State::zeros(), deviations }
    }

    /// Passing the centre at 1 rad/s, after a way long enough for all plants to coast steadily.
    ///
    /// * `lag_ticks`: the servo's lag
    /// * `coast_v`: voltage of coasting
    pub(super) fn coasting(&self, lag_ticks: f64, coast_v: f64) -> Start {
        let mut start = self.rest();
        start.state[1] = 1.0;
        for _ in 0..(N_LAGS * lag_ticks) as usize {
            self.deviate(&mut start, coast_v);
        }
        start
    }

    /// Plays these voltages.
    pub(super) fn play(&self, start: &Start, voltages_v: &[f64]) -> Course {
        let mut now = start.clone();
        let mut states = vec![now.state];
        let mut mirrors_rad = vec![Vec::new(); self.plants.len()];
        let mut speeds_rad_s = Vec::new();
        let at = |looks: &[Weights], state: State, voltage_v: f64| {
            let value = move |(weights, gain): &Weights| weights.dot(&state) + gain * voltage_v;
            looks.iter().map(value).collect::<Vec<_>>()
        };
        for &voltage_v in voltages_v {
            speeds_rad_s.extend(at(&self.plants[0].speeds, now.state, voltage_v));
            let deviations = self.plants.iter().zip(&now.deviations);
            for (mirror_rad, (plant, (state, voltage))) in mirrors_rad.iter_mut().zip(deviations) {
                mirror_rad.extend(at(&plant.angles, now.state + state, voltage_v + voltage));
            }
            self.deviate(&mut now, voltage_v);
            now.state = self.plants[0].advance(&now.state, voltage_v);
            states.push(now.state);
        }
        Course { states, speeds_rad_s, mirrors_rad }
    }

    /// Takes the deviations over a tick: the servo adds what a plant's distance from the nominal
    /// one is worth to the voltage one tick later.
    fn deviate(&self, now: &mut Start, voltage_v: f64) {
        let nominal = self.plants[0].advance(&now.state, voltage_v);
        for (plant, (state, voltage)) in self.plants.iter().zip(&mut now.deviations) {
            let feedback_v = self.feedback.fixed_rows::<5>(0).dot(state);
            let after = plant.advance(&(now.state + *state), voltage_v + *voltage) - nominal;
            *voltage = -feedback_v - self.feedback[5] * *voltage;
            *state = after;
        }
    }
}
