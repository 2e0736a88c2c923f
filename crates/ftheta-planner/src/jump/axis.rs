//! One axis as the jump programs see it: discrete motion, limits, and plants to be robust against.

use super::fan::Ask;
use super::held::Held;
use super::program::{self, Ends, Goal, Request, Way};
use super::{JumpError, polish};
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, Galvo, State, Step};

/// Longest time between two checks of the current, s; a tick has from 10 to 100 checks.
const CHECK_S: f64 = 1e-6;
/// Where in a slow tick the program bounds the current: a parabola between two ticks stays within
/// a thousandth of its bend.
const BOUNDED: [f64; 3] = [0.2, 0.5, 0.8];
/// The same for ticks in which the mode or the coil's time constant bends the current more.
const BOUNDED_OFTEN: [f64; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
/// Damping ratios that a robust jump stands, and what is between: nobody measures them, so both
/// ends of what is seen; the machine's own if it lies beyond.
const DAMPING_RATIOS: [f64; 2] = [0.0025, 0.02];
/// Parts of a tick after which the mirror's angle is looked at, besides its end. Between two looks
/// it bends by a few millionths of the angle limit, between two ticks by sixteen times that.
const TURNS: [f64; 3] = [0.25, 0.5, 0.75];
/// How closely uncertain plants are looked at.
#[derive(Clone, Copy, Debug)]
struct Watch {
    /// Frequencies of the torsional mode over the uncertainty.
    n_frequencies: usize,
    /// When one looks at what is left of the motion, in units of the time that a left current needs
    /// to drive the rigid part farthest away.
    looks: &'static [f64],
    /// Part of the allowed end error that the program may use; the rest is for what is between
    /// the frequencies and the looks.
    error_share: f64,
}

/// Enough for an atlas, whose sequences are solved by the hundred.
const ROBUST: Watch = Watch { n_frequencies: 7, looks: &[0.0, 0.5, 1.0], error_share: 0.95 };
/// What remains to be had costs four times the work. The last look is at rest.
const CLOSEST: Watch = Watch {
    n_frequencies: 13,
    looks: &[0.0, 0.25, 0.5, 0.75, 0.9, 1.05, 1.3, 3.0, 30.0],
    error_share: 0.982,
};

/// What is known of the torsional mode, and what the end of the jump must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// Infinitely stiff shaft, exact rest.
    Rigid,
    /// The nominal mode, exact rest.
    Flexible,
    /// Driven by these voltages, every plant whose mode is within the scanner's uncertainty and
    /// whose damping ratio is from 0.0025 to 0.02 ends within this many rad of the target, its
    /// vibration included, and stays there; nominally no current is left.
    Robust {
        /// Allowed end error, rad mechanical.
        epsilon_rad: f64,
    },
    /// As robust, with all of the tolerance used: plants and times are closer, and the place of
    /// rest may be off the target too. Single steps, not atlases, whose jumps end at their target.
    Closest {
        /// Allowed end error, rad mechanical.
        epsilon_rad: f64,
    },
    /// The nominal mode, exactly at the end; held by the servo, every plant whose mode and torque
    /// constant are within the scanner's uncertainty stays within this many rad of the nominal
    /// mirror from there on.
    Held {
        /// Allowed distance, rad mechanical.
        epsilon_rad: f64,
    },
}

/// How the jumps are to be computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisOptions {
    /// What is known of the mode.
    pub model: Model,
    /// Period of the voltage, s.
    pub tick_s: f64,
    /// Part of the voltage kept for the feedback, 0 to below 1.
    pub voltage_reserve: f64,
    /// When the current keeps its limit.
    pub current_bound: CurrentBound,
}

/// When the current keeps its limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurrentBound {
    /// At every time.
    #[default]
    Always,
    /// At the ticks only, as reference figures are computed: between two ticks at the limit the
    /// current of a 10 µs tick then bends past it by up to 2e-4 of the limit.
    AtTicks,
}

