//! Spot and focus against the numbers of `design/optics.md` A.5.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta_model::machine::{Axis, Focus, Lens, Optics};
use ftheta_model::space::FieldPoint;
use ftheta_physics::correction::optics_id;
use ftheta_physics::focus::{
    defocused_diameter_mm, depth_of_focus_mm, field_travel_mm, lens_gradient, lens_travel_mm,
    rayleigh_range_mm, sharp_radius_mm, spot_diameter_mm, truncated_share,
};
use ftheta_physics::optics::path_difference_mm;
use proptest::prelude::*;

fn post(e_mm: f64, d_mm: f64, field_mm: f64, first_mirror: Axis) -> Optics {
    let lens = Lens::PostObjective { mirror_distance_mm: e_mm, working_distance_mm: d_mm };
    Optics::new(lens, first_mirror, field_mm)
}

fn lens() -> Focus {
    Focus {
        magnification: 4.0,
        travel_mm: 5.0,
        speed_max_mm_s: 280.0,
        acceleration_max_mm_s2: 2e5,
        lag_s: 7e-4,
        balanced: true,
    }
}

/// Radius of the waist in µm and the Rayleigh ranges of 1064 nm and 10.6 µm (ten times the waist).
#[test]
fn rayleigh_ranges_agree_with_the_reference() {
    let rows = [(15.0, 0.664, 6.67), (25.0, 1.845, 18.52), (50.0, 7.382, 74.09)];
    for (radius_um, yag_mm, co2_mm) in rows {
        let yag = rayleigh_range_mm(1064.0, 1.0, 2e-3 * radius_um);
        let co2 = rayleigh_range_mm(10_600.0, 1.0, 2e-2 * radius_um);
        assert!((yag - yag_mm).abs() < 0.0006, "{yag} against {yag_mm}");
        // The reference cuts its digits.
        assert!((co2 - co2_mm).abs() < 0.011, "{co2} against {co2_mm}");
    }
}

