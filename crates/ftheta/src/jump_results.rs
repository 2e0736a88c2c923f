//! The files of a comparison of jumps: a report with pictures.

use crate::Error;
use crate::jump::{JumpOptions, Law, LawResult, StepResult, drive, motion};
use crate::output::Output;
use ftheta_model::machine::Machine;
use ftheta_model::space::MirrorAngles;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::optics::field_from_angles;
use ftheta_planner::jump::Route;
use ftheta_planner::law::{Aim, Motion};
use ftheta_report::jump_report::{
    JumpFigures, JumpLaw, JumpReportInput, JumpSample, JumpStep, RouteReportInput,
    jump_report_html, route_report_html,
};
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::open_loop::play;

/// Laws whose curves are drawn, the first that are there; more would hide each other.
const SHOWN: [Law; 6] = [
    Law::Optimal,
    Law::Robust,
    Law::Residual,
    Law::SCurve(Aim::Arrival),
    Law::Zv,
    Law::Quintic(Aim::Arrival),
];
const N_SHOWN: usize = 4;
/// Curves go on for this part of the longest law after its end.
const AFTER: f64 = 0.15;
/// A law this many times longer than the limit would squeeze the others.
const LONGEST: f64 = 4.0;
/// Samples of a curve, about.
const N_SAMPLES: f64 = 700.0;

/// Adds the report of a comparison, `jump.html`.
///
/// # Errors
/// If it cannot be written.
pub fn add(
    output: &mut Output,
    machine: &Machine,
    options: &JumpOptions,
    steps: &[StepResult],
) -> Result<(), Error> {
    let shown: Vec<JumpStep> = steps.iter().map(|step| pictured(machine, options, step)).collect();
    let settings = settings(options);
    let input = JumpReportInput {
        machine,
        tolerance_rad: options.tolerance_rad,
        settings: &settings,
        steps: &shown,
    };
    output.add("jump.html", |out| out.write_all(jump_report_html(&input).as_bytes()))
}

/// Adds the report of two axes between moving ends, played on the nominal axes.
///
/// * `name`: of the file, ending in .html
/// * `voltages_v`: of each axis, one per tick, equally many
///
/// # Errors
/// If it cannot be written.
pub fn add_route(
    output: &mut Output,
    name: &str,
    title: &str,
    machine: &Machine,
    (routes, voltages_v): (&[Route; 2], &[Vec<f64>]),
) -> Result<(), Error> {
    let hold_s = machine.output.period_s();
    let plan_s = voltages_v.first().map_or(0, Vec::len) as f64 * hold_s;
    let axis = |(route, voltages_v): (&Route, &Vec<f64>)| {
        let options = JumpOptions {
            steps_rad: Vec::new(),
            laws: Vec::new(),
            from_rad_s: route.from_rad_s,
            to_rad_s: route.to_rad_s,
            tolerance_rad: 0.0,
            reserve: 0.0,
            period_s: hold_s,
            mismatch: Mismatch::default(),
        };
        let motion = Motion { plan_s, hold_s, voltages_v: voltages_v.clone() };
        let mut samples = played(machine, &options, route.to_rad - route.from_rad, &motion, plan_s);
        samples.iter_mut().for_each(|sample| sample.angle_rad += route.from_rad);
        samples
    };
    let axes: Vec<Vec<JumpSample>> = routes.iter().zip(voltages_v).map(axis).collect();
    let [x, y] = &axes[..] else {
        return Ok(());
    };
    let place = |(x, y): (&JumpSample, &JumpSample)| {
        let place = field_from_angles(&machine.optics, MirrorAngles::new(x.angle_rad, y.angle_rad));
        (place.x_mm, place.y_mm)
    };
    let path_mm: Vec<(f64, f64)> = x.iter().zip(y).map(place).collect();
    let settings = [
        ("Machine".to_owned(), machine.name.clone()),
        ("Duration".to_owned(), format!("{:.0} µs", plan_s * 1e6)),
        ("Period".to_owned(), format!("{:.1} µs", hold_s * 1e6)),
    ];
    let input =
        RouteReportInput { title, machine, settings: &settings, axes: [x, y], path_mm: &path_mm };
    output.add(name, |out| out.write_all(route_report_html(&input).as_bytes()))
}

fn settings(options: &JumpOptions) -> Vec<(String, String)> {
    let mut settings = vec![
        ("Tolerance".into(), format!("{:.4}°", options.tolerance_rad.to_degrees())),
        ("Period".into(), format!("{:.1} µs", options.period_s * 1e6)),
        ("Voltage kept".into(), format!("{:.0} %", options.reserve * 100.0)),
    ];
    if options.from_rad_s != 0.0 || options.to_rad_s != 0.0 {
        let speeds = format!("{} to {} rad/s", options.from_rad_s, options.to_rad_s);
        settings.push(("Speed".into(), speeds));
    }
    settings
}

