//! The jump atlas: for every number of ticks the longest step and its voltages.

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

/// What the atlas covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtlasOptions {
    /// Model, period and reserve.
    pub axis: AxisOptions,
    /// Longest step that is needed, rad mechanical.
    pub range_rad: f64,
}

/// For every number of ticks the longest step and its voltages.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    options: AtlasOptions,
    /// Index is the number of ticks; steps never fall.
    steps_rad: Vec<f64>,
    sequences_v: Vec<Vec<f64>>,
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

impl Atlas {
    /// Builds the atlas of this scanner; the same for any number of processors.
    ///
    /// # Errors
    /// If a parameter is out of range or a linear program fails.
    pub fn build(scanner: &Scanner, options: AtlasOptions) -> Result<Self, JumpError> {
        let (low, high) = (1e-9, 4.0);
        let value = options.range_rad;
        if !(low..=high).contains(&value) {
            return Err(JumpError::Parameter { quantity: "step range rad", value, low, high });
        }
        let axis = Axis::new(scanner, options.axis)?;
        let mut atlas = Self { options, steps_rad: vec![0.0], sequences_v: vec![Vec::new()] };
        while atlas.reach_rad() < value {
            let first = atlas.steps_rad.len();
            if first > N_TICKS_MAX {
                let tick_us = options.axis.tick_s * 1e6;
                return Err(JumpError::TooLong { step_rad: value, limit: N_TICKS_MAX, tick_us });
            }
            for reach in batch(&axis, first) {
                // What lies beyond the range is dropped, errors with it, so that the batch does
                // not show in the result.
                if atlas.reach_rad() < value {
                    atlas.push(reach?);
                }
            }
        }
        Ok(atlas)
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

    /// The jump in the fewest ticks; `None` beyond the range.
    ///
    /// Exact by linearity: the end stays at rest and every limit holds with the factor.
    pub fn jump(&self, step_rad: f64) -> Option<Jump<'_>> {
        let distance = step_rad.abs();
        if !distance.is_finite() {
            return None;
        }
        let n_ticks = self.steps_rad.partition_point(|&reach| reach < distance);
        let reach = *self.steps_rad.get(n_ticks)?;
        let scale = if reach > 0.0 { step_rad / reach } else { 0.0 };
        Some(Jump { n_ticks, sequence: &self.sequences_v[n_ticks], scale })
    }

    /// Longest step, rad.
    pub fn reach_rad(&self) -> f64 {
        self.steps_rad.last().copied().unwrap_or(0.0)
    }

    /// Longest step of each number of ticks, rad; the index is the number.
    pub fn steps_rad(&self) -> &[f64] {
        &self.steps_rad
    }

    /// Voltages of the longest step of each number of ticks, V; the index is the number.
    pub fn sequences_v(&self) -> &[Vec<f64>] {
        &self.sequences_v
    }

    /// What the atlas was built for.
    pub fn options(&self) -> AtlasOptions {
        self.options
    }
}

/// The longest steps of the next numbers of ticks, in order.
fn batch(axis: &Axis, first: usize) -> Vec<Result<Option<Reach>, JumpError>> {
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
            let reach = axis.longest(first + index);
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
