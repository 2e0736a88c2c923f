//! Jumps from the atlas between marks: shorter, no less exact, within every limit, kept on disk.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::Error;
use ftheta::atlas_store::AtlasStore;
use ftheta::formats::{machine, plan_file, svg};
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::machine::{Drive, Machine, Servo};
use ftheta::model::plan::{Motion, PlanDraft, Planner};
use ftheta::model::recipe::Recipe;
use ftheta::physics::audit::AuditError;
use ftheta::physics::plan::Plan;
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use std::fs;
use std::path::Path;

/// Short lines with jumps of 1 to 6 mm between them.
const LINES: &str = r#"<path d="M10 10 h1"/><path d="M12 11 v2"/><path d="M17 13 l1 1"/>
    <path d="M14 10 h-1"/><circle cx="12" cy="15" r="0.5"/>"#;

fn preset(name: &str) -> Machine {
    machine::preset(name).unwrap().unwrap()
}

fn run(elements: &str, machine: &Machine, options: &MarkOptions) -> Result<Marked, Error> {
    let text = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="121mm" height="121mm"
            viewBox="-50 -50 121 121" fill="none" stroke="black">{elements}</svg>"#
    );
    let recipe = Recipe::default();
    let job = svg::read(text.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
    mark(&job, machine, &recipe, options, &mut |_| {})
}

fn keep() -> MarkOptions {
    MarkOptions { order: Order::Keep, ..MarkOptions::default() }
}

fn by(planner: Planner) -> MarkOptions {
    MarkOptions { planner: Some(planner), ..keep() }
}

fn jumps(draft: &PlanDraft) -> usize {
    draft.segments.iter().filter(|s| matches!(s.motion, Motion::Jump { .. })).count()
}

#[test]
fn jumps_are_shorter_and_marks_no_worse() {
    for name in ["S10-f160", "S14"] {
        let machine = preset(name);
        let classic = run(LINES, &machine, &by(Planner::Classic)).unwrap();
        let optimal = run(LINES, &machine, &keep()).unwrap();
        assert_eq!(optimal.plan.planner, Planner::Optimal);
        assert_eq!(jumps(&optimal.plan), 6);
        // The mark delay is the same in both; what is left of the dark time halves at least.
        let dark_s = |marked: &Marked| marked.times.jump_s;
        assert!(dark_s(&optimal) < 0.75 * dark_s(&classic), "{name}: {}", dark_s(&optimal));
        let error_um = |marked: &Marked| marked.score.contour_error_um.max;
        assert!(error_um(&optimal) < error_um(&classic) + 1.0, "{name}: {}", error_um(&optimal));
        assert!(optimal.score.stray_energy_ratio <= classic.score.stray_energy_ratio);
        assert!(optimal.plan.limits().voltage < 0.95, "{name}: reserve is kept");
    }
}

/// The feedback takes care of a plant that is not the nominal one.
#[test]
fn jumps_hold_on_other_plants() {
    let machine = preset("S10-f160");
    for mismatch in [
        Mismatch { f1: 0.03, ..Mismatch::default() },
        Mismatch { f1: -0.03, zeta: Some(0.0025), ..Mismatch::default() },
        Mismatch { kt: 0.005, ..Mismatch::default() },
    ] {
        let optimal = run(LINES, &machine, &MarkOptions { mismatch, ..keep() }).unwrap();
        let error_um = optimal.score.contour_error_um.max;
        assert!(error_um < 12.0, "{mismatch:?}: {error_um} µm");
    }
}

