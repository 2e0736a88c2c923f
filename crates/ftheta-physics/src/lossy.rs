//! An axis whose torque constant falls with its angle and whose rotor rubs: steps and feed-forward.

use crate::galvo::{CURRENT, Galvo, State, Step};
use ftheta_model::machine::{Losses, Scanner};

/// Longest step with losses held, s.
const STEP_MAX_S: f64 = 1e-6;

/// An axis with losses, advanced over one fixed duration at constant voltage.
///
/// Losses act as a torque on the rotor and a voltage in the coil that are added to the exact linear
/// step: `Kt(θ) = Kt·(1 - falloff·(θ/θ_max)²)` for torque and back-EMF alike, friction
/// `-b·θ' - F·sign(θ')`, and at rest whatever up to `F` keeps the rotor at rest.
///
/// # Accuracy
/// Steps of at most 1 µs with the losses of their middle (second order). Against a fine Runge-Kutta
/// solution over a move of 10° with 6 % falloff: 1e-9 rad; with Coulomb friction, whose reversal
/// falls on a step's end, 2e-8 rad. A rotor that friction holds creeps less than 1e-8 rad.
///
/// Source: exponential midpoint rule; Coulomb friction by time stepping after Moreau 1988.
#[derive(Clone, Debug)]
pub struct LossyAxis {
    torque: LossTorque,
    half: Disturbed,
    whole: Disturbed,
    n_steps: u32,
}

/// Losses of one axis as functions of its state.
#[derive(Clone, Debug)]
struct LossTorque {
    losses: Losses,
    angle_max_rad: f64,
    torque_constant: f64,
    rotor_row: State,
    rotor_speed_row: State,
}

/// A linear step and what a torque on the rotor adds to it.
#[derive(Clone, Debug)]
struct Disturbed {
    step: Step,
    /// Effect of one N·m.
    per_torque: State,
    /// Effect of one N·m on the rotor's speed, rad/s.
    speed_per_torque: f64,
}

impl LossyAxis {
    /// The plant with the scanner's losses, or `None` if it has none and is linear.
    ///
    /// * `plant`: the axis as it is; the scanner gives losses and greatest angle
    /// * `duration_s`: what one call of `advance` covers
    pub fn new(plant: &Galvo, scanner: &Scanner, duration_s: f64) -> Option<Self> {
        if scanner.losses == Losses::default() {
            return None;
        }
        let n_steps = (duration_s / STEP_MAX_S - 1e-6).ceil().max(1.0);
        let step_s = duration_s / n_steps;
        Some(Self {
            torque: LossTorque::new(plant, scanner),
            half: Disturbed::new(plant, 0.5 * step_s),
            whole: Disturbed::new(plant, step_s),
            n_steps: n_steps as u32,
        })
    }

    /// The states one duration later, with the voltage held.
    pub fn advance(&self, state: &State, voltage_v: f64) -> State {
        (0..self.n_steps).fold(*state, |start, _| {
            let middle = self.rubbed(&self.half, &start, &start, voltage_v);
            self.rubbed(&self.whole, &start, &middle, voltage_v)
        })
    }

    /// One step from `start` with the losses that `seen` has.
    fn rubbed(&self, part: &Disturbed, start: &State, seen: &State, voltage_v: f64) -> State {
        let missing = self.torque.missing_torque_constant(seen);
        let speed = self.torque.rotor_speed_row.dot(seen);
        let viscous = self.torque.losses.friction_viscous_n_m_s_rad * speed;
        let smooth = -missing * seen[CURRENT] - viscous;
        let free = part.step.a * start
            + part.step.b * (voltage_v + missing * speed)
            + part.per_torque * smooth;
        // The torque that would stop the rotor by the end of the step, as far as friction can.
        let coulomb = self.torque.losses.friction_coulomb_n_m.max(0.0);
        let stopping = -self.torque.rotor_speed_row.dot(&free) / part.speed_per_torque;
        free + part.per_torque * stopping.clamp(-coulomb, coulomb)
    }
}

