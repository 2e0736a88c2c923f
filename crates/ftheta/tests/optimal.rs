//! Planned marks and the motion between them: faster, no less exact, within every limit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::Error;
use ftheta::atlas_store::AtlasStore;
use ftheta::formats::{machine, plan_file, svg};
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::machine::{Drive, Machine, Servo};
use ftheta::model::plan::{Motion, PlanDraft, Planner, Segment};
use ftheta::model::recipe::Recipe;
use ftheta::physics::audit::AuditError;
use ftheta::physics::plan::Plan;
use ftheta::planner::optimal::Corner;
use ftheta::report::score::Score;
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;

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

/// In the drawing's order, with what these tests have solved so far.
fn keep() -> MarkOptions {
    static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());
    stored(FOLDER.path())
}

fn by(planner: Planner) -> MarkOptions {
    MarkOptions { planner: Some(planner), ..keep() }
}

fn flights(draft: &PlanDraft) -> usize {
    let between = |s: &&Segment| s.mark_index.is_none() && matches!(s.motion, Motion::Drive { .. });
    draft.segments.iter().filter(between).count()
}

#[test]
fn marks_begin_and_end_at_mark_speed() {
    for name in ["S10-f160", "S14"] {
        let machine = preset(name);
        let classic = run(LINES, &machine, &by(Planner::Classic)).unwrap();
        let optimal = run(LINES, &machine, &keep()).unwrap();
        assert_eq!(optimal.plan.planner, Planner::Optimal);
        // One to every mark, and one home.
        assert_eq!(flights(&optimal.plan), 6);
        let dark_s = |marked: &Marked| marked.times.jump_s;
        assert!(dark_s(&optimal) < 0.5 * dark_s(&classic), "{name}: {}", dark_s(&optimal));
        let Score { contour_error_um, end_error_um, dose_ratio, .. } = &optimal.score;
        assert!(contour_error_um.max < 2.0, "{name}: {}", contour_error_um.max);
        assert!(end_error_um.max < 0.5, "{name}: {}", end_error_um.max);
        let dose = dose_ratio.unwrap();
        assert!(dose.min > 0.99 && dose.max < 1.01, "{name}: {dose:?}");
        assert_eq!(optimal.score.stray_energy_ratio, 0.0);
        assert!(optimal.plan.limits().voltage < 0.95, "{name}: reserve is kept");
    }
}

/// Two squares, a zigzag and an arc: right, sharp and blunt corners.
const CORNERS: &str = r#"<path d="M10 10 h3 v3 h-3 z"/><path d="M15 10 l1 3 l1 -3 l1 3 l0.2 -0.4"/>
    <path d="M20 10 h2 a1 1 0 0 1 1 1 v2 l0.5 0.2"/>"#;

/// Each way of taking corners keeps what it promises, at several speeds, on the nominal plant.
#[test]
fn every_way_of_taking_corners_keeps_its_promise() {
    let machine = preset("S10-f160");
    for speed_mm_s in [500.0, 2000.0, 4000.0] {
        let by = |corner| {
            let options = MarkOptions { corner, speed_mm_s: Some(speed_mm_s), ..keep() };
            run(CORNERS, &machine, &options).unwrap()
        };
        let [blend, exact, sky] = [Corner::Blend, Corner::Exact, Corner::Sky].map(by);
        // Blended corners are within the tolerance, the others without an error worth a word.
        assert!(blend.score.contour_error_um.max < 10.0, "{:?}", blend.score.contour_error_um);
        assert!(exact.score.contour_error_um.max < 4.0, "{:?}", exact.score.contour_error_um);
        assert!(sky.score.contour_error_um.max < 4.0, "{:?}", sky.score.contour_error_um);
        assert!(blend.times.duration_s < exact.times.duration_s);
        for marked in [&blend, &exact, &sky] {
            assert_eq!(marked.score.stray_energy_ratio, 0.0);
            assert!(marked.score.end_error_um.max < 0.5);
        }
        let dose = sky.score.dose_ratio.unwrap();
        assert!(dose.p01 > 0.99 && dose.p99 < 1.01, "{speed_mm_s}: {dose:?}");
        let dose = exact.score.dose_ratio.unwrap();
        assert!(dose.p01 > 0.97 && dose.p99 < 1.03, "{speed_mm_s}: {dose:?}");
        // Sky makes a mark of every leg, each with its own light.
        assert!(sky.plan.marks.len() > blend.plan.marks.len());
    }
}

