//! Traces of which the figures are known.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod traces;

use ftheta_model::trace::{Light, Trace, TracePoint};
use ftheta_report::score::{Score, Scorer, score};
use kurbo::{BezPath, Circle, Line, ParamCurve, ParamCurveNearest, Point, Shape, Vec2};
use proptest::prelude::*;
use traces::{STEP_NS, near, plan, trace};

fn line(x_mm: f64) -> BezPath {
    BezPath::from_svg(&format!("M0 0 L{x_mm} 0")).unwrap()
}

#[test]
fn a_perfect_line_has_no_errors() {
    // Light comes on 1 ms after the start and between two points.
    let beam = |t: f64| Point::new(1000.0 * (t - 1.0007e-3), 0.0);
    let found = score(&plan(&[line(10.0)]), &trace(&[(1_000_700, 11_000_700)], beam));
    near(found.contour_error_um.max, 0.0, 1e-6);
    near(found.coverage_error_um.max, 0.0, 0.002);
    near(found.end_error_um.max, 0.0, 0.002);
    let dose = found.dose_ratio.unwrap();
    near(dose.min, 1.0, 1e-4);
    near(dose.max, 1.0, 1e-4);
    near(found.duration_s, 0.01, 1e-12);
    near(found.energy_j, 0.1, 1e-12);
    assert_eq!(found.stray_energy_ratio, 0.0);
    assert_eq!(found.dose_bars.iter().sum::<f64>(), 1.0);
}

#[test]
fn an_offset_is_the_contour_and_the_coverage_error() {
    let beam = |t: f64| Point::new(1000.0 * t, 0.007);
    let found = score(&plan(&[line(10.0)]), &trace(&[(0, 10_000_000)], beam));
    near(found.contour_error_um.max, 7.0, 1e-9);
    near(found.contour_error_um.p99, 7.0, 0.04);
    near(found.contour_error_um.rms, 7.0, 1e-9);
    near(found.coverage_error_um.max, 7.0, 1e-3);
    near(found.coverage_error_um.p99, 7.0, 0.04);
    near(found.end_error_um.max, 0.0, 1e-6);
    assert_eq!(found.stray_energy_ratio, 0.0);
    assert!(found.error_samples.iter().all(|s| (s.error_um - 7.0).abs() < 1e-6));
    near(found.worst_marks[0].error_um, 7.0, 1e-9);
}

#[test]
fn energy_beyond_the_tolerance_is_stray() {
    // Drifts from 5 µm to 15 µm: beyond 10 µm in the second half.
    let beam = |t: f64| Point::new(1000.0 * t, 0.005 + t);
    let found = score(&plan(&[line(10.0)]), &trace(&[(0, 10_000_000)], beam));
    near(found.stray_energy_ratio, 0.5, 1e-3);
    near(found.contour_error_um.max, 15.0, 1e-6);
    near(found.contour_error_um.p99, 14.9, 0.1);
    let exact_rms = ((15f64.powi(3) - 5f64.powi(3)) / 30.0).sqrt();
    near(found.contour_error_um.rms, exact_rms, 1e-3);
}

#[test]
fn light_outside_any_mark_is_stray() {
    let beam = |t: f64| Point::new(1000.0 * t, 0.0);
    let light = [(0, 10_000_000), (10_000_000, 20_000_000)];
    let found = score(&plan(&[line(10.0)]), &trace(&light, beam));
    near(found.stray_energy_ratio, 0.5, 1e-12);
    near(found.duration_s, 0.02, 1e-12);
}

#[test]
fn a_mark_that_ends_short_is_not_covered() {
    let beam = |t: f64| Point::new(1000.0 * t, 0.0);
    let found = score(&plan(&[line(10.0)]), &trace(&[(0, 9_980_000)], beam));
    near(found.end_error_um.max, 20.0, 1e-3);
    near(found.coverage_error_um.max, 20.0, 1e-3);
    near(found.contour_error_um.max, 0.0, 1e-9);
    near(found.dose_ratio.unwrap().min, 1.0 / 3.0, 0.01);
}

#[test]
fn light_before_the_start_is_too_long() {
    let beam = |t: f64| Point::new(1000.0 * t - 0.05, 0.0);
    let found = score(&plan(&[line(10.0)]), &trace(&[(0, 10_050_000)], beam));
    near(found.end_error_um.max, 50.0, 1e-6);
    near(found.contour_error_um.max, 50.0, 1e-6);
    near(found.coverage_error_um.max, 0.0, 1e-3);
}

