//! Random transitions, planned and checked by an independent propagator.

pub mod border;
pub mod plant;

use border::{Border, Verdict};
use ftheta_model::machine::Scanner;
use ftheta_planner::jump::{AxisOptions, CurrentBound, JumpError, Model, Route, Transitions};
use plant::{Flow, Motion, N_SUBSTEPS, TICK_S};
use std::hint::black_box;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// Requests that a thread takes at a time; results are added in order of these.
const N_CHUNK: usize = 500;
/// One in so many planned routes is judged as if it had been refused.
const N_JUDGED: usize = 50;
/// Requests that are planned twice, to be timed.
const N_TIMED: usize = 20_000;
/// Part by which a voltage may pass its limit: rounding.
const VOLTAGE_ROUNDING: f64 = 1e-9;
/// Part by which current, angle and speed may pass theirs between the checks of the planner.
const BETWEEN_CHECKS: f64 = 1e-5;
/// End error relative to the step and a tenth of a radian, each state counted as an angle.
const END_ERROR: f64 = 1e-9;

/// What a campaign plans.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    pub seed: u64,
    pub n_requests: usize,
    /// Steps are from 1e-4 degrees to this, evenly in their logarithm.
    pub step_max_deg: f64,
    /// Speed of the ends, either sign.
    pub speed_max_rad_s: f64,
    pub model: Model,
    pub voltage_reserve: f64,
}

/// Figures of another planner, summed.
pub type Yardstick = [f64; 7];

/// Counts and greatest values over the requests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    pub n_planned: usize,
    /// Refused: rightly, near the border, wrongly.
    pub n_refused: [usize; 3],
    pub n_failed: usize,
    pub n_ticks: usize,
    /// Greatest voltage, current, mirror angle, mirror speed over their limits.
    pub ratios: [f64; 4],
    /// Greatest error at the end, over what is allowed.
    pub end_error: f64,
    /// Sums over the planned routes of what the caller compares with.
    pub yardstick: Yardstick,
    /// Time of a plan once everything is solved, s; the only figure that differs from run to run.
    pub warm_s: f64,
}

/// Splitmix64: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

impl Campaign {
    /// The request of this number, both ends inside the angles; one end in 40 is at rest.
    pub fn request(&self, scanner: &Scanner, index: usize) -> Route {
        let mut random = Random(self.seed ^ (index as u64).wrapping_mul(0xd134_2543_de82_ef95));
        let range = scanner.angle_max_rad;
        let size = 10_f64.powf(random.within(-4.0, self.step_max_deg.log10())).to_radians();
        let step = if random.unit() < 0.5 { size } else { -size };
        let from_rad = random.within((-range).max(-range - step), range.min(range - step));
        let mut speed = || match random.unit() {
            ..0.025 => 0.0,
            _ => random.within(-self.speed_max_rad_s, self.speed_max_rad_s),
        };
        let (from_rad_s, to_rad_s) = (speed(), speed());
        let to_rad = (from_rad + step).clamp(-range, range);
        Route { from_rad, to_rad, from_rad_s, to_rad_s }
    }

    /// Plans and checks all requests on one scanner; the same for any number of processors, but for
    /// times.
    ///
    /// * `compare`: figures of another planner for a route that took so many ticks
    ///
    /// # Errors
    /// If the planner cannot be set up.
    pub fn run(
        &self,
        scanner: &Scanner,
        compare: impl Fn(&Route, usize) -> Yardstick + Sync,
    ) -> Result<Tally, JumpError> {
        let options = AxisOptions {
            model: self.model,
            tick_s: TICK_S,
            voltage_reserve: self.voltage_reserve,
            current_bound: CurrentBound::Always,
        };
        let transitions = Transitions::new(scanner, options)?;
        let voltage_max_v = scanner.voltage_max_v * (1.0 - self.voltage_reserve);
        let usable = Scanner { voltage_max_v, ..scanner.clone() };
        let check = Check { flow: Flow::new(scanner, TICK_S / N_SUBSTEPS as f64), usable: &usable };
        let border = Border::new(&usable, self.speed_max_rad_s);
        let exact = matches!(self.model, Model::Flexible);
        let one = |index: usize| {
            let route = self.request(scanner, index);
            let planned = transitions.plan(&route);
            let tally = match planned {
                Ok(Some(transition)) => {
                    let mut voltages_v = Vec::with_capacity(transition.n_ticks());
                    voltages_v.extend(transition.voltages_v());
                    let yardstick = compare(&route, voltages_v.len());
                    let mut tally = check.tally(&route, &voltages_v, self.model);
                    // Whoever judges refusals must not find what was planned impossible.
                    if exact
                        && index.is_multiple_of(N_JUDGED)
                        && border.verdict(&route) == Verdict::Right
                    {
                        tally.n_failed = 1;
                    }
                    Tally { yardstick, ..tally }
                }
                Ok(None) if exact => refused(border.verdict(&route)),
                // A robust plan needs more room than what is possible nominally.
                Ok(None) => refused(Verdict::Border),
                Err(_) => Tally { n_failed: 1, ..Tally::default() },
            };
            if tally.n_failed > 0 {
                eprintln!("request {index}: {route:?}: {tally:?}");
            }
            tally
        };
        let tally = in_chunks(self.n_requests, one).into_iter().fold(Tally::default(), Tally::plus);
        // Again, now that every fan is solved, and alone.
        let started = Instant::now();
        let n_timed = self.n_requests.min(N_TIMED);
        for index in 0..n_timed {
            black_box(transitions.plan(&self.request(scanner, index))?);
        }
        let warm_s = started.elapsed().as_secs_f64() / n_timed.max(1) as f64;
        Ok(Tally { warm_s, ..tally })
    }
}

