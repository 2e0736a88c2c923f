//! Scoring 5 million points (10 s of beam): wavy curves, hatch lines, and laps of one circle.

use divan::Bencher;
use divan::counter::ItemsCount;
#[path = "../tests/machine/mod.rs"]
mod machine;

use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::recipe::Pen;
use ftheta_model::space::FieldPoint;
use ftheta_model::trace::{Light, Trace, TracePoint};
use ftheta_report::score::score;
use kurbo::{BezPath, ParamCurve, Point};

const N_POINTS: u64 = 5_000_000;
const STEP_NS: u64 = 2000;

fn main() {
    divan::main();
}

/// Marks one after the other at 1 m/s, each lit from end to end with an error of some µm.
fn scene(curves: &[BezPath]) -> (PlanDraft, Trace) {
    let mut trace = Trace { step_ns: STEP_NS, ..Trace::default() };
    let mut marks = Vec::new();
    'marks: for index in 0.. {
        let curve = &curves[index % curves.len()];
        let on_ns = trace.points.len() as u64 * STEP_NS;
        for segment in curve.segments() {
            let length_mm = segment.start().distance(segment.end()).max(0.01) * 1.05;
            let n = (length_mm / 0.002) as usize;
            for i in 0..n {
                let wobble = 0.003 * (0.01 * trace.points.len() as f64).sin();
                let place = segment.eval(i as f64 / n as f64) + kurbo::Vec2::new(wobble, wobble);
                trace.points.push(TracePoint::from(FieldPoint::from(place)));
            }
            if trace.points.len() as u64 > N_POINTS {
                break 'marks;
            }
        }
        trace.light.push(Light {
            index,
            on_ns,
            off_ns: (trace.points.len() as u64 - 1) * STEP_NS,
            power_w: 10.0,
        });
        marks.push(PlannedMark {
            curve: curve.clone(),
            pen_index: 0,
            source: String::new(),
            on_ns: 0,
            off_ns: 0,
            power_w: 10.0,
            steps: Vec::new(),
        });
    }
    let plan = PlanDraft {
        machine: machine::machine(),
        planner: Planner::Classic,
        tolerance_mm: 0.01,
        pens: vec![Pen::default()],
        marks,
        vertices: Vec::new(),
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments: Vec::new(),
    };
    (plan, trace)
}

/// Waves of `length_mm` each, 20 to a mark.
fn waves(length_mm: f64) -> BezPath {
    let mut path = BezPath::new();
    path.move_to((0.0, 0.0));
    for i in 0..20 {
        let x = f64::from(i) * length_mm;
        let up = if i % 2 == 0 { length_mm } else { -length_mm };
        path.curve_to(
            Point::new(x + 0.3 * length_mm, up),
            Point::new(x + 0.7 * length_mm, up),
            Point::new(x + length_mm, 0.0),
        );
    }
    path
}

#[divan::bench(args = [0.3, 3.0], sample_count = 3)]
fn curves_5_million_points(bencher: Bencher<'_, '_>, length_mm: f64) {
    let (plan, trace) = scene(&[waves(length_mm)]);
    bencher.bench(|| score(&plan, &trace));
}

#[divan::bench(sample_count = 3)]
fn hatch_5_million_points(bencher: Bencher<'_, '_>) {
    let line = |y: f64| {
        BezPath::from_vec(vec![
            kurbo::PathEl::MoveTo((0.0, y).into()),
            kurbo::PathEl::LineTo((5.0, y).into()),
        ])
    };
    let lines: Vec<BezPath> = (0..100).map(|i| line(f64::from(i) * 0.05)).collect();
    let (plan, trace) = scene(&lines);
    bencher.bench(|| score(&plan, &trace));
}

/// As long for each point as other curves, however many laps there are.
#[divan::bench(args = [60, 600], sample_count = 1)]
fn laps_of_a_circle(bencher: Bencher<'_, '_>, n_laps: usize) {
    let lap = "a0.3 0.3 0 0 1 -0.6 0 a0.3 0.3 0 0 1 0.6 0 ";
    let curve = BezPath::from_svg(&format!("M10 10 {}", lap.repeat(n_laps)));
    let (mut plan, mut trace) = scene(&[curve.unwrap_or_default()]);
    plan.marks.truncate(1);
    trace.light.truncate(1);
    let n_points = (trace.light[0].off_ns / STEP_NS) as usize;
    trace.points.truncate(n_points + 1);
    bencher.counter(ItemsCount::new(n_points)).bench(|| score(&plan, &trace));
}
