//! The pulses of a pulsed laser: free at their rate, or one for each trigger.

use ftheta_model::machine::Laser;
use ftheta_model::trace::Light;
use std::collections::VecDeque;

/// When pulses come, and the mean power that they make.
#[derive(Clone, Debug)]
pub struct Pulses {
    source: Source,
    /// Energy of a pulse over the power of the signal, s.
    period_s: f64,
    /// Energy of pulses that no light was counted for yet, J; below 0 if too much was.
    owed_j: f64,
    /// Mean power between the last two pulses, W; `None` before the second of an interval.
    mean_w: Option<f64>,
    /// When the last pulse of the interval was, ns.
    last_ns: Option<u64>,
}

#[derive(Clone, Debug)]
enum Source {
    /// No pulses, or so many that they cannot be told apart.
    Continuous,
    /// By a clock of its own that starts with the first sample.
    Free { period_ns: f64, n_past: u64 },
    /// Light of triggers to come, ns.
    Triggered { latency_ns: i64, waiting: VecDeque<u64> },
}

/// What ends a stretch of light.
#[derive(Clone, Copy, Debug)]
pub enum Until {
    /// A pulse of this energy, J.
    Pulse(f64),
    /// The end of the interval.
    Off,
    /// Neither: another power, or the end of what is handed over.
    Cut,
}

impl Pulses {
    /// The pulses of this laser before the first sample.
    ///
    /// * `step_ns`: free pulses that come closer together than this are continuous light
    pub fn new(laser: &Laser, latency_ns: i64, step_ns: u64) -> Self {
        let period_s = laser.pulse_period_s().unwrap_or(0.0);
        let period_ns = 1e9 * period_s;
        let source = if laser.pulses_triggered {
            Source::Triggered { latency_ns, waiting: VecDeque::new() }
        } else if period_ns >= step_ns as f64 {
            Source::Free { period_ns, n_past: 0 }
        } else {
            Source::Continuous
        };
        Self { source, period_s, owed_j: 0.0, mean_w: None, last_ns: None }
    }

    /// Whether light comes in single pulses.
    pub fn are_seen(&self) -> bool {
        !matches!(self.source, Source::Continuous)
    }

    /// Takes a trigger; pulses that run free need none.
    pub fn take(&mut self, time_ns: u64) {
        if let Source::Triggered { latency_ns, waiting } = &mut self.source {
            waiting.push_back(time_ns.saturating_add_signed(*latency_ns));
        }
    }

    /// Leaves out pulses before `now_ns`.
    pub fn skip_to(&mut self, now_ns: u64) {
        match &mut self.source {
            Source::Continuous => {}
            Source::Free { period_ns, n_past } => {
                *n_past = (*n_past).max((now_ns as f64 / *period_ns).ceil() as u64);
            }
            Source::Triggered { waiting, .. } => {
                while waiting.front().is_some_and(|time_ns| *time_ns < now_ns) {
                    waiting.pop_front();
                }
            }
        }
    }

    /// Time of the next pulse, ns.
    pub fn next_ns(&self) -> u64 {
        match &self.source {
            Source::Continuous => u64::MAX,
            Source::Free { period_ns, n_past } => (*n_past as f64 * period_ns) as u64,
            Source::Triggered { waiting, .. } => waiting.front().copied().unwrap_or(u64::MAX),
        }
    }

    /// Makes the next pulse; its energy at this power of the signal, J.
    pub fn fire(&mut self, power_w: f64) -> f64 {
        match &mut self.source {
            Source::Continuous => {}
            Source::Free { n_past, .. } => *n_past += 1,
            Source::Triggered { waiting, .. } => drop(waiting.pop_front()),
        }
        power_w * self.period_s
    }

    /// A stretch of light with the mean power of its pulses: half of each before it, half after.
    ///
    /// Where a stretch ends between pulses the next one is not known; what is counted wrongly there
    /// is made good by the next stretch.
    pub fn spread(&mut self, light: Light, until: Until) -> Light {
        if !self.are_seen() {
            return light;
        }
        let duration_s = 1e-9 * (light.off_ns - light.on_ns) as f64;
        let energy_j = match until {
            Until::Pulse(energy_j) => self.owed_j + 0.5 * energy_j,
            Until::Off => self.owed_j,
            Until::Cut => self.mean_w.unwrap_or(light.power_w) * duration_s,
        };
        let counted_j = if duration_s > 0.0 { energy_j.max(0.0) } else { 0.0 };
        self.owed_j += match until {
            Until::Pulse(energy_j) => energy_j - counted_j,
            Until::Off | Until::Cut => -counted_j,
        };
        match until {
            Until::Pulse(energy_j) => {
                let since_s = self.last_ns.map(|ns| 1e-9 * (light.off_ns - ns) as f64);
                self.mean_w = since_s.filter(|s| *s > 0.0).map(|s| energy_j / s).or(self.mean_w);
                self.last_ns = Some(light.off_ns);
            }
            Until::Off => (self.owed_j, self.mean_w, self.last_ns) = (0.0, None, None),
            Until::Cut => {}
        }
        let power_w = if duration_s > 0.0 { counted_j / duration_s } else { 0.0 };
        Light { power_w, ..light }
    }
}
