//! Laws of prior art, which know the sampling period but neither motor nor mode.

use super::profile::Profile;
use super::tune::Task;

/// Most periods of a law.
pub(super) const N_PERIODS_MAX: u32 = 1 << 20;

impl Task<'_> {
    /// Equal increments of the angle per period: speed comes in the first period and goes in the
    /// last, by as much acceleration as one period allows. `None` if that takes too long.
    pub(super) fn fixed_step(&self, period_s: f64) -> Option<Profile> {
        self.fewest_periods(2, |n_periods| {
            let end_s = f64::from(n_periods) * period_s;
            let knots = [0.0, 0.5 * period_s, period_s];
            let last = knots.map(|time_s| end_s - period_s + time_s);
            let pulse = |times: [f64; 3], sign: f64| times.into_iter().zip([0.0, sign, 0.0]);
            Profile::new(pulse(knots, 1.0).chain(pulse(last, -1.0)).collect())
        })
    }

    /// A speed that rises and falls evenly: acceleration changes within one period. `None` if
    /// that takes too long.
    pub(super) fn trapezoid(&self, period_s: f64) -> Option<Profile> {
        self.fewest_periods(2, |n_periods| {
            let hold_s = f64::from(n_periods - 2) * period_s;
            Profile::pulses([period_s, hold_s, period_s, period_s, hold_s, period_s])
        })
    }

    fn fewest_periods(&self, least: u32, shape: impl Fn(u32) -> Profile) -> Option<Profile> {
        let allowed = |n_periods: u32| {
            let profile = shape(n_periods).reaching(self.step_rad);
            self.allows(&profile.demand(self.galvo)).then_some(profile)
        };
        let (mut low, mut high) = (least - 1, least);
        let mut found = allowed(high);
        while found.is_none() {
            low = high;
            high = high.checked_mul(2).filter(|&high| high <= N_PERIODS_MAX)?;
            found = allowed(high);
        }
        while high - low > 1 {
            let middle = low.midpoint(high);
            match allowed(middle) {
                Some(profile) => (high, found) = (middle, Some(profile)),
                None => low = middle,
            }
        }
        found
    }
}
