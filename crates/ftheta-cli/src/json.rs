//! The JSON of the command line contract.

use crate::screen::say;
use ftheta::Fault;
use ftheta::against::{Against, WAYS};
use ftheta::mark::{Marked, PlanTimes};
use ftheta::model::warning::Warning;
use ftheta::physics::audit::Limits;
use ftheta::physics::plan::Plan;
use ftheta::planner::classic::Settings;
use ftheta::report::score::{RatioSpread, Score};
use serde_json::{Value, json};

/// Prints the one object of a command.
pub fn print(value: &Value) {
    say!("{value}");
}

/// An error as an object.
pub fn fault(fault: &Fault) -> Value {
    json!({"error": {
        "message": fault.message,
        "where": fault.place,
        "value": fault.value,
        "limit": fault.limit,
    }})
}

/// A marked job as an object.
///
/// * `stages`: wall time of each stage, s
/// * `files`: what was written: kind and path
pub fn marked(
    marked: &Marked,
    warnings: &[Warning],
    stages: &[(&str, f64)],
    files: &[(&str, String)],
) -> Value {
    let planning_s: f64 = stages
        .iter()
        .filter(|(name, _)| ["lay", "atlas", "plan", "audit"].contains(name))
        .map(|(_, time_s)| time_s)
        .sum();
    let mut plan = plan(&marked.plan, &marked.times);
    plan["planning_s"] = json!(planning_s);
    if let Some(promise) = &marked.promise {
        plan["promise"] = json!({
            "contour_error_um": promise.contour_mm() * 1e3,
            "planned_um": promise.planned_mm * 1e3,
            "f1_um": promise.f1_mm * 1e3,
            "kt_um": promise.kt_mm * 1e3,
            "kt_near_um": promise.kt_near_mm * 1e3,
        });
    }
    json!({
        "plan": plan,
        "limits": limits(marked.plan.limits()),
        "twin": twin(&marked.score),
        "files": object(files),
        "stages_s": object(stages),
        "seed": marked.seed,
        "warnings": warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// The job by the classic planner as an object: that of the first way, and all of them.
///
/// * `duration_s`: of the job on the twin, that they are compared with
pub fn against(against: &Against, duration_s: f64) -> Value {
    let columns: Vec<Value> = against
        .columns
        .iter()
        .map(|column| {
            column.as_ref().map_or(Value::Null, |column| {
                json!({
                    "plan": plan(&column.plan, &column.times),
                    "twin": twin(&column.score),
                    "delays": delays(&column.settings),
                    "speedup": column.score.duration_s / duration_s,
                })
            })
        })
        .collect();
    let keys = ["plan", "twin", "delays", "speedup"];
    let mut object: Value =
        keys.iter().map(|&key| (key.to_owned(), columns[0][key].clone())).collect();
    let named = WAYS.iter().map(|way| way.key.to_owned()).zip(columns);
    object["columns"] = named.collect();
    object
}

fn delays(settings: &Settings) -> Value {
    // Whole steps of the tuning; what the conversion leaves is dropped.
    let us = |time_s: f64| (time_s * 1e9).round() * 1e-3;
    json!({
        "jump_speed_mm_s": settings.jump_speed_mm_s,
        "jump_delay_us": us(settings.jump_delay_s),
        "mark_delay_us": us(settings.mark_delay_s),
        "polygon_delay_us": us(settings.polygon_delay_s),
        "laser_on_delay_us": settings.laser_on_delay_ns as f64 * 1e-3,
        "laser_off_delay_us": settings.laser_off_delay_ns as f64 * 1e-3,
        "sky_run_in_us": us(settings.sky_run_in_s),
        "sky_run_out_us": us(settings.sky_run_out_s),
    })
}

/// Figures of a plan, without the time that planning took.
pub fn plan(plan: &Plan, times: &PlanTimes) -> Value {
    json!({
        "id": plan.id().to_string(),
        "planner": plan.planner.name(),
        "machine": plan.machine.name,
        "period_us": f64::from(plan.machine.output.period_ns) * 1e-3,
        "samples": plan.n_samples(),
        "duration_s": times.duration_s,
        "mark_s": times.mark_s,
        "jump_s": times.jump_s,
        "delay_s": times.delay_s,
        "marks": plan.marks.len(),
        "jumps": times.n_jumps,
        "marked_mm": times.marked_mm,
    })
}

/// Peaks of the audit.
pub fn limits(limits: &Limits) -> Value {
    json!({
        "angle": limits.angle,
        "speed": limits.speed,
        "voltage": limits.voltage,
        "current": limits.current,
        "heat": limits.heat,
        "violations": limits.violations,
    })
}

fn twin(score: &Score) -> Value {
    let contour = &score.contour_error_um;
    let spread = |RatioSpread { min, p01, p99, max }| json!({"min": min, "p01": p01, "p99": p99, "max": max});
    let mut figures = json!({
        "duration_s": score.duration_s,
        "contour_error_um": {"max": contour.max, "p99": contour.p99, "rms": contour.rms},
        "coverage_error_um": {
            "max": score.coverage_error_um.max,
            "p99": score.coverage_error_um.p99,
        },
        "end_error_um": {"max": score.end_error_um.max, "p99": score.end_error_um.p99},
        "dose_ratio": score.dose_ratio.map(spread),
        "stray_energy_ratio": score.stray_energy_ratio,
        "energy_j": score.energy_j,
    });
    if let Some(ratios) = score.pulse_spacing_ratio {
        figures["pulse_spacing_ratio"] = spread(ratios);
    }
    if let Some(focus) = score.focus_error_um {
        figures["focus_error_um"] = json!({"max": focus.max, "p99": focus.p99});
    }
    figures
}

/// Files that were written: kind and path.
pub fn files(files: &[(&str, String)]) -> Value {
    object(files)
}

fn object<T: Clone + Into<Value>>(rows: &[(&str, T)]) -> Value {
    rows.iter().map(|(key, value)| ((*key).to_owned(), value.clone().into())).collect()
}
