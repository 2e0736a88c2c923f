//! A head whose focus is moved by a lens: marks, waits, and what the audit says of them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::Error;
use ftheta::atlas_store::AtlasStore;
use ftheta::circle::{Ellipse, Round, circle};
use ftheta::field::angles_of;
use ftheta::formats::points::Place;
use ftheta::formats::{machine, svg};
use ftheta::mark::{MarkOptions, Marked, mark, play};
use ftheta::model::block::Block;
use ftheta::model::machine::{Drive, Focus, Machine};
use ftheta::model::plan::{PlanDraft, Planner};
use ftheta::model::recipe::{Pen, Recipe};
use ftheta::model::space::FieldPoint;
use ftheta::physics::audit::AuditError;
use ftheta::physics::focus::lens_travel_mm;
use ftheta::physics::plan::Plan;
use ftheta::planner::render::Renderer;
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use kurbo::{ParamCurve, Point};
use std::sync::LazyLock;
use tempfile::TempDir;

/// In a corner, near the centre, on an edge, and across half of the field.
const MARKS: &str = r#"<path d="M120 120 h8 v8"/><path d="M2 0 l3 4"/>
    <circle cx="0" cy="120" r="4"/><path d="M0 -20 L-80 -60"/>"#;

fn head() -> Machine {
    let text = include_str!("../../../gallery/dynamic-focus.toml");
    machine::read("dynamic-focus.toml", text).unwrap()
}

fn with_focus(machine: &Machine, change: impl Fn(&mut Focus)) -> Machine {
    let mut machine = machine.clone();
    change(machine.optics.focus.as_mut().unwrap());
    machine
}

fn run(machine: &Machine, planner: Option<Planner>) -> Result<Marked, Error> {
    let text = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="280mm" height="280mm"
            viewBox="-140 -140 280 280" fill="none" stroke="black">{MARKS}</svg>"#
    );
    let recipe = Recipe::default();
    let job = svg::read(text.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
    static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());
    let atlas_store = AtlasStore::new(Some(FOLDER.path().into()));
    let options =
        MarkOptions { planner, order: Some(Order::Keep), atlas_store, ..MarkOptions::default() };
    mark(&job, machine, &recipe, &options, &mut |_| {})
}

/// The marks as planned for the head.
static PLAN: LazyLock<Plan> = LazyLock::new(|| run(&head(), None).unwrap().plan);

/// Time that the lens has between marks, and that a lens without inertia would take, s.
fn darks(draft: &PlanDraft) -> Vec<(f64, f64)> {
    let machine = &draft.machine;
    let travel_mm = |place: Point| lens_travel_mm(&machine.optics, place.into()).unwrap();
    let speed_mm_s = machine.optics.focus.as_ref().unwrap().speed_max_mm_s;
    let between = |pair: &[ftheta::model::plan::PlannedMark]| {
        let end = pair[0].curve.segments().last().unwrap().end();
        let start = pair[1].curve.segments().next().unwrap().start();
        let dark_ns = pair[1].on_ns as f64 + machine.laser.on_latency_ns as f64
            - (pair[0].off_ns as f64 + machine.laser.off_latency_ns as f64);
        (dark_ns * 1e-9, (travel_mm(start) - travel_mm(end)).abs() / speed_mm_s)
    };
    draft.marks.windows(2).map(between).collect()
}

fn refusal(draft: &PlanDraft, change: impl Fn(&mut Focus)) -> AuditError {
    let machine = with_focus(&draft.machine, change);
    Plan::new(PlanDraft { machine, ..draft.clone() }).unwrap_err()
}

#[test]
fn mirrors_wait_for_the_lens() {
    let darks = darks(&PLAN);
    assert_eq!(darks.len(), 3);
    assert!(darks.iter().all(|(dark_s, least_s)| dark_s > least_s), "{darks:?}");
    // Corner to centre is 7 mm of lens, 26 ms; the mirrors alone are there in 5.
    assert!(darks[0].1 > 0.02, "{darks:?}");
    let mut fixed = head();
    fixed.optics.focus = None;
    let quick = run(&fixed, None).unwrap().plan;
    assert!(PLAN.n_samples() > quick.n_samples() + 5000, "{}", quick.n_samples());
}

