//! The twin at its boundary: what it refuses, when light comes, where the beam is.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine::preset;
use ftheta::model::block::{Block, LaserEdge, SampleSink};
use ftheta::model::machine::{Losses, Machine, Sensor};
use ftheta::model::space::{DacCodes, FieldPoint, MirrorAngles};
use ftheta::model::trace::Trace;
use ftheta::physics::axis_loop::AxisLoop;
use ftheta::physics::galvo::Galvo;
use ftheta::physics::optics::field_from_angles;
use ftheta::physics::servo::Gains;
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::twin::{Twin, TwinError, TwinOptions};

fn machine() -> Machine {
    preset("S10").unwrap().unwrap()
}

fn twin(machine: &Machine, mismatch: Mismatch) -> Twin {
    let options = TwinOptions { mismatch, seed: 1, pixel_mm: 0.01, state_stride: 1 };
    Twin::new(machine, &options).unwrap()
}

/// A step of both axes, long enough to settle.
fn step_block(n_samples: usize, word: i32) -> Block {
    let words = vec![DacCodes { x: word, y: -word / 2 }; n_samples];
    Block { words, ..Block::default() }
}

#[test]
fn blocks_must_follow_on() {
    let mut twin = twin(&machine(), Mismatch::default());
    twin.push(&step_block(10, 0)).unwrap();
    let error = twin.push(&step_block(10, 0)).unwrap_err();
    assert_eq!(error, TwinError::Gap { found: 0, expected: 10 });
}

#[test]
fn light_follows_its_edges_by_the_latency() {
    let machine = machine();
    let mut twin = twin(&machine, Mismatch::default());
    let mut block = step_block(100, 0);
    block.edges = [(100_003, 8.0), (400_001, 0.0), (600_000, 5.0), (990_000, 0.0)]
        .map(|(time_ns, power_w)| LaserEdge { time_ns, power_w })
        .into();
    twin.push(&block).unwrap();
    let first: Trace = twin.take_trace();
    twin.push(&Block { first_index: 100, ..step_block(100, 0) }).unwrap();
    let second = twin.take_trace();
    let light = |trace: &Trace| -> Vec<_> {
        trace.light.iter().map(|l| (l.index, l.on_ns, l.off_ns, l.power_w)).collect()
    };
    // On 20 µs late, off 15 µs late; the second interval is cut where the stretches meet.
    assert_eq!(light(&first), [(0, 120_003, 415_001, 8.0), (1, 620_000, 1_000_000, 5.0)]);
    assert_eq!(light(&second), [(1, 1_000_000, 1_005_000, 5.0)]);
    let energy_j = 8.0 * 294_998e-9 + 5.0 * 385_000e-9;
    let found_j = twin.into_dose().total_j();
    assert!((found_j / energy_j - 1.0).abs() < 1e-5, "{found_j} J, {energy_j} J");
}

/// The servo believes its sensor: with a gain error the beam settles short by just that much, and
/// drift moves it away from where it was.
#[test]
fn sensor_errors_move_the_beam() {
    let place = |sensor: Sensor| -> FieldPoint {
        let mut machine = machine();
        machine.scanner.sensor = sensor;
        let mut twin = twin(&machine, Mismatch::default());
        twin.push(&step_block(1000, 20_000)).unwrap();
        twin.take_trace().points.last().copied().unwrap().into()
    };
    let true_place = place(Sensor::default());
    let gain = place(Sensor { gain_error: 0.01, ..Sensor::default() });
    assert!((gain.x_mm / true_place.x_mm - 1.0 / 1.01).abs() < 1e-4);
    let drift = place(Sensor { drift_rad_s: 0.1, ..Sensor::default() });
    // 10 ms of 0.1 rad/s at 326 mm/rad.
    assert!((drift.x_mm - true_place.x_mm + 0.326).abs() < 0.02, "{drift:?}");
}

/// The trace against the axes stepped at 1 µs by another discretisation of the same plant.
#[test]
fn beam_is_where_a_finer_simulation_puts_it() {
    let machine = machine();
    let mismatch = Mismatch { f1: 0.03, kt: -0.02, zeta: Some(0.0025), ..Mismatch::default() };
    let mut twin = twin(&machine, mismatch);
    let word = 20_000;
    twin.push(&step_block(120, word)).unwrap();
    let trace = twin.take_trace();
    let plant = mismatch.apply(&Galvo::new(&machine.scanner));
    let gains = Gains::design(&machine.scanner, 1e-5).unwrap();
    let fine = plant.step(1e-6);
    let step_rad = machine.output.word_step_rad();
    let mut axes = [AxisLoop::new(&plant, gains, &machine.scanner, 1e-5), {
        AxisLoop::new(&plant, gains, &machine.scanner, 1e-5)
    }];
    let mut worst_um = 0.0_f64;
    for tick in 0..120_usize {
        let mut states = [*axes[0].state(), *axes[1].state()];
        let volts = [
            axes[0].tick(f64::from(word) * step_rad, 0.0),
            axes[1].tick(f64::from(-word / 2) * step_rad, 0.0),
        ];
        for micro in 1..=10_usize {
            for axis in 0..2 {
                states[axis] = fine.a * states[axis] + fine.b * volts[axis];
            }
            if micro % 2 == 0 {
                let angle = states.map(|state| plant.mirror_row().dot(&state));
                let exact =
                    field_from_angles(&machine.optics, MirrorAngles::new(angle[0], angle[1]));
                let found: FieldPoint = trace.points[5 * tick + micro / 2].into();
                let off = (found.x_mm - exact.x_mm).hypot(found.y_mm - exact.y_mm);
                worst_um = worst_um.max(off * 1e3);
            }
        }
    }
    assert!(worst_um < 0.02, "{worst_um} µm");
}

/// Falling torque and friction move the trace as they move the axis, at every tick's end.
#[test]
fn losses_act_on_the_beam() {
    let mut machine = machine();
    let word = 200_000;
    let play = |machine: &Machine| {
        let mut twin = twin(machine, Mismatch::default());
        twin.push(&step_block(120, word)).unwrap();
        twin.take_trace().points
    };
    let linear = play(&machine);
    machine.scanner.losses = Losses {
        torque_falloff: 0.06,
        friction_coulomb_n_m: 2e-4,
        friction_viscous_n_m_s_rad: 2e-7,
    };
    let points = play(&machine);
    let plant = Galvo::new(&machine.scanner);
    let gains = Gains::design(&machine.scanner, 1e-5).unwrap();
    let mut axes = [(); 2].map(|()| AxisLoop::new(&plant, gains, &machine.scanner, 1e-5));
    let step_rad = machine.output.word_step_rad();
    let mut apart_um = 0.0;
    for tick in 1..=120 {
        axes[0].tick(f64::from(word) * step_rad, 0.0);
        axes[1].tick(f64::from(-word / 2) * step_rad, 0.0);
        let angle = [0, 1].map(|axis| plant.mirror_row().dot(axes[axis].state()));
        let exact = field_from_angles(&machine.optics, MirrorAngles::new(angle[0], angle[1]));
        let place = FieldPoint::from(points[5 * tick]);
        let off_um = 1e3 * (place.x_mm - exact.x_mm).hypot(place.y_mm - exact.y_mm);
        assert!(off_um < 0.02, "tick {tick}: {off_um} µm");
        if tick == 40 {
            let without = FieldPoint::from(linear[5 * tick]);
            apart_um = 1e3 * (place.x_mm - without.x_mm).hypot(place.y_mm - without.y_mm);
        }
    }
    assert!(apart_um > 10.0, "{apart_um} µm");
}