/// A laser that is only on or off flies around corners, so that its dose stays what it is.
#[test]
fn a_laser_without_modulation_flies_around_corners() {
    let mut machine = preset("S10-f160");
    machine.laser.power_modulated = false;
    let marked = run(CORNERS, &machine, &keep()).unwrap();
    let dose = marked.score.dose_ratio.unwrap();
    assert!(dose.p01 > 0.99 && dose.p99 < 1.01, "{dose:?}");
    assert!(marked.plan.marks.iter().all(|mark| mark.steps.is_empty()));
}

/// Motors that are not the nominal one, within what the machine file says of them.
#[test]
fn uncertain_motors_hold_the_tolerance() {
    let machine = preset("S10-f160");
    for mismatch in [
        Mismatch { f1: 0.03, ..Mismatch::default() },
        Mismatch { f1: -0.03, ..Mismatch::default() },
        Mismatch { f1: -0.03, zeta: Some(0.0025), ..Mismatch::default() },
        Mismatch { kt: 0.005, ..Mismatch::default() },
        Mismatch { kt: -0.005, ..Mismatch::default() },
    ] {
        let options = MarkOptions { mismatch, speed_mm_s: Some(2000.0), ..keep() };
        for elements in [LINES, CORNERS] {
            let error_um = run(elements, &machine, &options).unwrap().score.contour_error_um.max;
            assert!(error_um <= 10.0, "{mismatch:?}: {error_um} µm");
        }
    }
}

/// Ways of at most 1 mm, from the field centre on: dashes in a row, strokes all about, hatch
/// lines half a millimetre apart.
const NEAR: [&str; 3] = [
    r#"<path d="M10.5 10.5 h2 m1 0 h2 m1 0 h2 m1 0 h2"/>"#,
    r#"<path d="M10.5 10.5 h3"/><path d="M14 11 v3"/><path d="M13.5 14.5 l-2 -2"/>
       <path d="M11 12 l-2 3"/><path d="M8.5 15.5 h3"/><path d="M12.4 15.5 l2 3"/>"#,
    r#"<path d="M10.5 10.5 h4 m0 .5 h-4 m0 .5 h4 m0 .5 h-4 m0 .5 h4 m0 .5 h-4 m0 .5 h4"/>"#,
];

/// Near ways hold four times the torque constant's uncertainty, by words and by voltages.
#[test]
fn near_ways_hold_more_torque_and_less() {
    let mut volts = preset("S10-f160");
    volts.output.drive = Drive::Voltage;
    for (machine, elements) in
        [preset("S10-f160"), volts].iter().flat_map(|machine| NEAR.map(|one| (machine, one)))
    {
        for kt in [0.02, -0.02] {
            let mismatch = Mismatch { kt, ..Mismatch::default() };
            let options = MarkOptions { mismatch, speed_mm_s: Some(2000.0), ..keep() };
            let marked = run(elements, machine, &options).unwrap();
            let error_um = marked.score.contour_error_um.max;
            let promised_um = 1e3 * marked.promise.unwrap().kt_near_mm;
            assert!(error_um <= promised_um + 0.3, "{error_um} µm, promised {promised_um} µm");
            assert!(promised_um <= 10.0, "{elements} with {kt}: {promised_um} µm");
        }
    }
}

/// A head that takes positions and tells no more than its lag.
#[test]
fn a_head_of_unknown_servo_keeps_the_tolerance() {
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
        let marked = run(CORNERS, &machine, &keep()).unwrap();
        assert_eq!(marked.plan.planner, Planner::Optimal);
        let error_um = marked.score.contour_error_um.max;
        assert!(error_um < 10.0, "{:?}: {error_um} µm", machine.scanner.servo);
        assert_eq!(marked.score.stray_energy_ratio, 0.0);
    }
}

