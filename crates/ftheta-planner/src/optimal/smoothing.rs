//! What averaging does to corners, and what corners then ask of the motor.

use ftheta_model::machine::Machine;
use ftheta_physics::follow::{Inverse, N_TAPS, Taps, dot};
use ftheta_physics::galvo::{CURRENT, Galvo};
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::servo::Gains;

/// An average is as long as this part of the servo's lag.
const LAG_SHARE: f64 = 0.25;

/// Spread of a servo's answer in time, as a part of its lag: two equal poles have 0.71, state
/// feedback 0.43.
const SERVO_SHARE: f64 = 0.65;
/// Mean of a bell's distance from its middle, as a part of its spread.
const MEAN_SHARE: f64 = 0.8;

/// Averaging over some ticks, three times.
#[derive(Clone, Debug)]
pub(super) struct Smoothing {
    pub(super) n_ticks: u32,
    /// Half of the time that is averaged over, s.
    pub(super) half_s: f64,
    /// Mean distance in time from the middle, s.
    pub(super) mean_s: f64,
    /// Mean square of it, s².
    pub(super) variance_s2: f64,
    /// Greatest voltage (V) and current (A) for a speed that changes at once by 1 mm/s.
    voltage_s_mm: f64,
    current_s_mm: f64,
    /// Voltage of coasting at 1 mm/s, V.
    coast_s_mm: f64,
}

impl Smoothing {
    /// What an unknown servo makes of a corner besides: as if it averaged, too.
    pub(super) fn with_servo(mut self, lag_s: f64) -> Self {
        let variance_s2 = (SERVO_SHARE * lag_s).powi(2);
        let before_s = self.mean_s / self.variance_s2.sqrt().max(f64::MIN_POSITIVE);
        self.variance_s2 += variance_s2;
        self.mean_s = before_s.max(MEAN_SHARE) * self.variance_s2.sqrt();
        self.half_s += lag_s;
        self
    }

    /// The averaging that a machine's motors want.
    pub(super) fn new(machine: &Machine, galvo: &Galvo, gains: &Gains, inverse: &Inverse) -> Self {
        let tick_s = machine.output.period_s();
        let n_ticks = (LAG_SHARE * gains.lag_s(galvo) / tick_s).round().clamp(1.0, 1000.0) as u32;
        let shares = shares(n_ticks);
        let middle = 0.5 * (shares.len() - 1) as f64;
        let moment = |power: i32| -> f64 {
            let off = |index: usize| ((index as f64 - middle).abs() * tick_s).powi(power);
            shares.iter().enumerate().map(|(index, share)| share * off(index)).sum()
        };
        let scale = scale_mm_per_rad(&machine.optics);
        let (voltage_s_mm, current_s_mm) = kink(&shares, inverse, tick_s / scale);
        Self {
            n_ticks,
            half_s: middle * tick_s,
            mean_s: moment(1),
            variance_s2: moment(2),
            voltage_s_mm,
            current_s_mm,
            coast_s_mm: galvo.torque_constant / scale,
        }
    }

    /// Change of speed at once that voltage and current stand at a speed, mm/s.
    pub(super) fn change_max_mm_s(
        &self,
        speed_mm_s: f64,
        voltage_max_v: f64,
        current_max_a: f64,
    ) -> f64 {
        let left_v = (voltage_max_v - self.coast_s_mm * speed_mm_s).max(0.0);
        (left_v / self.voltage_s_mm).min(current_max_a / self.current_s_mm)
    }
}

/// Shares of neighbouring ticks in three averages.
pub(super) fn shares(n_ticks: u32) -> Vec<f64> {
    let n = n_ticks as usize;
    let mut shares = vec![1.0];
    for _ in 0..3 {
        let mut longer = vec![0.0; shares.len() + n - 1];
        for (index, share) in shares.iter().enumerate() {
            longer[index..index + n].iter_mut().for_each(|sum| *sum += share / n as f64);
        }
        shares = longer;
    }
    shares
}

/// Greatest voltage and current where a ramp of `per_tick` rad begins at once, averaged.
fn kink(shares: &[f64], inverse: &Inverse, per_tick: f64) -> (f64, f64) {
    let middle = 0.5 * (shares.len() - 1) as f64;
    let angle_rad = |tick: f64| -> f64 {
        let ramp = |index: usize| (tick + index as f64 - middle).max(0.0);
        per_tick * shares.iter().enumerate().map(|(index, share)| share * ramp(index)).sum::<f64>()
    };
    let (mut voltage_v, mut current_a) = (0.0_f64, 0.0_f64);
    let reach = (middle as i32) + N_TAPS as i32 + 1;
    // Where between two ticks the kink lies decides little; halves show the most of it.
    for half_tick in -2 * reach..=2 * reach {
        let at = 0.5 * f64::from(half_tick);
        let first = at - ftheta_physics::follow::TAPS_BEFORE as f64;
        let around: Taps = std::array::from_fn(|tap| angle_rad(first + tap as f64));
        voltage_v = voltage_v.max(dot(&inverse.voltage, &around).abs());
        current_a = current_a.max(dot(&inverse.state[CURRENT], &around).abs());
    }
    (voltage_v, current_a)
}