/// The longest step in a number of ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Distance from rest to rest, rad mechanical.
    pub step_rad: f64,
    /// Voltage of each tick, V.
    pub voltages_v: Vec<f64>,
}

/// A quantity inside a tick: weights of the states before it, and of its voltage.
pub(super) type Weights = (State, f64);

/// One plant whose distance from rest at the end is bounded.
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub(super) step: Step,
    /// What is bounded at each look, as weights of the state at the end of the jump, rad.
    pub(super) looks: Vec<Look>,
}

/// Weights of the state at the end of a jump in what is left at some time: how far the rigid part
/// still has to creep, and the two components of the mirror's vibration, rad.
pub(super) type Look = [State; 3];

impl Plant {
    /// How the plant's deviation from the nominal axis in a state at the end depends on the nominal
    /// states and the voltage of each tick.
    ///
    /// Deviations, since they are small: the plant's whole motion, as a sum over voltages, would
    /// lose the end in rounding.
    pub(super) fn deviation(&self, nominal: &Step, state: usize, n_ticks: usize) -> Vec<Weights> {
        let mut weights = State::zeros();
        weights[state] = 1.0;
        let (a, b) = (self.step.a - nominal.a, self.step.b - nominal.b);
        let mut ticks = vec![(State::zeros(), 0.0); n_ticks];
        for tick in ticks.iter_mut().rev() {
            *tick = (a.transpose() * weights, weights.dot(&b));
            weights = self.step.a.transpose() * weights;
        }
        ticks
    }
}

/// One axis, its discrete motion and limits.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Rigid or nominal flexible motion over one tick.
    pub(super) step: Step,
    /// Which states the model has.
    pub(super) active: &'static [usize],
    /// Which of them must be zero at the end.
    pub(super) rest: &'static [usize],
    pub(super) tick_s: f64,
    pub(super) voltage_max_v: f64,
    pub(super) current_max_a: f64,
    /// The motion behind `step`.
    pub(super) galvo: Galvo,
    /// Plants whose distance from rest is bounded, and the bound, rad.
    pub(super) plants: Vec<Plant>,
    pub(super) residual_max_rad: f64,
    /// Whether the place of rest may be off the target, within that bound.
    pub(super) rests_anywhere: bool,
    /// Plants that the servo has to hold within the same bound.
    pub(super) held: Vec<Held>,
    /// Current where it is checked inside the tick.
    inside: Vec<Weights>,
    /// The same where the program bounds it.
    pub(super) bounded: Vec<Weights>,
    /// Mirror's angle inside the tick and at its end.
    pub(super) mirror: Vec<Weights>,
}

