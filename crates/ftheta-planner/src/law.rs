//! Motion laws for one step of one axis, all through [`plan`]: the optimum and what it is judged
//! against.
//!
//! Every law keeps the same voltage and current on the nominal axis. Laws in ticks give one voltage
//! per tick or segment; laws that are functions of time are played by an ideal drive, 0.5 µs per
//! voltage, that makes the current follow exactly (`design/control.md` B).

mod bisection;
mod descent;
mod drive;
mod error;
mod name;
mod prior;
mod profile;
mod tune;

pub use error::LawError;

use crate::jump::{
    Axis, AxisOptions, CurrentBound, JumpError, Model, Route, fewest_ticks, fewest_ticks_between,
};
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::Galvo;
use profile::Profile;
use tune::Task;

/// Parts into which `bisection` cuts the time unless told.
const N_SEGMENTS: usize = 20;
/// Tunings of a law until the voltage between the places that its search looks at fits too.
const N_TUNINGS: usize = 8;

/// A way to move an axis from one state to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Fewest ticks on the nominal axis, ending exactly at rest.
    Optimal,
    /// Fewest ticks that also stand the machine's uncertainty of mode and damping; from rest to
    /// rest with all of the tolerance used, so that the place of rest may be off the target too.
    Robust,
    /// Equal segments of constant voltage, the action time found by bisection.
    ///
    /// One segment is the literal formula of the source, which only passes through the target;
    /// three or four end at rest for a stiff shaft, five and more for the nominal mode.
    /// Source: patent CN105005322B (T4, T5).
    Bisection {
        /// Segments.
        n_segments: usize,
        /// Whether the current's limit is kept as well; the source knows the voltage only.
        current_bound: bool,
    },
    /// Equal increments of the angle per period.
    FixedStep,
    /// Acceleration and braking even, each coming and going within one period.
    Trapezoid,
    /// Symmetric S-curve.
    SCurve(Aim),
    /// S-curve whose acceleration and braking have a jerk each.
    Asymmetric,
    /// One period of a sine as acceleration.
    Cycloid(Aim),
    /// Polynomial of fifth degree.
    Quintic(Aim),
    /// S-curve behind a zero-vibration shaper.
    Zv,
    /// S-curve behind a zero-vibration-and-derivative shaper.
    Zvd,
    /// S-curve of six free parts, searched for the least time until the vibration has faded.
    ///
    /// Source: patent application 201610547833.9 (R2, R6).
    Residual,
}

/// What a smooth law is tuned for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The least time until the mirror stays near the target.
    Arrival,
    /// The shortest law, however long the mirror rings after it.
    Fastest,
}

/// What is asked of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// The step, rad mechanical.
    pub step_rad: f64,
    /// Speed at the start, rad/s.
    pub from_rad_s: f64,
    /// Speed at the end, rad/s.
    pub to_rad_s: f64,
    /// Distance from the target at which the mirror has arrived, rad.
    pub tolerance_rad: f64,
    /// Part of the voltage kept for feedback, 0 to below 1.
    pub reserve: f64,
    /// Output period, s.
    pub period_s: f64,
}

impl Request {
    /// Whether both ends are at rest.
    fn is_at_rest(&self) -> bool {
        self.from_rad_s == 0.0 && self.to_rad_s == 0.0
    }
}

/// Voltages that carry out a law.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// When the law ends, s; a drive that holds the current at zero goes on after it.
    pub plan_s: f64,
    /// For how long each voltage is held, s.
    pub hold_s: f64,
    /// The voltages, V.
    pub voltages_v: Vec<f64>,
}

