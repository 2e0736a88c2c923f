//! Motion between marks for a head of which only lag and limits are known: angles that any servo
//! follows, from place and speed to place and speed.

use super::fly_by::States;
use ftheta_model::machine::Machine;
use ftheta_physics::audit::{COMMAND_SHARE, CORRECTION_RESERVE};
use ftheta_physics::galvo::{Galvo, State};

/// Part of the greatest angular acceleration that a glide uses.
const ACCELERATION_SHARE: f64 = 0.3;
/// Part of the greatest voltage that it uses, as far as acceleration and back-EMF tell.
const VOLTAGE_SHARE: f64 = 0.5;
/// Shortest glide, in lags of the servo.
const LAGS_MIN: f64 = 2.0;
/// Points at which a glide is looked at.
const N_LOOKS: usize = 64;
/// By how much a glide grows from try to try.
const LONGER: f64 = 1.15;
/// Longest glide, ticks.
const N_TICKS_MAX: f64 = 1e6;

/// Plans glides.
pub(super) struct Glide {
    tick_s: f64,
    lag_s: f64,
    angle_max_rad: f64,
    speed_max_rad_s: f64,
    acceleration_max_rad_s2: f64,
    voltage_max_v: f64,
    /// Voltage per speed and per acceleration, in the steady state.
    voltage_per: [f64; 2],
    mirror_row: State,
    speed_row: State,
}

impl Glide {
    /// * `lag_s`: of the servo
    pub(super) fn new(machine: &Machine, lag_s: f64) -> Self {
        let scanner = &machine.scanner;
        let galvo = Galvo::new(scanner);
        let per_current = galvo.torque_constant / galvo.inertia();
        let free = 1.0 - CORRECTION_RESERVE;
        let word = machine.output.word_range_rad;
        Self {
            tick_s: machine.output.period_s(),
            lag_s,
            angle_max_rad: (free * scanner.angle_max_rad).min(COMMAND_SHARE * word),
            speed_max_rad_s: 0.9 * free * scanner.speed_max_rad_s,
            acceleration_max_rad_s2: ACCELERATION_SHARE * per_current * scanner.current_max_a,
            voltage_max_v: VOLTAGE_SHARE * scanner.voltage_max_v,
            voltage_per: [galvo.torque_constant, galvo.resistance / per_current],
            mirror_row: galvo.mirror_row(),
            speed_row: galvo.mirror_speed_row(),
        }
    }

    /// The angles of both axes after each tick, the last one where `to` is; `None` if the angles
    /// leave no room.
    ///
    /// * `n_least`: ticks that it takes at least
    pub(super) fn between(
        &self,
        from: &States,
        to: &States,
        n_least: usize,
    ) -> Option<Vec<[f64; 2]>> {
        let n_lags = (LAGS_MIN * self.lag_s / self.tick_s).ceil().max(2.0);
        let mut n_ticks = n_lags.max(n_least as f64);
        while n_ticks < N_TICKS_MAX {
            let duration_s = n_ticks * self.tick_s;
            let laws = [0, 1].map(|axis| self.law(&from[axis], &to[axis], duration_s));
            if laws.iter().all(|law| self.allows(law)) {
                let angles = |tick: usize| laws.map(|law| law.at((tick + 1) as f64 / n_ticks).0);
                return Some((0..n_ticks as usize).map(angles).collect());
            }
            n_ticks = (n_ticks * LONGER).ceil();
        }
        None
    }

    fn law(&self, from: &State, to: &State, duration_s: f64) -> Law {
        let ends = |state: &State| (self.mirror_row.dot(state), self.speed_row.dot(state));
        let ((x0, v0), (x1, v1)) = (ends(from), ends(to));
        Law { x0, x1, v0, v1, duration_s }
    }

    fn allows(&self, law: &Law) -> bool {
        (0..=N_LOOKS).all(|look| {
            let (angle, speed, acceleration) = law.at(look as f64 / N_LOOKS as f64);
            let voltage = self.voltage_per[0] * speed + self.voltage_per[1] * acceleration;
            angle.abs() <= self.angle_max_rad
                && speed.abs() <= self.speed_max_rad_s
                && acceleration.abs() <= self.acceleration_max_rad_s2
                && voltage.abs() <= self.voltage_max_v
        })
    }
}

/// The quintic from place and speed to place and speed, without acceleration at its ends.
#[derive(Clone, Copy)]
struct Law {
    x0: f64,
    x1: f64,
    v0: f64,
    v1: f64,
    duration_s: f64,
}

impl Law {
    /// Angle, speed and acceleration at a share of the duration.
    fn at(&self, share: f64) -> (f64, f64, f64) {
        let Self { x0, x1, v0, v1, duration_s: t } = *self;
        let d = x1 - x0;
        let (a3, a4, a5) = (
            10.0 * d - (6.0 * v0 + 4.0 * v1) * t,
            -15.0 * d + (8.0 * v0 + 7.0 * v1) * t,
            6.0 * d - 3.0 * (v0 + v1) * t,
        );
        let u = share;
        let angle = x0 + u * (v0 * t + u * u * (a3 + u * (a4 + u * a5)));
        let speed = v0 + u * u * (3.0 * a3 + u * (4.0 * a4 + u * 5.0 * a5)) / t;
        let acceleration = u * (6.0 * a3 + u * (12.0 * a4 + u * 20.0 * a5)) / (t * t);
        (angle, speed, acceleration)
    }
}
