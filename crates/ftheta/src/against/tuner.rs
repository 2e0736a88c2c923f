//! Tunes delays each way, on the whole job or on an excerpt that is checked against it.

use super::bench::{Bench, Goal};
use super::delays::{Delays, N_SETTINGS};
use super::descent::{Rank, descend};
use super::{WAYS, Way};
use crate::Error;
use crate::mark::{Stage, plan_times};
use ftheta_physics::plan::Plan;
use ftheta_planner::classic::Settings;

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

/// For every way its delays, or `None` where none keep the tolerance.
pub type Found = Vec<Option<[i32; N_SETTINGS]>>;

/// What every way finds, on the whole job or on an excerpt.
pub fn tune_all(
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
pub fn is_long(plan: &Plan) -> bool {
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
