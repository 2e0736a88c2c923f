//! The optimal planner against the time of the motion that it plans, with everything solved, and
//! what follows it.
//!
//! Run with `cargo bench -p ftheta --bench planning`. The head of the output gives the duration of
//! each motion; a job is planned so many times faster than real time as its duration is longer
//! than its row.
//!
//! | row | wanted, one core |
//! |---|---|
//! | `text_job` | duration / 100 |
//! | `dense_curve` | duration / 50 |
//! | `segments_of_5_um` | the same time for each item |
//! | `render_tracks` | 20 million items a second |

#![allow(clippy::unwrap_used, reason = "a bench may stop at once")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use ftheta::formats::machine::preset;
use ftheta::formats::svg::{self, SvgOptions};
use ftheta::model::block::Block;
use ftheta::model::machine::Machine;
use ftheta::model::recipe::{Pen, Recipe};
use ftheta::model::toolpath::{Mark, Toolpath};
use ftheta::physics::audit::audit;
use ftheta::physics::correction::{About, CorrectionTable};
use ftheta::physics::grid_map::{GridMap, Interpolation};
use ftheta::physics::plan::Plan;
use ftheta::physics::servo::Gains;
use ftheta::planner::corner::Corners;
use ftheta::planner::jump::{Atlas, AxisOptions, CurrentBound, Model, Transitions};
use ftheta::planner::optimal::{
    Corner, Motions, OptimalOptions, OptimalPlanner, RESTRAINTS, longest_step_rad, near_scanner,
};
use ftheta::planner::render::Renderer;
use ftheta::toolpath::lay::{LayOptions, Order, lay};
use kurbo::{BezPath, Point};
use std::f64::consts::TAU;
use std::sync::LazyLock;

const TOLERANCE_MM: f64 = 0.01;
const RESERVE: f64 = 0.12;
const SPEED_MM_S: f64 = 2000.0;

fn main() {
    for (name, toolpath) in [("text_job", text_job()), ("dense_curve", dense_curve())] {
        let draft = prepared().draft(toolpath).unwrap();
        let duration_s = draft.n_samples() as f64 * draft.machine.output.period_s();
        println!("{name}: {:.3} ms of motion", 1e3 * duration_s);
    }
    divan::main();
}

struct Solver {
    machine: Machine,
    transitions: Transitions,
    near: Transitions,
    corners: Corners,
}

/// An S10 whose programs are solved where they are needed.
static SOLVER: LazyLock<Solver> = LazyLock::new(|| {
    let machine = preset("S10-f160").unwrap().unwrap();
    let axis = AxisOptions {
        model: Model::Held { epsilon_rad: 0.75 * TOLERANCE_MM / 320.0 },
        tick_s: machine.output.period_s(),
        voltage_reserve: RESERVE,
        current_bound: CurrentBound::Always,
    };
    let mut atlas = Atlas::restore(&machine.scanner, axis, Default::default()).unwrap();
    let jobs = [text_job(), dense_curve(), spiral(10, 0.005)];
    let longest_rad = jobs.iter().map(|job| longest_step_rad(job, &machine)).fold(0.0, f64::max);
    atlas.extend(0, longest_rad).unwrap();
    let gains = Gains::design(&machine.scanner, axis.tick_s).unwrap();
    let corners = Corners::new(&machine.scanner, axis, Some(&gains)).unwrap();
    let transitions = Transitions::with_atlas(atlas).unwrap();
    let near = transitions.less_certain(&near_scanner(&machine.scanner)).unwrap();
    Solver { transitions, near, corners, machine }
});

fn prepared() -> OptimalPlanner<'static> {
    let Solver { machine, transitions, near, corners } = &*SOLVER;
    let options = OptimalOptions {
        care: 1.0,
        tolerance_mm: TOLERANCE_MM,
        corner: Corner::Auto,
        voltage_reserve: RESERVE,
        restraint: RESTRAINTS[0],
    };
    OptimalPlanner::new(machine, Motions::Known { transitions, near, corners }, options).unwrap()
}

fn toolpath(drawing: &[u8]) -> Toolpath {
    let job = svg::read(drawing, &Recipe::default(), &SvgOptions::default()).unwrap().value;
    let options = LayOptions { order: Order::Keep, ..LayOptions::default() };
    let mut toolpath = lay(&job, &options).unwrap().value;
    toolpath.pens.iter_mut().for_each(|pen| pen.mark_speed_mm_s = SPEED_MM_S);
    toolpath
}

