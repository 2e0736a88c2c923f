//! Grid maps and correction tables, against the reference's table and exact maps.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_model::machine::{Axis, Lens, Optics};
use ftheta_model::space::FieldPoint;
use ftheta_physics::correction::{
    About, CorrectionError, CorrectionPlane, CorrectionTable, Drift, optics_id,
};
use ftheta_physics::grid_map::{GridMap, Interpolation};
use ftheta_physics::optics::angles_from_field;
use proptest::prelude::*;
use serde_json::Value;

const F420: [f64; 4] = [420.456, -6.051, 37.397, -55.24];
const BOTH: [Interpolation; 2] = [Interpolation::Bilinear, Interpolation::CatmullRom];

fn optics() -> Optics {
    let lens = Lens::FTheta { coefficients_mm: F420.to_vec() };
    Optics::new(lens, Axis::X, 336.0)
}

/// Place to command of the f = 420 mm lens, in mm of the linear command, as in the reference.
fn command(x_mm: f64, y_mm: f64) -> [f64; 2] {
    let angles = angles_from_field(&optics(), FieldPoint::new(x_mm, y_mm)).unwrap();
    [angles.x_rad, angles.y_rad].map(|rad| 2.0 * F420[0] * rad)
}

fn lens_map(interpolation: Interpolation) -> GridMap {
    GridMap::tabled(150.0, interpolation, 65, |x, y| Some(command(x, y))).unwrap()
}

/// Nodes of `optics.json`, and the errors that the reference measured over 280 mm: bilinear 2.36,
/// Catmull-Rom 0.121 µm.
#[test]
fn tables_are_as_near_as_the_references() {
    let reference: Value = serde_json::from_str(include_str!("fixtures/head.json")).unwrap();
    let samples = reference["lut65"]["row_col_samples"].as_array().unwrap();
    let nodes: Vec<_> = lens_map(Interpolation::Bilinear).nodes().collect();
    for sample in samples {
        let [row, column, x, y] = [0, 1, 2, 3].map(|k| sample[k].as_f64().unwrap());
        let (.., value) = nodes[row as usize * 65 + column as usize];
        assert!((value[0] - x).abs() < 1e-9 && (value[1] - y).abs() < 1e-9);
    }
    for (interpolation, limit_um) in BOTH.into_iter().zip([2.5, 0.15]) {
        let map = lens_map(interpolation);
        let mut worst_mm = 0.0f64;
        for index in 0..401 * 401 {
            let at = |k: usize| 0.7 * k as f64 - 140.0;
            let (x, y) = (at(index % 401), at(index / 401));
            let (found, exact) = (map.value([x, y]), command(x, y));
            worst_mm = worst_mm.max((found[0] - exact[0]).hypot(found[1] - exact[1]));
        }
        assert!(worst_mm * 1e3 < limit_um, "{interpolation:?}: {} µm", worst_mm * 1e3);
    }
}

#[test]
fn maps_refuse_what_is_no_grid() {
    let nodes = [[0.0; 2]; 9];
    let new = |half_width, n: usize| GridMap::new(half_width, BOTH[0], &nodes[..n]);
    assert!(new(1.0, 9).is_some());
    for (half_width, n_nodes) in [(1.0, 8), (1.0, 4), (0.0, 9), (f64::NAN, 9), (-1.0, 9)] {
        assert!(new(half_width, n_nodes).is_none(), "{half_width} {n_nodes}");
    }
}

/// A head whose axes are bent, turned and shifted a little.
fn bent(x: f64, y: f64) -> [f64; 2] {
    [1.004 * x + 0.003 * y - 8e-4 + 0.02 * x * y, 0.997 * y - 0.002 * x + 5e-4 - 0.03 * x * x]
}

fn table(angles: impl Fn(f64, f64) -> [f64; 2]) -> Result<CorrectionTable, CorrectionError> {
    let half_rad = 12.5f64.to_radians();
    let angles = GridMap::tabled(half_rad, BOTH[1], 65, |x, y| Some(angles(x, y))).unwrap();
    let about = About { optics_id: optics_id(&optics()), ..About::default() };
    CorrectionTable::flat(about, angles)
}

fn scanner() -> ftheta_model::machine::Scanner {
    use ftheta_model::machine::{Losses, Scanner, Sensor, Servo};
    Scanner {
        rotor_inertia_kg_m2: 1e-7,
        mirror_inertia_kg_m2: 1e-7,
        torque_constant_n_m_a: 0.01,
        resistance_ohm: 1.0,
        inductance_h: 1e-4,
        torsional_mode_hz: 5000.0,
        damping_ratio: 0.01,
        voltage_max_v: 30.0,
        current_max_a: 10.0,
        current_rms_a: 4.0,
        thermal_time_s: 1.0,
        angle_max_rad: 12.5f64.to_radians(),
        speed_max_rad_s: 1000.0,
        f1_uncertainty: 0.03,
        kt_uncertainty: 0.005,
        losses: Losses::default(),
        servo: Servo::StateFeedback { velocity_weight_s: 7e-5, lag_s: 1.6e-4 },
        sensor: Sensor::default(),
    }
}

