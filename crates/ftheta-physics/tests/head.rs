//! The ray trace against numbers of the reference model (`reference/head_model.py`).
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_model::machine::{Axis, Lens, Optics};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::head::{Frame, Head, HeadLens, Plane, Response, Tracer};
use ftheta_physics::optics::{angles_from_field, field_from_angles, path_difference_mm};
use proptest::prelude::*;
use serde_json::Value;

fn reference() -> Value {
    serde_json::from_str(include_str!("fixtures/head.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// A head from the reference's own fields.
fn head(value: &Value) -> Head {
    let number = |key: &str| value[key].as_f64().unwrap();
    let pair = |key: &str| -> [f64; 2] { numbers(&value[key]).try_into().unwrap() };
    assert!((number("fs") - Response::FULL_SCALE_RAD).abs() < 1e-15);
    let response = [0, 1].map(|k| Response {
        zero_rad: pair("off")[k],
        gain: pair("gain")[k],
        square: pair("n2")[k],
        cube: pair("n3")[k],
        fifth: pair("n5")[k],
        ripple: pair("ns")[k],
    });
    let lens = value["lens"].as_array().map(|_| HeadLens {
        coefficients_mm: numbers(&value["lens"]),
        tilt_rad: pair("lens_tilt"),
        decentre_mm: pair("lens_dec"),
        tangential: pair("lens_p"),
        ripple_mm: number("lens_k5"),
        pupil_walk_mm: number("pupil"),
        stretch_per_mm: pair("stretch"),
    });
    let (plane, frame) = (numbers(&value["plane"]), numbers(&value["frame"]));
    Head {
        mirror_distance_mm: number("e"),
        working_distance_mm: number("d"),
        surface_mm: [number("t1"), number("t2")],
        aligned: value["aligned"].as_bool().unwrap(),
        beam_offset_mm: pair("las_pos"),
        beam_tilt_rad: pair("las_dir"),
        axis1_tilt_rad: pair("ax1"),
        axis2_tilt_rad: pair("ax2"),
        cone_rad: [number("cone1"), number("cone2")],
        response,
        lens,
        plane: Plane { height_mm: plane[0], slope: [plane[1], plane[2]] },
        frame: Frame { shift_mm: [frame[0], frame[1]], rotation_rad: frame[2] },
    }
}

#[test]
fn traces_agree_with_the_reference() {
    for case in reference()["ray_trace"].as_array().unwrap() {
        let tracer = Tracer::new(&head(&case["head"]));
        let rows = case["alpha"].as_array().unwrap().iter().zip(case["xy"].as_array().unwrap());
        for (alpha, xy) in rows.map(|(alpha, xy)| (numbers(alpha), numbers(xy))) {
            let commands = MirrorAngles::new(alpha[0], alpha[1]);
            let place = tracer.place(commands);
            let error_mm = (place.x_mm - xy[0]).hypot(place.y_mm - xy[1]);
            assert!(error_mm < 1e-9, "{}: {error_mm} mm off", case["name"]);
            let near = MirrorAngles::new(alpha[0] + 0.01, alpha[1] - 0.02);
            let back = tracer.commands(place, near).unwrap();
            assert!((back.x_rad - alpha[0]).abs() < 1e-11 && (back.y_rad - alpha[1]).abs() < 1e-11);
        }
    }
}

/// Commands that put the beam of hidden machine 1 on its targets, found by the reference.
#[test]
fn inverses_agree_with_the_reference() {
    const F_MM: f64 = 420.456;
    let reference = reference();
    let tracer = Tracer::new(&head(&reference["ray_trace"][1]["head"]));
    let case = &reference["true_inverse"][0];
    let rows = case["target"].as_array().unwrap().iter().zip(case["cmd"].as_array().unwrap());
    for (target, command) in rows.map(|(target, command)| (numbers(target), numbers(command))) {
        let start = MirrorAngles::new(target[0] / (2.0 * F_MM), target[1] / (2.0 * F_MM));
        let found = tracer.commands(FieldPoint::new(target[0], target[1]), start).unwrap();
        assert!((2.0 * F_MM * found.x_rad - command[0]).abs() < 1e-7);
        assert!((2.0 * F_MM * found.y_rad - command[1]).abs() < 1e-7);
    }
}

proptest! {
    /// A head without errors is the closed form, with and without a lens, path included.
    #[test]
    fn a_perfect_head_is_the_closed_form(x_rad in -0.2..0.2f64, y_rad in -0.2..0.2f64) {
        let angles = MirrorAngles::new(x_rad, y_rad);
        let coefficients_mm = vec![420.456, -6.051, 37.397, -55.24];
        let lens = Lens::FTheta { coefficients_mm: coefficients_mm.clone() };
        let optics = Optics::new(lens, Axis::X, 300.0);
        let lens = HeadLens::perfect(coefficients_mm);
        let tracer = Tracer::new(&Head::perfect(30.0, 500.0, Some(lens)));
        let (exact, traced) = (field_from_angles(&optics, angles), tracer.place(angles));
        prop_assert!((exact.x_mm - traced.x_mm).hypot(exact.y_mm - traced.y_mm) < 1e-10);

        let lens = Lens::PostObjective { mirror_distance_mm: 30.0, working_distance_mm: 460.0 };
        let optics = Optics { lens, ..optics };
        let tracer = Tracer::new(&Head::perfect(30.0, 460.0, None));
        let (exact, (traced, length_mm)) =
            (field_from_angles(&optics, angles), tracer.place_and_length(angles));
        prop_assert!((exact.x_mm - traced.x_mm).hypot(exact.y_mm - traced.y_mm) < 1e-10);
        prop_assert!((path_difference_mm(&optics, exact) - (length_mm - 490.0)).abs() < 1e-10);
        let found = tracer.commands(exact, MirrorAngles::default()).unwrap();
        let nominal = angles_from_field(&optics, exact).unwrap();
        prop_assert!((found.x_rad - nominal.x_rad).abs() < 1e-12);
        prop_assert!((found.y_rad - nominal.y_rad).abs() < 1e-12);
    }

    /// The Jacobian tells what a small step does.
    #[test]
    fn the_jacobian_is_the_slope(x_rad in -0.2..0.2f64, y_rad in -0.2..0.2f64) {
        let tracer = Tracer::new(&head(&reference()["ray_trace"][1]["head"]));
        let (step_x, step_y) = (1e-6, -2e-6);
        let (from, to) = (
            tracer.place(MirrorAngles::new(x_rad - step_x, y_rad - step_y)),
            tracer.place(MirrorAngles::new(x_rad + step_x, y_rad + step_y)),
        );
        let jacobian = tracer.jacobian(MirrorAngles::new(x_rad, y_rad));
        let told = jacobian * nalgebra::Vector2::new(2.0 * step_x, 2.0 * step_y);
        prop_assert!((to.x_mm - from.x_mm - told.x).abs() < 1e-9);
        prop_assert!((to.y_mm - from.y_mm - told.y).abs() < 1e-9);
    }
}