impl LossTorque {
    fn new(plant: &Galvo, scanner: &Scanner) -> Self {
        let rotor_row = plant.rotor_row();
        Self {
            losses: scanner.losses,
            angle_max_rad: scanner.angle_max_rad,
            torque_constant: plant.torque_constant,
            rotor_row,
            rotor_speed_row: State::new(0.0, rotor_row[0], 0.0, rotor_row[2], 0.0),
        }
    }

    /// By how much the torque constant is less than in the centre, N·m/A.
    fn missing_torque_constant(&self, state: &State) -> f64 {
        let share = self.rotor_row.dot(state) / self.angle_max_rad;
        self.torque_constant * (self.losses.torque_falloff * share * share).min(1.0)
    }

    /// Friction of a rotor that slides at the state's speed, N·m, along the speed.
    fn sliding_torque(&self, state: &State) -> f64 {
        let speed = self.rotor_speed_row.dot(state);
        let coulomb = self.losses.friction_coulomb_n_m;
        let sign = if speed == 0.0 { 0.0 } else { speed.signum() };
        self.losses.friction_viscous_n_m_s_rad * speed + coulomb * sign
    }
}

impl Disturbed {
    fn new(plant: &Galvo, duration_s: f64) -> Self {
        let step = plant.step(duration_s);
        // The integral of the transition over what one N·m does to the speeds, by Simpson's rule:
        // steps are so short that its error is below 1e-9.
        let column = State::new(0.0, 1.0 / plant.inertia(), 0.0, 1.0 / plant.rotor_inertia, 0.0);
        let middle = plant.step(0.5 * duration_s).a * column;
        let per_torque = (column + middle * 4.0 + step.a * column) * (duration_s / 6.0);
        let rotor_q = plant.mirror_inertia / plant.inertia();
        let speed_per_torque = per_torque[1] + rotor_q * per_torque[3];
        Self { step, per_torque, speed_per_torque }
    }
}

/// Voltages that move an axis with losses as the nominal axis moves with `voltages_v`, V.
///
/// The coil must carry `I' = (Kt·I + friction)/Kt(θ)`; the voltage that takes it there from tick to
/// tick is added, with the back-EMF that falls with the torque constant taken away.
///
/// * `states`: of the nominal axis at the ticks, one more than voltages
/// * returns: one voltage per tick; too few states give that many fewer voltages
///
/// # Accuracy
/// The current is right at the ticks and bends differently between them. On S10 with 6 % falloff,
/// 0.2 mN·m of Coulomb and 0.2 µN·m·s/rad of viscous friction the mirror of an open-loop move of
/// 10° in 1.2 ms strays by 1.9 µrad; uncorrected by 1502 µrad, with the falloff alone by 2736.
pub fn feed_forward(
    nominal: &Galvo,
    scanner: &Scanner,
    states: &[State],
    voltages_v: &[f64],
    tick_s: f64,
) -> Vec<f64> {
    let torque = LossTorque::new(nominal, scanner);
    let decay = (-nominal.resistance / nominal.inductance * tick_s).exp();
    let extra_a = |state: &State| {
        let missing = torque.missing_torque_constant(state);
        (missing * state[CURRENT] + torque.sliding_torque(state))
            / (nominal.torque_constant - missing).max(f64::MIN_POSITIVE)
    };
    let emf_less_v =
        |state: &State| torque.missing_torque_constant(state) * torque.rotor_speed_row.dot(state);
    let ticks = states.windows(2).zip(voltages_v);
    ticks
        .map(|(pair, voltage_v)| {
            let (before, after) = (&pair[0], &pair[1]);
            let change_a = extra_a(after) - decay * extra_a(before);
            let emf_v = 0.5 * (emf_less_v(before) + emf_less_v(after));
            voltage_v + change_a * nominal.resistance / (1.0 - decay) - emf_v
        })
        .collect()
}