/// Dense points, cusps, doubles and marks shorter than a tick: planned, without a stall.
#[test]
fn what_exports_contain_is_planned() {
    let machine = preset("S10-f160");
    let dense: String = (0..=4000)
        .map(|n| {
            let angle = f64::from(n) * 1e-3;
            format!("{:.6} {:.6} ", 20.0 + 5.0 * angle.cos(), 20.0 + 5.0 * angle.sin())
        })
        .collect();
    let dense = format!(r#"<polyline points="{dense}"/>"#);
    let options = MarkOptions { speed_mm_s: Some(2000.0), ..keep() };
    let marked = run(&dense, &machine, &options).unwrap();
    // 20 mm at full speed but for the flattening of points.
    assert!((marked.times.mark_s - 0.010).abs() < 2e-5, "{}", marked.times.mark_s);
    assert!(marked.score.contour_error_um.max < 1.0);
    let odd = r#"<path d="M10 10 h5 h-5 h5"/><path d="M20 10 h0 h2 h0 v2"/>
        <path d="M25 10 h0.002"/><circle cx="30" cy="10" r="0.01"/>
        <path d="M35 10 l5 0.05 l-5 0.05 l5 0.05"/>"#;
    for speed_mm_s in [100.0, 2000.0, 20_000.0] {
        let options = MarkOptions { speed_mm_s: Some(speed_mm_s), ..keep() };
        let marked = run(odd, &machine, &options).unwrap();
        assert_eq!(marked.plan.marks.len(), 5);
        assert!(marked.score.contour_error_um.max < 10.0, "{speed_mm_s}");
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

/// At the edge of the field commands lead the mirror, and there is little room to turn.
#[test]
fn the_edge_of_the_field_is_reached() {
    let corners = r#"<path d="M-50 -50 h1"/><path d="M-47 -50 h1"/><path d="M-49 -50 v1"/>"#;
    let marked = run(corners, &preset("S10"), &keep()).unwrap();
    assert!(marked.plan.limits().angle > 0.97);
    assert!(marked.score.contour_error_um.max < 10.0);
}

#[test]
fn planned_motion_is_written_and_read_as_the_same() {
    let plan = run(CORNERS, &preset("S10-f160"), &keep()).unwrap().plan;
    let mut text = Vec::new();
    plan_file::write(&plan, &plan.id().to_string(), &mut text).unwrap();
    let (draft, id) = plan_file::read(std::str::from_utf8(&text).unwrap()).unwrap();
    assert_eq!(Plan::new(draft).unwrap().id().to_string(), id);
}

#[test]
fn the_audit_refuses_motion_that_is_not_what_it_says() {
    let plan = run(CORNERS, &preset("S10-f160"), &keep()).unwrap().plan;
    let refusal = |change: &dyn Fn(&mut PlanDraft)| {
        let mut draft = PlanDraft::clone(&plan);
        change(&mut draft);
        Plan::new(draft).unwrap_err()
    };
    let limits: [&dyn Fn(&mut PlanDraft); 5] = [
        // Not where the next track begins.
        &|draft| draft.drives[5][0] += 2.0,
        // A mark beside its curve, and at another speed than its light.
        &|draft| draft.marks[0].curve.apply_affine(kurbo::Affine::translate((0.02, 0.0))),
        &|draft| draft.knots.iter_mut().for_each(|knot| knot.speed_mm_s *= 0.9),
        &|draft| draft.marks[0].steps.iter_mut().for_each(|step| step.power_w *= 0.8),
        &|draft| draft.marks[0].power_w *= 1.2,
    ];
    for (index, change) in limits.into_iter().enumerate() {
        let error = refusal(change);
        let fits = matches!(error, AuditError::Limit { .. } | AuditError::Malformed { .. });
        assert!(fits, "{index}: {error}");
    }
    let malformed: [&dyn Fn(&mut PlanDraft); 7] = [
        &|draft| draft.drives.truncate(3),
        &|draft| draft.drives[3][1] = f32::NAN,
        &|draft| draft.knots.truncate(1),
        &|draft| draft.knots[0].time_s = f64::INFINITY,
        &|draft| draft.stations.truncate(1),
        &|draft| draft.stations[1].arriving *= 2.0,
        &|draft| draft.marks[0].steps.reverse(),
    ];
    for (index, change) in malformed.into_iter().enumerate() {
        let error = refusal(change);
        assert!(matches!(error, AuditError::Malformed { .. }), "{index}: {error}");
    }
}

fn stored(folder: &Path) -> MarkOptions {
    let atlas_store = AtlasStore::new(Some(folder.into()));
    MarkOptions { order: Some(Order::Keep), atlas_store, ..MarkOptions::default() }
}

/// The atlas and what was solved for all ways and for near ones, and nothing half-written.
fn kept_files(folder: &Path) -> Vec<std::path::PathBuf> {
    let files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let n_of = |kind: &str| files.iter().filter(|file| file.extension().unwrap() == kind).count();
    assert_eq!((files.len(), n_of("atlas"), n_of("solved")), (3, 1, 2), "{files:?}");
    files
}

#[test]
fn what_is_solved_is_kept_and_made_anew_where_it_is_damaged() {
    let machine = preset("S10-f160");
    let folder = tempfile::tempdir().unwrap();
    let first = run(LINES, &machine, &stored(folder.path())).unwrap();
    let again = run(LINES, &machine, &stored(folder.path())).unwrap();
    assert_eq!(first.plan.id(), again.plan.id());
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    for path in kept_files(folder.path()) {
        let whole = fs::read(&path).unwrap();
        for damage in [&whole[..whole.len() / 2], b"", b"ftheta-atlas 0\n", b"\xff\xfe"] {
            fs::write(&path, damage).unwrap();
            let anew = run(LINES, &machine, &stored(folder.path())).unwrap();
            assert_eq!(first.plan.id(), anew.plan.id());
            assert!(anew.warnings.iter().any(|w| w.to_string().contains("made anew")));
            assert!(fs::read(&path).unwrap() == whole, "{path:?}");
        }
    }
}

/// Whatever other jobs have left in the store: longer jumps, other corners and transitions.
#[test]
fn plans_do_not_depend_on_what_is_kept() {
    let machine = preset("S10-f160");
    let other = r#"<path d="M-40 -30 h1 v1"/><path d="M45 50 v2"/><path d="M12 11 l2 1 v1"/>"#;
    let cold = run(LINES, &machine, &keep()).unwrap().plan.id();
    let folder = tempfile::tempdir().unwrap();
    let cold_other = run(other, &machine, &stored(folder.path())).unwrap().plan.id();
    assert_eq!(run(LINES, &machine, &stored(folder.path())).unwrap().plan.id(), cold);
    assert_eq!(run(LINES, &machine, &stored(folder.path())).unwrap().plan.id(), cold);
    assert_eq!(run(other, &machine, &keep()).unwrap().plan.id(), cold_other);
    kept_files(folder.path());
}

#[test]
fn writers_at_the_same_time_leave_whole_files() {
    let machine = preset("S10-f160");
    let folder = tempfile::tempdir().unwrap();
    let job = || run(LINES, &machine, &stored(folder.path())).unwrap().plan.id();
    let ids = std::thread::scope(|scope| {
        let writers: Vec<_> = (0..3).map(|_| scope.spawn(job)).collect();
        writers.into_iter().map(|writer| writer.join().unwrap()).collect::<Vec<_>>()
    });
    assert!(ids.iter().all(|id| *id == ids[0]));
    kept_files(folder.path());
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

/// A curve that passes a place straight before it turns there, and one that turns back inside a
/// segment: every part keeps to its own piece of the curve.
#[test]
fn curves_are_cut_where_they_turn() {
    let elements = r#"<path d="M10 10 H12 C18 10 12 16 12 10 L10 12"/>
        <path d="M20 10 C24 14 20 14 24 10"/>"#;
    let options = MarkOptions { corner: Corner::Sky, ..keep() };
    let marked = run(elements, &preset("S10-f160"), &options).unwrap();
    assert_eq!(marked.plan.marks.len(), 4);
    assert!(marked.score.contour_error_um.max < 4.0, "{:?}", marked.score.contour_error_um);
    assert!(marked.score.coverage_error_um.max < 4.0, "{:?}", marked.score.coverage_error_um);
}

/// Lasers that begin late are told in time, jumps or not; marks are not shorter than light is.
#[test]
fn slow_lasers_get_the_time_that_they_need() {
    let elements = r#"<path d="M0 0 h1"/><path d="M1.1 0 h1"/><path d="M2.2 0 h0.002"/>"#;
    for drive in [Drive::ServoKnown, Drive::BlackBox] {
        for (on_latency_ns, off_latency_ns) in [(1_500_000, 0), (5_000, 200_000)] {
            let mut machine = preset("S10-f160");
            machine.output.drive = drive;
            (machine.laser.on_latency_ns, machine.laser.off_latency_ns) =
                (on_latency_ns, off_latency_ns);
            let marked = run(elements, &machine, &keep()).unwrap();
            assert!(marked.score.contour_error_um.max < 2.0);
            assert_eq!(marked.score.stray_energy_ratio, 0.0);
        }
    }
}

/// Bends that go on for long are made more slowly where the coils would not stand them.
#[test]
fn no_bend_overheats_the_coil() {
    let circle = "a0.3 0.3 0 0 1 -0.6 0 a0.3 0.3 0 0 1 0.6 0 ".repeat(150);
    let mut machine = preset("S10-f160");
    machine.scanner.current_rms_a = 0.15;
    machine.scanner.thermal_time_s = 0.01;
    let options = MarkOptions { speed_mm_s: Some(5000.0), ..keep() };
    let marked = run(&format!(r#"<path d="M10 10 {circle}"/>"#), &machine, &options).unwrap();
    assert_eq!(marked.plan.planner, Planner::Optimal);
    let heat = marked.plan.limits().heat;
    assert!((0.5..1.0).contains(&heat), "heat {heat}");
    assert!(marked.score.contour_error_um.max < 10.0, "{:?}", marked.score.contour_error_um);
}
