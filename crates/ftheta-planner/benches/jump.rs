//! Jumps from the atlas and transitions from warm fans, with their samples written, and their
//! allocations.

#[path = "../tests/campaign/plant.rs"]
mod plant;

use divan::counter::ItemsCount;
use divan::{AllocProfiler, Bencher, black_box};
use ftheta_planner::jump::{
    Atlas, AtlasOptions, AxisOptions, CurrentBound, JumpError, Model, Route, Transitions,
};
use plant::{TICK_S, scanner};
use std::sync::LazyLock;

/// Shows allocations of every bench; jumps must have none.
#[global_allocator]
static ALLOCATIONS: AllocProfiler = AllocProfiler::system();

/// Steps in a row; each iteration does all of them.
const N_STEPS: u32 = 1000;
/// Longest step, rad: the mean jump then takes 47 samples on S10.
const STEP_MAX_RAD: f64 = 0.085;
/// Samples of the loop that only writes.
const N_SAMPLES: usize = 47;

static ATLAS: LazyLock<Result<Atlas, JumpError>> = LazyLock::new(|| {
    let range_rad = 25_f64.to_radians();
    Atlas::build(&scanner("S10"), AtlasOptions { axis: axis(), range_rad })
});
static TRANSITIONS: LazyLock<Result<Transitions, JumpError>> =
    LazyLock::new(|| Transitions::new(&scanner("S10"), axis()));

fn main() {
    if let Ok(atlas) = &*ATLAS {
        let ticks = steps_rad().filter_map(|step| atlas.jump(step)).map(|jump| jump.n_ticks);
        println!("mean jump: {:.1} samples", ticks.sum::<usize>() as f64 / f64::from(N_STEPS));
    }
    divan::main();
}

fn axis() -> AxisOptions {
    let (model, current_bound) = (Model::Flexible, CurrentBound::Always);
    AxisOptions { model, tick_s: TICK_S, voltage_reserve: 0.0, current_bound }
}

/// Numbers from 0 to 1 that look random.
fn units(salt: u32) -> impl Iterator<Item = f64> {
    (0..N_STEPS).map(move |i| {
        let mixed = (i ^ salt.rotate_left(16)).wrapping_mul(0x9E37_79B9);
        let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85EB_CA6B);
        f64::from(mixed ^ (mixed >> 13)) / f64::from(u32::MAX)
    })
}

fn steps_rad() -> impl Iterator<Item = f64> {
    units(1).zip(units(2)).map(|(size, sign)| STEP_MAX_RAD * size * (sign - 0.5).signum())
}

fn routes() -> Vec<Route> {
    let speeds = units(3).zip(units(4)).map(|pair| [pair.0, pair.1].map(|s| 300.0 * (s - 0.5)));
    let route = |(step, [from_rad_s, to_rad_s]): (f64, [f64; 2])| Route {
        from_rad: -0.5 * step,
        to_rad: 0.5 * step,
        from_rad_s,
        to_rad_s,
    };
    steps_rad().zip(speeds).map(route).collect()
}

/// The jump alone: which sequence, which factor.
#[divan::bench]
fn jump_look_up(bencher: Bencher<'_, '_>) {
    let Ok(atlas) = &*ATLAS else { return };
    let steps: Vec<f64> = steps_rad().collect();
    bencher.counter(ItemsCount::new(steps.len())).bench_local(|| {
        for &step in &steps {
            black_box(atlas.jump(black_box(step)));
        }
    });
}

/// The jump and its voltages, written.
#[divan::bench]
fn jump_written(bencher: Bencher<'_, '_>) {
    let Ok(atlas) = &*ATLAS else { return };
    let steps: Vec<f64> = steps_rad().collect();
    let mut samples_v = vec![0.0; 512];
    bencher.counter(ItemsCount::new(steps.len())).bench_local(|| {
        for &step in &steps {
            if let Some(jump) = atlas.jump(black_box(step)) {
                jump.write(black_box(&mut samples_v));
            }
        }
    });
}

/// The yardstick: as many samples, only written.
#[divan::bench]
fn write_only(bencher: Bencher<'_, '_>) {
    let mut samples_v = vec![0.0; N_SAMPLES];
    bencher.counter(ItemsCount::new(N_STEPS)).bench_local(|| {
        for index in 0..N_STEPS {
            let value = black_box(f64::from(index));
            black_box(&mut samples_v).fill(value);
        }
    });
}

/// A transition between moving ends and its voltages, written; the fans are solved.
#[divan::bench]
fn transition_written(bencher: Bencher<'_, '_>) {
    let Ok(transitions) = &*TRANSITIONS else { return };
    let routes = routes();
    let mut samples_v = vec![0.0; 1024];
    let mut all = move || {
        for route in &routes {
            if let Ok(Some(transition)) = transitions.plan(black_box(route)) {
                let samples = black_box(&mut samples_v).iter_mut();
                samples.zip(transition.voltages_v()).for_each(|(sample, v)| *sample = v);
            }
        }
    };
    all();
    bencher.counter(ItemsCount::new(N_STEPS)).bench_local(all);
}