impl Axis {
    /// The axis of this scanner.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(scanner: &Scanner, options: AxisOptions) -> Result<Self, JumpError> {
        check(scanner, options)?;
        let nominal = Galvo::new(scanner);
        let (galvo, active, rest): (Galvo, &'static [usize], &'static [usize]) = match options.model
        {
            Model::Rigid => (rigid(&nominal), &[0, 1, 4], &[1, 4]),
            Model::Flexible | Model::Held { .. } => (nominal, &[0, 1, 2, 3, 4], &[1, 2, 3, 4]),
            Model::Robust { .. } | Model::Closest { .. } => (nominal, &[0, 1, 2, 3, 4], &[4]),
        };
        let watched = |watch: Watch, epsilon_rad: f64| {
            let plants = uncertain(&nominal, scanner.f1_uncertainty, options.tick_s, watch);
            (plants, watch.error_share * epsilon_rad)
        };
        let mut held = Vec::new();
        let (plants, residual_max_rad) = match options.model {
            Model::Rigid | Model::Flexible => (Vec::new(), f64::INFINITY),
            Model::Robust { epsilon_rad } => watched(ROBUST, epsilon_rad),
            Model::Closest { epsilon_rad } => watched(CLOSEST, epsilon_rad),
            Model::Held { epsilon_rad } => {
                held = Held::plants(scanner, options.tick_s)?;
                (Vec::new(), ROBUST.error_share * epsilon_rad)
            }
        };
        let (inside, bounded) = match options.current_bound {
            CurrentBound::Always => currents(&galvo, options.tick_s),
            CurrentBound::AtTicks => (Vec::new(), Vec::new()),
        };
        let mirror = TURNS.into_iter().chain([1.0]).map(|part| {
            let step = galvo.step(options.tick_s * part);
            let row = galvo.mirror_row();
            (step.a.transpose() * row, row.dot(&step.b))
        });
        Ok(Self {
            step: galvo.step(options.tick_s),
            mirror: mirror.collect(),
            active,
            rest,
            tick_s: options.tick_s,
            voltage_max_v: scanner.voltage_max_v * (1.0 - options.voltage_reserve),
            current_max_a: scanner.current_max_a,
            galvo,
            plants,
            residual_max_rad,
            rests_anywhere: matches!(options.model, Model::Closest { .. }),
            held,
            inside,
            bounded,
        })
    }

    /// The longest step in this many ticks with its voltages; `None` if the ticks are too few to
    /// move and stop, or the step would drown in rounding, below 1e-10 rad.
    ///
    /// # Errors
    /// If the linear program cannot be solved.
    ///
    /// # Accuracy
    /// Voltage and current keep their limits exactly, the current also inside the ticks. The end
    /// is at rest within 1e-9 of the step after exact propagation. The step is the longest but
    /// for 1e-8 of it, or 2e-5 with the current bounded at every time of a 10 µs tick.
    pub fn longest(&self, n_ticks: usize) -> Result<Option<Reach>, JumpError> {
        let request = Request { n_ticks, ends: Ends::rest(), goal: Goal::Farthest, way: Way::Free };
        let found = self.best(&request)?;
        Ok(found.map(|(step_rad, voltages_v)| Reach { step_rad, voltages_v }))
    }

    /// The voltages that take a step in this many ticks with the least heat in the coil.
    ///
    /// * `step_rad`: within the longest step of so many ticks
    ///
    /// # Errors
    /// If the quadratic program cannot be solved.
    pub fn coolest(&self, n_ticks: usize, step_rad: f64) -> Result<Option<Reach>, JumpError> {
        let goal = Goal::Coolest(step_rad);
        let request = Request { n_ticks, ends: Ends::rest(), goal, way: Way::Free };
        let found = self.best(&request)?;
        Ok(found.map(|(step_rad, voltages_v)| Reach { step_rad, voltages_v }))
    }

    /// Whether a transition can be made in this many ticks, by a program for just that.
    ///
    /// What can be reached is convex and contains rest, so it can be made if the longest in its
    /// direction is at least as long.
    ///
    /// # Errors
    /// If the linear program cannot be solved.
    pub fn reaches(&self, ask: &Ask, n_ticks: usize) -> Result<bool, JumpError> {
        Ok(self.meet(ask, Way::Free, n_ticks)?.is_some())
    }

    /// The voltages of a transition in this many ticks, by a program for just that; `None` if there
    /// are none.
    pub(super) fn meet(
        &self,
        ask: &Ask,
        way: Way,
        n_ticks: usize,
    ) -> Result<Option<Vec<f64>>, JumpError> {
        let start = State::new(0.0, ask.from_rad_s, 0.0, 0.0, 0.0);
        let end = State::new(ask.distance_rad, ask.to_rad_s, 0.0, 0.0, 0.0);
        self.pass(Ends { start, end, place: true }, way, n_ticks)
    }

    /// The same between any states.
    pub(super) fn pass(
        &self,
        ends: Ends,
        way: Way,
        n_ticks: usize,
    ) -> Result<Option<Vec<f64>>, JumpError> {
        let request = Request { n_ticks, ends, goal: Goal::Farthest, way };
        let found = self.best(&request)?.filter(|(factor, _)| *factor >= 1.0);
        Ok(found.map(|(factor, mut voltages_v)| {
            voltages_v.iter_mut().for_each(|voltage| *voltage /= factor);
            voltages_v
        }))
    }

    /// The factor on the request's ends and the voltages, exact; `None` if nothing is reached.
    pub(super) fn best(&self, request: &Request) -> Result<Option<(f64, Vec<f64>)>, JumpError> {
        // Every state that counts must be met, and one voltage sets the scale.
        if request.n_ticks <= self.rest.len() {
            return Ok(None);
        }
        Ok(polish::polish(self, request, program::solve(self, request)?))
    }

    /// The longest step as the linear program states it, rad: without correction for the current
    /// inside the ticks, which vanishes with the tick.
    pub(super) fn longest_rad(&self, n_ticks: usize, way: Way) -> Result<f64, JumpError> {
        let request = Request { n_ticks, ends: Ends::rest(), goal: Goal::Farthest, way };
        program::solve(self, &request).map(|solution| solution.factor)
    }

    /// The held plants that programs know, with the part of the bound that they keep there.
    pub(super) fn held_in_programs(&self) -> impl Iterator<Item = (&Held, f64)> {
        self.held.iter().filter_map(|held| Some((held, held.share?)))
    }

    /// Whether the end is where the axis creeps to without voltage, not where it is.
    pub(super) fn creeps(&self) -> bool {
        !self.plants.is_empty()
    }

    /// Weights of the states in the angle to which the axis creeps without voltage, rad.
    pub(super) fn creep_row(&self) -> State {
        creep_row(&self.galvo)
    }

    /// How far these voltages move that angle, rad.
    pub(super) fn creep_rad(&self, voltages_v: &[f64]) -> f64 {
        voltages_v.iter().sum::<f64>() * self.tick_s / self.galvo.torque_constant
    }

    /// Acceleration at the greatest current, rad/s².
    pub(super) fn acceleration_max_rad_s2(&self) -> f64 {
        self.galvo.torque_constant / self.galvo.inertia() * self.current_max_a
    }

    /// State after the tick.
    pub(super) fn advance(&self, state: &State, voltage_v: f64) -> State {
        self.step.a * state + self.step.b * voltage_v
    }

    /// Mirror's angle at several times of the tick, up to its end, rad.
    pub(super) fn mirror_rad(&self, state: State, voltage_v: f64) -> impl Iterator<Item = f64> {
        self.mirror.iter().map(move |(weights, gain)| weights.dot(&state) + gain * voltage_v)
    }

    /// Greatest current during the tick, A, either sign.
    pub(super) fn peak_current_a(&self, state: &State, voltage_v: f64) -> f64 {
        let ends = state[CURRENT].abs().max(self.advance(state, voltage_v)[CURRENT].abs());
        self.inside
            .iter()
            .map(|(weights, gain)| (weights.dot(state) + gain * voltage_v).abs())
            .fold(ends, f64::max)
    }
}

