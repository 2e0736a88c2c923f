//! A mechanism against closed forms, its own refinement, and what rotation should do to it.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_physics::mechanism::spin::{Driven, Spin};
use ftheta_physics::mechanism::{
    Bearing, Coil, Material, Mechanism, MechanismError, Mirror, ModeKind, Model, Part, Segment,
    Station,
};
use proptest::prelude::*;
use std::f64::consts::TAU;

const STEEL: Material = Material { young_pa: 200e9, poisson: 0.3, density_kg_m3: 7850.0 };
const MAGNET: Material = Material { young_pa: 160e9, poisson: 0.24, density_kg_m3: 7500.0 };
const ALUMINIUM: Material = Material { young_pa: 70e9, poisson: 0.33, density_kg_m3: 2700.0 };
const SILICA: Material = Material { young_pa: 73e9, poisson: 0.17, density_kg_m3: 2200.0 };

fn segment(part: Part, length_m: f64, diameter_m: f64, material: Material) -> Segment {
    Segment { part, length_m, diameter_m, bore_m: 0.0, material }
}

/// About the gallery's mechanism: octagonal mirror on a thin shaft before a magnet.
fn mechanism(element_m: f64) -> Mechanism {
    let station = |along_m, width_m| Station { along_m, width_m };
    Mechanism {
        segments: vec![
            segment(Part::Shaft, 4e-3, 2e-3, STEEL),
            segment(Part::Rotor, 20e-3, 5e-3, MAGNET),
            segment(Part::Shaft, 10e-3, 2.2e-3, STEEL),
            segment(Part::Mount, 4e-3, 6e-3, ALUMINIUM),
        ],
        bearings: vec![
            Bearing { position_m: 2e-3, radial_n_m: 2e7, axial_n_m: 5e6 },
            Bearing { position_m: 28e-3, radial_n_m: 2e7, axial_n_m: 0.0 },
        ],
        mirror: Mirror {
            stations: vec![
                station(0.0, 8e-3),
                station(4e-3, 14e-3),
                station(16e-3, 14e-3),
                station(20e-3, 7e-3),
            ],
            thickness_m: 2e-3,
            bond_m: 2.5e-3,
            offset_m: 0.0,
            material: SILICA,
        },
        damping_ratio: 0.01,
        element_m,
    }
}

/// Rigid rotor, elastic bar with its own inertia, rigid mirror.
fn torsion_bar() -> Mechanism {
    let rigid = Material { young_pa: 2e14, ..STEEL };
    let mut bar = mechanism(1e-3);
    bar.segments =
        vec![segment(Part::Rotor, 10e-3, 6e-3, rigid), segment(Part::Shaft, 30e-3, 2e-3, STEEL)];
    bar.bearings[1].position_m = 38e-3;
    bar.mirror.stations =
        vec![Station { along_m: 0.0, width_m: 10e-3 }, Station { along_m: 5e-3, width_m: 10e-3 }];
    bar.mirror.bond_m = 4.999_999e-3;
    bar.mirror.material = rigid;
    bar
}

#[test]
fn torsion_bar_twists_at_the_closed_form() {
    let model = Model::new(&torsion_bar()).unwrap();
    let [rotor, shaft, _, mirror] = model.inertias_kg_m2();
    let modes = model.modes(12).unwrap();
    let found = modes.shapes.iter().find(|shape| shape.kind == ModeKind::Torsion).unwrap();
    // tan z·(b1·b2·z² - 1) = (b1 + b2)·z, z = ω·l/c: a bar with an inertia at either end.
    let (b1, b2) = (rotor / shaft, mirror / shaft);
    let root = |z: f64| z.sin() * (b1 * b2 * z * z - 1.0) - (b1 + b2) * z * z.cos();
    let (mut low, mut high) = (1e-3, 1.5);
    assert!(root(low) < 0.0 && root(high) > 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if root(middle) < 0.0 { low = middle } else { high = middle }
    }
    let speed = (STEEL.shear_pa() / STEEL.density_kg_m3).sqrt();
    let expected_hz = low * speed / 30e-3 / TAU;
    let error = found.frequency_hz / expected_hz - 1.0;
    println!("torsion bar: {} Hz, closed form {expected_hz} Hz", found.frequency_hz);
    assert!(error.abs() < 2e-4, "{} {expected_hz}", found.frequency_hz);
    // At either end the angle is the closed form's too.
    let ratio = found.mirror / found.rotor;
    let expected = low.cos() - b1 * low * low.sin();
    assert!((ratio / expected - 1.0).abs() < 1e-3, "{ratio} {expected}");
}

