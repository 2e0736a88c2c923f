//! Jumps compared: the limits of a machine for a step, and what each law makes of it on the twin.

use crate::Error;
use ftheta_model::machine::{Losses, Machine, Scanner};
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::lossy::feed_forward;
use ftheta_planner::jump::{JumpError, Model, limit_s, settle_limit_s};
use ftheta_planner::law::{Motion, Request, plan};
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::open_loop::{Arrival, Drive, arrival};
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

pub use ftheta_planner::law::{Aim, Law, LawError};

/// A rigid part faster than this at the end does not ring but goes away, rad/s.
const PASSING_RAD_S: f64 = 1.0;

/// What is to be compared.
#[derive(Clone, Debug)]
pub struct JumpOptions {
    /// Steps, rad mechanical.
    pub steps_rad: Vec<f64>,
    /// Laws, in the order of the result.
    pub laws: Vec<Law>,
    /// Speed at the start, rad/s.
    pub from_rad_s: f64,
    /// Speed at the end, rad/s.
    pub to_rad_s: f64,
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
    /// are not larger than twice the tolerance, or so much larger that it cannot be computed.
    pub limit_settle_s: Option<f64>,
    /// One result per law.
    pub laws: Vec<LawResult>,
}

/// What became of a law.
#[derive(Clone, Debug)]
pub struct LawResult {
    /// The law.
    pub law: Law,
    /// What it did, or why it gives no motion.
    pub outcome: Result<Outcome, LawError>,
}

/// What a law made of a step on the twin's plant, driven open loop.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The voltages.
    pub motion: Motion,
    /// Greatest voltage by the machine's limit.
    pub peak_voltage_ratio: f64,
    /// What the plant did.
    pub arrival: Arrival,
}

impl Outcome {
    /// Speed beside what was asked for with which the axis passes the target instead of arriving,
    /// rad/s; `None` if it arrives.
    pub fn passing_rad_s(&self, to_rad_s: f64) -> Option<f64> {
        let beside_rad_s = self.arrival.end_rad_s - to_rad_s;
        (self.arrival.settle_s.is_none() && beside_rad_s.abs() > PASSING_RAD_S)
            .then_some(beside_rad_s)
    }

    /// Duration of the law and time until the mirror is there for good, s; `None` if never.
    pub fn total_s(&self) -> Option<f64> {
        self.arrival.settle_s.map(|settle_s| self.motion.plan_s + settle_s)
    }
}

/// Compares laws on a machine; the same for any number of processors.
///
/// # Errors
/// If a step or setting is out of range, or a limit cannot be computed. A law that fails is a
/// result of its own.
pub fn compare(machine: &Machine, options: &JumpOptions) -> Result<Vec<StepResult>, Error> {
    let scanner = &machine.scanner;
    for &step_rad in &options.steps_rad {
        let high = (2.0 * scanner.angle_max_rad).to_degrees();
        let (low, value) = (1e-6, step_rad.abs().to_degrees());
        // Rounding of the conversion is not the user's.
        if !(low..=high * (1.0 + 1e-12)).contains(&value) {
            let quantity = "--step-deg";
            return Err(JumpError::Parameter { quantity, value, low, high }.into());
        }
    }
    let n_laws = options.laws.len();
    let outcomes = in_parallel(options.steps_rad.len() * n_laws, |index| {
        outcome(machine, options, options.steps_rad[index / n_laws], options.laws[index % n_laws])
    });
    let limits = in_parallel(options.steps_rad.len(), |index| {
        limits(scanner, options, options.steps_rad[index])
    });
    let mut outcomes = outcomes.into_iter();
    limits
        .into_iter()
        .map(|limits| {
            let outcomes = options.laws.iter().zip(outcomes.by_ref());
            let laws = outcomes.map(|(&law, outcome)| LawResult { law, outcome }).collect();
            Ok(StepResult { laws, ..limits? })
        })
        .collect()
}