/// The motion of a law on the nominal axis of a scanner.
///
/// # Errors
/// If a number is out of range, the law cannot do what is asked, or a linear program fails.
///
/// # Accuracy
/// Voltage and current keep their limits on the nominal axis to 1e-6, but for `bisection`
/// without the current's. Tuned laws are the best of several gradient searches, within 3 % of the
/// best that a long evolutionary search found.
pub fn plan(scanner: &Scanner, law: Law, request: &Request) -> Result<Motion, LawError> {
    check(scanner, law, request)?;
    match law {
        Law::Optimal => ticks(scanner, Model::Flexible, request),
        Law::Robust => {
            let epsilon_rad = request.tolerance_rad;
            let robust = ticks(scanner, Model::Robust { epsilon_rad }, request)?;
            closer(scanner, Model::Closest { epsilon_rad }, request, robust)
        }
        Law::Bisection { n_segments, current_bound } => {
            bisection::bisect(scanner, n_segments, current_bound, request)
        }
        _ => tuned(scanner, law, request),
    }
}

/// The fewest ticks; between moving ends on a way that lies as far on one side of the centre as on
/// the other.
fn ticks(scanner: &Scanner, model: Model, request: &Request) -> Result<Motion, LawError> {
    let options = options(model, request);
    if !request.is_at_rest() {
        let route = Route {
            from_rad: -0.5 * request.step_rad,
            to_rad: 0.5 * request.step_rad,
            from_rad_s: request.from_rad_s,
            to_rad_s: request.to_rad_s,
        };
        let found = fewest_ticks_between(scanner, options, &[route])?.and_then(|mut v| v.pop());
        let voltages_v = found.ok_or(LawError::NoRoom {
            step_rad: request.step_rad,
            angle_max_rad: scanner.angle_max_rad,
        })?;
        let plan_s = voltages_v.len() as f64 * request.period_s;
        return Ok(Motion { plan_s, hold_s: request.period_s, voltages_v });
    }
    let n_ticks = fewest_ticks(scanner, options, request.step_rad)?;
    let voltages_v = step(scanner, options, request.step_rad, n_ticks)?.unwrap_or_default();
    let plan_s = n_ticks as f64 * request.period_s;
    Ok(Motion { plan_s, hold_s: request.period_s, voltages_v })
}

/// The voltages of a step in this many ticks, scaled from the longest; `None` if that is shorter.
fn step(
    scanner: &Scanner,
    options: AxisOptions,
    step_rad: f64,
    n_ticks: usize,
) -> Result<Option<Vec<f64>>, JumpError> {
    let longest = Axis::new(scanner, options)?.longest(n_ticks)?;
    let longest = longest.filter(|longest| longest.step_rad >= step_rad.abs());
    Ok(longest.map(|longest| {
        let scale = step_rad / longest.step_rad;
        longest.voltages_v.iter().map(|voltage| voltage * scale).collect()
    }))
}

fn options(model: Model, request: &Request) -> AxisOptions {
    AxisOptions {
        model,
        tick_s: request.period_s,
        voltage_reserve: request.reserve,
        current_bound: CurrentBound::Always,
    }
}

/// The same step in fewer ticks as long as the model finds voltages, tick by tick.
fn closer(
    scanner: &Scanner,
    model: Model,
    request: &Request,
    mut motion: Motion,
) -> Result<Motion, LawError> {
    while request.is_at_rest() && motion.voltages_v.len() > 1 {
        let n_ticks = motion.voltages_v.len() - 1;
        match step(scanner, options(model, request), request.step_rad, n_ticks) {
            Ok(Some(voltages_v)) => {
                let plan_s = n_ticks as f64 * request.period_s;
                motion = Motion { plan_s, voltages_v, ..motion };
            }
            // What is at hand is good.
            Ok(None) | Err(JumpError::Unsolved { .. }) => break,
            Err(error) => return Err(error.into()),
        }
    }
    Ok(motion)
}

