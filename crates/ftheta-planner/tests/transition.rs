//! Transitions between moving ends, against an independent propagator and exact programs.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_planner::jump::{
    Ask, Axis, AxisOptions, CurrentBound, Model, Route, Transitions, fewest_ticks_between,
};

const TICK_S: f64 = 1e-5;

fn s10() -> Scanner {
    Scanner {
        rotor_inertia_kg_m2: 1.25e-8,
        mirror_inertia_kg_m2: 3e-8,
        torque_constant_n_m_a: 0.00617,
        resistance_ohm: 2.79,
        inductance_h: 180e-6,
        torsional_mode_hz: 5200.0,
        damping_ratio: 0.01,
        voltage_max_v: 24.0,
        current_max_a: 8.0,
        current_rms_a: 3.9,
        thermal_time_s: 1.0,
        angle_max_rad: 12.5_f64.to_radians(),
        speed_max_rad_s: 1000.0,
        f1_uncertainty: 0.03,
        kt_uncertainty: 0.005,
        servo: Servo::StateFeedback { velocity_weight_s: 1e-4, lag_s: 1.64e-4 },
        sensor: Sensor::default(),
        losses: Losses::default(),
    }
}

fn options(model: Model) -> AxisOptions {
    AxisOptions { model, tick_s: TICK_S, voltage_reserve: 0.0, current_bound: CurrentBound::Always }
}

/// Splitmix64: the same numbers everywhere.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Checks ends and limits in steps of 2 µs.
fn assert_sound(scanner: &Scanner, route: &Route, voltages_v: impl Iterator<Item = f64>) {
    let plant = Galvo::new(scanner);
    let step = plant.step(TICK_S / 5.0);
    let mut state = State::new(route.from_rad, route.from_rad_s, 0.0, 0.0, 0.0);
    let limit = |value: f64, limit: f64| value.abs() <= limit * (1.0 + 1e-3);
    for voltage in voltages_v {
        assert!(voltage.abs() <= scanner.voltage_max_v * (1.0 + 1e-9), "{route:?}: {voltage} V");
        for _ in 0..5 {
            state = step.a * state + step.b * voltage;
            assert!(limit(state[CURRENT], scanner.current_max_a), "{route:?} {state:?}");
            let mirror_rad = plant.mirror_row().dot(&state);
            assert!(limit(mirror_rad, scanner.angle_max_rad), "{route:?} {state:?}");
        }
    }
    let end = State::new(route.to_rad, route.to_rad_s, 0.0, 0.0, 0.0);
    let units = [1.0, plant.omega, 1.0, plant.omega, 1e3];
    let size = 0.1 + (route.to_rad - route.from_rad).abs();
    for (index, unit) in units.into_iter().enumerate() {
        let missed = (state - end)[index] / unit;
        assert!(missed.abs() < 1e-9 * size, "{route:?}: state {index} off by {missed}");
    }
}

#[test]
fn random_routes_are_planned_within_limits() {
    let scanner = s10();
    let transitions = Transitions::new(&scanner, options(Model::Flexible)).unwrap();
    let mut random = Random(7);
    let (mut n_planned, mut n_none) = (0, 0);
    for _ in 0..2000 {
        let range = scanner.angle_max_rad;
        let step = 10_f64.powf(random.within(-4.0, 1.3)).to_radians();
        let step = if random.unit() < 0.5 { step } else { -step };
        let from_rad = random.within(-range, range);
        let to_rad = from_rad + step;
        if to_rad.abs() > range {
            continue;
        }
        let route = Route {
            from_rad,
            to_rad,
            from_rad_s: random.within(-300.0, 300.0),
            to_rad_s: random.within(-300.0, 300.0),
        };
        match transitions.plan(&route).unwrap() {
            Some(transition) => {
                n_planned += 1;
                assert_sound(&scanner, &route, transition.voltages_v());
            }
            None => n_none += 1,
        }
    }
    // About one in sixteen starts too near the wall it runs into.
    assert!(n_planned > 1600 && n_none < 200, "{n_planned} planned, {n_none} out of room");
}

/// Ticks above the fewest that an exact program needs, as a part of them: mean and worst.
fn excess(seed: u64, n_cases: usize, steps_deg: (f64, f64), speed_rad_s: f64) -> (f64, f64) {
    let scanner = s10();
    let axis = Axis::new(&scanner, options(Model::Flexible)).unwrap();
    let transitions = Transitions::new(&scanner, options(Model::Flexible)).unwrap();
    let mut random = Random(seed);
    let (mut sum, mut worst) = (0.0, 0.0_f64);
    for _ in 0..n_cases {
        let step_deg = random.within(steps_deg.0.ln(), steps_deg.1.ln()).exp();
        let ask = Ask {
            distance_rad: step_deg.to_radians() * if random.unit() < 0.5 { 1.0 } else { -1.0 },
            from_rad_s: random.within(-speed_rad_s, speed_rad_s),
            to_rad_s: random.within(-speed_rad_s, speed_rad_s),
        };
        let route = Route {
            from_rad: 0.0,
            to_rad: ask.distance_rad,
            from_rad_s: ask.from_rad_s,
            to_rad_s: ask.to_rad_s,
        };
        let n_ticks = transitions.plan(&route).unwrap().unwrap().n_ticks();
        let fewest = (5..=n_ticks).find(|&n| axis.reaches(&ask, n).unwrap()).unwrap();
        let excess = n_ticks as f64 / fewest as f64 - 1.0;
        sum += excess;
        worst = worst.max(excess);
    }
    (sum / n_cases as f64, worst)
}

#[test]
fn fly_by_is_near_the_fewest_ticks() {
    let (mean, worst) = excess(1, 200, (0.05, 3.0), 2.0 / 0.32);
    let (_, fast) = excess(2, 200, (0.005, 3.0), 20.0 / 0.32);
    assert!(mean <= 0.02 && worst <= 0.06 && fast <= 0.10, "{mean} {worst} {fast}");
}

/// The example of patent CN105005322B at 0.32 m/rad: a laser-off loop round a corner of 90 degrees.
///
/// The ticks are those of `design/control.md`.
#[test]
fn the_loop_of_the_patent() {
    let scanner = s10();
    let (angle_rad, speed_rad_s) = (0.05 / 0.32, 100.0 / 0.32);
    let route = |to_rad_s: f64| Route {
        from_rad: angle_rad,
        to_rad: angle_rad,
        from_rad_s: speed_rad_s,
        to_rad_s,
    };
    let routes = [route(speed_rad_s), route(-speed_rad_s)];
    let fewest = |routes: &[Route]| {
        let voltages_v = fewest_ticks_between(&scanner, options(Model::Flexible), routes);
        voltages_v.unwrap().unwrap()
    };
    assert_eq!(fewest(&routes[..1])[0].len(), 123);
    assert_eq!(fewest(&routes[1..])[0].len(), 63);
    for (route, voltages_v) in routes.iter().zip(fewest(&routes)) {
        assert_eq!(voltages_v.len(), 123);
        assert_sound(&scanner, route, voltages_v.into_iter());
    }
}
