//! Corners against reference figures, an independent propagator, and plants off the nominal one.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

#[path = "campaign/plant.rs"]
mod plant;

use ftheta_model::machine::{Scanner, Servo};
use ftheta_physics::axis_loop::AxisLoop;
use ftheta_physics::galvo::{Galvo, State, Step};
use ftheta_physics::servo::Gains;
use ftheta_planner::corner::{Corner, Corners, End};
use ftheta_planner::jump::{AxisOptions, CurrentBound, JumpError, Model};
use plant::{Flow, N_SUBSTEPS, TICK_S, scanner};

/// Work plane per mechanical angle, m/rad.
const SCALE_M_RAD: f64 = 0.32;
/// Ticks of coasting on each leg, so that every plant has settled.
const N_COASTING: usize = 200;
/// Looks in a tick at the mirror.
const N_LOOKS: u32 = 16;

fn options(tick_s: f64, voltage_reserve: f64) -> AxisOptions {
    let current_bound = CurrentBound::Always;
    AxisOptions { model: Model::Flexible, tick_s, voltage_reserve, current_bound }
}

/// Corners of S10 that stand what its machine file is uncertain of.
fn robust() -> (Scanner, Gains, Corners) {
    let scanner = scanner("S10");
    let gains = Gains::design(&scanner, TICK_S).unwrap();
    let corners = Corners::new(&scanner, options(TICK_S, 0.12), Some(&gains)).unwrap();
    (scanner, gains, corners)
}

fn rad(um: f64) -> f64 {
    um * 1e-6 / SCALE_M_RAD
}

/// Losses of one side by a program with 9 V and 14 ticks on each side, written for
/// `design/control.md` C in another language and with another solver.
#[test]
fn losses_match_the_reference() {
    let reserve = 1.0 - 2.0 * 9.0 / 24.0;
    let corners = Corners::new(&scanner("S10"), options(TICK_S, reserve), None).unwrap();
    let losses_us = [
        (1.0, [-2.4, -7.0, -12.0, -17.0]),
        (2.0, [5.7, 1.4, -2.8, -6.8]),
        (4.0, [15.0, 11.0, 7.0, 3.0]),
    ];
    for (speed_m_s, losses_us) in losses_us {
        for (epsilon_um, loss_us) in [5.0, 8.0, 12.0, 17.0].into_iter().zip(losses_us) {
            for end in [End::Arrive, End::Depart] {
                let speed_rad_s = speed_m_s / SCALE_M_RAD;
                let side = corners.side(end, speed_rad_s, rad(epsilon_um)).unwrap().unwrap();
                let off_us = side.least_loss_s * 1e6 - loss_us;
                assert!(off_us.abs() < 1.0, "{end:?} {speed_m_s} {epsilon_um}: {off_us}");
                let slack_us = (side.loss_s - side.least_loss_s) * 1e6;
                assert!((0.0..4.2).contains(&slack_us), "{slack_us}");
            }
        }
    }
}

/// The two-mass axis from coasting or rest: states at the corner and the end, and what it passes.
#[test]
fn sides_keep_their_limits_on_an_axis_of_its_own() {
    let (scanner, _, corners) = robust();
    let flow = Flow::new(&scanner, TICK_S / N_SUBSTEPS as f64);
    for (speed_m_s, epsilon_um) in [(0.5, 5.0), (1.0, 12.0), (2.0, 8.0), (4.0, 10.0), (8.0, 17.0)] {
        let (speed_rad_s, band_rad) = (speed_m_s / SCALE_M_RAD, rad(epsilon_um));
        for end in [End::Arrive, End::Depart] {
            let side = corners.side(end, speed_rad_s, band_rad).unwrap().unwrap();
            let arrives = end == End::Arrive;
            let mut state = match arrives {
                true => [-side.run_rad, speed_rad_s, 0.0, 0.0, 0.0],
                false => [0.0; 5],
            };
            for (tick, &voltage_v) in side.voltages_v.iter().enumerate() {
                assert!(voltage_v.abs() <= 0.5 * 0.88 * 24.0 * (1.0 + 1e-9));
                assert!((state[0] - side.mirror_rad[tick]).abs() < 1e-9);
                for _ in 0..N_SUBSTEPS {
                    state = flow.after(&state, voltage_v);
                    assert!(state[4].abs() <= scanner.current_max_a);
                    assert!(state[1] <= 1.002 * speed_rad_s, "{state:?}");
                    if arrives == (tick >= side.n_before) {
                        assert!(state[0].abs() <= band_rad, "{end:?} {tick}: {state:?}");
                    }
                }
            }
            let wanted = match arrives {
                true => [0.0; 5],
                false => [side.run_rad, speed_rad_s, 0.0, 0.0, 0.0],
            };
            // Angle, speed, twist, its speed, current: each against what it is in the corner.
            let units = [side.run_rad, speed_rad_s, band_rad, speed_rad_s, scanner.current_max_a];
            for (index, unit) in units.into_iter().enumerate() {
                let off = (state[index] - wanted[index]) / unit;
                assert!(off.abs() < 1e-9, "{end:?} {speed_m_s} m/s, state {index}: {off}");
            }
        }
    }
}