/// The current inside a tick, where it is checked and where the program bounds it.
fn currents(galvo: &Galvo, tick_s: f64) -> (Vec<Weights>, Vec<Weights>) {
    let at = |part: f64| {
        let step = galvo.step(tick_s * part);
        (step.a.row(CURRENT).transpose(), step.b[CURRENT])
    };
    let n_parts = (tick_s / CHECK_S).round().clamp(10.0, 100.0) as u32;
    let inside = (1..n_parts).map(|part| at(f64::from(part) / f64::from(n_parts))).collect();
    let rate = galvo.omega.max(galvo.resistance / galvo.inductance);
    let bounded = if tick_s * rate < 0.5 { &BOUNDED[..] } else { &BOUNDED_OFTEN[..] };
    (inside, bounded.iter().copied().map(at).collect())
}

/// The same motor with a stiff shaft: with the whole inertia in the rotor the twist no longer acts
/// on the coil.
fn rigid(nominal: &Galvo) -> Galvo {
    Galvo { rotor_inertia: nominal.inertia(), mirror_inertia: 0.0, ..*nominal }
}

/// Weights of the states in the angle to which the axis creeps without voltage, rad.
///
/// The coil's and the motor's equations, integrated: `x + (Jm/J) q + (R J/Kt²) x' + (L/Kt) I` grows
/// by `U/Kt` alone, whatever the mode.
fn creep_row(galvo: &Galvo) -> State {
    let (kt, j) = (galvo.torque_constant, galvo.inertia());
    let rotor = galvo.mirror_inertia / j;
    State::new(1.0, galvo.resistance * j / (kt * kt), rotor, 0.0, galvo.inductance / kt)
}

