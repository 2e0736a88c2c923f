//! Sums over all marks, from which the figures come.

use crate::histogram::Histogram;
use crate::score::{ContourError, ErrorSample, MarkError, RatioSpread, Score, Tail};
use crate::track::MarkTrack;
use ftheta_model::trace::Light;
use kurbo::Point;

/// Marks that are listed as the worst.
const N_WORST_MARKS: usize = 50;
/// Most samples of the error map.
const N_ERROR_SAMPLES_MAX: usize = 20_000;
/// Arc length of one sample of the error map before thinning, mm.
const ERROR_SAMPLE_MM: f64 = 0.05;
/// Width of a bar of the dose histogram.
pub const DOSE_BAR: f64 = 0.05;
/// Bars of the dose histogram; the last one takes everything above.
const N_DOSE_BARS: usize = 41;

/// A step of the beam with the light on.
#[derive(Clone, Copy)]
pub struct Step {
    /// How long it took, s.
    pub duration_s: f64,
    /// Power during it, W.
    pub power_w: f64,
    /// Distance from the curve beyond which energy is stray, mm.
    pub tolerance_mm: f64,
}

/// All sums.
pub struct Tally {
    contour_um: Histogram,
    square_um2_s: f64,
    coverage_um: Histogram,
    end_um: Histogram,
    dose: Histogram,
    pulse_spacing: Histogram,
    focus_um: Histogram,
    dose_bars: Vec<f64>,
    stray_j: f64,
    energy_j: f64,
    light_ns: Option<(u64, u64)>,
    n_unlit_marks: usize,
    worst_marks: Vec<MarkError>,
    map: ErrorMap,
}

/// Samples of the error, thinned so that there are never too many.
struct ErrorMap {
    samples: Vec<ErrorSample>,
    /// Length and worst place of the stretch under way.
    length_mm: f64,
    worst: Option<ErrorSample>,
    /// Stretches that make one sample, and how many the next one has.
    n_together: usize,
    n_seen: usize,
    group: Option<ErrorSample>,
}

impl Tally {
    /// Nothing yet.
    pub fn new() -> Self {
        Self {
            contour_um: Histogram::of_errors_um(),
            square_um2_s: 0.0,
            coverage_um: Histogram::of_errors_um(),
            end_um: Histogram::of_errors_um(),
            dose: Histogram::new(1e-4, 1e4, 10),
            pulse_spacing: Histogram::new(1e-4, 1e4, 10),
            focus_um: Histogram::of_errors_um(),
            dose_bars: vec![0.0; N_DOSE_BARS],
            stray_j: 0.0,
            energy_j: 0.0,
            light_ns: None,
            n_unlit_marks: 0,
            worst_marks: Vec::new(),
            map: ErrorMap {
                samples: Vec::new(),
                length_mm: 0.0,
                worst: None,
                n_together: 1,
                n_seen: 0,
                group: None,
            },
        }
    }

    /// Counts light in time and energy; returns its energy, J.
    pub fn take_light(&mut self, light: &Light) -> f64 {
        let (on_ns, off_ns) = self.light_ns.unwrap_or((light.on_ns, light.off_ns));
        self.light_ns = Some((on_ns.min(light.on_ns), off_ns.max(light.off_ns)));
        let energy_j = light.power_w * 1e-9 * light.off_ns.saturating_sub(light.on_ns) as f64;
        self.energy_j += energy_j;
        energy_j
    }

    /// Counts energy that belongs to no mark, J.
    pub fn take_stray(&mut self, energy_j: f64) {
        self.stray_j += energy_j;
    }

    /// Counts the distance of two pulses, over what the pen asks for.
    pub fn take_pulse_spacing(&mut self, ratio: f64) {
        self.pulse_spacing.add(ratio, 1.0);
    }

    /// Counts how far the focus is from the lit beam, once a tick.
    pub fn take_focus(&mut self, error_um: f64) {
        self.focus_um.add(error_um, 1.0);
    }

    /// Counts a mark that saw no light.
    pub fn miss_mark(&mut self, length_mm: f64) {
        self.coverage_um.add(1e3 * length_mm, 1e3 * length_mm);
        self.n_unlit_marks += 1;
    }

    /// Moves a mark's beam on to `beam` and counts what happens on the way.
    pub fn take(&mut self, track: &mut MarkTrack, beam: Point, step: Step) {
        let energy_j = step.power_w * step.duration_s;
        let way_mm = track.beam.distance(beam);
        let a_mm = track.distance_mm();
        track.advance(beam, energy_j);
        let b_mm = track.distance_mm();
        let (a_um, b_um) = (1e3 * a_mm, 1e3 * b_mm);
        self.contour_um.see(a_um.max(b_um));
        self.contour_um.add(0.5 * (a_um + b_um), step.duration_s);
        // Mean square of what changes linearly from a to b.
        self.square_um2_s += step.duration_s * (a_um * a_um + a_um * b_um + b_um * b_um) / 3.0;
        let (near_mm, far_mm) = (a_mm.min(b_mm), a_mm.max(b_mm));
        if far_mm > step.tolerance_mm {
            let beyond_mm = far_mm - near_mm.max(step.tolerance_mm);
            let share = match far_mm > near_mm && near_mm < step.tolerance_mm {
                true => beyond_mm / (far_mm - near_mm),
                false => 1.0,
            };
            self.stray_j += share * energy_j;
        }
        self.map.take(beam, b_um, way_mm);
    }