/// Voltages along two legs from start to stop, a corner between them.
struct Tour {
    voltages_v: [Vec<f64>; 2],
    /// Way to the vertex, rad.
    vertex_rad: f64,
}

impl Tour {
    fn new(corners: &Corners, corner: &Corner, speed_rad_s: f64, epsilon_rad: f64) -> Self {
        let side = |end| corners.side(end, speed_rad_s, epsilon_rad).unwrap().unwrap();
        let (start, stop) = (side(End::Depart), side(End::Arrive));
        let coast = vec![scanner("S10").torque_constant_n_m_a * speed_rad_s; N_COASTING];
        let n_start = start.voltages_v.len();
        let n_stop = N_COASTING + stop.voltages_v.len() + 100;
        let (first, rest) = (vec![0.0; n_start + N_COASTING], vec![0.0; n_stop]);
        let alpha = [start.voltages_v, coast.clone(), corner.arrive_v.clone(), rest].concat();
        let beta = [first, corner.depart_v.clone(), coast, stop.voltages_v, vec![0.0; 100]];
        let way_rad = N_COASTING as f64 * TICK_S * speed_rad_s;
        let vertex_rad = start.run_rad + way_rad + corner.arrive_rad;
        Self { voltages_v: [alpha, beta.concat()], vertex_rad }
    }

    /// Greatest distance from the legs when both axes are this plant, driven by words, rad.
    fn contour_rad(&self, plant: &Galvo, scanner: &Scanner, gains: Gains, turn_rad: f64) -> f64 {
        let legs = [[1.0, 0.0], [turn_rad.cos(), turn_rad.sin()]];
        let voltage = |axis: usize, tick: usize| {
            let along = |leg: usize| self.voltages_v[leg].get(tick).unwrap_or(&0.0);
            legs[0][axis] * along(0) + legs[1][axis] * along(1)
        };
        let nominal = Galvo::new(scanner).step(TICK_S);
        let look = |part| plant.step(TICK_S * f64::from(part) / f64::from(N_LOOKS));
        let looks: Vec<Step> = (1..=N_LOOKS).map(look).collect();
        let mut states = [State::zeros(); 2];
        let mut loops = [(); 2].map(|()| AxisLoop::new(plant, gains, scanner, TICK_S));
        let mut worst_rad = 0.0_f64;
        for tick in 0..self.voltages_v[0].len() {
            let before = loops.each_ref().map(|axis| *axis.state());
            let acting_v: [f64; 2] = std::array::from_fn(|axis| {
                let (now_v, next_v) = (voltage(axis, tick), voltage(axis, tick + 1));
                let word = gains.reference_rad(&states[axis], now_v, next_v).unwrap();
                states[axis] = nominal.a * states[axis] + nominal.b * now_v;
                loops[axis].tick(word, 0.0)
            });
            for Step { a, b } in &looks {
                let point = std::array::from_fn(|axis| {
                    let mirror_rad =
                        plant.mirror_row().dot(&(a * before[axis] + b * acting_v[axis]));
                    mirror_rad - self.vertex_rad * legs[0][axis]
                });
                worst_rad = worst_rad.max(distance_rad(point, legs));
            }
        }
        worst_rad
    }
}

/// Distance of a point from the nearer of two legs that meet at the origin.
fn distance_rad(point: [f64; 2], legs: [[f64; 2]; 2]) -> f64 {
    let from_ray = |way: [f64; 2]| {
        let along = (point[0] * way[0] + point[1] * way[1]).max(0.0);
        (point[0] - along * way[0]).hypot(point[1] - along * way[1])
    };
    from_ray(legs[0].map(|value| -value)).min(from_ray(legs[1]))
}

