//! The envelope in real time: nanoseconds per sample, to be divided by the number of modes.

use divan::Bencher;
use divan::counter::ItemsCount;
use ftheta_physics::envelope::{Tracker, analyse};

const PERIOD_S: f64 = 2e-6;

fn main() {
    divan::main();
}

fn record(n: u32) -> Vec<f64> {
    let at = |i: u32| {
        let time_s = f64::from(i) * PERIOD_S;
        1e-4 * (-330.0 * time_s).exp() * (32_672.0 * time_s).cos()
            + 3e-5 * (-200.0 * time_s).exp() * (14_000.0 * time_s).sin()
    };
    (0..n).map(at).collect()
}

/// Items are samples times modes.
#[divan::bench(args = [1, 2, 4, 8])]
fn push(bencher: Bencher, n_modes: u32) {
    let modes: Vec<(f64, f64)> = (1..=n_modes).map(|i| (9e3 * f64::from(i), 300.0)).collect();
    let samples = record(10_000);
    bencher.counter(ItemsCount::new(10_000_u32 * n_modes)).bench_local(|| {
        let mut tracker = Tracker::new(&modes, 1e3, PERIOD_S);
        samples.iter().map(|sample| tracker.push(*sample)).sum::<f64>()
    });
}

#[divan::bench]
fn analyse_10_000_samples(bencher: Bencher) {
    let samples = record(10_000);
    bencher.bench_local(|| analyse(&samples, PERIOD_S));
}
