//! Laws tuned per step: the parameters with the least time until the mirror stays near the target.

use super::descent::descend;
use super::profile::{Demand, Profile};
use ftheta_physics::galvo::Galvo;
use std::f64::consts::{PI, TAU};

/// Knots of a law that is a smooth function of time; its residual is then right within 1e-3.
const N_KNOTS: u32 = 96;
/// Lengths of a smooth law that are tried, and the factor from one to the next.
const N_LENGTHS: i32 = 1600;
const LENGTH_RATIO: f64 = 1.001;
/// A search stops this part short of the limits of voltage and current, and of the tolerance, so
/// that what the penalty leaves in excess is within them.
const MARGINS: [f64; 3] = [5e-4, 5e-4, 1e-2];
/// Starts of a search per parameter of the law.
const N_STARTS: usize = 24;

/// The axis a law is tuned for, and the task.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task<'a> {
    pub(super) galvo: &'a Galvo,
    pub(super) step_rad: f64,
    pub(super) tolerance_rad: f64,
    pub(super) voltage_max_v: f64,
    pub(super) current_max_a: f64,
}

impl Task<'_> {
    /// Time from the law's end until the vibration alone is within the tolerance, s.
    fn settle_s(&self, demand: &Demand) -> f64 {
        let decay = self.galvo.damping_ratio * self.galvo.omega;
        (demand.residual_rad / self.tolerance_rad).ln().max(0.0) / decay
    }

    pub(super) fn allows(&self, demand: &Demand) -> bool {
        demand.voltage_v <= self.voltage_max_v && demand.current_a <= self.current_max_a
    }

    /// The shortest this shape can be, s.
    fn shortest_s(&self, shape: &Profile) -> f64 {
        let allows =
            |time_s: f64| self.allows(&shape.stretched(self.step_rad, time_s).demand(self.galvo));
        let mut high = PI / self.galvo.omega;
        while !allows(high) && high < 1e3 {
            high *= 1.5;
        }
        let mut low = 0.0;
        while high - low > 1e-6 * high {
            let middle = 0.5 * (low + high);
            if allows(middle) { high = middle } else { low = middle }
        }
        high
    }

    /// This shape as short as can be, or stretched to the least time until the mirror is there.
    fn stretched(&self, shape: &Profile, fastest: bool) -> Profile {
        let shortest_s = self.shortest_s(shape);
        let mut best = shape.stretched(self.step_rad, shortest_s);
        if fastest {
            return best;
        }
        let mut least_s = f64::INFINITY;
        for length in 0..N_LENGTHS {
            let time_s = shortest_s * LENGTH_RATIO.powi(length);
            let stretched = shape.stretched(self.step_rad, time_s);
            let total_s = time_s + self.settle_s(&stretched.demand(self.galvo));
            if total_s < least_s {
                (best, least_s) = (stretched, total_s);
            }
        }
        best
    }

    /// The cycloid: one period of a sine as acceleration.
    pub(super) fn cycloid(&self, fastest: bool) -> Profile {
        self.stretched(&sampled(|t| (TAU * t).sin()), fastest)
    }

    /// The polynomial of fifth degree that starts and ends at rest.
    pub(super) fn quintic(&self, fastest: bool) -> Profile {
        self.stretched(&sampled(|t| t * (1.0 - t) * (1.0 - 2.0 * t)), fastest)
    }

    /// The S-curve that is fastest, whatever it leaves in the mode.
    pub(super) fn s_curve_fastest(&self) -> Profile {
        let patient = Self { tolerance_rad: f64::INFINITY, ..*self };
        patient.s_curve()
    }

    /// The symmetric S-curve: jerk and greatest acceleration are searched.
    pub(super) fn s_curve(&self) -> Profile {
        self.search(|&[rise, hold]: &[f64; 2]| {
            Profile::pulses([rise, hold, rise, rise, hold, rise])
        })
    }

    /// The S-curve whose acceleration and braking have a jerk each.
    pub(super) fn asymmetric(&self) -> Profile {
        self.search(|&[rise, hold, brake_rise, brake_hold]: &[f64; 4]| {
            Profile::pulses([rise, hold, rise, brake_rise, brake_hold, brake_rise])
        })
    }

    /// The S-curve whose six parts are all free.
    pub(super) fn residual(&self) -> Profile {
        self.search(|durations: &[f64; 6]| Profile::pulses(*durations))
    }

    /// The S-curve behind a shaper whose impulses, `n` half periods of the mode apart, cancel it:
    /// one is zero vibration, two that and its derivative by frequency.
    pub(super) fn shaped(&self, n_delays: u32) -> Profile {
        let damping = self.galvo.damping_ratio;
        let root = (1.0 - damping * damping).sqrt();
        let (decay, half_s) = ((-damping * PI / root).exp(), PI / (self.galvo.omega * root));
        let gains: &[f64] = if n_delays == 1 { &[1.0, 1.0] } else { &[1.0, 2.0, 1.0] };
        let impulses: Vec<(f64, f64)> = gains
            .iter()
            .zip(0_u32..)
            .map(|(gain, index)| (gain * decay.powi(index as i32), f64::from(index) * half_s))
            .collect();
        self.search(|&[rise, hold]: &[f64; 2]| {
            Profile::pulses([rise, hold, rise, rise, hold, rise]).shaped(&impulses)
        })
    }

    /// The law of this family with the least total time.
    ///
    /// Gradient searches from starts of many lengths and shapes; the parameters are logarithms
    /// of durations.
    fn search<const N: usize>(&self, family: impl Fn(&[f64; N]) -> Profile) -> Profile {
        let profile = |logs: &[f64; N]| family(&logs.map(f64::exp)).reaching(self.step_rad);
        let scale_s = self.shortest_s(&family(&[1.0; N]));
        let evaluate = |logs: &[f64; N]| {
            let profile = profile(logs);
            let demand = profile.demand(self.galvo);
            let excess = [
                demand.voltage_v / self.voltage_max_v,
                demand.current_a / self.current_max_a,
                demand.residual_rad / self.tolerance_rad,
            ];
            let excess = std::array::from_fn(|i| excess[i] - 1.0 + MARGINS[i]);
            (profile.duration_s() / scale_s, excess)
        };
        let mut best = None;
        let mut least_s = f64::INFINITY;
        for start in 0..N_STARTS * N {
            let logs = descend(self.start(start, scale_s, &family), evaluate);
            let profile = profile(&logs);
            let demand = profile.demand(self.galvo);
            let total_s = profile.duration_s() + self.settle_s(&demand);
            if self.allows(&demand) && total_s < least_s {
                (best, least_s) = (Some(profile), total_s);
            }
        }
        // Even equal parts, slow enough, are within the limits.
        best.unwrap_or_else(|| self.stretched(&family(&[scale_s; N]), false))
    }

    /// Logarithms of the durations of one start: spread evenly over shapes and lengths.
    fn start<const N: usize>(
        &self,
        index: usize,
        scale_s: f64,
        family: &impl Fn(&[f64; N]) -> Profile,
    ) -> [f64; N] {
        let spread = |dimension: usize| {
            // Multiples of the roots of a cubic-like equation fill a cube evenly.
            let root = 1.0 + 1.0 / (N as f64 + 1.5);
            (0.5 + (index + 1) as f64 / root.powi(dimension as i32 + 1)).fract()
        };
        let durations: [f64; N] = std::array::from_fn(|i| (3.0 * spread(i) - 1.5).exp());
        let length = 1.0 + 2.5 * spread(N).powi(2);
        let natural_s = family(&durations).duration_s();
        durations.map(|part| (part / natural_s * scale_s * length).ln())
    }
}

/// An acceleration over 0 to 1 as knots.
fn sampled(acceleration: impl Fn(f64) -> f64) -> Profile {
    let knot = |index: u32| {
        let t = f64::from(index) / f64::from(N_KNOTS);
        (t, if index.is_multiple_of(N_KNOTS) { 0.0 } else { acceleration(t) })
    };
    Profile::new((0..=N_KNOTS).map(knot).collect())
}
