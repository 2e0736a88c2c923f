//! The optics against numbers of an independent prototype (`design/optics.md`).
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta_model::machine::{Axis, Lens, Optics};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::map_table::MapTable;
use ftheta_physics::optics::{angles_from_field, field_from_angles, path_difference_mm};
use proptest::prelude::*;
use serde_json::Value;

const F163: [f64; 4] = [163.064, -1.259, -21.465, -26.664];
const F255: [f64; 4] = [255.059, -1.365, 1.493, -18.087];
const F420: [f64; 4] = [420.456, -6.051, 37.397, -55.24];

fn reference() -> Value {
    serde_json::from_str(include_str!("fixtures/optics.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn lens(coefficients_mm: Vec<f64>, field_mm: f64) -> Optics {
    Optics::new(Lens::FTheta { coefficients_mm }, Axis::X, field_mm)
}

fn post(case: &Value) -> Optics {
    let number = |key: &str| case[key].as_f64().unwrap();
    let lens =
        Lens::PostObjective { mirror_distance_mm: number("e"), working_distance_mm: number("d") };
    Optics::new(lens, Axis::X, 300.0)
}

/// Forward to 1e-9 mm and back to 1e-12 rad over all rows of a case.
fn check_case(optics: &Optics, case: &Value) {
    for (alpha, xy) in rows(&case["alpha"]).iter().zip(rows(&case["xy"])) {
        let place = field_from_angles(optics, MirrorAngles::new(alpha[0], alpha[1]));
        assert!((place.x_mm - xy[0]).abs() < 1e-9, "x {} against {}", place.x_mm, xy[0]);
        assert!((place.y_mm - xy[1]).abs() < 1e-9, "y {} against {}", place.y_mm, xy[1]);
        let angles = angles_from_field(optics, place).unwrap();
        assert!((angles.x_rad - alpha[0]).abs() < 1e-12);
        assert!((angles.y_rad - alpha[1]).abs() < 1e-12);
    }
}

#[test]
fn post_objective_agrees_with_the_reference() {
    for case in reference()["post_objective"].as_array().unwrap() {
        let optics = post(case);
        check_case(&optics, case);
        for (xy, path_mm) in rows(&case["xy"]).iter().zip(numbers(&case["dL"])) {
            let found_mm = path_difference_mm(&optics, FieldPoint::new(xy[0], xy[1]));
            assert!((found_mm - path_mm).abs() < 1e-9);
        }
    }
}

#[test]
fn ftheta_agrees_with_the_reference() {
    for case in reference()["ftheta"].as_array().unwrap() {
        check_case(&lens(numbers(&case["coef"]), 300.0), case);
    }
}

#[test]
fn inverses_agree_with_the_reference() {
    let reference = reference();
    let cases = reference["ftheta_inverse"].as_array().unwrap().iter();
    let ftheta = cases.map(|case| (lens(numbers(&case["coef"]), 300.0), case));
    let cases = reference["post_inverse"].as_array().unwrap().iter();
    for (optics, case) in ftheta.chain(cases.map(|case| (post(case), case))) {
        for (xy, theta) in rows(&case["xy"]).iter().zip(rows(&case["theta"])) {
            let angles = angles_from_field(&optics, FieldPoint::new(xy[0], xy[1])).unwrap();
            assert!((2.0 * angles.x_rad - theta[0]).abs() < 1e-12);
            assert!((2.0 * angles.y_rad - theta[1]).abs() < 1e-12);
        }
    }
}

/// Six lens makers' data sheets give the greatest mirror angles over the square field: an
/// independent check of mirror order, lens angle and polynomial.
#[test]
fn published_mirror_angles_are_met() {
    for case in reference()["scanlab_max_angles"].as_array().unwrap() {
        let half_mm = 0.5 * case["field_mm"].as_f64().unwrap();
        let optics = lens(numbers(&case["coef"]), 2.0 * half_mm);
        let mut greatest = [0.0_f64; 2];
        for i in 0..=200 {
            let along_mm = half_mm * f64::from(i) / 200.0;
            for (x, y) in [(along_mm, half_mm), (half_mm, along_mm)] {
                let angles = angles_from_field(&optics, FieldPoint::new(x, y)).unwrap();
                greatest[0] = greatest[0].max(angles.x_rad.to_degrees());
                greatest[1] = greatest[1].max(angles.y_rad.to_degrees());
            }
        }
        for (found, key) in greatest.iter().zip(["mirror1_deg_published", "mirror2_deg_published"])
        {
            let published = case[key].as_f64().unwrap();
            assert!((found - published).abs() < 0.0006, "{found} against {published}");
        }
    }
}

#[test]
fn first_mirror_swaps_the_roles() {
    let x_first = lens(F163.into(), 121.0);
    let y_first = Optics { first_mirror: Axis::Y, ..x_first.clone() };
    let a = field_from_angles(&x_first, MirrorAngles::new(0.1, 0.15));
    let b = field_from_angles(&y_first, MirrorAngles::new(0.15, 0.1));
    assert_eq!((a.x_mm, a.y_mm), (b.y_mm, b.x_mm));
}

#[test]
fn unreachable_places_are_none() {
    let optics = lens(F163.into(), 121.0);
    for place in [FieldPoint::new(1e6, 0.0), FieldPoint::new(f64::NAN, 1.0)] {
        assert_eq!(angles_from_field(&optics, place), None);
    }
}

/// The table that `render` reads must be within 1 nm of the exact inverse, everywhere.
fn table_difference_nm(optics: &Optics, x_mm: f64, y_mm: f64, table: &MapTable) -> f64 {
    let exact = angles_from_field(optics, FieldPoint::new(x_mm, y_mm)).unwrap();
    let Some([x_rad, y_rad]) = table.value(x_mm, y_mm) else {
        return 0.0;
    };
    let read = field_from_angles(optics, MirrorAngles::new(x_rad, y_rad));
    let back = field_from_angles(optics, exact);
    (read.x_mm - back.x_mm).hypot(read.y_mm - back.y_mm) * 1e6
}

fn inverse_table(optics: &Optics) -> MapTable {
    MapTable::new(0.5 * optics.field_mm, 3.0, |x, y| {
        angles_from_field(optics, FieldPoint::new(x, y)).map(|angles| [angles.x_rad, angles.y_rad])
    })
    .unwrap()
}

#[test]
fn inverse_table_is_within_a_nanometre() {
    let post = Lens::PostObjective { mirror_distance_mm: 12.0, working_distance_mm: 180.0 };
    let post = Optics::new(post, Axis::Y, 110.0);
    let ideal = lens(vec![160.0], 120.0);
    let all =
        [lens(F163.into(), 121.0), lens(F255.into(), 202.0), lens(F420.into(), 336.0), ideal, post];
    for optics in all {
        let table = inverse_table(&optics);
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        let half_mm = 0.5 * optics.field_mm;
        runner
            .run(&(-half_mm..half_mm, -half_mm..half_mm), |(x_mm, y_mm)| {
                // Near the centre as well, where the slopes change fastest.
                for scale in [1.0, 0.1] {
                    let nm = table_difference_nm(&optics, scale * x_mm, scale * y_mm, &table);
                    prop_assert!(nm < 1.0, "{nm} nm at {x_mm}, {y_mm} times {scale}");
                }
                Ok(())
            })
            .unwrap();
    }
}

/// The twin's forward table has no exact centre; it must stay within 20 nm all the same.
#[test]
fn forward_table_is_within_twenty_nanometres() {
    for (coefficients_mm, field_mm) in [(F163, 121.0), (F255, 202.0), (F420, 336.0)] {
        let optics = lens(coefficients_mm.into(), field_mm);
        let exact = |x: f64, y: f64| {
            let place = field_from_angles(&optics, MirrorAngles::new(x, y));
            Some([place.x_mm, place.y_mm])
        };
        let table = MapTable::new(0.24, 0.0, exact).unwrap();
        let mut worst_nm = 0.0_f64;
        for i in 0..40_000 {
            let (x, y) =
                (0.23 * (f64::from(i) * 0.618).sin(), 0.23 * (f64::from(i) * 0.7549).cos());
            for scale in [1.0, 0.01] {
                let read = table.value(scale * x, scale * y).unwrap();
                let [x_mm, y_mm] = exact(scale * x, scale * y).unwrap();
                worst_nm = worst_nm.max((read[0] - x_mm).hypot(read[1] - y_mm) * 1e6);
            }
        }
        assert!(worst_nm < 20.0, "{worst_nm} nm");
    }
}

/// Just inside its end a table has a value, though the cell's number rounds up there.
#[test]
fn a_table_reaches_its_end() {
    for half_width in [0.24, 60.0, 60.5, 168.0] {
        let table = MapTable::new(half_width, 0.0, |u, v| Some([u, v])).unwrap();
        let inside = f64::from_bits(f64::to_bits(half_width) - 1);
        for (u, v) in [(inside, inside), (inside, -inside), (-inside, inside), (0.1, inside)] {
            let [at_u, at_v] = table.value(u, v).unwrap();
            assert!((at_u - u).abs().max((at_v - v).abs()) < 1e-12 * half_width, "{half_width}");
        }
    }
}

proptest! {
    #[test]
    fn round_trip(x_rad in -0.2..0.2_f64, y_rad in -0.2..0.2_f64) {
        for coefficients_mm in [F163, F255, F420] {
            let optics = lens(coefficients_mm.into(), 300.0);
            let place = field_from_angles(&optics, MirrorAngles::new(x_rad, y_rad));
            let angles = angles_from_field(&optics, place).unwrap();
            prop_assert!((angles.x_rad - x_rad).abs() < 1e-14);
            prop_assert!((angles.y_rad - y_rad).abs() < 1e-14);
        }
    }
}
