//! Jumps compared: the limits of a machine for a step, and what each law makes of it on the twin.

use crate::Error;
use ftheta_model::machine::{Losses, Machine, Scanner};
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::lossy::feed_forward;
use ftheta_planner::jump::{
    Atlas, AtlasOptions, AxisOptions, CurrentBound, JumpError, Model, limit_s, settle_limit_s,
};
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::open_loop::{Arrival, Played, arrival_with_losses};

/// A way to move from rest to rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Fewest ticks on the nominal axis, ending exactly at rest.
    Optimal,
    /// Fewest ticks that also stand the machine's uncertainty of mode and damping.
    Robust,
}

/// What is to be compared.
#[derive(Clone, Debug)]
pub struct JumpOptions {
    /// Steps, rad mechanical.
    pub steps_rad: Vec<f64>,
    /// Laws, in the order of the result.
    pub laws: Vec<Law>,
    /// Distance from the target at which the mirror has arrived, rad.
    pub tolerance_rad: f64,
    /// Part of the voltage kept for feedback.
    pub reserve: f64,
    /// Period of the voltage, s.
    pub period_s: f64,
    /// How the twin's plant differs.
    pub mismatch: Mismatch,
}

/// One step: its limits and laws.
#[derive(Clone, Debug)]
pub struct StepResult {
    /// The step, rad mechanical.
    pub step_rad: f64,
    /// Shortest time with an infinitely stiff shaft, s.
    pub limit_rigid_s: f64,
    /// Shortest time to exact rest, s.
    pub limit_s: f64,
    /// Shortest time until the mirror is within the tolerance for good, s; `None` for steps that
    /// are not larger than twice the tolerance.
    pub limit_settle_s: Option<f64>,
    /// One result per law.
    pub laws: Vec<LawResult>,
}

/// What a law made of a step on the twin's plant, driven open loop.
#[derive(Clone, Debug)]
pub struct LawResult {
    /// The law.
    pub law: Law,
    /// Duration of the voltages, s.
    pub plan_s: f64,
    /// Greatest voltage by the machine's limit.
    pub peak_voltage_ratio: f64,
    /// What the plant did; `None` if it had not settled after 0.25 s.
    pub arrival: Option<Arrival>,
}

impl Law {
    /// All laws there are.
    pub const ALL: [Self; 2] = [Self::Optimal, Self::Robust];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Optimal => "optimal",
            Self::Robust => "robust",
        }
    }
}

/// Compares laws on a machine.
///
/// # Errors
/// If a step or setting is out of range, or a linear program fails.
pub fn compare(machine: &Machine, options: &JumpOptions) -> Result<Vec<StepResult>, Error> {
    let scanner = &machine.scanner;
    for &step_rad in &options.steps_rad {
        let (value, high) = (step_rad.abs(), 2.0 * scanner.angle_max_rad);
        if !(0.0 < value && value <= high) {
            let quantity = "step rad";
            return Err(JumpError::Parameter { quantity, value, low: 0.0, high }.into());
        }
    }
    let range_rad = options.steps_rad.iter().fold(0.0_f64, |range, step| range.max(step.abs()));
    let mut atlases = Vec::new();
    for &law in &options.laws {
        atlases.push((law, build(scanner, options, law, range_rad)?));
    }
    options.steps_rad.iter().map(|&step| one(scanner, options, &atlases, step)).collect()
}

fn build(
    scanner: &Scanner,
    options: &JumpOptions,
    law: Law,
    range_rad: f64,
) -> Result<Atlas, JumpError> {
    let model = match law {
        Law::Optimal => Model::Flexible,
        Law::Robust => Model::Robust { epsilon_rad: options.tolerance_rad },
    };
    let axis = AxisOptions {
        model,
        tick_s: options.period_s,
        voltage_reserve: options.reserve,
        current_bound: CurrentBound::Always,
    };
    Atlas::build(scanner, AtlasOptions { axis, range_rad })
}

/// Voltages that do on an axis with losses what these do on the nominal one, V.
fn with_losses(nominal: &Galvo, scanner: &Scanner, voltages_v: Vec<f64>, tick_s: f64) -> Vec<f64> {
    if scanner.losses == Losses::default() {
        return voltages_v;
    }
    let step = nominal.step(tick_s);
    let mut states = vec![State::zeros()];
    for &voltage_v in &voltages_v {
        states.push(step.a * states[states.len() - 1] + step.b * voltage_v);
    }
    feed_forward(nominal, scanner, &states, &voltages_v, tick_s)
}

fn one(
    scanner: &Scanner,
    options: &JumpOptions,
    atlases: &[(Law, Atlas)],
    step_rad: f64,
) -> Result<StepResult, Error> {
    let nominal = Galvo::new(scanner);
    let plant = options.mismatch.apply(&nominal);
    let mut laws = Vec::new();
    for &(law, ref atlas) in atlases {
        let jump = atlas.jump(step_rad).ok_or(JumpError::Parameter {
            quantity: "step rad",
            value: step_rad,
            low: -atlas.reach_rad(),
            high: atlas.reach_rad(),
        })?;
        let linear_v: Vec<f64> = jump.voltages_v().collect();
        let voltages_v = with_losses(&nominal, scanner, linear_v, options.period_s);
        let peak_v = voltages_v.iter().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
        let (tick_s, tolerance_rad) = (options.period_s, options.tolerance_rad);
        laws.push(LawResult {
            law,
            plan_s: jump.n_ticks as f64 * tick_s,
            peak_voltage_ratio: peak_v / scanner.voltage_max_v,
            arrival: arrival_with_losses(
                &plant,
                scanner,
                &Played { voltages_v: &voltages_v, tick_s, target_rad: step_rad, tolerance_rad },
            ),
        });
    }
    let settles = options.tolerance_rad < 0.5 * step_rad.abs();
    Ok(StepResult {
        step_rad,
        limit_rigid_s: limit_s(scanner, step_rad, Model::Rigid)?,
        limit_s: limit_s(scanner, step_rad, Model::Flexible)?,
        limit_settle_s: settles
            .then(|| settle_limit_s(scanner, step_rad, options.tolerance_rad))
            .transpose()?,
        laws,
    })
}
