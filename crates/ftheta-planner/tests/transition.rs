//! Transitions between moving ends, against an independent propagator and exact programs.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

mod campaign;

use campaign::plant::{Flow, N_SUBSTEPS, TICK_S, scanner};
use campaign::{Campaign, Random, Tally};
use ftheta_planner::jump::{
    Ask, Axis, AxisOptions, CurrentBound, Model, Route, Transitions, fewest_ticks_between,
};

fn options(model: Model) -> AxisOptions {
    AxisOptions { model, tick_s: TICK_S, voltage_reserve: 0.0, current_bound: CurrentBound::Always }
}

/// The whole range of requests as one planner is asked them: one part in a hundred of the campaign
/// in `examples/transitions`.
const WHOLE: Campaign = Campaign {
    seed: 7,
    n_requests: 3400,
    step_max_deg: 20.0,
    speed_max_rad_s: 300.0,
    model: Model::Flexible,
    voltage_reserve: 0.0,
};

fn run(set: &str, campaign: Campaign) -> Tally {
    let tally = campaign.run(&scanner(set), |_, _| Default::default()).unwrap();
    assert_eq!(tally.n_failed, 0, "{set}: {tally:?}");
    let n_refused: usize = tally.n_refused.iter().sum();
    assert_eq!(tally.n_planned + n_refused, campaign.n_requests, "{set}");
    assert!(tally.n_planned > campaign.n_requests * 4 / 5, "{set}: {tally:?}");
    tally
}

#[test]
fn random_routes_are_planned_within_limits() {
    let tally = run("S10", WHOLE);
    // About one in fifteen starts too near the wall it runs into; next to none of them so that it
    // could be doubted.
    assert!(tally.n_refused[0] > 150 && tally.n_refused[1] <= 10, "{tally:?}");
}

/// In whatever order rays are solved, and whichever of them have been kept.
#[test]
fn transitions_are_the_same_whatever_is_solved_before() {
    let transitions = || Transitions::new(&scanner("S10"), options(Model::Flexible)).unwrap();
    let [first, backwards, restored] = [transitions(), transitions(), transitions()];
    let routes = [(0.02, 40.0, -10.0), (0.004, -6.0, 6.0), (-0.01, 20.0, 30.0)].map(
        |(to_rad, from_rad_s, to_rad_s)| Route { from_rad: 0.0, to_rad, from_rad_s, to_rad_s },
    );
    let plan = |transitions: &Transitions, route: &Route| {
        transitions.plan(route).unwrap().unwrap().voltages_v().collect::<Vec<_>>()
    };
    let planned: Vec<_> = routes.iter().map(|route| plan(&first, route)).collect();
    let half: Vec<_> = first.solved().into_iter().step_by(2).collect();
    assert!(!half.is_empty());
    restored.restore(&half.into_iter().collect());
    for (route, voltages_v) in routes.iter().zip(&planned).rev() {
        assert_eq!(&plan(&backwards, route), voltages_v);
        assert_eq!(&plan(&restored, route), voltages_v);
    }
    assert_eq!(backwards.solved(), first.solved());
}

#[test]
fn one_number_of_ticks_before_a_wall_is_found() {
    let scanner = scanner("S14");
    let transitions = Transitions::new(&scanner, options(Model::Flexible)).unwrap();
    let route = Route {
        from_rad: 0.15778731296155327,
        to_rad: 0.2179453731968404,
        from_rad_s: 298.17725801092445,
        to_rad_s: 275.4571522207141,
    };
    assert!(transitions.plan(&route).unwrap().is_some());
}

/// Few ticks, so that few fans are solved.
#[test]
fn slow_routes_of_larger_scanners_are_planned_within_limits() {
    for (set, voltage_reserve) in [("S14", 0.12), ("S25", 0.0)] {
        let slow = Campaign { n_requests: 1000, step_max_deg: 0.3, speed_max_rad_s: 15.0, ..WHOLE };
        run(set, Campaign { voltage_reserve, ..slow });
    }
}

/// Ticks above the fewest that an exact program needs, as a part of them: mean and worst.
fn excess(seed: u64, n_cases: usize, steps_deg: (f64, f64), speed_rad_s: f64) -> (f64, f64) {
    let scanner = scanner("S10");
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
    let scanner = scanner("S10");
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
    let flow = Flow::new(&scanner, TICK_S / N_SUBSTEPS as f64);
    for (route, voltages_v) in routes.iter().zip(fewest(&routes)) {
        assert_eq!(voltages_v.len(), 123);
        let mut state = [route.from_rad, route.from_rad_s, 0.0, 0.0, 0.0];
        for voltage_v in voltages_v {
            assert!(voltage_v.abs() <= scanner.voltage_max_v);
            for _ in 0..N_SUBSTEPS {
                state = flow.after(&state, voltage_v);
                assert!(state[0].abs() <= scanner.angle_max_rad * (1.0 + 1e-4), "{state:?}");
                assert!(state[4].abs() <= scanner.current_max_a * (1.0 + 1e-9), "{state:?}");
            }
        }
        let end = [route.to_rad, route.to_rad_s, 0.0, 0.0, 0.0];
        let missed = state.iter().zip(end).map(|(value, wanted)| (value - wanted).abs());
        assert!(missed.fold(0.0, f64::max) < 1e-6, "{state:?}");
    }
}