/// The drive that plays a motion.
pub fn drive<'a>(
    scanner: &'a Scanner,
    options: &JumpOptions,
    step_rad: f64,
    motion: &'a Motion,
) -> Drive<'a> {
    Drive {
        voltages_v: &motion.voltages_v,
        hold_s: motion.hold_s,
        rest_v: scanner.torque_constant_n_m_a * options.to_rad_s,
        plan_s: motion.plan_s,
        from_rad_s: options.from_rad_s,
        target_rad: step_rad,
        to_rad_s: options.to_rad_s,
        scanner: Some(scanner),
    }
}

/// The motion of a law for a step; on an axis with losses its voltages make up for them.
///
/// # Errors
/// If the law cannot do it.
pub fn motion(
    machine: &Machine,
    options: &JumpOptions,
    step_rad: f64,
    law: Law,
) -> Result<Motion, LawError> {
    let request = Request {
        step_rad,
        from_rad_s: options.from_rad_s,
        to_rad_s: options.to_rad_s,
        tolerance_rad: options.tolerance_rad,
        reserve: options.reserve,
        period_s: options.period_s,
    };
    let motion = plan(&machine.scanner, law, &request)?;
    Ok(with_losses(&machine.scanner, options.from_rad_s, motion))
}

/// Voltages that do on an axis with losses what these do on the nominal one.
fn with_losses(scanner: &Scanner, from_rad_s: f64, motion: Motion) -> Motion {
    if scanner.losses == Losses::default() {
        return motion;
    }
    let nominal = Galvo::new(scanner);
    let step = nominal.step(motion.hold_s);
    let mut states = vec![State::new(0.0, from_rad_s, 0.0, 0.0, 0.0)];
    for &voltage_v in &motion.voltages_v {
        states.push(step.a * states[states.len() - 1] + step.b * voltage_v);
    }
    let voltages_v = feed_forward(&nominal, scanner, &states, &motion.voltages_v, motion.hold_s);
    Motion { voltages_v, ..motion }
}

fn outcome(
    machine: &Machine,
    options: &JumpOptions,
    step_rad: f64,
    law: Law,
) -> Result<Outcome, LawError> {
    let scanner = &machine.scanner;
    let motion = motion(machine, options, step_rad, law)?;
    let plant = options.mismatch.apply(&Galvo::new(scanner));
    let peak_v = motion.voltages_v.iter().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
    let drive = drive(scanner, options, step_rad, &motion);
    let arrival = arrival(&plant, &drive, options.tolerance_rad);
    Ok(Outcome { peak_voltage_ratio: peak_v / scanner.voltage_max_v, arrival, motion })
}

/// The limits of a step from rest to rest, laws left out.
fn limits(scanner: &Scanner, options: &JumpOptions, step_rad: f64) -> Result<StepResult, Error> {
    let settles = options.tolerance_rad < 0.5 * step_rad.abs();
    Ok(StepResult {
        step_rad,
        limit_rigid_s: limit_s(scanner, step_rad, Model::Rigid)?,
        limit_s: limit_s(scanner, step_rad, Model::Flexible)?,
        // Where the tolerance drowns in the step's rounding, the other figures are still good.
        limit_settle_s: settles
            .then(|| settle_limit_s(scanner, step_rad, options.tolerance_rad).ok())
            .flatten(),
        laws: Vec::new(),
    })
}

/// The results for indices from zero on, in order.
fn in_parallel<T: Send>(n: usize, compute: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let n_threads = thread::available_parallelism().map_or(1, NonZero::get).min(n);
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::with_capacity(n));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= n {
                break;
            }
            let result = compute(index);
            found.lock().unwrap_or_else(PoisonError::into_inner).push((index, result));
        }
    };
    thread::scope(|scope| {
        for _ in 1..n_threads {
            scope.spawn(work);
        }
        work();
    });
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_by_key(|result| result.0);
    found.into_iter().map(|(_, result)| result).collect()
}
