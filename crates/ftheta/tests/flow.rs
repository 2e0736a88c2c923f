//! Marks that ask much of the machine are made slower, and marks that touch are made as one.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::atlas_store::AtlasStore;
use ftheta::formats::{machine, svg};
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::plan::{Motion, Planner};
use ftheta::model::recipe::Recipe;
use ftheta::toolpath::lay::Order;
use std::sync::LazyLock;
use tempfile::TempDir;

/// By the optimal planner, in the drawing's order; centre of the field at (10.5, 10.5) mm.
fn run(elements: &str, machine: &str, speed_mm_s: f64, tolerance_mm: f64) -> Marked {
    static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());
    let text = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="121mm" height="121mm"
            viewBox="-50 -50 121 121" fill="none" stroke="black">{elements}</svg>"#
    );
    let recipe = Recipe::default();
    let job = svg::read(text.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
    let machine = machine::preset(machine).unwrap().unwrap();
    let options = MarkOptions {
        planner: Some(Planner::Optimal),
        speed_mm_s: Some(speed_mm_s),
        tolerance_mm,
        order: Some(Order::Keep),
        atlas_store: AtlasStore::new(Some(FOLDER.path().into())),
        ..MarkOptions::default()
    };
    mark(&job, &machine, &recipe, &options, &mut |_| {}).unwrap()
}

/// Curves that turn back and forth, tips, and small arcs: a wide tolerance does not let the mirrors
/// bend as they cannot.
#[test]
fn wide_tolerances_do_not_strain_the_driver() {
    let curves = r#"<path d="M10 10 C14 14 10 14 14 10 c2 -2 4 2 2 3 c-3 2 -4 -3 -5 -4 q1 3 4 1"/>
        <path d="M22 10 a1 1 0 0 1 2 0 a0.4 0.4 0 0 1 -0.8 0"/>"#;
    let mut slowest_ms = f64::INFINITY;
    for tolerance_mm in [0.01, 0.03, 0.1] {
        let marked = run(curves, "S10-f160", 6000.0, tolerance_mm);
        assert!(marked.plan.limits().voltage <= 0.97, "{:?}", marked.plan.limits());
        assert!(marked.plan.limits().current <= 1.0, "{:?}", marked.plan.limits());
        let error_um = marked.score.contour_error_um.max;
        assert!(error_um <= 1e3 * tolerance_mm, "{tolerance_mm}: {error_um} µm");
        // More tolerance never makes it slower.
        let duration_ms = 1e3 * marked.score.duration_s;
        assert!(duration_ms <= 1.01 * slowest_ms, "{tolerance_mm}: {duration_ms} ms");
        slowest_ms = duration_ms;
    }
}

/// At the angles' end a mark that runs outwards is made so slowly that the mirrors can stop.
#[test]
fn outward_marks_at_the_edge_leave_room_to_stop() {
    let outward = r#"<path d="M65 20 h5.9"/><path d="M60 60 l10.9 10.9"/><path d="M-50 -50 h1"/>"#;
    for speed_mm_s in [2000.0, 18_000.0] {
        let marked = run(outward, "S10", speed_mm_s, 0.01);
        assert_eq!(marked.plan.marks.len(), 3);
        assert!(marked.score.contour_error_um.max < 2.0, "{:?}", marked.score.contour_error_um);
        let dose = marked.score.dose_ratio.unwrap();
        assert!(dose.p01 > 0.97 && dose.p99 < 1.03, "{speed_mm_s}: {dose:?}");
        let slower = marked.warnings.iter().any(|warning| warning.to_string().contains("slower"));
        assert_eq!(slower, speed_mm_s > 10_000.0);
    }
}

/// Lines, an arc and a line end to end, and one that turns away: two strokes of light, the first
/// without a loop or a gap in dose.
#[test]
fn marks_that_touch_flow_on() {
    let touching = r#"<path d="M0 10 h3"/><path d="M3 10 h3"/><path d="M6 10 a2 2 0 0 1 2 2"/>
        <path d="M8.0005 12 v3"/><path d="M8 15 h-2"/>"#;
    let marked = run(touching, "S10-f160", 2000.0, 0.01);
    assert_eq!(marked.plan.marks.len(), 2);
    let flights = marked.plan.segments.iter();
    let flights =
        flights.filter(|s| s.mark_index.is_none() && matches!(s.motion, Motion::Drive { .. }));
    assert_eq!(flights.count(), 3);
    assert!(marked.score.contour_error_um.max < 4.0, "{:?}", marked.score.contour_error_um);
    let dose = marked.score.dose_ratio.unwrap();
    assert!(dose.min > 0.98 && dose.max < 1.02, "{dose:?}");
    // 9 mm, π mm of arc and 2 mm, and one way between.
    let lit_ms = (11.0 + std::f64::consts::PI) / 2.0;
    let duration_ms = 1e3 * marked.score.duration_s;
    assert!((lit_ms..lit_ms + 1.2).contains(&duration_ms), "{duration_ms} ms");
}
