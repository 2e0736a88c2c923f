//! Modes and envelope from a recorded residual, whose frequencies and damping nobody knows.

use nalgebra::{DMatrix, DVector};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use std::f64::consts::TAU;
use thiserror::Error;

/// Samples of a record, least and most.
const N_SAMPLES: (usize, usize) = (128, 1 << 22);
/// Most modes that are looked for.
const N_MODES_MAX: usize = 8;
/// A peak counts above this multiple of the spectrum's median, which noise hardly reaches, and
/// this part of the highest peak.
const PEAK_OVER_NOISE: f64 = 6.0;
const PEAK_PART: f64 = 0.01;
/// Periods of the slowest mode that the record must hold: below them offset and drift live.
const N_PERIODS_MIN: f64 = 4.0;
/// Half width of the band-pass, as a part of the peak's frequency.
const BAND: f64 = 0.06;
/// The fit leaves out this many time constants of the band-pass at both ends of the record.
const EDGES: f64 = 2.5;
/// Longest time until a residual has settled, s.
const SETTLE_MAX_S: f64 = 10.0;

/// Why a record cannot be read.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum EnvelopeError {
    /// A number is out of range.
    #[error("{quantity} {value} is outside {low} to {high}")]
    Parameter {
        /// Which number, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// A sample is not a number.
    #[error("sample {index} is {value}, not a finite number")]
    NotFinite {
        /// Which sample.
        index: usize,
        /// Its value.
        value: f64,
    },
}

/// One vibration in a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedMode {
    /// Angular frequency, rad/s.
    pub omega_rad_s: f64,
    /// Decay of the amplitude, 1/s.
    pub decay_per_s: f64,
    /// Amplitude at the record's start, rad.
    pub amplitude_rad: f64,
}

/// What a record holds.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedResidual {
    /// Its modes, the highest peak first.
    pub modes: Vec<RecordedMode>,
    /// Constant distance from the target, rad.
    pub offset_rad: f64,
    /// What is left, rad rms.
    pub noise_rad: f64,
}

impl RecordedResidual {
    /// Distance from the target and envelopes of all modes, this long after the start, rad.
    pub fn envelope_rad(&self, time_s: f64) -> f64 {
        let modes = self.modes.iter();
        let sum: f64 =
            modes.map(|mode| mode.amplitude_rad * (-mode.decay_per_s * time_s).exp()).sum();
        self.offset_rad.abs() + sum
    }

    /// Time after the start from which the envelope is within the tolerance for good, s; `None` if
    /// it is not after 10 s.
    pub fn settle_s(&self, tolerance_rad: f64) -> Option<f64> {
        let within = |time_s: f64| self.envelope_rad(time_s) <= tolerance_rad;
        if within(0.0) {
            return Some(0.0);
        }
        let (mut low, mut high) = (0.0, SETTLE_MAX_S);
        if !within(high) {
            return None;
        }
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if within(middle) { high = middle } else { low = middle }
        }
        Some(high)
    }
}

/// Modes, offset and noise of a record of distances from the target, rad, one per `period_s`.
///
/// The highest peak of the spectrum, between bins by a parabola, is cut out by a band-pass; the
/// logarithm of what passes gives frequency and decay; the mode is taken away, and the next peak
/// looked for. Last, the amplitudes of all modes and the offset are fitted together.
///
/// # Errors
/// If the record is too short or long, or holds what is no number.
///
/// # Accuracy
/// Two modes an octave apart, noise of 2 % of the greater: amplitudes within 3 %, settling time
/// within 3 %. Modes nearer than 6 % of their frequency are taken as one.
/// Source: patent application 201610547833.9 (R4, R5).
pub fn analyse(record_rad: &[f64], period_s: f64) -> Result<RecordedResidual, EnvelopeError> {
    check(record_rad, period_s)?;
    let mut rest = record_rad.to_vec();
    let mut modes: Vec<RecordedMode> = Vec::new();
    let mut fit = Fit::new(record_rad, period_s, &modes);
    let mut highest = 0.0;
    while modes.len() < N_MODES_MAX {
        let mean = rest.iter().sum::<f64>() / rest.len() as f64;
        rest.iter_mut().for_each(|value| *value -= mean);
        let Some(peak) = peak(&rest, &mut highest) else { break };
        let Some(mode) = passed(&rest, peak, period_s) else { break };
        modes.push(mode);
        let next = Fit::new(record_rad, period_s, &modes);
        // A peak that explains next to nothing is what an imperfect fit left of a mode before it.
        if next.noise_rad > 0.999 * fit.noise_rad {
            modes.pop();
            break;
        }
        fit = next;
        rest.clone_from(&fit.rest);
    }
    for (mode, amplitude_rad) in modes.iter_mut().zip(&fit.amplitudes_rad) {
        mode.amplitude_rad = *amplitude_rad;
    }
    Ok(RecordedResidual { modes, offset_rad: fit.offset_rad, noise_rad: fit.noise_rad })
}

