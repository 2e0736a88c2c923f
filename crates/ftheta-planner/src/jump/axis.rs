//! One axis as the jump programs see it: discrete motion, limits, and plants to be robust against.

use super::program::{self, Solution, Tube};
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
/// Frequencies of the torsional mode that a robust jump stands.
const N_FREQUENCIES: usize = 7;
/// Damping ratios that a robust jump stands: nobody measures them, so both ends of what is seen.
const DAMPING_RATIOS: [f64; 2] = [0.0025, 0.02];
/// Part of the allowed end error that the program may use.
const ERROR_SHARE: f64 = 0.95;

/// What is known of the torsional mode, and what the end of the jump must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// Infinitely stiff shaft, exact rest.
    Rigid,
    /// The nominal mode, exact rest.
    Flexible,
    /// Rigid motion to exact rest; the mirror's residual vibration stays below this many rad for
    /// every frequency within the scanner's uncertainty and every damping ratio from 0.0025 to
    /// 0.02, driven by the one nominal current.
    Robust {
        /// Allowed end error, rad mechanical.
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
type Weights = (State, f64);

/// One plant whose vibration at the end is bounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plant {
    pub(super) step: Step,
    /// Its angular frequency, rad/s.
    pub(super) omega: f64,
}

/// One axis, its discrete motion and limits.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Rigid or nominal flexible motion over one tick.
    pub(super) step: Step,
    /// Which states the model has.
    pub(super) active: &'static [usize],
    pub(super) tick_s: f64,
    pub(super) voltage_max_v: f64,
    pub(super) current_max_a: f64,
    /// The motion behind `step`.
    pub(super) galvo: Galvo,
    /// Plants whose residual vibration is bounded, and the bound, rad.
    pub(super) plants: Vec<Plant>,
    pub(super) residual_max_rad: f64,
    /// Current where it is checked inside the tick.
    inside: Vec<Weights>,
    /// The same where the program bounds it.
    pub(super) bounded: Vec<Weights>,
}

impl Axis {
    /// The axis of this scanner.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(scanner: &Scanner, options: AxisOptions) -> Result<Self, JumpError> {
        check(scanner, options)?;
        let nominal = Galvo::new(scanner);
        let (galvo, active): (Galvo, &'static [usize]) = match options.model {
            Model::Flexible => (nominal, &[0, 1, 2, 3, 4]),
            Model::Rigid | Model::Robust { .. } => (rigid(&nominal), &[0, 1, 4]),
        };
        let mut plants = Vec::new();
        let mut residual_max_rad = f64::INFINITY;
        if let Model::Robust { epsilon_rad } = options.model {
            plants = uncertain(&galvo, scanner.f1_uncertainty, options.tick_s);
            residual_max_rad = ERROR_SHARE * epsilon_rad;
        }
        let (inside, bounded) = match options.current_bound {
            CurrentBound::Always => currents(&galvo, options.tick_s),
            CurrentBound::AtTicks => (Vec::new(), Vec::new()),
        };
        Ok(Self {
            step: galvo.step(options.tick_s),
            active,
            tick_s: options.tick_s,
            voltage_max_v: scanner.voltage_max_v * (1.0 - options.voltage_reserve),
            current_max_a: scanner.current_max_a,
            galvo,
            plants,
            residual_max_rad,
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
        // Every state but the angle must come back to zero, and one voltage sets the scale.
        if n_ticks < self.active.len() {
            return Ok(None);
        }
        let Solution { voltages_v, .. } = program::solve(self, n_ticks, None)?;
        Ok(polish::polish(self, voltages_v))
    }

    /// The longest step as the linear program states it, rad: without correction for the current
    /// inside the ticks, which vanishes with the tick.
    pub(super) fn longest_rad(&self, n_ticks: usize, tube: Option<Tube>) -> Result<f64, JumpError> {
        program::solve(self, n_ticks, tube).map(|solution| solution.step_rad)
    }

    /// State after the tick.
    pub(super) fn advance(&self, state: &State, voltage_v: f64) -> State {
        self.step.a * state + self.step.b * voltage_v
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

/// The same motor with a stiff shaft.
///
/// With the whole inertia in the rotor the twist no longer acts on the coil; it then only rides
/// along, driven by the current, and equals the error of the mirror, (Jr/J) q of the real shaft.
fn rigid(nominal: &Galvo) -> Galvo {
    Galvo { rotor_inertia: nominal.inertia(), mirror_inertia: 0.0, ..*nominal }
}

/// Plants over the uncertainty of the mode.
fn uncertain(rigid: &Galvo, uncertainty: f64, tick_s: f64) -> Vec<Plant> {
    let middle = (N_FREQUENCIES / 2) as f64;
    let plant = |index: usize, damping_ratio: f64| {
        let omega = rigid.omega * (1.0 + uncertainty * (index as f64 / middle - 1.0));
        Plant { step: Galvo { omega, damping_ratio, ..*rigid }.step(tick_s), omega }
    };
    (0..N_FREQUENCIES)
        .flat_map(|index| DAMPING_RATIOS.map(|damping_ratio| plant(index, damping_ratio)))
        .collect()
}

fn check(scanner: &Scanner, options: AxisOptions) -> Result<(), JumpError> {
    let tiny = f64::MIN_POSITIVE;
    let epsilon_rad = match options.model {
        Model::Robust { epsilon_rad } => epsilon_rad,
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