/// Plants over the uncertainty of the mode.
///
/// Without voltage all of them creep to the same place, and that is where the step leads. What the
/// rigid part is short of it, and the vibration, both only decay once the current is gone.
fn uncertain(nominal: &Galvo, uncertainty: f64, tick_s: f64, watch: Watch) -> Vec<Plant> {
    let middle = (watch.n_frequencies / 2) as f64;
    let mut creep = creep_row(nominal);
    creep[0] = 0.0;
    let share = nominal.rotor_inertia / nominal.inertia();
    let plant = |index: usize, damping_ratio: f64| {
        let omega = nominal.omega * (1.0 + uncertainty * (index as f64 / middle - 1.0));
        let plant = Galvo { omega, damping_ratio, ..*nominal };
        let (coil, motor) = (nominal.resistance / nominal.inductance, creep[1].recip());
        let farthest_s = (coil / motor).ln() / (coil - motor);
        let looks = watch.looks.iter().map(|look| {
            let later = plant.step(look * farthest_s).a.transpose();
            let q = State::new(0.0, 0.0, share, 0.0, 0.0);
            let speed = State::new(0.0, 0.0, 0.0, share / omega, 0.0);
            [creep, q, speed].map(|weights| later * weights)
        });
        Plant { step: plant.step(tick_s), looks: looks.collect() }
    };
    let [low, high] = DAMPING_RATIOS;
    let ratios = [low.min(nominal.damping_ratio), high.max(nominal.damping_ratio)];
    (0..watch.n_frequencies)
        .flat_map(|index| ratios.map(|damping_ratio| plant(index, damping_ratio)))
        .collect()
}

/// Whether scanner and options are in range.
pub(crate) fn check(scanner: &Scanner, options: AxisOptions) -> Result<(), JumpError> {
    let tiny = f64::MIN_POSITIVE;
    let epsilon_rad = match options.model {
        Model::Robust { epsilon_rad }
        | Model::Closest { epsilon_rad }
        | Model::Held { epsilon_rad } => epsilon_rad,
        Model::Rigid | Model::Flexible => 1.0,
    };
    let ranges = [
        ("rotor inertia kg·m²", scanner.rotor_inertia_kg_m2, tiny, 1.0),
        ("mirror inertia kg·m²", scanner.mirror_inertia_kg_m2, tiny, 1.0),
        ("torque constant N·m/A", scanner.torque_constant_n_m_a, tiny, 1e3),
        ("coil resistance ohm", scanner.resistance_ohm, 0.0, 1e4),
        ("coil inductance H", scanner.inductance_h, tiny, 1.0),
        ("torsional mode Hz", scanner.torsional_mode_hz, tiny, 1e6),
        ("damping ratio", scanner.damping_ratio, 0.0, 1.0),
        ("greatest voltage V", scanner.voltage_max_v, tiny, 1e4),
        ("greatest current A", scanner.current_max_a, tiny, 1e4),
        ("uncertainty of the torsional mode", scanner.f1_uncertainty, 0.0, 0.5),
        ("uncertainty of the torque constant", scanner.kt_uncertainty, 0.0, 0.5),
        ("tick s", options.tick_s, 1e-9, 1e-2),
        ("voltage reserve", options.voltage_reserve, 0.0, 0.95),
        ("allowed end error rad", epsilon_rad, 1e-12, 1.0),
    ];
    for (quantity, value, low, high) in ranges {
        // A value that is not a number is in no range.
        if !(low..=high).contains(&value) {
            return Err(JumpError::Parameter { quantity, value, low, high });
        }
    }
    Ok(())
}