#[test]
fn torsional_modes_converge_to_half_a_percent() {
    let modes = |element_m| {
        let model = Model::new(&mechanism(element_m)).unwrap();
        let modes = model.modes(12).unwrap();
        println!("{} freedoms", model.n_freedoms());
        for shape in &modes.shapes {
            println!(
                "{:9.1} Hz {:10} rotor {:8.4} mirror {:8.4} tilt {:8.4}",
                shape.frequency_hz,
                shape.kind.word(),
                shape.rotor * modes.inertia_kg_m2.sqrt(),
                shape.mirror * modes.inertia_kg_m2.sqrt(),
                shape.tilt * modes.inertia_kg_m2.sqrt()
            );
        }
        println!("{:?}", modes.two_inertias());
        modes
    };
    let (coarse, fine) = (modes(1e-3), modes(5e-4));
    let torsion = |modes: &ftheta_physics::mechanism::Modes| -> Vec<f64> {
        let twists = modes.shapes.iter().filter(|shape| shape.kind == ModeKind::Torsion);
        twists.map(|shape| shape.frequency_hz).collect()
    };
    let (coarse, fine) = (torsion(&coarse), torsion(&fine));
    assert!(fine.len() >= 2, "{fine:?}");
    for (rough, good) in coarse.iter().zip(&fine) {
        assert!((rough / good - 1.0).abs() < 5e-3, "{rough} {good}");
    }
}

const COIL: Coil = Coil { torque_constant: 0.00617, resistance: 2.79, inductance: 180e-6 };

/// Transfer from torque to an angle at a frequency, by the reduced axis and by all freedoms.
#[test]
fn reduction_transfers_as_the_full_model_does() {
    let model = Model::new(&mechanism(2e-3)).unwrap();
    let modes = model.modes(20).unwrap();
    let axis = modes.axis(&COIL, 1e-3);
    assert!(axis.modes.len() >= 2 && axis.modes.len() < 12, "{}", axis.modes.len());
    let [stiffness, mass] = model.matrices().unwrap();
    let [rotor, mirror] = model.angle_rows();
    for frequency_hz in [500.0, 2000.0, 6000.0, 7900.0, 9000.0, 12_000.0] {
        let square = (TAU * frequency_hz).powi(2);
        let full = (&stiffness - &mass * square).lu().solve(rotor).unwrap();
        let reduced = |row: fn(&ftheta_physics::modal::Mode) -> f64| -> f64 {
            let modes = axis.modes.iter().map(|mode| {
                row(mode) * mode.rotor / mode.inertia / (mode.omega * mode.omega - square)
            });
            -1.0 / (axis.inertia * square) + modes.sum::<f64>()
        };
        // Against the rigid body, so that a zero between modes is no singular case.
        let rigid = 1.0 / (axis.inertia * square);
        for (found, expected) in [
            (reduced(|mode| mode.rotor), rotor.dot(&full)),
            (reduced(|mode| mode.mirror), mirror.dot(&full)),
        ] {
            let error = (found - expected).abs() / rigid.max(expected.abs());
            println!("{frequency_hz} Hz: {found:e} {expected:e} {error:e}");
            assert!(error < 0.01, "{frequency_hz} Hz: {found:e} {expected:e}");
        }
    }
}

/// A torque on the rotor meets the inverse inertias of rotation and modes together: all of them
/// make up what the mass matrix says, and a few make up most of it.
#[test]
fn participations_sum_to_the_whole() {
    let model = Model::new(&mechanism(4e-3)).unwrap();
    let modes = model.modes(model.n_freedoms() / 4).unwrap();
    let [_, mass] = model.matrices().unwrap();
    let [rotor, mirror] = model.angle_rows();
    for (row, take) in [(rotor, 0), (mirror, 1)] {
        let whole = row.dot(&mass.clone().lu().solve(row).unwrap());
        let mut sum = 1.0 / modes.inertia_kg_m2;
        for shape in &modes.shapes {
            sum += [shape.rotor, shape.mirror][take].powi(2);
            assert!(sum < whole * (1.0 + 1e-9), "{sum} {whole}");
        }
        println!("{} modes: {} of the whole", modes.shapes.len(), sum / whole);
        assert!(sum > 0.97 * whole, "{sum} {whole}");
    }
}