/// A coil that stands little: the plan waits or jumps more gently, and the audit finds no limit
/// passed; without the governor it would be refused.
#[test]
fn no_sequence_of_jumps_overheats_the_coil() {
    let lines: String = (0..60)
        .map(|n| {
            format!(r#"<path d="M{} {} h0.1"/>"#, if n % 2 == 0 { 5 } else { 25 }, n as f64 * 0.1)
        })
        .collect();
    let cool = preset("S10-f160");
    let mut hot = cool.clone();
    hot.scanner.current_rms_a = 1.2;
    hot.scanner.thermal_time_s = 0.02;
    let free = run(&lines, &cool, &keep()).unwrap();
    let governed = run(&lines, &hot, &keep()).unwrap();
    let heat = governed.plan.limits().heat;
    assert!((0.5..1.0).contains(&heat), "heat {heat}");
    assert!(governed.times.duration_s > 1.05 * free.times.duration_s);
    let mut ungoverned = PlanDraft::clone(&free.plan);
    ungoverned.machine = hot;
    assert!(matches!(Plan::new(ungoverned), Err(AuditError::Limit { quantity: "coil heat", .. })));
}

/// At the edge of the field a jump's commands, which lead the mirror, would leave the angles: there
/// the jump is slower, and the job is planned all the same.
#[test]
fn the_edge_of_the_field_is_reached() {
    let corners = r#"<path d="M-50 -50 h1"/><path d="M-47 -50 h1"/><path d="M-49 -50 v1"/>"#;
    let marked = run(corners, &preset("S10"), &keep()).unwrap();
    assert!(marked.plan.limits().angle > 0.97);
    assert!(marked.score.contour_error_um.max < 10.0);
}

#[test]
fn plans_with_jumps_are_written_and_read_as_the_same() {
    let plan = run(LINES, &preset("S10-f160"), &keep()).unwrap().plan;
    let mut text = Vec::new();
    plan_file::write(&plan, &plan.id().to_string(), &mut text).unwrap();
    let (draft, id) = plan_file::read(std::str::from_utf8(&text).unwrap()).unwrap();
    assert_eq!(Plan::new(draft).unwrap().id().to_string(), id);
}

#[test]
fn the_audit_refuses_jumps_that_are_not_what_they_say() {
    let plan = run(LINES, &preset("S10-f160"), &keep()).unwrap().plan;
    let refusal = |change: &dyn Fn(&mut PlanDraft)| {
        let mut draft = PlanDraft::clone(&plan);
        change(&mut draft);
        Plan::new(draft).unwrap_err()
    };
    // One voltage off, and the axis does not come to rest.
    let restless = refusal(&|draft| draft.sequences_v[0][5] += 0.5);
    assert!(matches!(restless, AuditError::Limit { .. }), "{restless}");
    let malformed: [&dyn Fn(&mut PlanDraft); 4] = [
        &|draft| drop(draft.sequences_v.pop()),
        &|draft| draft.sequences_v[0].truncate(3),
        &|draft| draft.sequences_v[0].fill(0.0),
        &|draft| draft.sequences_v[0][3] = f64::NAN,
    ];
    for change in malformed {
        let error = refusal(change);
        assert!(matches!(error, AuditError::Malformed { .. }), "{error}");
    }
}

/// A head whose servo is not known, or remembers, jumps at constant speed; asked for by name, the
/// planner says why it cannot.
#[test]
fn heads_that_cannot_be_inverted_jump_as_classic() {
    let mut black_box = preset("S10-f160");
    black_box.output.drive = Drive::BlackBox;
    let mut pid = preset("S10-f160");
    pid.scanner.servo = Servo::Pid {
        bandwidth_hz: 600.0,
        damping: 0.9,
        integral_time_s: f64::INFINITY,
        current_bandwidth_hz: 5000.0,
    };
    for machine in [black_box, pid] {
        let marked = run(LINES, &machine, &keep()).unwrap();
        assert_eq!(marked.plan.planner, Planner::Classic);
        let refused = run(LINES, &machine, &by(Planner::Optimal));
        assert!(matches!(refused, Err(Error::NoPlanner { .. })));
    }
}

fn stored(folder: &Path) -> MarkOptions {
    MarkOptions { atlas_store: AtlasStore::new(Some(folder.into())), ..keep() }
}

fn atlas_file(folder: &Path) -> std::path::PathBuf {
    let files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "one atlas and nothing half-written: {files:?}");
    files[0].clone()
}

#[test]
fn an_atlas_is_kept_and_a_damaged_one_is_built_anew() {
    let machine = preset("S10-f160");
    let folder = tempfile::tempdir().unwrap();
    let first = run(LINES, &machine, &stored(folder.path())).unwrap();
    let path = atlas_file(folder.path());
    let whole = fs::read(&path).unwrap();
    let again = run(LINES, &machine, &stored(folder.path())).unwrap();
    assert_eq!(first.plan.id(), again.plan.id());
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    for damage in [&whole[..whole.len() / 2], b"", b"ftheta-atlas 0\n", b"\xff\xfe"] {
        fs::write(&path, damage).unwrap();
        let anew = run(LINES, &machine, &stored(folder.path())).unwrap();
        assert_eq!(first.plan.id(), anew.plan.id());
        assert!(anew.warnings.iter().any(|w| w.to_string().contains("made anew")));
        assert_eq!(fs::read(&path).unwrap(), whole);
    }
}

#[test]
fn two_writers_leave_a_whole_atlas() {
    let machine = preset("S10-f160");
    let folder = tempfile::tempdir().unwrap();
    let job = || run(LINES, &machine, &stored(folder.path())).unwrap().plan.id();
    let ids = std::thread::scope(|scope| {
        let writers: Vec<_> = (0..3).map(|_| scope.spawn(job)).collect();
        writers.into_iter().map(|writer| writer.join().unwrap()).collect::<Vec<_>>()
    });
    assert!(ids.iter().all(|id| *id == ids[0]));
    atlas_file(folder.path());
    assert_eq!(job(), ids[0]);
}

/// What cannot be kept costs time, not the job.
#[test]
fn a_store_that_cannot_be_written_is_only_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"").unwrap();
    let marked = run(LINES, &preset("S10-f160"), &stored(&file.join("below"))).unwrap();
    assert!(marked.warnings.iter().any(|warning| warning.to_string().contains("cannot be")));
}
