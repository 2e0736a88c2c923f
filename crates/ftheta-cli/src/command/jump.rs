//! `ftheta jump`: how fast a machine can jump, and how near each law comes to that.

use crate::arguments::Jump;
use crate::json;
use crate::screen::say;
use ftheta::jump::{JumpOptions, Law, LawResult, StepResult, compare};
use ftheta::output::Output;
use ftheta::{Error, jump_results, machines};
use serde_json::{Value, json};

/// Compares laws on a machine and prints a table.
pub fn run(arguments: &Jump, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let period_s = arguments.period_us.map_or(machine.output.period_s(), |us| us * 1e-6);
    let options = JumpOptions {
        steps_rad: arguments.step_deg.iter().map(|step| step.to_radians()).collect(),
        laws: arguments.laws(),
        from_rad_s: arguments.from_rad_s,
        to_rad_s: arguments.to_rad_s,
        tolerance_rad: arguments.tolerance_deg.to_radians(),
        reserve: arguments.reserve,
        period_s,
        mismatch: arguments.mismatch,
    };
    let mut output = arguments.out.as_deref().map(Output::new).transpose()?;
    let steps = compare(&machine, &options)?;
    let report = output.as_ref().map(|output| output.path("jump.html"));
    if let Some(output) = &mut output {
        jump_results::add(output, &machine, &options, &steps)?;
    }
    output.map(Output::publish).transpose()?;
    let current_max_a = machine.scanner.current_max_a;
    if as_json {
        let steps: Vec<Value> = steps.iter().map(|step| object(step, current_max_a)).collect();
        json::print(&json!({
            "machine": machine.name,
            "tolerance_deg": arguments.tolerance_deg,
            "from_rad_s": arguments.from_rad_s,
            "to_rad_s": arguments.to_rad_s,
            "reserve": arguments.reserve,
            "period_us": period_s * 1e6,
            "files": report.map(|path| json!({ "report": path })),
            "steps": steps,
        }));
        return Ok(());
    }
    say!("{}, arrived within {} deg", machine.name, arguments.tolerance_deg);
    say!(
        "{:>8} {:>9} {:>9}  {:21} {:>9} {:>9} {:>7} {:>8} {:>8}",
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
        step.laws.iter().for_each(|law| print(step, law, &options, current_max_a));
    }
    if let Some(path) = report {
        say!("report   {}", path.display());
    }
    Ok(())
}

fn print(step: &StepResult, law: &LawResult, options: &JumpOptions, current_max_a: f64) {
    let (step_deg, name) = (step.step_rad.to_degrees(), law.law.to_string());
    let (rigid_us, limit_us) = (step.limit_rigid_s * 1e6, step.limit_s * 1e6);
    let start = format!("{step_deg:8} {rigid_us:9.1} {limit_us:9.1}  {name:21}");
    let outcome = match &law.outcome {
        Ok(outcome) => outcome,
        Err(error) => {
            say!("{start} {error}");
            return;
        }
    };
    let total_s = outcome.total_s();
    let total = total_s.map_or("never".into(), |total_s| format!("{:.1}", total_s * 1e6));
    let ratio = total_s.map_or("-".into(), |total_s| format!("{:.3}", total_s / step.limit_s));
    let passing = outcome.passing_rad_s(options.to_rad_s);
    let passing = passing.map_or(String::new(), |speed| format!("  passing at {speed:.0} rad/s"));
    say!(
        "{start} {:9.1} {total:>9} {ratio:>7} {:>7.1}% {:>7.1}%{passing}",
        outcome.motion.plan_s * 1e6,
        outcome.peak_voltage_ratio * 100.0,
        outcome.arrival.peak_current_a / current_max_a * 100.0,
    );
}

fn object(step: &StepResult, current_max_a: f64) -> Value {
    let law = |law: &LawResult| match &law.outcome {
        Ok(outcome) => {
            let arrival = &outcome.arrival;
            let total_s = outcome.total_s();
            json!({
                "law": law.law.to_string(),
                "plan_s": outcome.motion.plan_s,
                "settle_s": arrival.settle_s,
                "total_s": total_s,
                "ratio": total_s.map(|total_s| total_s / step.limit_s),
                "peak_voltage_ratio": outcome.peak_voltage_ratio,
                "peak_current_ratio": arrival.peak_current_a / current_max_a,
                "residual_deg": arrival.residual_rad.to_degrees(),
                "end_rad_s": arrival.end_rad_s,
                "heat_a2s": arrival.heat_a2s,
            })
        }
        Err(error) => {
            let mut object = json!({ "law": law.law.to_string(), "reason": error.to_string() });
            for key in [
                "plan_s",
                "settle_s",
                "total_s",
                "ratio",
                "peak_voltage_ratio",
                "peak_current_ratio",
                "residual_deg",
                "end_rad_s",
                "heat_a2s",
            ] {
                object[key] = Value::Null;
            }
            object
        }
    };
    json!({
        "step_deg": step.step_rad.to_degrees(),
        "limit_rigid_s": step.limit_rigid_s,
        "limit_s": step.limit_s,
        "limit_settle_s": step.limit_settle_s,
        "laws": step.laws.iter().map(law).collect::<Vec<_>>(),
    })
}

impl Jump {
    /// The laws asked for, each once.
    fn laws(&self) -> Vec<Law> {
        let mut laws: Vec<Law> = Vec::new();
        for law in self.law.iter().flat_map(|laws| &laws.0) {
            if !laws.contains(law) {
                laws.push(*law);
            }
        }
        laws
    }
}