/// Bin of the highest peak, in parts of a bin; `None` where all is noise.
///
/// * `highest` is the greatest height so far, kept up to date
fn peak(record: &[f64], highest: &mut f64) -> Option<f64> {
    let n = record.len();
    // A window keeps the edges of the record from hiding small peaks.
    let mut windowed: Vec<f64> = record
        .iter()
        .enumerate()
        .map(|(i, value)| value * 0.5 * (1.0 - (TAU * (i as f64 + 0.5) / n as f64).cos()))
        .collect();
    let heights: Vec<f64> = spectrum(&mut windowed).iter().map(|bin| bin.norm()).collect();
    let first = N_PERIODS_MIN as usize;
    let places = first..heights.len().checked_sub(2)?;
    let best = places.max_by(|&a, &b| heights[a].total_cmp(&heights[b]))?;
    let height = heights[best];
    let mut sorted = heights.clone();
    sorted.sort_by(f64::total_cmp);
    *highest = height.max(*highest);
    if height <= PEAK_OVER_NOISE * sorted[sorted.len() / 2] || height <= PEAK_PART * *highest {
        return None;
    }
    // The logarithm of a windowed peak is all but a parabola.
    let [left, middle, right] = [best - 1, best, best + 1].map(|i| heights[i].ln());
    let shift = 0.5 * (left - right) / (left - 2.0 * middle + right);
    Some(best as f64 + if shift.is_finite() { shift.clamp(-0.5, 0.5) } else { 0.0 })
}

/// The mode at a peak: frequency and decay of what a band-pass lets through.
fn passed(record: &[f64], peak: f64, period_s: f64) -> Option<RecordedMode> {
    let n = record.len();
    let bins = spectrum(&mut record.to_vec());
    let width = (BAND * peak).max(2.0);
    // A Gaussian band-pass of the positive frequencies alone, moved to zero: slow enough to keep
    // one value in some samples.
    let reach = (4.0 * width).ceil();
    let first = (peak - reach).max(1.0) as usize;
    let last = ((peak + reach) as usize).min(bins.len() - 1);
    let edge_s = EDGES / (TAU * width / (n as f64 * period_s));
    let length_s = n as f64 * period_s;
    let n_points = 64;
    let mut points: Vec<(f64, Complex<f64>)> = Vec::with_capacity(n_points);
    for point in 0..n_points {
        let span_s = length_s - 2.0 * edge_s;
        let time_s = edge_s + span_s * point as f64 / n_points as f64;
        let turn = TAU * time_s / length_s;
        let value: Complex<f64> = (first..=last)
            .map(|bin| {
                let off = bin as f64 - peak;
                bins[bin] * (-0.5 * (off / width).powi(2)).exp() * Complex::cis(turn * off)
            })
            .sum();
        points.push((time_s, value * (2.0 / n as f64)));
    }
    let line = Line::through(&points)?;
    let omega_rad_s = TAU * peak / length_s + line.phase_slope;
    let decay_per_s = -line.log_slope;
    (omega_rad_s > 0.0 && decay_per_s.is_finite()).then_some(RecordedMode {
        omega_rad_s,
        decay_per_s: decay_per_s.max(0.0),
        amplitude_rad: 0.0,
    })
}

