//! Look-ups in correction tables beside what memory alone would allow.
//!
//! Points per second on one core: a million places over the whole table in a scattered order, as
//! marks are not, and along lines, as marks are.
#![allow(clippy::unwrap_used, reason = "a bench may stop at once")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use ftheta_model::machine::{Axis, Lens, Optics};
use ftheta_model::space::FieldPoint;
use ftheta_physics::grid_map::{GridMap, Interpolation};
use ftheta_physics::optics::angles_from_field;

const N_PLACES: usize = 1_000_000;

fn main() {
    divan::main();
}

fn map(interpolation: Interpolation, n_nodes: usize) -> GridMap {
    let coefficients_mm = vec![420.456, -6.051, 37.397, -55.24];
    let lens = Lens::FTheta { coefficients_mm };
    let optics = Optics::new(lens, Axis::X, 336.0);
    let command = |x_mm, y_mm| {
        let angles = angles_from_field(&optics, FieldPoint::new(x_mm, y_mm))?;
        Some([angles.x_rad, angles.y_rad])
    };
    GridMap::tabled(150.0, interpolation, n_nodes, command).unwrap()
}

/// Places over ±140 mm: scattered by two irrational steps, or along lines 0.1 mm apart.
fn places(scattered: bool) -> Vec<[f64; 2]> {
    let at = |share: f64| 280.0 * share.fract() - 140.0;
    (0..N_PLACES)
        .map(|k| match scattered {
            true => [at(k as f64 * 0.754_877_666), at(k as f64 * 0.569_840_291)],
            false => [at(k as f64 / 2800.0), at((k / 2800) as f64 / 2800.0)],
        })
        .collect()
}

fn look_up(
    bencher: Bencher<'_, '_>,
    interpolation: Interpolation,
    n_nodes: usize,
    scattered: bool,
) {
    let (map, places) = (map(interpolation, n_nodes), places(scattered));
    let mut values = vec![[0.0; 2]; N_PLACES];
    bencher
        .counter(ItemsCount::new(N_PLACES))
        .bench_local(|| map.map(black_box(&places), black_box(&mut values)));
}

#[divan::bench(args = [(65, true), (65, false), (129, true)])]
fn bilinear(bencher: Bencher<'_, '_>, (n_nodes, scattered): (usize, bool)) {
    look_up(bencher, Interpolation::Bilinear, n_nodes, scattered);
}

#[divan::bench(args = [(65, true), (65, false), (129, true)])]
fn catmull_rom(bencher: Bencher<'_, '_>, (n_nodes, scattered): (usize, bool)) {
    look_up(bencher, Interpolation::CatmullRom, n_nodes, scattered);
}

/// Places read and values written, nothing computed: what memory allows.
#[divan::bench]
fn copy(bencher: Bencher<'_, '_>) {
    let places = places(true);
    let mut values = vec![[0.0; 2]; N_PLACES];
    bencher
        .counter(ItemsCount::new(N_PLACES))
        .bench_local(|| black_box(&mut values).copy_from_slice(black_box(&places)));
}
