//! The same job by the classic planner with tuned delays: what other planners are compared with.

mod bench;
mod delays;
mod descent;
mod excerpt;
mod tuner;

use crate::Error;
use crate::mark::{MarkOptions, PlanTimes, Stage, lay_out, plan_times};
use bench::{Bench, Setup};
use delays::Delays;
use ftheta_formats::cache_key::CacheKey;
use ftheta_formats::delays_file;
use ftheta_model::job::Job;
use ftheta_model::machine::Machine;
use ftheta_model::recipe::{ClassicRecipe, Recipe};
use ftheta_model::warning::Warning;
use ftheta_physics::plan::Plan;
use ftheta_planner::classic::{self, Settings};
use ftheta_planner::render::Renderer;
use ftheta_report::score::Score;
use ftheta_twin::mismatch::Mismatch;
use tuner::{Found, is_long, tune_all};

/// A way to tune.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// Its key in JSON and files.
    pub key: &'static str,
    /// Its name for people.
    pub name: &'static str,
    /// Whether the coverage error is within the tolerance as well.
    pub coverage: bool,
    /// Whether legs are skywritten.
    pub sky: bool,
}

/// The columns of the comparison; the first is the one that figures use.
pub const WAYS: [Way; 4] = [
    Way { key: "a", name: "delays A", coverage: false, sky: false },
    Way { key: "b", name: "delays B", coverage: true, sky: false },
    Way { key: "sky_a", name: "skywriting A", coverage: false, sky: true },
    Way { key: "sky_b", name: "skywriting B", coverage: true, sky: true },
];

/// What the classic planner makes of a job.
pub struct Against {
    /// In the order of [`WAYS`]; `None` where no delays keep the tolerance.
    pub columns: [Option<Column>; WAYS.len()],
    /// What a user has to know of the comparison.
    pub warnings: Vec<Warning>,
}

/// The job with one set of tuned delays.
pub struct Column {
    /// The delays.
    pub settings: Settings,
    /// The plan.
    pub plan: Plan,
    /// Where its time goes.
    pub times: PlanTimes,
    /// What the beam did on the twin.
    pub score: Score,
}

/// To be raised when the same job and machine would be tuned differently.
const VERSION: u32 = 1;

/// Tunes the classic planner's delays: least time on the twin, without mismatch, while errors stay
/// within the tolerance (`measures.md`, "Classic, tuned").
///
/// Light is never shorter than its mark's command, the jump delay is the same after all jumps, and
/// skywriting waits for no mark delay. What is found is kept in `options.atlas_store`.
///
/// # Accuracy
/// For jobs up to a quarter of a second no single step of any delay helps. Longer ones are tuned on
/// an excerpt and checked as a whole, with a warning.
///
/// # Errors
/// As [`crate::mark::mark`] with the classic planner and lag-derived delays.
pub fn against(
    job: &Job,
    machine: &Machine,
    recipe: &Recipe,
    options: &MarkOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Against, Error> {
    observer(Stage::Tune(0.0));
    let toolpath = lay_out(job, machine, recipe, options)?.value;
    // All that is tuned starts from what follows from the lag.
    let base = ClassicRecipe {
        interpolation: recipe.classic.interpolation,
        acceleration_mm_s2: recipe.classic.acceleration_mm_s2,
        deceleration_mm_s2: recipe.classic.deceleration_mm_s2,
        ..ClassicRecipe::default()
    };
    let settings = Settings::new(machine, &base)?;
    let plan = classic::plan(toolpath.clone(), machine, &settings, options.tolerance_mm)?;
    let renderer = Renderer::new(&plan);
    let setup = Setup { machine, recipe: &base, options, renderer: &renderer };
    let whole = Bench::new(setup, toolpath)?;
    let mut warnings = Vec::new();
    if options.mismatch != Mismatch::default() {
        let message = "the classic planner's plans are played without the mismatch";
        warnings.push(Warning::new("against", message));
    }
    if is_long(&plan) {
        let message = "delays are tuned on an excerpt of the job and checked on all of it: shorter \
                       times may be possible";
        warnings.push(Warning::new("against", message));
    }
    let found = kept_or(machine, options, &plan, &mut warnings, || {
        tune_all(&whole, &plan, &settings, observer)
    })?;
    let mut columns = [const { None }; WAYS.len()];
    for ((way, found), column) in WAYS.iter().zip(found).zip(&mut columns) {
        let Some(steps) = found else {
            let message = format!("{}: no delays keep the tolerance", way.name);
            warnings.push(Warning::new("against", message));
            continue;
        };
        let (settings, plan, score) = whole.play(Delays(steps))?;
        let times = plan_times(&plan);
        *column = Some(Column { settings, plan, times, score });
    }
    Ok(Against { columns, warnings })
}

/// What was kept from an earlier run, or else what `tune` finds, which is kept.
///
/// * `plan` with lag-derived delays: its id stands for job and machine
fn kept_or(
    machine: &Machine,
    options: &MarkOptions,
    plan: &Plan,
    warnings: &mut Vec<Warning>,
    tune: impl FnOnce() -> Result<Found, Error>,
) -> Result<Found, Error> {
    let MarkOptions { noise_mm, seed, atlas_store: store, .. } = options;
    // What the twin adds to the plan is not in its id.
    let sensor = &machine.scanner.sensor;
    let key = CacheKey::of(&format!("{VERSION} {} {sensor:?} {noise_mm:?} {seed}", plan.id()));
    let file = key.file_name("delays");
    let names = WAYS.map(|way| way.key);
    let kept = store.read(&file, "against", warnings, |bytes| {
        delays_file::read(bytes, key, &names).map_err(|error| error.to_string())
    });
    if let Some(found) = kept {
        return Ok(found);
    }
    let found = tune()?;
    let rows: Vec<_> = names.into_iter().zip(found.iter().copied()).collect();
    store.write(&file, "against", warnings, delays_file::write(key, &rows).as_bytes());
    Ok(found)
}