#[test]
fn the_waist_is_that_of_the_thesis() {
    // w0 = M² λ f / (π w_in): radius 22.58 µm of 1064 nm, M² 1.2, f 160 mm, w_in 2.88 mm.
    let spot_mm = spot_diameter_mm(1064.0, 1.2, 160.0, 2.0 * 2.88);
    assert!((0.5e3 * spot_mm - 22.579).abs() < 0.001, "{spot_mm}");
    // K_f = w0·θ = M² λ / π, with the half divergence w_in / f.
    let product = 0.5 * spot_mm * 2.88 / 160.0;
    assert!((product - 1.2 * 1064e-6 / std::f64::consts::PI).abs() < 1e-15);
    let range_mm = rayleigh_range_mm(1064.0, 1.2, spot_mm);
    let edge_mm = 0.5 * depth_of_focus_mm(range_mm);
    let grown = defocused_diameter_mm(spot_mm, range_mm, -edge_mm) / spot_mm;
    assert!((grown - 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((truncated_share(10.0, 15.0) - 0.011_109).abs() < 1e-6);
    assert!((truncated_share(10.0, 10.0) - 0.135_335).abs() < 1e-6);
}

/// e, d, field, and δL on the x edge, the y edge and in the corner, mm. The table lists the edge
/// along x first, which is that of the first mirror.
#[test]
fn path_differences_agree_with_the_table() {
    let rows = [
        (12.0, 180.0, 110.0, [7.7223, 8.2153, 15.6323]),
        (20.0, 280.0, 175.0, [12.5, 13.3535, 25.3408]),
        (30.0, 460.0, 110.0, [3.0771, 3.2764, 6.3331]),
        (30.0, 460.0, 280.0, [19.6077, 20.8326, 39.6697]),
        (30.0, 500.0, 300.0, [20.8176, 22.0153, 42.0323]),
        (45.0, 800.0, 500.0, [36.2066, 38.1527, 72.8555]),
    ];
    for (e_mm, d_mm, field_mm, expected_mm) in rows {
        let half_mm = 0.5 * field_mm;
        let optics = post(e_mm, d_mm, field_mm, Axis::X);
        let places = [(half_mm, 0.0), (0.0, half_mm), (half_mm, half_mm)];
        for ((x_mm, y_mm), expected_mm) in places.into_iter().zip(expected_mm) {
            let found_mm = path_difference_mm(&optics, FieldPoint::new(x_mm, y_mm));
            assert!((found_mm - expected_mm).abs() < 5.1e-5, "{found_mm} against {expected_mm}");
        }
    }
}

#[test]
fn a_balanced_lens_halves_the_travel() {
    let optics = post(30.0, 460.0, 280.0, Axis::X);
    let balanced = field_travel_mm(&optics, &lens());
    let centred = field_travel_mm(&optics, &Focus { balanced: false, ..lens() });
    assert!((balanced - 39.6697 / 8.0).abs() < 1e-5, "{balanced}");
    assert!((centred - 39.6697 / 4.0).abs() < 1e-5, "{centred}");
    let optics = Optics { focus: Some(lens()), ..optics };
    let at = |x, y| lens_travel_mm(&optics, FieldPoint::new(x, y)).unwrap();
    assert!((at(0.0, 0.0) + balanced).abs() < 1e-12);
    assert!((at(-140.0, 140.0) - balanced).abs() < 1e-12);
    assert!(lens_travel_mm(&post(30.0, 460.0, 280.0, Axis::X), FieldPoint::default()).is_none());
}

/// No place nearer to the centre is off by more than the range, and the radius itself is.
#[test]
fn the_sharp_radius_is_the_smallest() {
    for (range_mm, expected) in [(0.664, true), (25.0, true), (39.6, true), (39.7, false)] {
        let optics = post(30.0, 460.0, 280.0, Axis::Y);
        let radius_mm = sharp_radius_mm(&optics, range_mm);
        assert_eq!(radius_mm.is_some(), expected, "{range_mm}");
        let inside_mm = radius_mm.map_or(f64::INFINITY, |radius| radius * (1.0 - 1e-9));
        let mut first_mm = f64::INFINITY;
        for step in 0..281 * 281 {
            let place = FieldPoint::new(f64::from(step % 281) * 0.5, f64::from(step / 281) * 0.5);
            let off_mm = path_difference_mm(&optics, place);
            if off_mm > range_mm {
                let distance_mm = place.x_mm.hypot(place.y_mm);
                assert!(distance_mm > inside_mm, "{place:?} is off by {off_mm}");
                first_mm = first_mm.min(distance_mm);
            }
        }
        if let Some(radius_mm) = radius_mm {
            assert!(first_mm - radius_mm < 1.0, "{first_mm} against {radius_mm}");
        }
    }
    let ftheta = Lens::FTheta { coefficients_mm: vec![160.0] };
    let ftheta = Optics { lens: ftheta, ..post(0.0, 1.0, 100.0, Axis::X) };
    assert!(sharp_radius_mm(&ftheta, 1e-3).is_none());
}

/// Tables stay valid when the lens gets faster, not when it stands elsewhere.
#[test]
fn the_lens_is_part_of_the_optics_id() {
    let without = post(30.0, 460.0, 280.0, Axis::X);
    let id = |focus| optics_id(&Optics { focus: Some(focus), ..without.clone() });
    assert_ne!(id(lens()), optics_id(&without));
    assert_ne!(id(lens()), id(Focus { balanced: false, ..lens() }));
    assert_eq!(id(lens()), id(Focus { speed_max_mm_s: 100.0, ..lens() }));
}

proptest! {
    #[test]
    fn the_gradient_is_that_of_the_travel(
        x_mm in -140.0..140.0_f64, y_mm in -140.0..140.0_f64, y_first in any::<bool>(),
    ) {
        let first = if y_first { Axis::Y } else { Axis::X };
        let optics = Optics { focus: Some(lens()), ..post(30.0, 460.0, 280.0, first) };
        let at = |dx, dy| lens_travel_mm(&optics, FieldPoint::new(x_mm + dx, y_mm + dy)).unwrap();
        let slope = lens_gradient(&optics, FieldPoint::new(x_mm, y_mm)).unwrap();
        let h = 1e-3;
        prop_assert!((slope.x - (at(h, 0.0) - at(-h, 0.0)) / (2.0 * h)).abs() < 1e-9);
        prop_assert!((slope.y - (at(0.0, h) - at(0.0, -h)) / (2.0 * h)).abs() < 1e-9);
    }
}
