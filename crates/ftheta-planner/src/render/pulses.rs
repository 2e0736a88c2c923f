//! Triggers of a laser that gives one pulse for each: the distance of pulses along a mark is the
//! pen's at any speed.

use ftheta_model::machine::Laser;
use ftheta_model::plan::{PlanDraft, PlannedMark};

/// Where a walk through the pulses of a plan is.
#[derive(Clone, Debug)]
pub struct Triggers {
    /// Time between pulses at the pen's power and full rate, ns; `None` where pulses run free.
    period_ns: Option<f64>,
    /// How much later than its signal the off edge ends the light, beside the on edge, ns.
    stretch_ns: i64,
    mark_index: usize,
    /// Steps of the mark's power already passed.
    n_steps: usize,
    /// Signal time up to which energy is counted, ns; `None` before the mark.
    counted_ns: Option<f64>,
    /// Pulses that the energy counted is worth, and pulses given.
    worth: f64,
    n_given: u64,
}

impl Triggers {
    /// Before the first mark.
    pub fn new(laser: &Laser) -> Self {
        let period_s = laser.pulse_period_s().filter(|_| laser.pulses_triggered);
        Self {
            period_ns: period_s.map(|s| 1e9 * s),
            stretch_ns: laser.off_latency_ns - laser.on_latency_ns,
            mark_index: 0,
            n_steps: 0,
            counted_ns: None,
            worth: 0.0,
            n_given: 0,
        }
    }

    /// Appends the triggers before `end_ns` that were not given yet.
    ///
    /// The planned power over time is what a continuous beam would need. Each time it has given
    /// half a pulse, one and a half, and so on, a pulse is due: pulses lie in the middle of what
    /// they stand for. Of a mark that is not worth a whole number of pulses, one at least, both
    /// ends have the same share of what is over or missing.
    pub fn push_before(&mut self, plan: &PlanDraft, end_ns: u64, triggers_ns: &mut Vec<u64>) {
        let Some(period_ns) = self.period_ns else {
            return;
        };
        let end_ns = end_ns as f64;
        while let Some(mark) = plan.marks.get(self.mark_index) {
            let pen_w = plan.pens[mark.pen_index].power_w;
            let off_ns = mark.off_ns.saturating_add_signed(self.stretch_ns) as f64;
            let from_ns = self.counted_ns.unwrap_or(mark.on_ns as f64);
            if from_ns >= end_ns {
                return;
            }
            if self.counted_ns.is_none() && pen_w > 0.0 {
                let worth = worth(mark, off_ns) / pen_w / period_ns;
                self.worth = 0.5 * (worth.round().max(1.0) - worth);
            }
            let power_w = match self.n_steps.checked_sub(1) {
                Some(step) => mark.steps[step].power_w,
                None => mark.power_w,
            };
            let next = mark.steps.get(self.n_steps).map(|step| step.time_ns as f64);
            let until_ns = next.unwrap_or(off_ns).min(off_ns);
            let to_ns = until_ns.min(end_ns).max(from_ns);
            if pen_w > 0.0 {
                self.give(from_ns, to_ns, power_w / pen_w / period_ns, triggers_ns);
            }
            self.counted_ns = Some(to_ns);
            if until_ns > end_ns {
                return;
            }
            if next.is_some() && until_ns < off_ns {
                self.n_steps += 1;
                continue;
            }
            self.mark_index += 1;
            (self.n_steps, self.counted_ns) = (0, None);
            (self.worth, self.n_given) = (0.0, 0);
        }
    }

    /// Gives the pulses due between two times.
    ///
    /// * `per_ns`: pulses that a nanosecond is worth
    fn give(&mut self, from_ns: f64, to_ns: f64, per_ns: f64, triggers_ns: &mut Vec<u64>) {
        let after = self.worth + per_ns * (to_ns - from_ns);
        while self.n_given as f64 + 0.5 < after {
            let due = self.n_given as f64 + 0.5;
            triggers_ns.push((from_ns + (due - self.worth) / per_ns) as u64);
            self.n_given += 1;
        }
        self.worth = after;
    }
}

/// What a mark's light would give until `off_ns`, W·ns.
fn worth(mark: &PlannedMark, off_ns: f64) -> f64 {
    let begins = [(mark.on_ns, mark.power_w)].into_iter();
    let begins = begins.chain(mark.steps.iter().map(|step| (step.time_ns, step.power_w)));
    let ends = mark.steps.iter().map(|step| step.time_ns as f64).chain([off_ns]);
    let parts = begins.zip(ends);
    parts
        .map(|((on_ns, power_w), end_ns)| power_w * (end_ns.min(off_ns) - on_ns as f64).max(0.0))
        .sum()
}
