//! Marks that come back to where they were: light belongs to the passage that it is on.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod traces;

use ftheta_report::score::score;
use kurbo::{BezPath, ParamCurve, ParamCurveArclen, PathSeg, Point, Vec2};
use std::f64::consts::TAU;
use traces::{near, plan, trace};

/// A beam that turns 10 µm before the tip, and comes back beside the line.
#[test]
fn a_blunted_cusp_keeps_the_dose_of_both_legs() {
    let curve = BezPath::from_svg("M0 0 L5 0 L0 0").unwrap();
    let beam = |t: f64| match 1000.0 * t {
        way if way < 4.99 => Point::new(way, 0.001),
        way => Point::new(9.98 - way, -0.003),
    };
    let found = score(&plan(&[curve]), &trace(&[(0, 9_980_000)], beam));
    near(found.contour_error_um.max, 3.0, 0.01);
    near(found.end_error_um.max, 0.0, 0.01);
    near(found.coverage_error_um.max, 10.4, 0.2);
    let dose = found.dose_ratio.unwrap();
    near(dose.p01, 1.0, 0.01);
    near(dose.max, 1.0, 0.07);
    assert!(dose.min > 0.3, "{dose:?}");
}

/// There and back on a curve, again and again, each time short of the tips.
#[test]
fn a_curve_and_its_reverse_are_told_apart() {
    let there = BezPath::from_svg("M0 0 C3 0 0 2 3 2").unwrap();
    let PathSeg::Cubic(cubic) = there.segments().next().unwrap() else { unreachable!() };
    let n_ways = 6;
    let mut curve = BezPath::new();
    curve.move_to(cubic.p0);
    for way in 0..n_ways {
        match way % 2 {
            0 => curve.curve_to(cubic.p1, cubic.p2, cubic.p3),
            _ => curve.curve_to(cubic.p2, cubic.p1, cubic.p0),
        }
    }
    let length_mm = cubic.arclen(1e-9);
    // Places along the curve at every µm.
    let n = (1e3 * length_mm) as usize;
    let places: Vec<Point> = (0..=n)
        .map(|k| cubic.eval(cubic.inv_arclen(length_mm * k as f64 / n as f64, 1e-9)))
        .collect();
    let short_mm = 0.006;
    let beam = |t: f64| {
        let leg_mm = length_mm - 2.0 * short_mm;
        let (way, on_mm) = ((1000.0 * t / leg_mm).floor(), (1000.0 * t).rem_euclid(leg_mm));
        let at_mm = if way % 2.0 == 0.0 { short_mm + on_mm } else { length_mm - short_mm - on_mm };
        let index = (at_mm / length_mm * n as f64).clamp(0.0, n as f64 - 1.0);
        let (from, to) = (places[index as usize], places[index as usize + 1]);
        from.lerp(to, index.fract()) + 0.002 * (to - from).normalize().turn_90()
    };
    let end_ns = (1e6 * f64::from(n_ways) * (length_mm - 2.0 * short_mm)) as u64;
    let found = score(&plan(&[curve]), &trace(&[(0, end_ns)], beam));
    near(found.contour_error_um.max, 2.0, 0.05);
    let dose = found.dose_ratio.unwrap();
    near(dose.p01, 1.0, 0.3);
    near(dose.p99, 1.0, 0.02);
    near(dose.max, 1.0, 0.08);
    // All but the tips: no bar but those around 1 has more than they have.
    let tips = 12.0 * (2.0 * 0.006 + 0.03) / (f64::from(n_ways) * length_mm);
    let away: f64 = found.dose_bars[..19].iter().chain(&found.dose_bars[21..]).sum();
    assert!(away < tips, "{away}");
}

/// The nearest leg counts, however far away it is along the mark.
#[test]
fn the_other_leg_of_a_hairpin_may_be_nearer() {
    let curve = BezPath::from_svg("M0 0 L5 0 L5 0.006 L0 0.006").unwrap();
    let beam = |t: f64| Point::new(1000.0 * t, 0.0035);
    let found = score(&plan(&[curve]), &trace(&[(0, 4_900_000)], beam));
    near(found.contour_error_um.max, 2.5, 0.01);
    near(found.contour_error_um.rms, 2.5, 0.01);
}

/// Laps of a figure of eight, beside it, so that each crossing is nearer for a moment.
#[test]
fn crossings_do_not_mix_up_laps() {
    let eight = "l2 2 c1 1 1 -3 0 -2 l-2 2 c-1 1 -1 -3 0 -2";
    let n_laps = 5;
    let curve = BezPath::from_svg(&format!("M0 0 {}", eight.repeat(n_laps))).unwrap();
    let segments: Vec<PathSeg> = curve.segments().collect();
    let n = 4000;
    let places: Vec<Point> = segments
        .iter()
        .flat_map(|segment| (0..n).map(move |k| (segment, f64::from(k) / f64::from(n))))
        .map(|(segment, share)| segment.eval(share))
        .collect();
    // Places are passed one after the other, so speed and dose differ; laps are alike.
    let beam = |t: f64| {
        let index = ((t / 2e-6).round() as usize).min(places.len() - 2);
        let along: Vec2 = (places[index + 1] - places[index]).normalize();
        places[index] + 0.005 * along.turn_90()
    };
    let lap_ns = 2000 * (places.len() / n_laps) as u64;
    let one_lap = BezPath::from_svg(&format!("M0 0 {eight}")).unwrap();
    let one = score(&plan(&[one_lap]), &trace(&[(0, lap_ns)], beam));
    let all = score(&plan(&[curve]), &trace(&[(0, lap_ns * n_laps as u64)], beam));
    let (one, all) = (one.dose_ratio.unwrap(), all.dose_ratio.unwrap());
    near(all.p01, one.p01, 0.01);
    near(all.p99, one.p99, 0.01 * one.p99);
    near(all.max, one.max, 0.02 * one.max);
}

/// Many laps of one circle as one mark, with as much light on each.
#[test]
fn laps_of_a_circle_are_alike() {
    let n_laps = 200;
    let radius_mm = 0.3;
    let lap =
        format!("a{radius_mm} {radius_mm} 0 0 1 -0.6 0 a{radius_mm} {radius_mm} 0 0 1 0.6 0 ");
    let curve = BezPath::from_svg(&format!("M10 10 {}", lap.repeat(n_laps))).unwrap();
    let beam = |t: f64| {
        let angle = 2000.0 * t / radius_mm;
        Point::new(9.7, 10.0) + (radius_mm + 0.003) * Vec2::new(angle.cos(), angle.sin())
    };
    let end_ns = (n_laps as f64 * TAU * radius_mm / 2000.0 * 1e9) as u64;
    let found = score(&plan(&[curve]), &trace(&[(0, end_ns)], beam));
    near(found.contour_error_um.max, 3.0, 0.1);
    near(found.end_error_um.max, 0.0, 0.1);
    near(found.coverage_error_um.max, 3.0, 0.1);
    let dose = found.dose_ratio.unwrap();
    near(dose.min, 0.5, 0.01);
    near(dose.max, 0.5, 0.01);
}

/// A step of the beam that is longer than the window still gives its energy to all of its way.
#[test]
fn a_fast_beam_has_an_even_dose() {
    let curve = BezPath::from_svg("M0 0 L20 0").unwrap();
    let beam = |t: f64| Point::new(20_000.0 * t, 0.0);
    let found = score(&plan(&[curve]), &trace(&[(0, 1_000_000)], beam));
    let dose = found.dose_ratio.unwrap();
    near(dose.min, 0.05, 1e-4);
    near(dose.max, 0.05, 1e-4);
}