/// Applies a function to all indices on all processors; results in order of the chunks.
fn in_chunks(n: usize, one: impl Fn(usize) -> Tally + Sync) -> Vec<Tally> {
    let n_threads = thread::available_parallelism().map_or(1, NonZero::get);
    let n_chunks = n.div_ceil(N_CHUNK);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut tallies = Vec::new();
        loop {
            let chunk = next.fetch_add(1, Ordering::Relaxed);
            if chunk >= n_chunks {
                return tallies;
            }
            let indices = chunk * N_CHUNK..n.min((chunk + 1) * N_CHUNK);
            tallies.push((chunk, indices.map(&one).fold(Tally::default(), Tally::plus)));
        }
    };
    let mut tallies: Vec<(usize, Tally)> = thread::scope(|scope| {
        let threads: Vec<_> = (0..n_threads).map(|_| scope.spawn(work)).collect();
        // A thread that panics takes its requests with it, which the caller's counts show.
        threads.into_iter().filter_map(|thread| thread.join().ok()).flatten().collect()
    });
    tallies.sort_by_key(|(chunk, _)| *chunk);
    tallies.into_iter().map(|(_, tally)| tally).collect()
}

fn refused(verdict: Verdict) -> Tally {
    let n_refused =
        [Verdict::Right, Verdict::Border, Verdict::Wrong].map(|each| usize::from(each == verdict));
    Tally { n_refused, n_failed: n_refused[2], ..Tally::default() }
}

impl Tally {
    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        Self {
            n_planned: self.n_planned + other.n_planned,
            n_refused: std::array::from_fn(|i| self.n_refused[i] + other.n_refused[i]),
            n_failed: self.n_failed + other.n_failed,
            n_ticks: self.n_ticks + other.n_ticks,
            ratios: std::array::from_fn(|i| self.ratios[i].max(other.ratios[i])),
            end_error: self.end_error.max(other.end_error),
            yardstick: std::array::from_fn(|i| self.yardstick[i] + other.yardstick[i]),
            warm_s: self.warm_s + other.warm_s,
        }
    }
}

/// Plays voltages and compares with the limits.
struct Check<'a> {
    flow: Flow,
    usable: &'a Scanner,
}

impl Check<'_> {
    fn tally(&self, route: &Route, voltages_v: &[f64], model: Model) -> Tally {
        let limits = self.usable;
        let mut ratios = [0.0_f64; 4];
        let mut state = [route.from_rad, route.from_rad_s, 0.0, 0.0, 0.0];
        for &voltage in voltages_v {
            ratios[0] = ratios[0].max((voltage / limits.voltage_max_v).abs());
            for _ in 0..N_SUBSTEPS {
                state = self.flow.after(&state, voltage);
                ratios[1] = ratios[1].max((state[4] / limits.current_max_a).abs());
                ratios[2] = ratios[2].max((state[0] / limits.angle_max_rad).abs());
                ratios[3] = ratios[3].max((state[1] / limits.speed_max_rad_s).abs());
            }
        }
        let omega = std::f64::consts::TAU * limits.torsional_mode_hz;
        let end = [route.to_rad, route.to_rad_s, 0.0, 0.0, 0.0];
        let units = [1.0, omega, 1.0, omega, 1e3];
        let missed: Motion = std::array::from_fn(|i| ((state[i] - end[i]) / units[i]).abs());
        let end_error = match model {
            // Stop, jump and start each have their share.
            Model::Robust { epsilon_rad } => missed[0] / (3.0 * epsilon_rad),
            _ => {
                let allowed = END_ERROR * (0.1 + (route.to_rad - route.from_rad).abs());
                missed.into_iter().fold(0.0, f64::max) / allowed
            }
        };
        let sound = ratios[0] <= 1.0 + VOLTAGE_ROUNDING
            && ratios[1..].iter().all(|&ratio| ratio <= 1.0 + BETWEEN_CHECKS)
            && end_error <= 1.0;
        Tally {
            n_planned: 1,
            n_failed: usize::from(!sound),
            n_ticks: voltages_v.len(),
            ratios,
            end_error,
            ..Tally::default()
        }
    }
}
