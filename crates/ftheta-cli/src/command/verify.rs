//! `ftheta verify`: the audit alone.

use crate::arguments::Verify;
use crate::json;
use crate::screen::say;
use ftheta::mark::plan_times;
use ftheta::{Error, verify};
use serde_json::json;

/// Audits a plan file and prints its peaks.
pub fn run(arguments: &Verify, as_json: bool) -> Result<(), Error> {
    let plan = verify::verify(&arguments.plan)?;
    let times = plan_times(&plan);
    if as_json {
        json::print(&json!({
            "plan": json::plan(&plan, &times),
            "limits": json::limits(plan.limits()),
        }));
        return Ok(());
    }
    say!("plan {} for {} holds every limit", plan.id(), plan.machine.name);
    say!("{} marks, {:.3} s, {} samples", plan.marks.len(), times.duration_s, plan.n_samples());
    super::mark::print_limits(plan.limits());
    Ok(())
}