    /// Closes a mark.
    pub fn end_mark(&mut self, mut track: MarkTrack) {
        self.map.end_mark();
        for end_mm in [track.before_start_mm, track.end()] {
            self.end_um.add(1e3 * end_mm.abs(), 1.0);
        }
        // Both ends are sampled, so each stands for half a step: weights follow arc length.
        let distances_mm = track.coverage_mm();
        let last = distances_mm.len() - 1;
        for (index, (n_passages, distance_mm)) in distances_mm.into_iter().enumerate() {
            let weight = if index == 0 || index == last { 0.5 } else { 1.0 };
            self.coverage_um.add(1e3 * distance_mm, weight * n_passages as f64);
        }
        for line_j_mm in track.dose.windows_j_mm() {
            let ratio = line_j_mm / track.asked_j_mm;
            self.dose.add(ratio, 1.0);
            let bar = (ratio / DOSE_BAR) as usize;
            self.dose_bars[bar.min(N_DOSE_BARS - 1)] += 1.0;
        }
        let (error_mm, at) = track.worst;
        let error_um = 1e3 * error_mm;
        let place = self.worst_marks.partition_point(|other| other.error_um >= error_um);
        if place < N_WORST_MARKS {
            let mark = MarkError { mark_index: track.mark_index, error_um, x_mm: at.x, y_mm: at.y };
            self.worst_marks.insert(place, mark);
            self.worst_marks.truncate(N_WORST_MARKS);
        }
    }

    /// The figures.
    pub fn score(mut self) -> Score {
        let time_s = self.contour_um.total();
        let tail =
            |histogram: &Histogram| Tail { max: histogram.max(), p99: histogram.percentile(0.99) };
        let n_windows = self.dose.total();
        self.dose_bars.iter_mut().for_each(|bar| *bar /= n_windows.max(1.0));
        let (on_ns, off_ns) = self.light_ns.unwrap_or_default();
        Score {
            contour_error_um: ContourError {
                max: self.contour_um.max(),
                p99: self.contour_um.percentile(0.99),
                rms: match time_s > 0.0 {
                    true => (self.square_um2_s / time_s).sqrt(),
                    false => 0.0,
                },
            },
            coverage_error_um: tail(&self.coverage_um),
            end_error_um: tail(&self.end_um),
            dose_ratio: spread(&self.dose),
            pulse_spacing_ratio: spread(&self.pulse_spacing),
            focus_error_um: (self.focus_um.total() > 0.0).then(|| tail(&self.focus_um)),
            stray_energy_ratio: match self.energy_j > 0.0 {
                true => self.stray_j / self.energy_j,
                false => 0.0,
            },
            duration_s: 1e-9 * (off_ns - on_ns) as f64,
            energy_j: self.energy_j,
            n_unlit_marks: self.n_unlit_marks,
            dose_bars: self.dose_bars,
            worst_marks: self.worst_marks,
            error_samples: self.map.finish(),
        }
    }
}

impl ErrorMap {
    fn take(&mut self, beam: Point, error_um: f64, way_mm: f64) {
        self.worst = worse(self.worst, ErrorSample { x_mm: beam.x, y_mm: beam.y, error_um });
        self.length_mm += way_mm;
        if self.length_mm >= ERROR_SAMPLE_MM {
            self.end_mark();
        }
    }

    /// Ends the stretch under way.
    fn end_mark(&mut self) {
        self.length_mm = 0.0;
        let Some(worst) = self.worst.take() else {
            return;
        };
        self.group = worse(self.group, worst);
        self.n_seen += 1;
        if self.n_seen >= self.n_together {
            self.n_seen = 0;
            self.samples.extend(self.group.take());
        }
        if self.samples.len() >= 2 * N_ERROR_SAMPLES_MAX {
            self.n_together *= 2;
            let pairs = self.samples.chunks(2);
            self.samples = pairs
                .filter_map(|pair| pair.iter().fold(None, |found, &next| worse(found, next)))
                .collect();
        }
    }

    fn finish(mut self) -> Vec<ErrorSample> {
        self.samples.extend(self.group.take());
        self.samples
    }
}

/// Both ends of what was counted, if anything was.
fn spread(ratios: &Histogram) -> Option<RatioSpread> {
    (ratios.total() > 0.0).then(|| RatioSpread {
        min: ratios.min(),
        p01: ratios.percentile(0.01),
        p99: ratios.percentile(0.99),
        max: ratios.max(),
    })
}

fn worse(found: Option<ErrorSample>, next: ErrorSample) -> Option<ErrorSample> {
    match found {
        Some(found) if found.error_um >= next.error_um => Some(found),
        _ => Some(next),
    }
}
