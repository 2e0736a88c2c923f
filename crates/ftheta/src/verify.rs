//! Verifies a plan file: its content against its id, and the audit alone.

use crate::{Error, import};
use ftheta_formats::plan_file;
use ftheta_physics::plan::Plan;
use std::path::Path;

/// Reads a plan file and audits it again.
///
/// # Errors
/// If the file is damaged, does not hold what its id stands for, or the audit refuses it.
pub fn verify(path: &Path) -> Result<Plan, Error> {
    let text = import::text(path)?;
    let (draft, claimed) =
        plan_file::read(&text).map_err(|source| Error::PlanFile { path: path.into(), source })?;
    let plan = Plan::new(draft)?;
    let found = plan.id().to_string();
    if found != claimed {
        return Err(Error::PlanId { path: path.into(), found, claimed });
    }
    Ok(plan)
}