fn offset(offset_m: f64, damping_ratio: f64) -> Mechanism {
    let mut mechanism = mechanism(2e-3);
    mechanism.mirror.offset_m = offset_m;
    mechanism.damping_ratio = damping_ratio;
    mechanism
}

fn spin(mechanism: &Mechanism, n_modes: usize) -> (Spin, ftheta_physics::mechanism::Modes) {
    let model = Model::new(mechanism).unwrap();
    let modes = model.modes(n_modes).unwrap();
    (Spin::new(&modes), modes)
}

/// A small torque moves the mirror as independent modes would, in closed form.
#[test]
fn slow_motion_is_the_linear_response() {
    let (spin, modes) = spin(&offset(1e-3, 0.01), 8);
    let torque = 1e-6;
    let times: Vec<f64> = (0..=100).map(|i| f64::from(i) * 5e-6).collect();
    let motion = spin.play(&times, Driven::Torque(&[torque; 101])).unwrap();
    for (&t, sample) in times.iter().zip(&motion) {
        let mut expected = 0.5 * torque / modes.inertia_kg_m2 * t * t;
        for shape in &modes.shapes {
            let (omega, zeta) = (TAU * shape.frequency_hz, modes.damping_ratio);
            let damped = omega * (1.0 - zeta * zeta).sqrt();
            let ring = (damped * t).cos() + zeta * omega / damped * (damped * t).sin();
            expected += shape.mirror * shape.rotor * torque / (omega * omega)
                * (1.0 - (-zeta * omega * t).exp() * ring);
        }
        let scale = 0.5 * torque / modes.inertia_kg_m2 * times[100].powi(2);
        let error = (sample.mirror_rad - expected).abs() / scale;
        assert!(error < 1e-6, "{t} s: {} {expected}", sample.mirror_rad);
    }
}

/// What rotation adds begins with the square of the torque: a mirror beside the axis is pulled off.
#[test]
fn rotation_adds_what_grows_with_the_square() {
    let (spin, _) = spin(&offset(1e-3, 0.01), 8);
    let times: Vec<f64> = (0..=100).map(|i| f64::from(i) * 5e-6).collect();
    let tilt = |torque: f64| {
        let motion = spin.play(&times, Driven::Torque(&[torque; 101])).unwrap();
        motion[100].tilt_rad
    };
    let (one, two) = (tilt(1e-3), tilt(2e-3));
    println!("tilt {one:e} {two:e}");
    assert!((two / one - 4.0).abs() < 0.01, "{one:e} {two:e}");
    // At the torque of a fast jump it is not small any more and not quite a square either.
    assert!((tilt(0.05) / one / 2500.0 - 1.0).abs() > 1e-3);
}

#[test]
fn free_motion_keeps_energy_and_momentum() {
    let (spin, modes) = spin(&offset(1e-3, 0.0), 8);
    let mut state = spin.rest(0.3);
    state.speed_rad_s = 1000.0;
    state.twist[0] = 3e-8;
    state.twist[3] = 1e-7;
    state.twist_speed[1] = 2e-3;
    let (energy, momentum) = (spin.energy_j(&state), spin.momentum_n_m_s(&state));
    let after = spin.advance(&state, 0.0, 2e-3).unwrap();
    let energy_error = spin.energy_j(&after) / energy - 1.0;
    let momentum_error = spin.momentum_n_m_s(&after) / momentum - 1.0;
    println!("energy {energy_error:e}, momentum {momentum_error:e}");
    assert!(energy_error.abs() < 1e-5 && momentum_error.abs() < 1e-9);
    // The speed itself is not kept: the modes trade momentum with the rotation.
    assert!((after.speed_rad_s - 1000.0).abs() > 1e-4 && !modes.shapes.is_empty());
}