/// Slopes of logarithm and phase of a band-passed vibration.
struct Line {
    log_slope: f64,
    phase_slope: f64,
}

impl Line {
    /// Least squares, each point weighted by its power, for noise shifts small ones more.
    fn through(points: &[(f64, Complex<f64>)]) -> Option<Self> {
        let mut phase = 0.0;
        let mut before = points.first()?.1;
        let mut sums = [0.0_f64; 3];
        let mut rows = Vec::with_capacity(points.len());
        for &(time_s, value) in points {
            phase += (value * before.conj()).arg();
            before = value;
            let weight = value.norm_sqr();
            rows.push((time_s, value.norm().max(f64::MIN_POSITIVE).ln(), phase, weight));
            sums[0] += weight;
            sums[1] += weight * time_s;
        }
        let mean_s = sums[1] / sums[0];
        let (mut log, mut turn) = (0.0, 0.0);
        for (time_s, logarithm, phase, weight) in rows {
            let lever = weight * (time_s - mean_s);
            sums[2] += lever * (time_s - mean_s);
            log += lever * logarithm;
            turn += lever * phase;
        }
        let line = Self { log_slope: log / sums[2], phase_slope: turn / sums[2] };
        (line.log_slope.is_finite() && line.phase_slope.is_finite()).then_some(line)
    }
}

/// Amplitudes of given modes and an offset, fitted to a record together.
struct Fit {
    amplitudes_rad: Vec<f64>,
    offset_rad: f64,
    noise_rad: f64,
    rest: Vec<f64>,
}

impl Fit {
    fn new(record: &[f64], period_s: f64, modes: &[RecordedMode]) -> Self {
        let n = 1 + 2 * modes.len();
        let mut row = vec![1.0; n];
        let fill = |row: &mut [f64], index: usize| {
            let time_s = index as f64 * period_s;
            for (mode, pair) in modes.iter().zip(row[1..].chunks_exact_mut(2)) {
                let size = (-mode.decay_per_s * time_s).exp();
                let (sine, cosine) = (mode.omega_rad_s * time_s).sin_cos();
                (pair[0], pair[1]) = (size * cosine, size * sine);
            }
        };
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
        for (index, value) in record.iter().enumerate() {
            fill(&mut row, index);
            for i in 0..n {
                right[i] += row[i] * value;
                for j in 0..n {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
        }
        let weights = normal.lu().solve(&right).unwrap_or_else(|| DVector::zeros(n));
        let mut rest = record.to_vec();
        for (index, value) in rest.iter_mut().enumerate() {
            fill(&mut row, index);
            *value -= row.iter().zip(weights.iter()).map(|(a, b)| a * b).sum::<f64>();
        }
        let power = rest.iter().map(|value| value * value).sum::<f64>() / rest.len() as f64;
        let pairs = weights.as_slice()[1..].chunks_exact(2);
        Self {
            amplitudes_rad: pairs.map(|pair| pair[0].hypot(pair[1])).collect(),
            offset_rad: weights[0],
            noise_rad: power.sqrt(),
            rest,
        }
    }
}

/// Spectrum of a real record; destroys it.
fn spectrum(record: &mut [f64]) -> Vec<Complex<f64>> {
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(record.len());
    let mut bins = fft.make_output_vec();
    // The lengths fit by construction; a spectrum of zeros has no peak.
    if fft.process(record, &mut bins).is_err() {
        bins.fill(Complex::default());
    }
    bins
}

fn check(record: &[f64], period_s: f64) -> Result<(), EnvelopeError> {
    let n = record.len() as f64;
    for (quantity, value, low, high) in
        [("samples", n, N_SAMPLES.0 as f64, N_SAMPLES.1 as f64), ("period s", period_s, 1e-9, 1.0)]
    {
        if !(low..=high).contains(&value) {
            return Err(EnvelopeError::Parameter { quantity, value, low, high });
        }
    }
    match record.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(EnvelopeError::NotFinite { index, value: record[index] }),
        None => Ok(()),
    }
}
