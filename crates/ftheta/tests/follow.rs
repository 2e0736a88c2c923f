//! The inverse of servo and motor, played on the axis that it inverts.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine;
use ftheta::model::machine::Scanner;
use ftheta::physics::along::Along;
use ftheta::physics::axis_loop::AxisLoop;
use ftheta::physics::follow::{Inverse, N_TAPS, TAPS_BEFORE, Taps, dot};
use ftheta::physics::galvo::Galvo;
use ftheta::physics::servo::Gains;
use kurbo::{BezPath, Point};

const TICK_S: f64 = 1e-5;

fn s10() -> Scanner {
    machine::preset("S10").unwrap().unwrap().scanner
}

/// Greatest distance of the mirror from a wanted motion in its steady state, rad.
fn worst(wanted_rad: impl Fn(f64) -> f64) -> f64 {
    let scanner = s10();
    let galvo = Galvo::new(&scanner);
    let gains = Gains::design(&scanner, TICK_S).unwrap();
    let taps = Inverse::new(&galvo, &gains, TICK_S).unwrap().reference.unwrap();
    let mut axis = AxisLoop::new(&galvo, gains, &scanner, TICK_S);
    let mut worst_rad = 0.0_f64;
    for tick in 0..6000 {
        let first = f64::from(tick) - TAPS_BEFORE as f64;
        let around: Taps = std::array::from_fn(|tap| wanted_rad((first + tap as f64) * TICK_S));
        axis.tick(dot(&taps, &around), 0.0);
        if tick > 4000 {
            let mirror_rad = galvo.mirror_row().dot(axis.state());
            worst_rad =
                worst_rad.max((mirror_rad - wanted_rad(f64::from(tick + 1) * TICK_S)).abs());
        }
    }
    worst_rad
}

/// Circles of 0.5 mm at 1, 2 and 6 m/s are sines of 318, 637 and 2000 Hz.
#[test]
fn sines_are_followed() {
    for (hz, most) in [(318.0, 1e-9), (637.0, 1e-8), (2000.0, 1e-6)] {
        let amplitude = 1e-3;
        let omega = std::f64::consts::TAU * hz;
        let off = worst(|time_s| amplitude * (omega * time_s).sin()) / amplitude;
        assert!(off < most, "{hz} Hz: {off}");
    }
}

/// A parabola, as of a line through a lens, is followed to rounding.
#[test]
fn polynomials_are_followed_exactly() {
    let off_rad = worst(|time_s| 0.5 * time_s + 3.0 * time_s * time_s);
    assert!(off_rad < 1e-12, "{off_rad}");
}

/// The weights of the mirror's own angle are those of a value taken as it is.
#[test]
fn the_state_has_the_wanted_angle() {
    let scanner = s10();
    let galvo = Galvo::new(&scanner);
    let gains = Gains::design(&scanner, TICK_S).unwrap();
    let inverse = Inverse::new(&galvo, &gains, TICK_S).unwrap();
    let around: Taps = std::array::from_fn(|tap| ((tap * tap) as f64).sin());
    let (state, _) = inverse.state(&around);
    let mirror_rad = galvo.mirror_row().dot(&state);
    assert!((mirror_rad - around[TAPS_BEFORE]).abs() < 1e-6, "{mirror_rad}");
    assert_eq!(around.len(), N_TAPS);
}

/// A beam that goes to a tip and back over the same line has come twice the way.
#[test]
fn a_beam_on_a_cusp_has_come_all_the_way() {
    let mut curve = BezPath::new();
    curve.move_to((0.0, 0.0));
    curve.line_to((1.0, 0.0));
    curve.line_to((0.0, 0.0));
    let mut along = Along::new(&curve, 0.01);
    for step in 0..=200 {
        let way = f64::from(step) * 0.01;
        let place = Point::new(if way <= 1.0 { way } else { 2.0 - way }, 0.002);
        let off_mm = along.distance_mm(place);
        assert!((off_mm - 0.002).abs() < 1e-9, "{way}: {off_mm}");
        assert!((along.at_mm() - way).abs() < 0.03, "{way}: {}", along.at_mm());
    }
}
