//! Planner `classic`: what RTC- and EZCAD-type controllers do, as the honest baseline.
//!
//! Every vector is cut into micro-steps at constant speed. The mirrors lag behind, so the
//! controller waits: after jumps, after marks, in corners; and it shifts the laser's edges.

mod legs;
mod settings;

use crate::{PlanError, builder};
use ftheta_model::machine::Machine;
use ftheta_model::plan::PlanDraft;
use ftheta_model::toolpath::Toolpath;
use ftheta_physics::plan::Plan;
pub(crate) use legs::legs;
pub use settings::Settings;
pub(crate) use settings::{check_pen, fastest_mm_s};

/// Plans a toolpath as a classic controller would play it, and audits the plan.
///
/// The beam starts and ends in the field centre.
///
/// * `settings`: delays and speeds, from [`Settings::new`]
/// * `tolerance_mm`: greatest contour error that the job allows; only carried along
///
/// # Errors
/// If a pen or a setting is out of the machine's range, or the audit refuses the plan.
pub fn plan(
    toolpath: Toolpath,
    machine: &Machine,
    settings: &Settings,
    tolerance_mm: f64,
) -> Result<Plan, PlanError> {
    Ok(Plan::new(draft(toolpath, machine, settings, tolerance_mm)?)?)
}

/// The plan's content before the audit; see [`plan`].
///
/// # Errors
/// As [`plan`], less the audit.
pub fn draft(
    toolpath: Toolpath,
    machine: &Machine,
    settings: &Settings,
    tolerance_mm: f64,
) -> Result<PlanDraft, PlanError> {
    builder::draft(toolpath, machine, settings, tolerance_mm)
}
