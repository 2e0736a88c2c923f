//! The jump atlas: for every number of ticks the longest step and its voltages, at three levels of
//! heat.

use super::{Axis, AxisOptions, JumpError, Reach};
use ftheta_model::machine::Scanner;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Numbers of ticks that are solved before looking whether the range is covered.
const N_BATCH: usize = 8;
/// Greatest number of ticks.
const N_TICKS_MAX: usize = 20_000;
/// Above this many ticks only some numbers are solved, at most 1 % apart, and the voltage is held
/// for as many ticks as leave no more than these to the program.
const N_SEGMENTS: usize = 300;
/// Part of the longest step of a number of ticks that each level covers. Time grows like the root
/// of the step: 5 and 20 % more of it leave 0.8 and 0.5 of the heat (`design/control.md` B).
const LEVELS: [f64; N_LEVELS] = [1.0, 0.9, 0.69];
/// Raised when other voltages come out for the same parameters.
pub const ATLAS_VERSION: u32 = 4;
/// Number of levels.
pub const N_LEVELS: usize = 3;

/// What the atlas covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtlasOptions {
    /// Model, period and reserve.
    pub axis: AxisOptions,
    /// Longest step that is needed, rad mechanical.
    pub range_rad: f64,
}

/// For every number of ticks the longest step and its voltages.
#[derive(Clone, Debug)]
pub struct Atlas {
    scanner: Scanner,
    options: AxisOptions,
    axis: Axis,
    levels: [Level; N_LEVELS],
}

/// The steps and voltages of one level; the index is the number of ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Longest step of each number of ticks, rad; they never fall.
    pub steps_rad: Vec<f64>,
    /// Voltages of that step, V.
    pub sequences_v: Vec<Vec<f64>>,
}

/// A jump: a sequence of the atlas and the factor on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump<'a> {
    /// Duration, ticks.
    pub n_ticks: usize,
    /// Voltages of the longest step of that duration, V.
    pub sequence: &'a [f64],
    /// Factor on the voltages, -1 to 1.
    pub scale: f64,
}

impl Jump<'_> {
    /// Voltage of each tick, V.
    pub fn voltages_v(&self) -> impl ExactSizeIterator<Item = f64> {
        let scale = self.scale;
        self.sequence.iter().map(move |voltage| voltage * scale)
    }

    /// Writes the voltages, V, to the front of the buffer and returns how many fit.
    pub fn write(&self, buffer_v: &mut [f64]) -> usize {
        for (sample, voltage) in buffer_v.iter_mut().zip(self.sequence) {
            *sample = voltage * self.scale;
        }
        self.n_ticks.min(buffer_v.len())
    }
}

impl Default for Level {
    /// No ticks, no way.
    fn default() -> Self {
        Self { steps_rad: vec![0.0], sequences_v: vec![Vec::new()] }
    }
}

impl Level {
    /// Longest step, rad.
    fn reach_rad(&self) -> f64 {
        self.steps_rad.last().copied().unwrap_or(0.0)
    }

    /// Adds one more tick.
    fn push(&mut self, reach: Option<Reach>) {
        let before_rad = self.reach_rad();
        let (step_rad, sequence_v) = match reach {
            Some(reach) if reach.step_rad > before_rad => (reach.step_rad, reach.voltages_v),
            // One more tick at rest; a longer time must never reach less.
            _ => {
                let mut longer = self.sequences_v.last().cloned().unwrap_or_default();
                longer.push(0.0);
                (before_rad, longer)
            }
        };
        self.steps_rad.push(step_rad);
        self.sequences_v.push(sequence_v);
    }

    /// Whether every number of ticks has its step and voltages.
    fn is_whole(&self) -> bool {
        let lengths = self.sequences_v.iter().enumerate().all(|(n, v)| v.len() == n);
        let finite =
            self.sequences_v.iter().flatten().chain(&self.steps_rad).all(|v| v.is_finite());
        self.steps_rad.len() == self.sequences_v.len()
            && self.steps_rad.first() == Some(&0.0)
            && self.steps_rad.is_sorted()
            && lengths
            && finite
    }
}