#[test]
fn half_the_speed_is_twice_the_dose() {
    let beam = |t: f64| {
        let x = match t {
            t if t < 3e-3 => 1000.0 * t,
            t if t < 9e-3 => 3.0 + 500.0 * (t - 3e-3),
            t => 6.0 + 1000.0 * (t - 9e-3),
        };
        Point::new(x, 0.0)
    };
    let found = score(&plan(&[line(9.0)]), &trace(&[(0, 12_000_000)], beam));
    let dose = found.dose_ratio.unwrap();
    near(dose.min, 1.0, 1e-3);
    near(dose.max, 2.0, 1e-3);
    near(dose.p99, 2.0, 3e-3);
    near(found.dose_bars[40], 1.0 / 3.0, 0.2);
}

#[test]
fn a_circle_is_followed_all_the_way_round() {
    let radius_mm = 2.0;
    let beam = |t: f64| {
        let angle = 1000.0 * t / radius_mm;
        Point::new(1.005 * radius_mm * angle.cos(), 1.005 * radius_mm * angle.sin())
    };
    // 100 µm more than once round.
    let turn_ns = (2.0 * std::f64::consts::PI * radius_mm * 1e6) as u64;
    let circle = Circle::new(Point::ZERO, radius_mm).to_path(1e-7);
    let mut curve = BezPath::from_vec(circle.elements()[..circle.elements().len() - 1].to_vec());
    curve.line_to((radius_mm, 0.0));
    let found = score(&plan(&[curve]), &trace(&[(0, turn_ns + 100_000)], beam));
    near(found.contour_error_um.max, 10.0, 0.05);
    near(found.contour_error_um.rms, 10.0, 0.05);
    near(found.coverage_error_um.max, 10.0, 0.05);
    near(found.end_error_um.max, 100.0, 0.1);
    let dose = found.dose_ratio.unwrap();
    near(dose.p01, 1.0, 3e-3);
    near(dose.max, 2.0, 0.01);
}

#[test]
fn a_retraced_line_stays_on_its_branch() {
    let curve = BezPath::from_svg("M0 0 L5 0 L0 0").unwrap();
    let beam = |t: f64| Point::new((1000.0 * t).min(10.0 - 1000.0 * t), 0.0);
    let found = score(&plan(&[curve]), &trace(&[(0, 10_000_000)], beam));
    near(found.contour_error_um.max, 0.0, 1e-6);
    near(found.end_error_um.max, 0.0, 1e-6);
    let dose = found.dose_ratio.unwrap();
    near(dose.min, 1.0, 0.07);
    near(dose.max, 1.0, 0.07);
}

#[test]
fn a_cut_corner_is_not_covered() {
    // Cuts 0.1 mm off both legs of a right angle.
    let curve = BezPath::from_svg("M0 0 L5 0 L5 5").unwrap();
    let beam = |t: f64| {
        let way = 1000.0 * t;
        let cut = 0.1 * 2f64.sqrt();
        match way {
            w if w < 4.9 => Point::new(w, 0.0),
            w if w < 4.9 + cut => {
                let share = (w - 4.9) / cut;
                Point::new(4.9 + 0.1 * share, 0.1 * share)
            }
            w => Point::new(5.0, 0.1 + w - 4.9 - cut),
        }
    };
    let end_ns = ((9.8 + 0.1 * 2f64.sqrt()) * 1e6) as u64;
    let found = score(&plan(&[curve]), &trace(&[(0, end_ns)], beam));
    near(found.contour_error_um.max, 50.0, 0.75);
    near(found.coverage_error_um.max, 50.0 * 2f64.sqrt(), 0.1);
    near(found.end_error_um.max, 0.0, 0.01);
}

#[test]
fn an_unlit_mark_is_missed() {
    let beam = |t: f64| Point::new(1000.0 * t, 0.0);
    let found = score(&plan(&[line(10.0), line(3.0)]), &trace(&[(0, 10_000_000)], beam));
    assert_eq!(found.n_unlit_marks, 1);
    near(found.coverage_error_um.max, 3000.0, 1e-6);
}

