//! Uniform circles and ellipses on the twin.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::circle::{Circled, Ellipse, Round, Spiral, circle};
use ftheta::mark::MarkOptions;
use ftheta_formats::machine::preset;
use ftheta_model::machine::{Drive, Machine};
use ftheta_model::recipe::Pen;
use ftheta_twin::mismatch::Mismatch;
use kurbo::{Point, Shape};

fn machine(name: &str, word_bits: u32) -> Machine {
    let mut machine = preset(name).unwrap().unwrap();
    machine.output.word_bits = word_bits;
    machine
}

fn round(machine: &Machine, round: Round) -> Result<Circled, ftheta::Error> {
    circle(machine, &round, Pen::default(), &MarkOptions::default(), &mut |_| {})
}

fn turn(machine: &Machine, ellipse: &Ellipse) -> Circled {
    round(machine, Round::Ellipse(*ellipse)).unwrap()
}

fn at_centre(radii_mm: [f64; 2], speed_mm_s: f64) -> Ellipse {
    Ellipse::new([0.0; 2], radii_mm, speed_mm_s)
}

/// Distance from the circle and ratio of speed that are promised; 16 bits are steps of 2 µm.
#[test]
fn circles_are_round_and_uniform() {
    let small = at_centre([0.5, 0.5], 2000.0);
    let aside = Ellipse { centre: Point::new(30.0, -20.0), ..small };
    let cases = [
        ("S10-f160", 24, small, 0.01, 2e-4),
        ("S10-f160", 20, small, 0.05, 1e-3),
        ("S10-f160", 16, small, 0.5, 5e-3),
        ("S10-f160", 20, aside, 0.05, 1e-3),
        ("S10-f160", 20, at_centre([5.0, 5.0], 8000.0), 0.05, 1e-3),
        ("S25-f420", 20, at_centre([5.0, 5.0], 2000.0), 0.2, 2e-3),
    ];
    for (name, bits, ellipse, error_um, speed) in cases {
        let Circled { roundness, run_in_s, turn_s, marked, .. } =
            turn(&machine(name, bits), &ellipse);
        assert!(roundness.error_max_mm * 1e3 <= error_um, "{name} {bits}: {roundness:?}");
        let [low, high] = roundness.speed_ratio;
        assert!(1.0 - speed <= low && high <= 1.0 + speed, "{name} {bits}: {roundness:?}");
        assert!(run_in_s < 1e-3, "{run_in_s}");
        assert!((turn_s * ellipse.speed_mm_s / ellipse.length_mm() - 1.0).abs() < 1e-12);
        // The report's own measure, by another way.
        assert!(marked.score.contour_error_um.max <= error_um + 0.05);
    }
}

/// A driver that is sent voltages does not see the words' steps.
#[test]
fn voltages_are_finer_than_words() {
    let mut machine = machine("S10-f160", 16);
    machine.output.drive = Drive::Voltage;
    let roundness = turn(&machine, &at_centre([0.5, 0.5], 2000.0)).roundness;
    let [low, high] = roundness.speed_ratio;
    assert!(roundness.error_max_mm <= 1e-5 && 0.999 <= low && high <= 1.001, "{roundness:?}");
}

#[test]
fn a_fast_ellipse_is_uniform() {
    let shape = at_centre([0.5, 0.25], 1.0);
    // A hundred ticks a turn.
    let ellipse = Ellipse { speed_mm_s: shape.length_mm() / 1e-3, ..shape };
    let roundness = turn(&machine("S10-f160", 20), &ellipse).roundness;
    let [low, high] = roundness.speed_ratio;
    assert!(roundness.error_max_mm <= 1e-4 && 0.995 <= low && high <= 1.005, "{roundness:?}");
}

#[test]
fn ellipses_are_as_long_as_they_are() {
    for ratio in [1.0, 2.0, 20.0] {
        let length_mm = at_centre([1.0, 1.0 / ratio], 1.0).length_mm();
        let known_mm = kurbo::Ellipse::new(Point::ZERO, (1.0, 1.0 / ratio), 0.0).perimeter(1e-12);
        assert!((length_mm / known_mm - 1.0).abs() < 1e-9, "1:{ratio}: {length_mm} {known_mm}");
    }
}

/// A motor that is not quite the nominal one is held by the servo.
#[test]
fn a_circle_stands_another_motor() {
    let mismatch = Mismatch { f1: 0.03, kt: -0.005, ..Mismatch::default() };
    let options = MarkOptions { mismatch, ..MarkOptions::default() };
    let ellipse = Round::Ellipse(at_centre([0.5, 0.5], 2000.0));
    let circled =
        circle(&machine("S10-f160", 20), &ellipse, Pen::default(), &options, &mut |_| {}).unwrap();
    assert!(circled.roundness.error_max_mm < 0.010, "{:?}", circled.roundness);
}