/// One step with the curves of the laws that are shown.
fn pictured(machine: &Machine, options: &JumpOptions, step: &StepResult) -> JumpStep {
    let curved = curved(step);
    let plans_s = step.laws.iter().filter(|law| curved.contains(&law.law));
    let plans_s = plans_s.filter_map(|law| law.outcome.as_ref().ok()).map(|o| o.motion.plan_s);
    let end_s = (1.0 + AFTER) * plans_s.fold(0.0, f64::max);
    let law = |law: &LawResult| {
        let mut samples = Vec::new();
        let mut path_rad = Vec::new();
        if let Ok(outcome) = &law.outcome
            && curved.contains(&law.law)
        {
            samples = played(machine, options, step.step_rad, &outcome.motion, end_s);
            if let Ok(half) = motion(machine, options, 0.5 * step.step_rad, law.law) {
                let y = played(machine, options, 0.5 * step.step_rad, &half, end_s);
                path_rad = joined(&samples, &y);
            }
        }
        let figures =
            law.outcome.as_ref().map_err(ToString::to_string).map(|outcome| JumpFigures {
                plan_s: outcome.motion.plan_s,
                total_s: outcome.total_s(),
                passing_rad_s: outcome.passing_rad_s(options.to_rad_s),
                peak_voltage_ratio: outcome.peak_voltage_ratio,
                peak_current_ratio: outcome.arrival.peak_current_a / machine.scanner.current_max_a,
            });
        JumpLaw { name: law.law.to_string(), figures, samples, path_rad }
    };
    JumpStep {
        step_rad: step.step_rad,
        limit_rigid_s: step.limit_rigid_s,
        limit_s: step.limit_s,
        laws: step.laws.iter().map(law).collect(),
    }
}

/// The laws whose curves are drawn: those of the list, then any, as far as they are short enough.
fn curved(step: &StepResult) -> Vec<Law> {
    let short = |law: &Law| {
        let result = step.laws.iter().find(|result| result.law == *law);
        let outcome = result.and_then(|result| result.outcome.as_ref().ok());
        outcome.is_some_and(|outcome| outcome.motion.plan_s <= LONGEST * step.limit_s)
    };
    let others = step.laws.iter().map(|result| result.law).filter(|law| !SHOWN.contains(law));
    SHOWN.into_iter().chain(others).filter(short).take(N_SHOWN).collect()
}

/// What the plant does under a motion until a time.
fn played(
    machine: &Machine,
    options: &JumpOptions,
    step_rad: f64,
    motion: &Motion,
    end_s: f64,
) -> Vec<JumpSample> {
    let plant = options.mismatch.apply(&Galvo::new(&machine.scanner));
    let drive = drive(&machine.scanner, options, step_rad, motion);
    let (mirror, mirror_speed) = (plant.mirror_row(), plant.mirror_speed_row());
    let share = plant.rotor_inertia / plant.inertia();
    let mut samples: Vec<JumpSample> = Vec::new();
    play(&plant, &drive, end_s, |time_s, state: &State| {
        let due_s = samples.len() as f64 * end_s / N_SAMPLES;
        if time_s < due_s || time_s > end_s {
            return;
        }
        // Only the shaft moves the mirror.
        let twist = plant.omega * plant.omega * state[2]
            + 2.0 * plant.damping_ratio * plant.omega * state[3];
        let held = ((time_s / motion.hold_s - 1e-6).ceil() as usize).saturating_sub(1);
        let angle_rad = mirror.dot(state);
        samples.push(JumpSample {
            time_s,
            angle_rad,
            speed_rad_s: mirror_speed.dot(state),
            acceleration_rad_s2: share * twist,
            voltage_v: motion.voltages_v.get(held).copied().unwrap_or(drive.rest_v),
            current_a: state[CURRENT],
            error_rad: angle_rad - step_rad - options.to_rad_s * (time_s - motion.plan_s),
        });
    });
    samples
}

/// Places of both axes at the times of the first.
fn joined(x: &[JumpSample], y: &[JumpSample]) -> Vec<(f64, f64)> {
    let mut next = 0;
    x.iter()
        .filter_map(|sample| {
            while next + 1 < y.len() && y[next + 1].time_s <= sample.time_s {
                next += 1;
            }
            let (at, after) = (y.get(next)?, y.get(next + 1).or(y.last())?);
            let span_s = after.time_s - at.time_s;
            let part = if span_s > 0.0 { (sample.time_s - at.time_s) / span_s } else { 0.0 };
            Some((sample.angle_rad, at.angle_rad + part * (after.angle_rad - at.angle_rad)))
        })
        .collect()
}