#[test]
fn chunks_are_as_good_as_the_whole() {
    let beam = |t: f64| Point::new(1000.0 * t, 0.004 * (700.0 * t).sin());
    let light = [(700, 3_000_100), (3_500_000, 9_000_300), (9_100_000, 12_000_000)];
    let curve = |a: f64, b: f64| BezPath::from_svg(&format!("M{a} 0 L{b} 0")).unwrap();
    let plan = plan(&[curve(0.0, 3.0), curve(3.5, 9.0), curve(9.1, 12.0)]);
    let whole = trace(&light, beam);
    let expected = score(&plan, &whole);
    for n in [1, 7, 100, 2500] {
        let mut scorer = Scorer::new(&plan);
        for (i, points) in whole.points.chunks(n).enumerate() {
            scorer.add(&chunk(&whole, i * n, points));
        }
        let found: Score = scorer.finish();
        near(found.contour_error_um.rms, expected.contour_error_um.rms, 1e-9);
        near(found.duration_s, expected.duration_s, 1e-12);
        near(found.energy_j, expected.energy_j, 1e-12);
        assert_eq!(found.contour_error_um.max, expected.contour_error_um.max);
        assert_eq!(found.coverage_error_um, expected.coverage_error_um);
        assert_eq!(found.end_error_um, expected.end_error_um);
        let (a, b) = (found.dose_ratio.unwrap(), expected.dose_ratio.unwrap());
        near(a.min, b.min, 1e-9);
        near(a.max, b.max, 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(16)
    })]

    /// Against every point of the beam and of the curve.
    #[test]
    fn errors_are_what_a_full_search_finds(
        places in prop::collection::vec((-4.0..4.0, -4.0..4.0), 4),
        wave in (0.0..0.02f64, 1.0..9.0f64, 0.0..6.0f64),
        closed in any::<bool>(),
    ) {
        let p: Vec<Point> = places.into_iter().map(Point::from).collect();
        let mut curve = BezPath::new();
        curve.move_to(p[0]);
        curve.curve_to(p[1], p[2], p[3]);
        if closed {
            curve.line_to(p[0]);
        }
        let segments: Vec<_> = curve.segments().collect();
        let n = 4000 * segments.len();
        let at = |k: usize| segments[(k / 4000).min(segments.len() - 1)];
        let place = |k: usize| at(k).eval((k % 4000) as f64 / 3999.0);
        let beam = |k: usize| {
            let phase: f64 = wave.1 * k as f64 / 1000.0 + wave.2;
            place(k.min(n - 1)) + wave.0 * Vec2::new(phase.sin(), phase.cos())
        };
        let end_ns = (n as u64 - 1) * STEP_NS;
        let found = score(&plan(&[curve]), &trace(&[(0, end_ns)], |t| {
            beam((t / 2e-6).round() as usize)
        }));
        let nearest = |from: Point, to: &dyn Fn(usize) -> Point| {
            let lines = (1..n).map(|k| Line::new(to(k - 1), to(k)));
            let squares = lines.map(|line| line.nearest(from, 1e-9).distance_sq);
            1e3 * squares.fold(f64::INFINITY, f64::min).sqrt()
        };
        let some = (0..n).step_by(41);
        let contour: Vec<f64> = some.clone().map(|k| nearest(beam(k), &place)).collect();
        let coverage: Vec<f64> = some.map(|k| nearest(place(k), &beam)).collect();
        let max = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let mean = contour.iter().map(|v| v * v).sum::<f64>() / contour.len() as f64;
        // Every 41st place is searched, and no place is farther than the wave is high.
        let wave_um = 1e3 * wave.0 + 0.4;
        let (contour_um, coverage_um) = (max(&contour), max(&coverage));
        let found_um = (found.contour_error_um.max, found.coverage_error_um.max);
        let top_um = 1.03 * wave_um + 0.6;
        prop_assert!(contour_um - 0.1 < found_um.0 && found_um.0 < top_um, "{found_um:?}");
        prop_assert!(coverage_um - 0.1 < found_um.1 && found_um.1 < top_um, "{found_um:?}");
        // Other branches count in the full search only, so it may find less, never more.
        prop_assert!(found.contour_error_um.rms > 0.98 * mean.sqrt() - 0.1);
    }
}

/// The light that ends in a chunk or is cut at its last point.
fn chunk(whole: &Trace, first: usize, points: &[TracePoint]) -> Trace {
    let start_ns = (first as u64).saturating_sub(1) * STEP_NS;
    let end_ns = (first + points.len() - 1) as u64 * STEP_NS;
    let light = whole.light.iter().filter_map(|light| {
        let cut =
            Light { on_ns: light.on_ns.max(start_ns), off_ns: light.off_ns.min(end_ns), ..*light };
        (cut.on_ns < cut.off_ns).then_some(cut)
    });
    Trace {
        step_ns: STEP_NS,
        first_index: first as u64,
        points: points.to_vec(),
        light: light.collect(),
        ..Trace::default()
    }
}