/// At constant speed a mass beside the axis goes out as far as Jeffcott's rotor does: by
/// `Ω²/(ω² - Ω²)`, not by `Ω²/ω²`.
#[test]
fn fast_rotation_deflects_as_jeffcott_says() {
    let (spin, modes) = spin(&offset(1e-3, 0.3), 6);
    let speed = 3000.0;
    // Up to speed along a smooth ramp in 4 ms, then 4 ms at speed.
    let times: Vec<f64> = (0..=800).map(|i| f64::from(i) * 1e-5).collect();
    let angle = |t: f64| {
        let s = (t / 4e-3).min(1.0);
        let ramp = s.powi(3) - 0.5 * s.powi(4);
        speed * (4e-3 * ramp + (t - 4e-3).max(0.0))
    };
    let law: Vec<f64> = times.iter().map(|&t| angle(t)).collect();
    let motion = spin.play(&times, Driven::Angle(&law)).unwrap();
    let tilt = |softened: bool| -> f64 {
        let each = modes.shapes.iter().enumerate().map(|(i, shape)| {
            let square = (TAU * shape.frequency_hz).powi(2);
            let soft = if softened { speed * speed } else { 0.0 };
            shape.tilt * speed * speed * modes.rotation.pull[i] / (square - soft)
        });
        each.sum()
    };
    // The spline's own end brings the speed to zero, so look a little before it.
    let found = motion[780].tilt_rad;
    println!("tilt {found:e}, Jeffcott {:e}, without softening {:e}", tilt(true), tilt(false));
    assert!((found / tilt(true) - 1.0).abs() < 0.03, "{found:e} {:e}", tilt(true));
    assert!((found / tilt(false) - 1.0).abs() > 0.1);
}

/// Bending that moves everything across the axis softens by the whole modal mass and couples with
/// its twin; a rigid mirror that turns neither stiffens nor softens.
#[test]
fn rotation_costs_nothing_and_bending_softens() {
    let model = Model::new(&torsion_bar()).unwrap();
    let modes = model.modes(12).unwrap();
    for (index, shape) in modes.shapes.iter().enumerate() {
        let stiffening = modes.rotation.stiffening[(index, index)];
        match shape.kind {
            ModeKind::Torsion => assert!(stiffening.abs() < 1e-6, "{stiffening}"),
            ModeKind::Axial => assert!(stiffening.abs() < 0.01, "{stiffening}"),
            _ => assert!(stiffening > -1.0 && stiffening < -0.5, "{stiffening}"),
        }
    }
    assert!(
        (modes.rotation.coupling[(0, 1)].abs() - 1.0).abs() < 0.1,
        "{}",
        modes.rotation.coupling[(0, 1)]
    );
}

/// A driven rotor follows its law, and the mirror lags by acceleration over its own frequency.
#[test]
fn driven_law_is_followed_and_the_mirror_lags() {
    let (spin, modes) = spin(&mechanism(2e-3), 12);
    let two = modes.two_inertias().unwrap();
    // Long against the mode's period, so that the mirror does not ring.
    let (n, total_s) = (1000_u32, 1e-2);
    let times: Vec<f64> = (0..=n).map(|i| f64::from(i) * total_s / f64::from(n)).collect();
    let law: Vec<f64> = times
        .iter()
        .map(|&t| {
            let s = t / total_s;
            0.2 * s.powi(5) * (126.0 - s * (420.0 - s * (540.0 - s * (315.0 - 70.0 * s))))
        })
        .collect();
    let motion = spin.play(&times, Driven::Angle(&law)).unwrap();
    let square = (TAU * two.frequency_hz).powi(2) * two.rotor_kg_m2 / modes.inertia_kg_m2;
    let mut worst = 0.0_f64;
    for index in 1..n as usize {
        assert!((motion[index].rotor_rad - law[index]).abs() < 1e-9);
        let h = times[1];
        let acceleration = (law[index + 1] - 2.0 * law[index] + law[index - 1]) / (h * h);
        let error = motion[index].mirror_rad - law[index] + acceleration / square;
        worst = worst.max(error.abs());
    }
    let lag = motion.iter().zip(&law).map(|(m, l)| (m.mirror_rad - l).abs()).fold(0.0, f64::max);
    println!("mirror lags by up to {lag:e} rad, unexplained {worst:e}");
    assert!(worst < 0.05 * lag, "{worst:e} {lag:e}");
    assert!((motion[n as usize].mirror_rad - 0.2).abs() < 0.01 * lag);
}

