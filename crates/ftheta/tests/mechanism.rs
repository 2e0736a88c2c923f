//! The gallery's mechanism: near the preset S10, converged, and fit to be marked with.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::{machine, mechanism};
use ftheta::mechanism::{N_MODES, analyse, write_machine};
use ftheta::physics::mechanism::{Coil, ModeKind, Model, Modes};
use ftheta::physics::servo::Gains;
use ftheta::planner::jump::{self, Atlas, AtlasOptions, AxisOptions, CurrentBound};
use std::path::Path;

const GALLERY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../gallery/s10-mechanism.toml");

#[test]
fn gallery_mechanism_is_near_the_preset() {
    let two = analyse(Path::new(GALLERY)).unwrap().two_inertias;
    assert!((two.rotor_kg_m2 / 1.25e-8 - 1.0).abs() < 0.01, "{two:?}");
    assert!((two.mirror_kg_m2 / 3e-8 - 1.0).abs() < 0.01, "{two:?}");
    assert!((two.frequency_hz / 5200.0 - 1.0).abs() < 0.01, "{two:?}");
}

#[test]
fn torsional_modes_change_by_less_than_half_a_percent_on_a_finer_mesh() {
    let mut mechanism =
        mechanism::read("gallery", &std::fs::read_to_string(GALLERY).unwrap()).unwrap();
    let torsion = |modes: &Modes| -> Vec<f64> {
        let twists = modes.shapes.iter().filter(|shape| shape.kind == ModeKind::Torsion);
        twists.map(|shape| shape.frequency_hz).collect()
    };
    let coarse = torsion(&Model::new(&mechanism).unwrap().modes(N_MODES).unwrap());
    mechanism.element_m *= 0.5;
    let fine = torsion(&Model::new(&mechanism).unwrap().modes(N_MODES).unwrap());
    assert!(!fine.is_empty() && fine.len() == coarse.len());
    for (rough, good) in coarse.iter().zip(&fine) {
        println!("{rough} Hz, finer {good} Hz, {:.3} %", 100.0 * (rough / good - 1.0));
        assert!((rough / good - 1.0).abs() < 5e-3, "{rough} {good}");
    }
}

#[test]
fn machine_file_holds_the_mechanism_and_has_a_servo() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("mine.toml");
    let analysis = analyse(Path::new(GALLERY)).unwrap();
    write_machine("S10-f160", &analysis, &path).unwrap();
    let found = machine::read("mine", &std::fs::read_to_string(&path).unwrap()).unwrap();
    assert_eq!((found.name.as_str(), found.optics.field_mm), ("mine", 120.0));
    let error = found.scanner.torsional_mode_hz / analysis.two_inertias.frequency_hz - 1.0;
    assert!(error.abs() < 1e-12, "{error}");
    Gains::design(&found.scanner, found.output.period_s()).unwrap();
}

/// A jump planned on two inertias, played on the axis with every mode that turns the mirror: what
/// the planner does not know of moves the mirror by less than 1 µrad.
#[test]
fn jumps_planned_on_two_inertias_arrive_on_many_modes() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("mine.toml");
    let mechanism = mechanism::read("g", &std::fs::read_to_string(GALLERY).unwrap()).unwrap();
    let mut analysis = analyse(Path::new(GALLERY)).unwrap();
    analysis.modes = Model::new(&mechanism).unwrap().modes(24).unwrap();
    write_machine("S10", &analysis, &path).unwrap();
    let scanner = machine::read("mine", &std::fs::read_to_string(&path).unwrap()).unwrap().scanner;
    let coil = Coil {
        torque_constant: scanner.torque_constant_n_m_a,
        resistance: scanner.resistance_ohm,
        inductance: scanner.inductance_h,
    };
    let axis = analysis.modes.axis(&coil, 1e-4);
    assert!(axis.modes.len() >= 3, "{}", axis.modes.len());
    let options = AxisOptions {
        model: jump::Model::Flexible,
        tick_s: 1e-5,
        voltage_reserve: 0.12,
        current_bound: CurrentBound::Always,
    };
    let step_rad = 1_f64.to_radians();
    let atlas =
        Atlas::build(&scanner, AtlasOptions { axis: options, range_rad: step_rad }).unwrap();
    let look = axis.step(1e-6).unwrap();
    let mut state = &look.b * 0.0;
    for voltage_v in atlas.jump(step_rad).unwrap().voltages_v() {
        for _ in 0..10 {
            state = &look.a * state + &look.b * voltage_v;
        }
    }
    let mut worst_rad = 0.0_f64;
    for _ in 0..500 {
        state = &look.a * state;
        worst_rad = worst_rad.max((axis.mirror_row().dot(&state) - step_rad).abs());
    }
    println!("{} modes: {worst_rad:e} rad", axis.modes.len());
    assert!(worst_rad < 1e-6, "{worst_rad:e} rad");
}