/// A law that is a profile of acceleration.
fn tuned(scanner: &Scanner, law: Law, request: &Request) -> Result<Motion, LawError> {
    let galvo = Galvo::new(scanner);
    let voltage_max_v = scanner.voltage_max_v * (1.0 - request.reserve);
    let mut task = Task {
        galvo: &galvo,
        step_rad: request.step_rad.abs(),
        tolerance_rad: request.tolerance_rad,
        voltage_max_v,
        current_max_a: scanner.current_max_a,
    };
    let mut tuning = 1;
    loop {
        let profile = profile(&task, law, request.period_s).ok_or_else(|| LawError::TooLong {
            law: law.to_string(),
            step_rad: request.step_rad,
            limit: prior::N_PERIODS_MAX,
            period_us: request.period_s * 1e6,
        })?;
        let mut motion = drive::motion(&profile, &galvo, request.tolerance_rad);
        let peak_v =
            motion.voltages_v.iter().fold(0.0_f64, |peak, voltage| peak.max(voltage.abs()));
        let excess = peak_v / voltage_max_v;
        if excess <= 1.0 + 1e-6 || tuning == N_TUNINGS {
            let sign = request.step_rad.signum();
            motion.voltages_v.iter_mut().for_each(|voltage| *voltage *= sign);
            return Ok(motion);
        }
        // The search looks at the voltage in places only; leave room for what is between them.
        task.voltage_max_v *= (1.0 - 1e-3) / excess;
        tuning += 1;
    }
}

fn profile(task: &Task<'_>, law: Law, period_s: f64) -> Option<Profile> {
    Some(match law {
        Law::FixedStep => return task.fixed_step(period_s),
        Law::Trapezoid => return task.trapezoid(period_s),
        Law::SCurve(Aim::Arrival) => task.s_curve(),
        Law::SCurve(Aim::Fastest) => task.s_curve_fastest(),
        Law::Asymmetric => task.asymmetric(),
        Law::Cycloid(aim) => task.cycloid(aim == Aim::Fastest),
        Law::Quintic(aim) => task.quintic(aim == Aim::Fastest),
        Law::Zv => task.shaped(1),
        Law::Zvd => task.shaped(2),
        Law::Residual => task.residual(),
        Law::Optimal | Law::Robust | Law::Bisection { .. } => return None,
    })
}

fn check(scanner: &Scanner, law: Law, request: &Request) -> Result<(), LawError> {
    let tiny = f64::MIN_POSITIVE;
    let galvo = Galvo::new(scanner);
    let speed_high = scanner.speed_max_rad_s.max(0.0);
    let (step, period) = (request.step_rad.abs(), request.period_s);
    for (quantity, value, low, high) in [
        ("step rad", step, 1e-9, 4.0),
        ("speed at the start rad/s", request.from_rad_s.abs(), 0.0, speed_high),
        ("speed at the end rad/s", request.to_rad_s.abs(), 0.0, speed_high),
        ("tolerance rad", request.tolerance_rad, 1e-9, 1.0),
        ("voltage reserve", request.reserve, 0.0, 0.95),
        ("period s", period, 1e-7, 1e-3),
        ("rotor inertia kg m2", galvo.rotor_inertia, tiny, 1.0),
        ("mirror inertia kg m2", galvo.mirror_inertia, tiny, 1.0),
        ("torque constant N m/A", galvo.torque_constant, tiny, 100.0),
        ("resistance ohm", galvo.resistance, 0.0, 1e4),
        ("inductance H", galvo.inductance, 1e-7, 1.0),
        ("torsional mode rad/s", galvo.omega, 10.0, 1e7),
        ("damping ratio", galvo.damping_ratio, 1e-6, 0.7),
        ("voltage limit V", scanner.voltage_max_v, 1e-3, 1e4),
        ("current limit A", scanner.current_max_a, 1e-4, 1e4),
    ] {
        if !(low..=high).contains(&value) {
            return Err(LawError::Parameter { law: law.to_string(), quantity, value, low, high });
        }
    }
    let moves = matches!(law, Law::Bisection { .. } | Law::Optimal | Law::Robust);
    if moves || request.is_at_rest() {
        return Ok(());
    }
    Err(LawError::RestOnly {
        law: law.to_string(),
        from_rad_s: request.from_rad_s,
        to_rad_s: request.to_rad_s,
    })
}