#[test]
fn impossible_mechanisms_are_refused_with_place_value_and_limit() {
    let message = |change: fn(&mut Mechanism)| {
        let mut bad = mechanism(1e-3);
        change(&mut bad);
        let found = Model::new(&bad).and_then(|model| model.modes(4));
        found.unwrap_err().to_string()
    };
    assert_eq!(
        message(|m| m.segments[1].diameter_m = -1.0),
        "segment 1 diameter_m = -1 is outside above 0"
    );
    assert_eq!(
        message(|m| m.segments[0].bore_m = 0.003),
        "segment 0 bore_m = 0.003 is outside 0 to the diameter 0.002"
    );
    assert_eq!(
        message(|m| m.mirror.bond_m = 0.02),
        "mirror bond_m = 0.02 is outside above 0 and below 0.02"
    );
    assert_eq!(
        message(|m| m.mirror.stations[2].along_m = 0.004),
        "mirror station 2 along_m = 0.004 is outside above 0.004"
    );
    assert!(message(|m| m.element_m = 1e-9).ends_with(" elements are more than the limit of 4000"));
    assert!(message(|m| m.bearings.clear()).starts_with("bearings hold too little"));
    assert!(message(|m| m.bearings.truncate(1)).starts_with("bearings hold too little"));
    assert!(message(|m| m.segments.clear()).starts_with("number of rotor segments = 0"));
    assert!(message(|m| m.mirror.thickness_m = f64::NAN).contains("thickness_m = NaN"));
}

#[test]
fn faulty_samples_are_refused() {
    let (spin, _) = spin(&mechanism(4e-3), 4);
    let message = |times: &[f64], values: &[f64]| {
        spin.play(times, Driven::Torque(values)).unwrap_err().to_string()
    };
    assert_eq!(message(&[0.0], &[1.0]), "sample 1: there must be a time for each, and two of them");
    assert_eq!(message(&[0.0, 0.0], &[1.0, 1.0]), "sample 1: not later than the one before");
    assert_eq!(message(&[0.0, 1.0], &[1.0, f64::NAN]), "sample 1: not a finite number");
    assert!(message(&[0.0, 1e9], &[0.0, 0.0]).contains("2e7 steps"));
    assert!(matches!(spin.advance(&spin.rest(0.0), 0.0, 1e9), Err(MechanismError::Samples { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    /// Whatever a mechanism file can state gives modes or an error, and modes are in order.
    #[test]
    fn any_mechanism_gives_modes_or_an_error(
        segments in prop::collection::vec(
            (-5.0..0.0_f64, -5.0..-0.3_f64, 0.0..1.2_f64, 5.0..12.3_f64),
            1..4
        ),
        bearings in prop::collection::vec((0.0..1.0_f64, -1.0..10.0_f64, -1.0..10.0_f64), 0..3),
        plate in (-4.0..-0.3_f64, -4.0..-0.3_f64, -5.0..-1.0_f64, 0.01..1.0_f64, -0.1..0.1_f64),
    ) {
        let mut any = mechanism(1e-3);
        any.segments = segments
            .iter()
            .map(|&(length, diameter, bore, young)| Segment {
                part: Part::Rotor,
                length_m: 10_f64.powf(length),
                diameter_m: 10_f64.powf(diameter),
                bore_m: bore * 10_f64.powf(diameter),
                material: Material { young_pa: 10_f64.powf(young), ..STEEL },
            })
            .collect();
        let shaft_m = any.shaft_m();
        any.bearings = bearings
            .iter()
            .map(|&(place, radial, axial)| Bearing {
                position_m: place * shaft_m,
                radial_n_m: 10_f64.powf(radial),
                axial_n_m: 10_f64.powf(axial),
            })
            .collect();
        let (width, height, thickness, bond, offset_m) = plate;
        any.mirror.stations =
            ftheta_physics::mechanism::rectangle(10_f64.powf(width), 10_f64.powf(height));
        any.mirror.thickness_m = 10_f64.powf(thickness);
        any.mirror.bond_m = bond * 10_f64.powf(height);
        any.mirror.offset_m = offset_m;
        any.element_m = 0.5 * shaft_m.max(any.mirror.height_m()).max(any.mirror.width_m());
        if let Ok(modes) = Model::new(&any).and_then(|model| model.modes(6)) {
            prop_assert!(modes.shapes.iter().all(|shape| shape.frequency_hz.is_finite()));
            prop_assert!(modes.shapes.is_sorted_by_key(|shape| shape.frequency_hz));
            let _ = Spin::new(&modes).play(&[0.0, 1e-6], Driven::Torque(&[0.0, 1e-6]));
        }
    }
}