#[test]
fn impossible_circles_are_refused() {
    let refuse = |machine: &Machine, ellipse: &Ellipse| {
        round(machine, Round::Ellipse(*ellipse)).err().unwrap().to_string()
    };
    let s10 = machine("S10-f160", 20);
    let message = refuse(&s10, &at_centre([0.5, 0.5], 40_000.0));
    assert!(message.starts_with("circle: samples of a turn 7.85"), "{message}");
    let message = refuse(&s10, &at_centre([0.5, 0.5], 25_000.0));
    assert!(message.contains("exceeds the limit") || message.contains("outside"), "{message}");
    let message = refuse(&s10, &at_centre([2000.0, 2000.0], 1000.0));
    assert!(message.contains("cannot reach"), "{message}");
    let mut black_box = s10;
    black_box.output.drive = Drive::BlackBox;
    let message = refuse(&black_box, &at_centre([0.5, 0.5], 1000.0));
    assert!(message.contains("servo is not known"), "{message}");
}

fn from_centre(radius_mm: f64, pitch_mm: f64, turns: f64, speed_mm_s: f64) -> Spiral {
    Spiral { centre: Point::ZERO, radius_mm, pitch_mm, turns, speed_mm_s }
}

/// As true as circles, outwards and inwards, with any number of turns.
#[test]
fn spirals_keep_radius_and_speed() {
    let aside = Spiral { centre: Point::new(30.0, -20.0), ..from_centre(0.5, 0.1, 5.0, 2000.0) };
    let cases = [
        ("S10-f160", 24, from_centre(0.5, 0.1, 5.0, 2000.0), 0.01, 2e-4),
        ("S10-f160", 20, from_centre(0.5, 0.1, 5.0, 2000.0), 0.05, 1e-3),
        ("S10-f160", 20, from_centre(3.0, -0.25, 9.3, 4000.0), 0.05, 1e-3),
        ("S10-f160", 20, aside, 0.05, 1e-3),
        ("S10-f160", 20, from_centre(1.0, 0.0, 2.5, 2000.0), 0.05, 1e-3),
        ("S25-f420", 20, from_centre(5.0, 0.05, 3.0, 2000.0), 0.2, 2e-3),
    ];
    for (name, bits, spiral, error_um, speed) in cases {
        let machine = machine(name, bits);
        let Circled { roundness, run_in_s, turn_s, marked, .. } =
            round(&machine, Round::Spiral(spiral)).unwrap();
        assert!(roundness.error_max_mm * 1e3 <= error_um, "{name} {bits}: {roundness:?}");
        let [low, high] = roundness.speed_ratio;
        assert!(1.0 - speed <= low && high <= 1.0 + speed, "{name} {bits}: {roundness:?}");
        assert!(run_in_s < 1e-3, "{run_in_s}");
        assert!((turn_s * spiral.speed_mm_s / spiral.length_mm() - 1.0).abs() < 1e-12);
        assert!(marked.score.contour_error_um.max <= error_um + 0.05, "{:?}", marked.score);
        let dose = marked.score.dose_ratio.unwrap();
        assert!(dose.min > 0.99 && dose.max < 1.01, "{name} {bits}: {dose:?}");
    }
}

#[test]
fn spirals_are_as_long_as_they_are() {
    for pitch_mm in [0.0, 1e-9, 0.1, -0.1, 2.0] {
        let spiral = from_centre(1.0, pitch_mm, 5.0, 1.0);
        let n = 200_000;
        let speed_mm = |index: u32| {
            let turn = 5.0 * (f64::from(index) + 0.5) / f64::from(n);
            (1.0 + pitch_mm * turn).hypot(pitch_mm / std::f64::consts::TAU)
        };
        let sum_mm: f64 = (0..n).map(speed_mm).sum();
        let known_mm = sum_mm * std::f64::consts::TAU * 5.0 / f64::from(n);
        let length_mm = spiral.length_mm();
        assert!((length_mm / known_mm - 1.0).abs() < 1e-9, "{pitch_mm}: {length_mm} {known_mm}");
    }
}

#[test]
fn impossible_spirals_are_refused() {
    let s10 = machine("S10-f160", 20);
    for (spiral, words) in [
        (from_centre(1.0, -0.3, 5.0, 1000.0), "spiral: smallest radius"),
        (from_centre(0.5, 0.1, 5.0, 40_000.0), "spiral: samples of the smallest turn 7.85"),
        (from_centre(0.5, 0.1, 5.0, 25_000.0), "outside"),
        (from_centre(10.0, 20.0, 9.0, 1000.0), "spiral: mirror angle"),
        (from_centre(1.0, 0.1, 2e4, 1000.0), "spiral: turns 20000"),
    ] {
        let message = round(&s10, Round::Spiral(spiral)).err().unwrap().to_string();
        assert!(message.contains(words), "{message}");
    }
}
