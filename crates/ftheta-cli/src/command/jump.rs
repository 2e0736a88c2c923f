//! `ftheta jump`: how fast a machine can jump, and how near each law comes to that.

use crate::arguments::Jump;
use crate::json;
use crate::screen::say;
use ftheta::jump::{JumpOptions, Law, LawResult, StepResult, compare};
use ftheta::{Error, machines};
use serde_json::{Value, json};

/// Compares laws on a machine and prints a table.
pub fn run(arguments: &Jump, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let period_s = arguments.period_us.map_or(machine.output.period_s(), |us| us * 1e-6);
    let options = JumpOptions {
        steps_rad: arguments.step_deg.iter().map(|step| step.to_radians()).collect(),
        laws: arguments.laws(),
        tolerance_rad: arguments.tolerance_deg.to_radians(),
        reserve: arguments.reserve,
        period_s,
        mismatch: arguments.mismatch,
    };
    let steps = compare(&machine, &options)?;
    let current_max_a = machine.scanner.current_max_a;
    if as_json {
        let steps: Vec<Value> = steps.iter().map(|step| object(step, current_max_a)).collect();
        json::print(&json!({
            "machine": machine.name,
            "tolerance_deg": arguments.tolerance_deg,
            "reserve": arguments.reserve,
            "period_us": period_s * 1e6,
            "steps": steps,
        }));
        return Ok(());
    }
    say!("{}, arrived within {} deg", machine.name, arguments.tolerance_deg);
    say!(
        "{:>8} {:>9} {:>9}  {:8} {:>8} {:>8} {:>6} {:>8} {:>8}",
        "step deg",
        "rigid µs",
        "limit µs",
        "law",
        "plan µs",
        "total µs",
        "ratio",
        "voltage",
        "current"
    );
    for step in &steps {
        step.laws.iter().for_each(|law| print(step, law, current_max_a));
    }
    Ok(())
}

fn print(step: &StepResult, law: &LawResult, current_max_a: f64) {
    let total_s = law.arrival.map(|arrival| law.plan_s + arrival.settle_s);
    let total = total_s.map_or("never".into(), |total_s| format!("{:.0}", total_s * 1e6));
    let ratio = total_s.map_or("-".into(), |total_s| format!("{:.3}", total_s / step.limit_s));
    let current = law.arrival.map_or("-".into(), |arrival| {
        format!("{:.0} %", arrival.peak_current_a / current_max_a * 100.0)
    });
    say!(
        "{:8} {:9.1} {:9.1}  {:8} {:8.0} {:>8} {:>6} {:>7.0}% {:>8}",
        step.step_rad.to_degrees(),
        step.limit_rigid_s * 1e6,
        step.limit_s * 1e6,
        law.law.name(),
        law.plan_s * 1e6,
        total,
        ratio,
        law.peak_voltage_ratio * 100.0,
        current
    );
}

fn object(step: &StepResult, current_max_a: f64) -> Value {
    let laws: Vec<Value> = step
        .laws
        .iter()
        .map(|law| {
            let arrival = law.arrival;
            let total_s = arrival.map(|arrival| law.plan_s + arrival.settle_s);
            json!({
                "law": law.law.name(),
                "plan_s": law.plan_s,
                "settle_s": arrival.map(|arrival| arrival.settle_s),
                "total_s": total_s,
                "ratio": total_s.map(|total_s| total_s / step.limit_s),
                "peak_voltage_ratio": law.peak_voltage_ratio,
                "peak_current_ratio": arrival.map(|arrival| arrival.peak_current_a / current_max_a),
                "residual_deg": arrival.map(|arrival| arrival.residual_rad.to_degrees()),
                "heat_a2s": arrival.map(|arrival| arrival.heat_a2s),
            })
        })
        .collect();
    json!({
        "step_deg": step.step_rad.to_degrees(),
        "limit_rigid_s": step.limit_rigid_s,
        "limit_s": step.limit_s,
        "limit_settle_s": step.limit_settle_s,
        "laws": laws,
    })
}

impl Jump {
    /// The laws asked for, each once.
    fn laws(&self) -> Vec<Law> {
        let mut laws: Vec<Law> = self.law.iter().flat_map(|name| name.laws()).copied().collect();
        let mut seen = Vec::new();
        laws.retain(|law| {
            let new = !seen.contains(law);
            seen.push(*law);
            new
        });
        laws
    }
}
