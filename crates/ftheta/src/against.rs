//! The same job by the classic planner with tuned delays: what other planners are compared with.

mod bench;
mod delays;
mod descent;
mod excerpt;

use crate::Error;
use crate::mark::{MarkOptions, PlanTimes, Stage, lay_out, plan_times};
use bench::{Bench, Goal, Setup};
use delays::{Delays, N_SETTINGS};
use descent::{Rank, descend};
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
/// Jobs longer than this are tuned on an excerpt, s.
const WHOLE_MAX_S: f64 = 0.25;
/// Length of the excerpt, s.
const EXCERPT_S: f64 = 0.1;
/// How often the excerpt's tolerance is narrowed until the whole job keeps it.
const N_ROUNDS: usize = 4;
/// By how much more than was missing.
const NARROWER: f64 = 0.98;
/// Samples of an excerpt that may be played for one way: some 10 s.
const N_SAMPLES_MAX: u64 = 6_000_000;
/// Part of them for the first round.
const FIRST_ROUND: f64 = 0.7;

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

/// For every way its delays, or `None` where none keep the tolerance.
type Found = Vec<Option<[i32; N_SETTINGS]>>;

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

/// What every way finds, on the whole job or on an excerpt.
fn tune_all(
    whole: &Bench<'_>,
    plan: &Plan,
    settings: &Settings,
    observer: &mut dyn FnMut(Stage),
) -> Result<Found, Error> {
    let excerpt = is_long(plan).then(|| whole.excerpt(plan, EXCERPT_S)).transpose()?;
    let bench = excerpt.as_ref().unwrap_or(whole);
    // A short job is tuned to the end.
    let n_candidates = match excerpt {
        Some(_) => N_SAMPLES_MAX as f64 / bench.n_samples(settings) as f64,
        None => f64::INFINITY,
    };
    let mut found = Vec::new();
    for (index, way) in WAYS.iter().enumerate() {
        observer(Stage::Tune(index as f64 / WAYS.len() as f64));
        let tuner = Tuner { bench, whole, way, settings };
        let limit = |share: f64| (n_candidates * (index as f64 + share)) as usize;
        found.push(tuner.run([limit(FIRST_ROUND), limit(1.0)]).map(|delays| delays.0));
    }
    Ok(found)
}

/// Whether an excerpt stands for the job while its delays are tuned.
fn is_long(plan: &Plan) -> bool {
    plan_times(plan).duration_s > WHOLE_MAX_S
}

/// One way's search.
struct Tuner<'a> {
    bench: &'a Bench<'a>,
    whole: &'a Bench<'a>,
    way: &'a Way,
    settings: &'a Settings,
}

impl Tuner<'_> {
    /// The best delays that keep the tolerance on the whole job.
    ///
    /// * `n_played_max`: candidates on the bench, those of other ways too, after which the first
    ///   round ends, and all do
    fn run(&self, n_played_max: [usize; 2]) -> Option<Delays> {
        let tolerance_um = 1e3 * self.whole.tolerance_mm();
        let mut goal = Goal { tolerance_um, coverage: self.way.coverage };
        let mut starts = Delays::starts(self.settings, self.way.coverage, self.way.sky);
        if self.bench.n_marks() < self.whole.n_marks() {
            starts.truncate(1);
        }
        for round in 0..N_ROUNDS {
            let (found, rank) = self.tune(&starts, goal, n_played_max[round.min(1)]);
            let excess_um = self.whole.rank(found, Goal { tolerance_um, ..goal }).excess_um;
            if excess_um == 0.0 {
                return Some(found);
            }
            if rank.excess_um > 0.0 {
                return None;
            }
            goal.tolerance_um *= NARROWER * tolerance_um / (tolerance_um + excess_um);
            starts = vec![found];
        }
        None
    }

    /// The best that is found from any start, and where no single step of any setting helps.
    fn tune(&self, starts: &[Delays], goal: Goal, n_played_max: usize) -> (Delays, Rank) {
        let rank = |delays: Delays| self.bench.rank(delays, goal);
        let spent = || self.bench.n_played() >= n_played_max;
        let settings = Delays::tuned(self.way.sky);
        let mut best = (starts[0], Rank::NONE);
        for &start in starts {
            // Its jump speed first keeps to itself: a faster one needs longer delays to be better.
            let found = descend(start, &settings[1..], &rank, &spent);
            if found.1.is_below(&best.1) {
                best = found;
            }
        }
        descend(best.0, settings, &rank, &spent)
    }
}