/// All commands of the lens.
fn lens_mm(plan: &Plan) -> Vec<f64> {
    let (mut renderer, mut block, mut all) = (Renderer::new(plan), Block::default(), Vec::new());
    while renderer.next_block(&mut block) {
        all.extend_from_slice(&block.lens_mm);
    }
    all
}

#[test]
fn the_lens_is_told_within_its_limits() {
    let plan = &*PLAN;
    let (lens_mm, machine) = (lens_mm(plan), &plan.machine);
    assert_eq!(lens_mm.len() as u64, plan.n_samples());
    let (focus, tick_s) = (machine.optics.focus.as_ref().unwrap(), machine.output.period_s());
    let centre_mm = lens_travel_mm(&machine.optics, FieldPoint::default()).unwrap();
    assert!((lens_mm[0] - centre_mm).abs() < 1e-5);
    assert!((lens_mm[lens_mm.len() - 1] - centre_mm).abs() < 1e-5);
    let most = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
    let speed = most(&mut lens_mm.windows(2).map(|pair| (pair[1] - pair[0]) / tick_s));
    let bends = lens_mm.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]);
    let acceleration = most(&mut bends.map(|bend| bend / (tick_s * tick_s)));
    assert!(most(&mut lens_mm.iter().copied()) <= focus.travel_mm);
    assert!((0.5..=1.0).contains(&(speed / focus.speed_max_mm_s)), "{speed}");
    assert!(acceleration <= focus.acceleration_max_mm_s2, "{acceleration}");
    // The same in blocks of another plan's renderer, and none for a head without a lens.
    let again = Renderer::new(plan).for_plan(plan);
    let (mut again, mut block) = (again, Block::default());
    again.next_block(&mut block);
    assert_eq!(block.lens_mm[..], lens_mm[..block.lens_mm.len()]);
}

/// What is left is what the lens' axis makes of acceleration, a·lag²/4; far less than the Rayleigh
/// range, unlike a lens that is later than its file says.
#[test]
fn the_focus_is_on_the_lit_beam() {
    let machine = head();
    let focus = machine.optics.focus.as_ref().unwrap();
    let most_mm = 0.25 * focus.acceleration_max_mm_s2 * focus.lag_s.powi(2) * focus.magnification;
    let off_mm = |lens_late_ns| {
        let mismatch = Mismatch { lens_late_ns, ..Mismatch::default() };
        let options = MarkOptions { mismatch, ..MarkOptions::default() };
        let score = play(&PLAN, &options, &mut |_| {}).unwrap().score;
        1e-3 * score.focus_error_um.unwrap().max
    };
    let [on_time_mm, late_mm] = [0, 700_000].map(off_mm);
    assert!(on_time_mm > 0.0 && on_time_mm < most_mm, "{on_time_mm} of {most_mm} mm");
    assert!(late_mm > 0.3, "{late_mm}");
    let mut black_box = head();
    black_box.output.drive = Drive::BlackBox;
    let black_box = run(&black_box, None).unwrap().score.focus_error_um.unwrap().max;
    assert!(1e-3 * black_box < most_mm, "{black_box} µm");
    let mut fixed = head();
    fixed.optics.focus = None;
    let fixed = run(&fixed, None).unwrap();
    assert!(fixed.score.focus_error_um.is_none() && lens_mm(&fixed.plan).is_empty());
}

