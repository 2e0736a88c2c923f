//! Envelopes from the model, from a record and in real time agree.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_physics::envelope::{EnvelopeError, Tracker, analyse, mode_rad};
use ftheta_physics::galvo::{Galvo, State};
use proptest::prelude::*;

const PERIOD_S: f64 = 2e-6;
const N_SAMPLES: usize = 8192;

const PLANT: Galvo = Galvo {
    rotor_inertia: 1.25e-8,
    mirror_inertia: 3e-8,
    torque_constant: 0.00617,
    resistance: 2.79,
    inductance: 180e-6,
    omega: 32_672.563_597_333_847,
    damping_ratio: 0.01,
};

/// Noise that is the same every time: the sum of twelve uniform numbers is all but Gaussian.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
}

/// The mirror's distance and the model's envelope over time, driven by no current.
fn free(plant: &Galvo, amplitude_rad: f64) -> Vec<(f64, f64)> {
    // Without current nothing acts on the coil: an open circuit.
    let open = Galvo { torque_constant: 1e-12, ..*plant };
    let step = open.step(PERIOD_S);
    let twist = amplitude_rad * plant.inertia() / plant.rotor_inertia;
    let mut state = State::new(0.0, 0.0, twist * 0.6, twist * 0.8 * plant.omega, 0.0);
    let sample = |_| {
        let now = (plant.mirror_row().dot(&state), mode_rad(plant, &state));
        state = step.a * state;
        now
    };
    (0..N_SAMPLES).map(sample).collect()
}

/// A second mode, half as high, an octave below.
fn second() -> Galvo {
    Galvo { omega: 0.47 * PLANT.omega, damping_ratio: 0.02, ..PLANT }
}

/// Record and model's envelope of both modes.
fn two_modes(noise_rad: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut noise = Noise(seed);
    let pairs = free(&PLANT, 2e-4).into_iter().zip(free(&second(), 1e-4));
    pairs.map(|(a, b)| (a.0 + b.0 + noise_rad * noise.next(), a.1 + b.1)).unzip()
}

fn settled(envelope: &[f64], tolerance_rad: f64) -> f64 {
    envelope.iter().rposition(|value| *value > tolerance_rad).map_or(0, |last| last + 1) as f64
        * PERIOD_S
}

#[test]
fn record_and_model_agree_with_noise_and_two_modes() {
    for seed in 1..=8 {
        let (record, envelope) = two_modes(4e-6, seed);
        let found = analyse(&record, PERIOD_S).unwrap();
        assert_eq!(found.modes.len(), 2, "{found:?}");
        for (mode, plant, amplitude_rad) in
            [(found.modes[0], PLANT, 2e-4), (found.modes[1], second(), 1e-4)]
        {
            assert!((mode.omega_rad_s / plant.omega - 1.0).abs() < 1e-3, "{found:?}");
            let decay = mode.decay_per_s / (plant.omega * plant.damping_ratio);
            assert!((decay - 1.0).abs() < 0.05, "{found:?}");
            assert!((mode.amplitude_rad / amplitude_rad - 1.0).abs() < 0.03, "{found:?}");
        }
        assert!((found.noise_rad / 4e-6 - 1.0).abs() < 0.05, "{found:?}");
        for tolerance_rad in [1.5e-4, 7e-5, 3.5e-5, 1.5e-5] {
            let ratio = found.settle_s(tolerance_rad).unwrap() / settled(&envelope, tolerance_rad);
            assert!((ratio - 1.0).abs() < 0.03, "{seed} {tolerance_rad}: {ratio}");
        }
    }
}

#[test]
fn the_tracker_follows_the_model() {
    let (record, envelope) = two_modes(1e-6, 1);
    let modes = [PLANT, second()].map(|plant| (plant.omega, plant.damping_ratio * plant.omega));
    let mut tracker = Tracker::new(&modes, 1500.0, PERIOD_S);
    let tracked: Vec<f64> = record.iter().map(|sample| tracker.push(*sample)).collect();
    // From three time constants on.
    for index in 1200..4000 {
        let ratio = tracked[index] / envelope[index];
        assert!((ratio - 1.0).abs() < 0.06, "{index}: {ratio}");
    }
    let ratio = settled(&tracked, 3.5e-5) / settled(&envelope, 3.5e-5);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

#[test]
fn noise_alone_has_no_modes() {
    let mut noise = Noise(7);
    let record: Vec<f64> = (0..4096).map(|_| 3e-5 + 1e-6 * noise.next()).collect();
    let found = analyse(&record, PERIOD_S).unwrap();
    assert!(found.modes.is_empty(), "{found:?}");
    assert!((found.offset_rad / 3e-5 - 1.0).abs() < 0.01);
    assert_eq!(found.settle_s(2e-5), None);
    assert_eq!(found.settle_s(4e-5), Some(0.0));
}

#[test]
fn records_that_cannot_be_read_are_refused() {
    let parameter = |result| matches!(result, Err(EnvelopeError::Parameter { .. }));
    assert!(parameter(analyse(&[0.0; 100], PERIOD_S)));
    assert!(parameter(analyse(&[0.0; 1000], 0.0)));
    let mut record = vec![0.0; 1000];
    record[7] = f64::NAN;
    assert!(matches!(analyse(&record, PERIOD_S), Err(EnvelopeError::NotFinite { index: 7, .. })));
    assert!(analyse(&[0.0; 1000], PERIOD_S).unwrap().modes.is_empty());
}

proptest! {
    #[test]
    fn any_single_mode_is_found(
        log_omega in 8.5..12.0_f64,
        damping_ratio in 0.002..0.03_f64,
        phase in 0.0..std::f64::consts::TAU,
    ) {
        let omega = log_omega.exp();
        let decay = damping_ratio * omega;
        let at = |index: usize| {
            let time_s = index as f64 * PERIOD_S;
            1e-4 * (-decay * time_s).exp() * (omega * time_s + phase).cos()
        };
        let record: Vec<f64> = (0..N_SAMPLES).map(at).collect();
        let found = analyse(&record, PERIOD_S).unwrap();
        prop_assert!((found.modes[0].omega_rad_s / omega - 1.0).abs() < 2e-3, "{:?}", found);
        prop_assert!((found.modes[0].decay_per_s / decay - 1.0).abs() < 0.1, "{:?}", found);
        prop_assert!((found.modes[0].amplitude_rad / 1e-4 - 1.0).abs() < 0.05, "{:?}", found);
    }

    #[test]
    fn no_record_panics(record in prop::collection::vec(prop::num::f64::ANY, 0..300)) {
        let _ = analyse(&record, PERIOD_S);
        let tame: Vec<f64> = record.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
        let _ = analyse(&tame, PERIOD_S);
    }
}