/// Thirteen capitals in straight strokes.
fn text_job() -> Toolpath {
    toolpath(include_bytes!("text_job.svg"))
}

/// A rosette of 5 µm chords, 90 mm long, whose bends slow the beam down.
fn dense_curve() -> Toolpath {
    let at = |turn: f64| {
        let radius_mm = 4.0 + 0.8 * (9.0 * turn).cos();
        Point::new(radius_mm * turn.cos(), radius_mm * turn.sin())
    };
    polyline((0..=8000).map(|index| at(TAU * f64::from(index) / 8000.0)))
}

/// Chords along circles whose radius grows.
fn spiral(n_segments: u32, chord_mm: f64) -> Toolpath {
    let mut turn = 0.0;
    let points = (0..=n_segments).map(|_| {
        let radius_mm = 20.0 + turn / TAU;
        turn += chord_mm / radius_mm;
        Point::new(radius_mm * f64::cos(turn), radius_mm * f64::sin(turn))
    });
    polyline(points)
}

fn polyline(points: impl Iterator<Item = Point>) -> Toolpath {
    let points: Vec<Point> = points.collect();
    let mut curve = BezPath::new();
    curve.move_to(points[0]);
    points[1..].iter().for_each(|&point| curve.line_to(point));
    let pen = Pen { mark_speed_mm_s: SPEED_MM_S, ..text_job().pens[0].clone() };
    let mark = Mark { points, curve, closed: false, pen_index: 0, source: "curve".into() };
    Toolpath { pens: vec![pen], marks: vec![mark] }
}

fn plan(bencher: Bencher, toolpath: Toolpath, n_items: usize) {
    let planner = prepared();
    let draft = |toolpath: Toolpath| planner.draft(toolpath).unwrap();
    // Once, so that every program is solved.
    draft(toolpath.clone());
    bencher
        .counter(ItemsCount::new(n_items))
        .with_inputs(|| toolpath.clone())
        .bench_local_values(draft);
}

#[divan::bench]
fn text_job_planned(bencher: Bencher) {
    let toolpath = text_job();
    let n_marks = toolpath.marks.len();
    plan(bencher, toolpath, n_marks);
}

#[divan::bench]
fn dense_curve_planned(bencher: Bencher) {
    plan(bencher, dense_curve(), 8000);
}

#[divan::bench(args = [1_000, 10_000, 100_000, 1_000_000])]
fn segments_of_5_um(bencher: Bencher, n_segments: u32) {
    plan(bencher, spiral(n_segments, 0.005), n_segments as usize);
}

/// What is prepared once for all jobs.
#[divan::bench]
fn preparation(bencher: Bencher) {
    bencher.bench_local(prepared);
}

/// 200 mm of track.
fn tracks(chord_um: u32) -> Plan {
    let spiral = spiral(200_000 / chord_um, 1e-3 * f64::from(chord_um));
    Plan::new(prepared().draft(spiral).unwrap()).unwrap()
}

#[divan::bench(args = [5, 50])]
fn render_tracks(bencher: Bencher, chord_um: u32) {
    let plan = tracks(chord_um);
    render(bencher, &plan, &Renderer::new(&plan));
}

/// The same through a correction table.
#[divan::bench(args = [50])]
fn render_tracks_corrected(bencher: Bencher, chord_um: u32) {
    let plan = tracks(chord_um);
    let half_rad = plan.machine.scanner.angle_max_rad;
    let bent = |x: f64, y: f64| Some([1.002 * x + 0.01 * x * y, 0.999 * y - 0.01 * x * x + 1e-4]);
    let angles = GridMap::tabled(half_rad, Interpolation::CatmullRom, 65, bent).unwrap();
    let table = CorrectionTable::flat(About::default(), angles).unwrap();
    render(bencher, &plan, &Renderer::new(&plan).correct_by(&table));
}

fn render(bencher: Bencher, plan: &Plan, renderer: &Renderer<'_>) {
    let mut block = Block::default();
    bencher.counter(ItemsCount::new(plan.n_samples())).bench_local(|| {
        let mut renderer = renderer.clone();
        while renderer.next_block(&mut block) {
            black_box(&block);
        }
    });
}

#[divan::bench(args = [50])]
fn audit_tracks(bencher: Bencher, chord_um: u32) {
    let plan = tracks(chord_um);
    bencher.counter(ItemsCount::new(plan.n_samples())).bench_local(|| audit(&plan).unwrap());
}