#[test]
fn beam_stays_near_the_legs_on_plants_off_the_nominal() {
    let (scanner, gains, corners) = robust();
    let nominal = Galvo::new(&scanner);
    let mode = |factor: f64| Galvo { omega: nominal.omega * factor, ..nominal };
    let torque =
        |factor: f64| Galvo { torque_constant: nominal.torque_constant * factor, ..nominal };
    let plants = [nominal, mode(1.03), mode(0.97), torque(1.005), torque(0.995)];
    let epsilon_rad = rad(8.0);
    for speed_m_s in [1.0, 2.0, 4.0] {
        let speed_rad_s = speed_m_s / SCALE_M_RAD;
        let corner = corners.corner(speed_rad_s, epsilon_rad).unwrap().unwrap();
        assert!(corner.peak_voltage_v <= 0.88 * 24.0);
        let tour = Tour::new(&corners, &corner, speed_rad_s, epsilon_rad);
        for turn_deg in [30.0, 90.0, 150.0_f64] {
            let turn_rad = turn_deg.to_radians();
            let most_rad = epsilon_rad * turn_rad.sin() * (1.0 + 1e-6);
            let worst = plants.map(|plant| tour.contour_rad(&plant, &scanner, gains, turn_rad));
            let worst = worst.into_iter().fold(0.0, f64::max) / most_rad;
            // Near the band, or the corner would lose time for nothing.
            assert!((0.9..=1.0).contains(&worst), "{turn_deg}° {speed_m_s} m/s: {worst}");
        }
    }
}

#[test]
fn corners_scale_with_speed() {
    let (_, _, corners) = robust();
    // Both speeds stand in one cell.
    let [slow, fast] =
        [1.01, 1.15].map(|speed| corners.corner(speed, speed * 4e-6).unwrap().unwrap());
    let factor = 1.15 / 1.01;
    let same = |one: f64, other: f64| (one * factor - other).abs() <= 1e-12 * other.abs();
    assert!(same(slow.arrive_rad, fast.arrive_rad) && same(slow.depart_rad, fast.depart_rad));
    assert!(same(slow.peak_voltage_v, fast.peak_voltage_v));
    assert!(slow.arrive_v.iter().zip(&fast.arrive_v).all(|(one, other)| same(*one, *other)));
    assert_eq!(slow.loss_s, fast.loss_s);
}

#[test]
fn corners_are_the_same_whenever_and_wherever_they_are_solved() {
    let (_, _, corners) = robust();
    let ask = |corners: &Corners| corners.corner(6.0, rad(7.0)).unwrap().unwrap();
    let corner = ask(&corners);
    let n_ticks = corner.n_before + corner.n_after;
    assert_eq!([corner.arrive_v.len(), corner.depart_v.len()], [n_ticks; 2]);
    assert_eq!(corner.arrive_mirror_rad.len(), n_ticks + 1);
    assert_eq!(corner.depart_mirror_rad.len(), n_ticks + 1);
    let (_, _, others) = robust();
    assert_eq!(ask(&others), corner);
    let (_, _, restored) = robust();
    restored.restore(&corners.solved());
    assert_eq!(restored.solved().len(), 2);
    assert_eq!(ask(&restored), corner);
}

#[test]
fn other_scanners_and_periods_are_solved() {
    let cases = [
        ("S14", 1e-5, 2.247e-4),
        ("S25", 1e-5, 3.712e-4),
        ("S10", 1e-6, 1.64e-4),
        ("S10", 2e-5, 1.7e-4),
    ];
    for (set, tick_s, lag_s) in cases {
        let servo = Servo::StateFeedback { velocity_weight_s: 1e-4, lag_s };
        let scanner = Scanner { servo, ..scanner(set) };
        let gains = Gains::design(&scanner, tick_s).unwrap();
        let corners = Corners::new(&scanner, options(tick_s, 0.12), Some(&gains)).unwrap();
        let corner = corners.corner(1.0 / SCALE_M_RAD, rad(10.0)).unwrap().unwrap();
        let loss_us = corner.loss_s * 1e6;
        assert!((-30.0..60.0).contains(&loss_us), "{set} {tick_s}: {loss_us}");
    }
}

#[test]
fn impossible_corners_are_refused() {
    let (_, _, corners) = robust();
    let parameter = |result| matches!(result, Err(JumpError::Parameter { .. }));
    assert!(parameter(corners.corner(f64::NAN, 1e-5)));
    assert!(parameter(corners.corner(1.0, 0.0)));
    assert!(parameter(corners.corner(2000.0, 1e-5)));
    // A band of a thousandth of a micrometre at 8 m/s.
    assert_eq!(corners.corner(25.0, rad(0.001)).unwrap(), None);
}
