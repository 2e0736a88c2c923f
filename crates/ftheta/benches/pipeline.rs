//! Samples per second of every stage behind the toolpath, on one job: `gallery/panel.svg`.
//!
//! Compare rows of one run: `write_only` is a loop that only stores samples, `exact_inverse` the
//! optics alone. Real time at 10 µs is 0.1 million samples a second.

#![allow(clippy::unwrap_used, reason = "a bench may stop at once")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use ftheta::formats::machine::preset;
use ftheta::formats::svg::SvgOptions;
use ftheta::import;
use ftheta::model::block::{Block, SampleSink};
use ftheta::model::machine::Machine;
use ftheta::model::space::{DacCodes, FieldPoint};
use ftheta::model::toolpath::Toolpath;
use ftheta::model::trace::Trace;
use ftheta::physics::optics::angles_from_field;
use ftheta::physics::plan::Plan;
use ftheta::planner::classic::{Settings, draft, plan};
use ftheta::planner::render::Renderer;
use ftheta::report::score::Scorer;
use ftheta::toolpath::lay::{LayOptions, lay};
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::twin::{Twin, TwinOptions};
use std::path::Path;

fn main() {
    divan::main();
}

/// The panel's toolpath with its machine and settings.
fn panel_toolpath() -> (Toolpath, Machine, Settings) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../gallery/panel.svg");
    let (recipe, _) = import::recipe_for(&path, None).unwrap();
    let job = import::drawing(&path, &recipe, &SvgOptions::default()).unwrap().value;
    let machine = preset("S10").unwrap().unwrap();
    let toolpath = lay(&job, &LayOptions::default()).unwrap().value;
    let settings = Settings::new(&machine, &recipe.classic).unwrap();
    (toolpath, machine, settings)
}

fn panel() -> Plan {
    let (toolpath, machine, settings) = panel_toolpath();
    plan(toolpath, &machine, &settings, 0.01).unwrap()
}

fn blocks(plan: &Plan) -> Vec<Block> {
    let mut renderer = Renderer::new(plan);
    let mut all = Vec::new();
    let mut block = Block::default();
    while renderer.next_block(&mut block) {
        all.push(block.clone());
    }
    all
}

#[divan::bench]
fn render(bencher: Bencher) {
    let plan = panel();
    let renderer = Renderer::new(&plan);
    let mut block = Block::default();
    bencher.counter(ItemsCount::new(plan.n_samples())).bench_local(|| {
        let mut renderer = renderer.clone();
        while renderer.next_block(&mut block) {
            black_box(&block);
        }
    });
}

/// The classic planner without the audit.
#[divan::bench]
fn plan_classic(bencher: Bencher) {
    let (toolpath, machine, settings) = panel_toolpath();
    let n_samples = draft(toolpath.clone(), &machine, &settings, 0.01).unwrap().n_samples();
    bencher
        .counter(ItemsCount::new(n_samples))
        .with_inputs(|| toolpath.clone())
        .bench_local_values(|toolpath| draft(toolpath, &machine, &settings, 0.01).unwrap());
}

#[divan::bench]
fn write_only(bencher: Bencher) {
    let n_samples = panel().n_samples();
    let mut words = vec![DacCodes::default(); 4096];
    bencher.counter(ItemsCount::new(n_samples)).bench_local(|| {
        for index in 0..n_samples as usize {
            words[index & 4095] = black_box(DacCodes { x: index as i32, y: -(index as i32) });
        }
    });
}

#[divan::bench]
fn exact_inverse(bencher: Bencher) {
    let machine = preset("S10").unwrap().unwrap();
    let n_samples = 100_000_u32;
    bencher.counter(ItemsCount::new(n_samples)).bench_local(|| {
        for index in 0..n_samples {
            let along = f64::from(index) * 1e-3;
            let place = FieldPoint::new(along - 50.0, 20.0 - 0.5 * along);
            black_box(angles_from_field(&machine.optics, place));
        }
    });
}

#[divan::bench]
fn audit(bencher: Bencher) {
    let plan = panel();
    bencher
        .counter(ItemsCount::new(plan.n_samples()))
        .bench_local(|| ftheta::physics::audit::audit(&plan).unwrap());
}

fn twin(plan: &Plan) -> Twin {
    let options =
        TwinOptions { mismatch: Mismatch::default(), seed: 1, pixel_mm: 0.016, state_stride: 6 };
    Twin::new(&plan.machine, &options).unwrap()
}

#[divan::bench]
fn twin_play(bencher: Bencher) {
    let plan = panel();
    let blocks = blocks(&plan);
    bencher
        .counter(ItemsCount::new(plan.n_samples()))
        .with_inputs(|| twin(&plan))
        .bench_local_values(|mut twin| {
            for stretch in blocks.chunks(32) {
                stretch.iter().for_each(|block| twin.push(block).unwrap());
                black_box(twin.take_trace());
            }
            twin
        });
}

#[divan::bench]
fn score(bencher: Bencher) {
    let plan = panel();
    let mut twin = twin(&plan);
    let traces: Vec<Trace> = blocks(&plan)
        .chunks(32)
        .map(|stretch| {
            stretch.iter().for_each(|block| twin.push(block).unwrap());
            twin.take_trace()
        })
        .collect();
    bencher.counter(ItemsCount::new(plan.n_samples())).bench_local(|| {
        let mut scorer = Scorer::new(&plan);
        traces.iter().for_each(|trace| scorer.add(trace));
        scorer.finish()
    });
}
