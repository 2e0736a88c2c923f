//! Plans and traces of which the figures are known.

#[path = "../machine/mod.rs"]
mod machine;

use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::recipe::Pen;
use ftheta_model::space::FieldPoint;
use ftheta_model::trace::{Light, Trace, TracePoint};
use kurbo::{BezPath, Point};

/// Time between two points of a trace, ns.
pub const STEP_NS: u64 = 2000;

/// A plan of curves, 10 W at 1 m/s, spot 30 µm, tolerance 10 µm.
pub fn plan(curves: &[BezPath]) -> PlanDraft {
    let marks = curves.iter().map(|curve| PlannedMark {
        curve: curve.clone(),
        pen_index: 0,
        source: "#m".into(),
        on_ns: 0,
        off_ns: 0,
        power_w: 10.0,
        steps: Vec::new(),
    });
    PlanDraft {
        machine: machine::machine(),
        planner: Planner::Classic,
        tolerance_mm: 0.01,
        pens: vec![Pen::default()],
        marks: marks.collect(),
        vertices: Vec::new(),
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments: Vec::new(),
    }
}

/// A beam given by its place at any time in s, and light from `on_ns` to `off_ns` for each mark.
pub fn trace(light_ns: &[(u64, u64)], beam: impl Fn(f64) -> Point) -> Trace {
    let end_ns = light_ns.last().unwrap().1;
    let points = (0..=end_ns / STEP_NS + 5).map(|i| {
        let place = beam((i * STEP_NS) as f64 * 1e-9);
        TracePoint::from(FieldPoint::from(place))
    });
    let light = light_ns.iter().enumerate();
    Trace {
        step_ns: STEP_NS,
        first_index: 0,
        points: points.collect(),
        light: light
            .map(|(index, &(on_ns, off_ns))| Light { index, on_ns, off_ns, power_w: 10.0 })
            .collect(),
        ..Trace::default()
    }
}

/// Asserts that a value is what is expected, within `off`.
#[track_caller]
pub fn near(value: f64, expected: f64, off: f64) {
    assert!((value - expected).abs() <= off, "{value} is not {expected}");
}