/// A circle beside the field's centre waits for the lens before and after it.
#[test]
fn circles_wait_for_the_lens() {
    let ellipse = Ellipse::new([100.0, 50.0], [2.0, 2.0], 500.0);
    let round = Round::Ellipse(ellipse);
    let of = |machine: &Machine| {
        circle(machine, &round, Pen::default(), &MarkOptions::default(), &mut |_| {}).unwrap()
    };
    let mut fixed = head();
    fixed.optics.focus = None;
    let (circled, quick) = (of(&head()), of(&fixed));
    // 3 mm of lens at 280 mm/s, twice.
    assert!(circled.marked.plan.n_samples() > quick.marked.plan.n_samples() + 2000);
    assert!(circled.roundness.error_max_mm < 3e-4, "{:?}", circled.roundness);
    assert!(circled.marked.score.focus_error_um.unwrap().max < 100.0);
}

#[test]
fn the_audit_refuses_what_the_lens_cannot_do() {
    let plan = &*PLAN;
    let says = |change: &dyn Fn(&mut Focus), what: &str| {
        let error = refusal(plan, change);
        let AuditError::Limit { quantity, .. } = &error else { panic!("{error}") };
        assert!(quantity.contains(what), "{error}");
    };
    says(&|focus| focus.speed_max_mm_s *= 0.7, "the focusing lens");
    says(&|focus| focus.speed_max_mm_s = 40.0, "the focusing lens");
    says(&|focus| focus.acceleration_max_mm_s2 *= 0.05, "the focusing lens");
    says(&|focus| focus.travel_mm = 3.0, "travel of the focusing lens");
    // Plans leave a tenth of speed and acceleration.
    let machine = with_focus(&plan.machine, |focus| {
        focus.speed_max_mm_s *= 0.95;
        focus.acceleration_max_mm_s2 *= 0.95;
    });
    Plan::new(PlanDraft { machine, ..PlanDraft::clone(plan) }).unwrap();
    // Commands are ahead by the lag, so nothing moves before it.
    let late = refusal(plan, |focus| focus.lag_s = 0.1);
    assert!(late.to_string().contains("the dark before it"), "{late}");
}

#[test]
fn plans_for_other_lenses_have_other_ids() {
    let plan = &*PLAN;
    let machine = with_focus(&plan.machine, |focus| focus.lag_s *= 0.5);
    let other = Plan::new(PlanDraft { machine, ..PlanDraft::clone(plan) }).unwrap();
    assert_ne!(other.id(), plan.id());
}

#[test]
fn a_head_of_unknown_servo_waits_too() {
    let mut machine = head();
    machine.output.drive = Drive::BlackBox;
    let plan = run(&machine, None).unwrap().plan;
    assert!(darks(&plan).iter().all(|(dark_s, least_s)| dark_s > least_s));
}

#[test]
fn classic_delays_that_leave_the_lens_behind_are_refused() {
    let error = run(&head(), Some(Planner::Classic)).err().unwrap();
    assert!(matches!(&error, Error::Audit(AuditError::Limit { .. })), "{error}");
    assert!(error.to_string().contains("the focusing lens"), "{error}");
}

#[test]
fn places_tell_where_the_lens_stands() {
    let machine = head();
    let place = |x_mm, y_mm, z_mm| Place { place_mm: FieldPoint::new(x_mm, y_mm), z_mm, line: 3 };
    let places = [place(0.0, 0.0, None), place(140.0, -140.0, None), place(0.0, 140.0, Some(2.0))];
    let mapped = angles_of(&machine, None, &places).unwrap();
    let travel_mm: Vec<f64> = mapped.iter().map(|row| row.focus_mm.unwrap()).collect();
    let middle_mm = 0.5 * 39.669_667_502_690_91;
    // At 2 mm of height: e 30 and d 458 to y 140, and 2 mm nearer than the way to the centre.
    let raised_mm = 458.0_f64.hypot(140.0) - 458.0 - 2.0;
    for (found, shift_mm) in travel_mm.iter().zip([0.0, 2.0 * middle_mm, raised_mm]) {
        assert!((found - (shift_mm - middle_mm) / 4.0).abs() < 1e-9, "{found}");
    }
    let error = angles_of(&machine, None, &[place(0.0, 0.0, Some(1.0))]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 3: (0, 0) mm at a height of 1 mm needs the focusing lens at -5.2087 mm, the limit is ±5 mm"
    );
}