impl Atlas {
    /// Builds the atlas of this scanner; the same for any number of processors.
    ///
    /// # Errors
    /// If a parameter is out of range or a linear program fails.
    pub fn build(scanner: &Scanner, options: AtlasOptions) -> Result<Self, JumpError> {
        let mut atlas = Self::restore(scanner, options.axis, Default::default())?;
        atlas.extend(0, options.range_rad)?;
        Ok(atlas)
    }

    /// The atlas with the levels that an earlier one has kept, as far as they are whole.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn restore(
        scanner: &Scanner,
        options: AxisOptions,
        levels: [Level; N_LEVELS],
    ) -> Result<Self, JumpError> {
        let axis = Axis::new(scanner, options)?;
        let whole = |level: Level| if level.is_whole() { level } else { Level::default() };
        Ok(Self { scanner: scanner.clone(), options, axis, levels: levels.map(whole) })
    }

    /// Makes a level cover steps up to this one.
    ///
    /// # Errors
    /// If the step is out of range or a program fails; what was solved before stays.
    pub fn extend(&mut self, level: usize, step_rad: f64) -> Result<(), JumpError> {
        let (low, high) = (0.0, 4.0);
        if !(low..=high).contains(&step_rad) {
            let quantity = "step range rad";
            return Err(JumpError::Parameter { quantity, value: step_rad, low, high });
        }
        if level > 0 {
            self.extend(0, step_rad / LEVELS[level])?;
        }
        self.extend_while(level, |built| built.reach_rad() < step_rad)
    }

    /// Makes the first level cover a few more ticks if it does not reach this step; returns whether
    /// it still does not.
    ///
    /// # Errors
    /// As [`Self::extend`].
    pub fn grow(&mut self, step_rad: f64) -> Result<bool, JumpError> {
        let is_short = |built: &Level| built.reach_rad() < step_rad;
        if is_short(&self.levels[0]) {
            self.grow_while(0, &is_short)?;
        }
        Ok(is_short(&self.levels[0]))
    }

    /// The atlas without what lies beyond the first number of ticks that covers a step: the same
    /// however far it had grown for others.
    pub fn up_to(mut self, step_rad: f64) -> Self {
        let n_needed = 1 + self.steps_rad().partition_point(|&reach| reach < step_rad);
        for level in &mut self.levels {
            level.steps_rad.truncate(n_needed);
            level.sequences_v.truncate(n_needed);
        }
        self
    }

    fn extend_while(
        &mut self,
        level: usize,
        is_short: impl Fn(&Level) -> bool,
    ) -> Result<(), JumpError> {
        while is_short(&self.levels[level]) {
            self.grow_while(level, &is_short)?;
        }
        Ok(())
    }

    /// Solves the next few numbers of ticks and keeps them as long as the level is short.
    ///
    /// What lies beyond is dropped, errors with it, so that the batch does not show in the result.
    fn grow_while(
        &mut self,
        level: usize,
        is_short: &impl Fn(&Level) -> bool,
    ) -> Result<(), JumpError> {
        let first = self.levels[level].steps_rad.len();
        if first > N_TICKS_MAX {
            let (step_rad, tick_us) = (self.reach_rad(), self.options.tick_s * 1e6);
            return Err(JumpError::TooLong { step_rad, limit: N_TICKS_MAX, tick_us });
        }
        let batch = self.batch(level, first);
        // A few numbers that the solver fails at are passed over; where it fails at all, it ends.
        let all_fail = batch.iter().all(Result::is_err);
        for reach in batch {
            if is_short(&self.levels[level]) {
                let reach = match reach {
                    Err(JumpError::Unsolved { .. }) if !all_fail => None,
                    reach => reach?,
                };
                self.levels[level].push(reach);
            }
        }
        Ok(())
    }

    /// The jump in the fewest ticks; `None` beyond the range.
    ///
    /// Exact by linearity: the end stays at rest and every limit holds with the factor.
    pub fn jump(&self, step_rad: f64) -> Option<Jump<'_>> {
        self.jump_at(0, step_rad, 0)
    }

    /// The jump of this level in the fewest ticks, at least so many; `None` beyond the range.
    pub fn jump_at(&self, level: usize, step_rad: f64, n_ticks_min: usize) -> Option<Jump<'_>> {
        let distance = step_rad.abs();
        if !distance.is_finite() {
            return None;
        }
        let Level { steps_rad, sequences_v } = &self.levels[level];
        let n_ticks = steps_rad.partition_point(|&reach| reach < distance).max(n_ticks_min);
        let reach = *steps_rad.get(n_ticks)?;
        let scale = if reach > 0.0 { step_rad / reach } else { 0.0 };
        Some(Jump { n_ticks, sequence: &sequences_v[n_ticks], scale })
    }

    /// Longest step, rad.
    pub fn reach_rad(&self) -> f64 {
        self.levels[0].reach_rad()
    }

    /// Longest step of each number of ticks, rad; the index is the number.
    pub fn steps_rad(&self) -> &[f64] {
        &self.levels[0].steps_rad
    }

    /// Voltages of the longest step of each number of ticks, V; the index is the number.
    pub fn sequences_v(&self) -> &[Vec<f64>] {
        &self.levels[0].sequences_v
    }

    /// Step (rad) and voltages of exactly so many ticks, if a program of its own gave them.
    pub(super) fn solved(&self, n_ticks: usize) -> Option<(f64, &[f64])> {
        let Level { steps_rad, sequences_v } = &self.levels[0];
        let before = n_ticks.checked_sub(1).filter(|_| n_ticks <= N_SEGMENTS)?;
        let step_rad = *steps_rad.get(n_ticks)?;
        (step_rad > steps_rad[before]).then(|| (step_rad, &sequences_v[n_ticks][..]))
    }

    /// The scanner that the atlas is for.
    pub fn scanner(&self) -> &Scanner {
        &self.scanner
    }

    /// What the atlas was built for.
    pub fn axis_options(&self) -> AxisOptions {
        self.options
    }

    /// How many sequences have been solved, of all levels.
    pub fn n_sequences(&self) -> usize {
        self.levels.iter().map(|level| level.sequences_v.len()).sum()
    }

    /// All levels, to be kept.
    pub fn levels(&self) -> &[Level; N_LEVELS] {
        &self.levels
    }

    /// The longest steps of the next numbers of ticks, in order.
    fn batch(&self, level: usize, first: usize) -> Vec<Result<Option<Reach>, JumpError>> {
        let n_threads = thread::available_parallelism().map_or(1, NonZero::get).min(N_BATCH);
        let next = AtomicUsize::new(0);
        let results = Mutex::new(vec![Ok(None); N_BATCH]);
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= N_BATCH {
                    break;
                }
                // The largest first, so that no thread is left alone with it.
                let index = N_BATCH - 1 - index;
                let reach = self.solve(level, first + index);
                results.lock().unwrap_or_else(PoisonError::into_inner)[index] = reach;
            }
        };
        thread::scope(|scope| {
            for _ in 1..n_threads {
                scope.spawn(work);
            }
            work();
        });
        results.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn solve(&self, level: usize, n_ticks: usize) -> Result<Option<Reach>, JumpError> {
        if n_ticks <= N_SEGMENTS {
            return self.solve_on(&self.axis, level, n_ticks, n_ticks);
        }
        if !n_ticks.is_multiple_of(n_ticks / 100) {
            // As the number before, with one more tick at rest.
            return Ok(None);
        }
        let n_held = n_ticks.div_ceil(N_SEGMENTS);
        let tick_s = self.options.tick_s * n_held as f64;
        let axis = Axis::new(&self.scanner, AxisOptions { tick_s, ..self.options })?;
        let reach = self.solve_on(&axis, level, n_ticks / n_held, n_ticks)?;
        Ok(reach.map(|Reach { step_rad, voltages_v }| {
            let held = voltages_v.into_iter().flat_map(|v| std::iter::repeat_n(v, n_held));
            let mut voltages_v: Vec<f64> = held.collect();
            voltages_v.resize(n_ticks, 0.0);
            Reach { step_rad, voltages_v }
        }))
    }

    /// Solves on an axis of perhaps longer ticks what covers so many of the atlas's.
    fn solve_on(
        &self,
        axis: &Axis,
        level: usize,
        n_segments: usize,
        n_ticks: usize,
    ) -> Result<Option<Reach>, JumpError> {
        if level == 0 {
            return axis.longest(n_segments);
        }
        let longest_rad = self.steps_rad().get(n_ticks).copied().unwrap_or(self.reach_rad());
        if longest_rad == 0.0 {
            return Ok(None);
        }
        axis.coolest(n_segments, LEVELS[level] * longest_rad)
    }
}