#[test]
fn tables_that_fold_or_need_too_much_are_refused() {
    let refusal = |table: Result<CorrectionTable, _>| format!("{:?}", table.unwrap_err());
    assert!(refusal(table(|x, y| [x - 6.0 * x * x, y])).starts_with("Fold"));
    assert!(refusal(table(|x, _| [x, x])).starts_with("Fold"));
    assert!(refusal(table(|x, y| [4.0 * x, y])).starts_with("Value"));
    assert!(refusal(table(|_, _| [f64::NAN; 2])).starts_with("Value"));

    let limits = |angles: fn(f64, f64) -> [f64; 2]| {
        table(angles).unwrap().check_limits(&scanner(), &optics())
    };
    limits(bent).unwrap();
    limits(|x, y| [-y, x]).unwrap();
    let error = limits(|x, y| [x + 0.004 * (8.0 * x).sin(), y]).unwrap_err().to_string();
    assert!(error.contains("makes X 1.0") && error.contains("times as fast as planned"), "{error}");
    let error = limits(|x, y| [x, y + 0.01]).unwrap_err().to_string();
    assert!(error.contains("asks Y for") && error.contains("the limit is 12.500°"), "{error}");

    let other = Optics { field_mm: 200.0, ..optics() };
    let table = table(bent).unwrap();
    table.check_machine("any", &optics()).unwrap();
    assert!(table.check_machine("other", &other).unwrap_err().to_string().contains("other"));
}

#[test]
fn planes_blend_and_drift_comes_last() {
    let flat = |z_mm: f64, gain: f64| CorrectionPlane {
        z_mm,
        angles: GridMap::tabled(0.2, BOTH[0], 3, |x, y| Some([gain * x, y])).unwrap(),
    };
    let planes = vec![flat(-10.0, 0.9), flat(0.0, 1.0), flat(20.0, 1.2)];
    let drift = Drift { gain: [1.0, 2.0], offset_rad: [0.01, 0.0] };
    let table = CorrectionTable::new(About::default(), planes, drift).unwrap();
    for (z_mm, gain) in [(-50.0, 0.9), (-5.0, 0.95), (0.0, 1.0), (5.0, 1.05), (99.0, 1.2)] {
        let [x, y] = table.angles_at([0.1, 0.05], z_mm);
        assert!((x - (gain * 0.1 + 0.01)).abs() < 1e-15 && (y - 0.1).abs() < 1e-15, "{z_mm}");
    }
    assert_eq!(table.angles([0.1, 0.0])[0], table.angles_at([0.1, 0.0], 0.0)[0]);
    let unordered = vec![flat(0.0, 1.0), flat(0.0, 1.0)];
    let error = CorrectionTable::new(About::default(), unordered, Drift::NONE).unwrap_err();
    assert_eq!(error, CorrectionError::Planes { index: 1, z_mm: 0.0 });
}

proptest! {
    /// The inverse comes back, with swapped axes too, and slopes are slopes.
    #[test]
    fn nominal_undoes_angles(x in -0.2..0.2f64, y in -0.2..0.2f64, swapped: bool) {
        let table = table(|x, y| {
            let [u, v] = bent(x, y);
            if swapped { [-v, u] } else { [u, v] }
        }).unwrap();
        let there = table.angles([x, y]);
        let back = table.nominal(there).unwrap();
        prop_assert!((back[0] - x).abs() < 1e-12 && (back[1] - y).abs() < 1e-12);
        let step = 1e-7;
        let slopes = table.slopes([x, y]);
        for (column, (dx, dy)) in [(step, 0.0), (0.0, step)].into_iter().enumerate() {
            let (low, high) = (table.angles([x - dx, y - dy]), table.angles([x + dx, y + dy]));
            for row in 0..2 {
                let slope = (high[row] - low[row]) / (2.0 * step);
                prop_assert!((slope - slopes[row][column]).abs() < 1e-6);
            }
        }
    }

    /// Many places at once are the same as one by one.
    #[test]
    fn mapping_many_is_mapping_each(
        places in prop::collection::vec(prop::array::uniform2(-300.0..300.0f64), 0..20),
    ) {
        for interpolation in BOTH {
            let map = lens_map(interpolation);
            let mut values = vec![[0.0; 2]; places.len()];
            map.map(&places, &mut values);
            for (&place, value) in places.iter().zip(values) {
                prop_assert_eq!(map.value(place), value);
            }
        }
    }
}
