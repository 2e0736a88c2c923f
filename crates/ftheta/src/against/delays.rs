//! The classic planner's delays in the steps that they are tuned in.

use ftheta_model::machine::Laser;
use ftheta_model::recipe::ClassicRecipe;
use ftheta_planner::classic::Settings;

/// Speeds of jumps that are tried, mm/s.
pub const JUMP_SPEEDS_MM_S: [f64; 5] = [1e3, 2e3, 4e3, 8e3, 16e3];
/// Step of delays and runs, as a controller counts them, s.
const STEP_S: f64 = 10e-6;
/// Step of the laser's delays, ns.
const LASER_STEP_NS: i64 = 1000;

/// Number of settings that are tuned.
pub const N_SETTINGS: usize = 8;
/// Position of the jump speed among them.
pub const JUMP_SPEED: usize = 0;
const JUMP: usize = 1;
const MARK: usize = 2;
const POLYGON: usize = 3;
const LASER_ON: usize = 4;
const LASER_OFF: usize = 5;
const RUN_IN: usize = 6;
const RUN_OUT: usize = 7;

/// Positions of the jump speeds that are worth a start of their own.
const STARTS: [i32; 2] = [3, 4];
/// How many times what the lag suggests is enough for nearly any job.
const GENEROUS: i32 = 3;
/// Lags by which light is longer at a mark's start and end where those have to be reached.
const LONGER: [f64; 2] = [0.4, 0.9];

/// Index of the jump speed; jump, mark and polygon delay in 10 µs; laser-on and laser-off delay in
/// 1 µs; run-in and run-out in 10 µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Delays(pub [i32; N_SETTINGS]);

impl Delays {
    /// Generous settings at the faster jump speeds, the usual one first, and the lag-derived ones.
    ///
    /// From where the tolerance is kept only time is to be saved, which takes the fewest steps.
    ///
    /// * `coverage`: whether ends and corners have to be reached, which takes light that is longer
    ///   at both ends, unless they are passed at full speed
    pub fn starts(settings: &Settings, coverage: bool, sky: bool) -> Vec<Self> {
        let derived = Self::near(settings, sky);
        let mut generous = derived;
        if coverage && !sky {
            let lag_us = 1e6 * settings.polygon_delay_s;
            generous.0[LASER_ON] -= (LONGER[0] * lag_us) as i32;
            generous.0[LASER_OFF] += (LONGER[1] * lag_us) as i32;
        }
        let waits = if sky { RUN_IN..=RUN_OUT } else { JUMP..=POLYGON };
        waits.for_each(|setting| generous.0[setting] *= GENEROUS);
        let starts = STARTS.map(|speed| {
            let mut delays = generous;
            delays.0[JUMP_SPEED] = speed;
            delays
        });
        starts.into_iter().chain([derived]).collect()
    }

    /// The steps nearest to lag-derived settings.
    ///
    /// * `sky`: with runs of two lags before and one after every leg, the jump delay at 0
    fn near(settings: &Settings, sky: bool) -> Self {
        let steps = |time_s: f64| (time_s / STEP_S).round() as i32;
        let laser = |time_ns: i64| (time_ns as f64 / LASER_STEP_NS as f64).round() as i32;
        let apart = |speed_mm_s: f64| (speed_mm_s / settings.jump_speed_mm_s).ln().abs();
        let speeds = JUMP_SPEEDS_MM_S.iter().enumerate();
        let speed = speeds.min_by(|a, b| apart(*a.1).total_cmp(&apart(*b.1)));
        // Lag-derived, the jump delay is two lags and the polygon delay one.
        let (lag, lags) = (steps(settings.polygon_delay_s), steps(settings.jump_delay_s));
        let [jump, mark, run_in, run_out] =
            if sky { [0, 0, lags, lag] } else { [lags, steps(settings.mark_delay_s), 0, 0] };
        Self([
            speed.map_or(0, |(index, _)| index as i32),
            jump,
            mark,
            lag,
            laser(settings.laser_on_delay_ns),
            laser(settings.laser_off_delay_ns),
            run_in,
            run_out,
        ])
    }

    /// Which settings play a part.
    pub fn tuned(sky: bool) -> &'static [usize] {
        // Skywriting waits for no mark delay; its polygon delay says what a corner is.
        match sky {
            true => &[JUMP_SPEED, JUMP, POLYGON, LASER_ON, LASER_OFF, RUN_IN, RUN_OUT],
            false => &[JUMP_SPEED, JUMP, MARK, POLYGON, LASER_ON, LASER_OFF],
        }
    }

    /// With one setting changed by `steps`; `None` where it would leave its range.
    pub fn moved(mut self, setting: usize, steps: i32) -> Option<Self> {
        let value = self.0[setting].checked_add(steps)?;
        let within = match setting {
            JUMP_SPEED => (0..JUMP_SPEEDS_MM_S.len() as i32).contains(&value),
            LASER_ON | LASER_OFF => true,
            // Without any run it would be no skywriting.
            RUN_IN => value > 0,
            _ => value >= 0,
        };
        self.0[setting] = value;
        within.then_some(self)
    }

    /// By how much light is shorter than its mark's command, µs; negative where it is longer.
    pub fn light_missing_us(self, laser: &Laser) -> f64 {
        let (on_us, off_us) = (self.0[LASER_ON], self.0[LASER_OFF]);
        f64::from(on_us - off_us) + (laser.on_latency_ns - laser.off_latency_ns) as f64 * 1e-3
    }

    /// As the user's settings would be; the jump delay is the same after all jumps.
    pub fn recipe(self, base: &ClassicRecipe) -> ClassicRecipe {
        let [speed, jump, mark, polygon, on, off, run_in, run_out] = self.0;
        let time = |steps: i32| Some(f64::from(steps) * STEP_S);
        let laser = |steps: i32| Some(i64::from(steps) * LASER_STEP_NS);
        let speed = (speed.max(0) as usize).min(JUMP_SPEEDS_MM_S.len() - 1);
        ClassicRecipe {
            jump_speed_mm_s: Some(JUMP_SPEEDS_MM_S[speed]),
            jump_delay_min_s: time(jump),
            jump_delay_s: time(jump),
            mark_delay_s: time(mark),
            polygon_delay_s: time(polygon),
            laser_on_delay_ns: laser(on),
            laser_off_delay_ns: laser(off),
            sky_run_in_s: time(run_in),
            sky_run_out_s: time(run_out),
            ..*base
        }
    }
}
