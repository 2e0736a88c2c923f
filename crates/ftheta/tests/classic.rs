//! The classic planner on the twin: the faults it is known for, and the invariants of every run.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::Error;
use ftheta::formats::{machine, svg};
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::job::Job;
use ftheta::model::machine::{Lens, Machine, Servo};
use ftheta::model::plan::Planner;
use ftheta::model::recipe::{ClassicRecipe, Interpolation, Pen, PenRule, Recipe};
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use proptest::prelude::*;

/// A 40 mm page with these elements, stroked.
fn drawing(elements: &str, recipe: &Recipe) -> Job {
    let text = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40"
            fill="none" stroke="black">{elements}</svg>"#
    );
    svg::read(text.as_bytes(), recipe, &svg::SvgOptions::default()).unwrap().value
}

const SQUARE_AND_LINES: &str = r#"<path d="M10 10 h10 v10 h-10 z"/>
    <path d="M25 10 l8 4"/> <path d="M25 16 l3 -2"/> <circle cx="15" cy="30" r="4"/>"#;

fn preset(name: &str) -> Machine {
    machine::preset(name).unwrap().unwrap()
}

fn at_speed(mark_speed_mm_s: f64, classic: ClassicRecipe) -> Recipe {
    let pen = Pen { mark_speed_mm_s, ..Pen::default() };
    let pens = vec![PenRule { pen, color_rgb: None, layer: None }];
    Recipe { pens, classic, ..Recipe::default() }
}

fn run(machine: &Machine, recipe: &Recipe, options: &MarkOptions) -> Result<Marked, Error> {
    let job = drawing(SQUARE_AND_LINES, recipe);
    mark(&job, machine, recipe, options, &mut |_| {})
}

fn classic() -> MarkOptions {
    MarkOptions { planner: Some(Planner::Classic), ..MarkOptions::default() }
}

fn zero_delays() -> ClassicRecipe {
    ClassicRecipe {
        jump_delay_min_s: Some(0.0),
        jump_delay_s: Some(0.0),
        mark_delay_s: Some(0.0),
        polygon_delay_s: Some(0.0),
        laser_on_delay_ns: Some(0),
        laser_off_delay_ns: Some(0),
        ..ClassicRecipe::default()
    }
}

/// The figure asked for: right delays keep the beam within 10 µm at 0.5 m/s on S10, f = 163 mm.
#[test]
fn lag_derived_delays_keep_ten_micrometres() {
    let recipe = at_speed(500.0, ClassicRecipe::default());
    let marked = run(&preset("S10-f163"), &recipe, &classic()).unwrap();
    let error_um = marked.score.contour_error_um.max;
    assert!(error_um < 10.0, "contour error {error_um} µm");
    assert!(marked.score.stray_energy_ratio < 0.001);
    assert_eq!(marked.plan.limits().violations, 0);
}

/// Without delays the light ends about one lag of travel short, and corners are cut.
#[test]
fn zero_delays_leave_ends_short_and_corners_round() {
    let machine = preset("S10-f163");
    let recipe = at_speed(500.0, zero_delays());
    let marked = run(&machine, &recipe, &classic()).unwrap();
    let lag_travel_um = 164.0e-6 * 500.0e3;
    let score = &marked.score;
    assert!(score.end_error_um.max > 0.7 * lag_travel_um, "ends {:?}", score.end_error_um);
    assert!(score.coverage_error_um.max > 15.0, "corners {:?}", score.coverage_error_um);
    // With everything right but the polygon delay, what is left is the corner alone.
    let no_polygon = ClassicRecipe { polygon_delay_s: Some(0.0), ..ClassicRecipe::default() };
    let rounded = run(&machine, &at_speed(2000.0, no_polygon), &classic()).unwrap();
    let waited = at_speed(2000.0, ClassicRecipe::default());
    let waited = run(&machine, &waited, &classic()).unwrap();
    let [rounded, waited] = [rounded, waited].map(|marked| marked.score.contour_error_um.max);
    assert!(rounded > 4.0 * waited, "corner {rounded} µm without, {waited} µm with delay");
}

#[test]
fn same_job_gives_same_plan_and_mismatch_only_touches_the_twin() {
    let (machine, recipe) = (preset("S14"), at_speed(1000.0, ClassicRecipe::default()));
    let first = run(&machine, &recipe, &classic()).unwrap();
    let second = run(&machine, &recipe, &classic()).unwrap();
    let mismatch = Mismatch { f1: 0.03, kt: -0.02, zeta: Some(0.0025), ..Mismatch::default() };
    let options = MarkOptions { mismatch, noise_mm: 0.001, ..classic() };
    let other = run(&machine, &recipe, &options).unwrap();
    assert_eq!(first.plan.id(), second.plan.id());
    assert_eq!(first.plan.id(), other.plan.id());
    assert_eq!(first.score, second.score);
    assert!(first.score.contour_error_um.rms != other.score.contour_error_um.rms);
}

/// Marks that all but touch are joined without a jump, and the plan holds together.
#[test]
fn marks_that_all_but_touch_are_joined() {
    let recipe = at_speed(1000.0, ClassicRecipe::default());
    let elements = r#"<path d="M10 10 h5"/><path d="M15.0000003 10 h5"/>"#;
    let job = drawing(elements, &recipe);
    let options = MarkOptions { order: Some(Order::Keep), ..classic() };
    let marked = mark(&job, &preset("S10"), &recipe, &options, &mut |_| {}).unwrap();
    assert_eq!((marked.plan.marks.len(), marked.times.n_jumps), (2, 0));
}

#[test]
fn noise_is_seeded() {
    let (machine, recipe) = (preset("S10"), at_speed(1000.0, ClassicRecipe::default()));
    let with_seed = |seed| {
        let options = MarkOptions { noise_mm: 0.002, seed, ..classic() };
        run(&machine, &recipe, &options).unwrap().score
    };
    assert_eq!(with_seed(7), with_seed(7));
    assert!(with_seed(7).contour_error_um.rms != with_seed(8).contour_error_um.rms);
}

/// `lineTo(point, vmax, a0, a1)`: with ramps at both ends the beam lags less where light is
/// switched, at the price of time.
#[test]
fn ramps_and_dda_are_played() {
    let machine = preset("S10");
    let plain = run(&machine, &at_speed(1000.0, ClassicRecipe::default()), &classic());
    let plain = plain.unwrap();
    let ramps = ClassicRecipe {
        acceleration_mm_s2: Some(5e6),
        deceleration_mm_s2: Some(1e7),
        ..ClassicRecipe::default()
    };
    let ramped = run(&machine, &at_speed(1000.0, ramps), &classic()).unwrap();
    assert!(ramped.times.mark_s > plain.times.mark_s);
    assert!(ramped.score.contour_error_um.max < plain.score.contour_error_um.max);
    let dda = ClassicRecipe { interpolation: Some(Interpolation::Dda), ..Default::default() };
    let stepped = run(&machine, &at_speed(1000.0, dda), &classic()).unwrap();
    assert!(stepped.score.contour_error_um.max < 20.0, "{:?}", stepped.score.contour_error_um);
}

/// Skywriting: legs at full speed from end to end have the dose asked for right up to their ends,
/// where delays burn corners; they pay with time.
#[test]
fn skywriting_keeps_speed_and_dose_up_to_every_corner() {
    let machine = preset("S10-f160");
    let sky = ClassicRecipe {
        sky_run_in_s: Some(500e-6),
        sky_run_out_s: Some(200e-6),
        jump_delay_min_s: Some(0.0),
        jump_delay_s: Some(0.0),
        ..ClassicRecipe::default()
    };
    for interpolation in [Interpolation::Absolute, Interpolation::Dda] {
        let recipe = ClassicRecipe { interpolation: Some(interpolation), ..sky };
        let marked = run(&machine, &at_speed(2000.0, recipe), &classic()).unwrap();
        // Four sides, two lines, one circle.
        assert_eq!((marked.plan.marks.len(), marked.times.n_jumps), (7, 6));
        assert_eq!(marked.times.delay_s, 0.0);
        let score = &marked.score;
        assert!(score.end_error_um.max < 3.0, "ends {:?}", score.end_error_um);
        let dose = score.dose_ratio.unwrap();
        assert!(0.98 < dose.min && dose.max < 1.02, "dose {dose:?}");
        let delays = run(&machine, &at_speed(2000.0, ClassicRecipe::default()), &classic());
        let delays = delays.unwrap();
        assert!(delays.score.dose_ratio.unwrap().max > 3.0);
        assert!((delays.times.marked_mm - marked.times.marked_mm).abs() < 1e-6);
    }
}

#[test]
fn other_servos_and_optics_are_played() {
    let mut machine = preset("S10");
    machine.scanner.servo = Servo::Pid {
        bandwidth_hz: 600.0,
        damping: 0.9,
        integral_time_s: f64::INFINITY,
        current_bandwidth_hz: 5000.0,
    };
    machine.optics.lens =
        Lens::PostObjective { mirror_distance_mm: 12.0, working_distance_mm: 180.0 };
    let recipe = at_speed(300.0, ClassicRecipe::default());
    let marked = run(&machine, &recipe, &classic()).unwrap();
    assert!(marked.score.contour_error_um.max < 30.0, "{:?}", marked.score.contour_error_um);
}

/// The whole field can be marked, up to its corners, with every preset.
#[test]
fn frame_of_the_field_is_within_the_limits() {
    for name in machine::PRESETS {
        let machine = preset(name);
        let side_mm = machine.optics.field_mm;
        let text = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{side_mm}mm" height="{side_mm}mm"
                viewBox="0 0 1 1"><path stroke="red" fill="none" d="M0 0H1V1H0Z"/></svg>"#
        );
        let recipe = at_speed(3000.0, ClassicRecipe::default());
        let job = svg::read(text.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
        let options = MarkOptions { order: Some(Order::Keep), ..classic() };
        let marked = mark(&job, &machine, &recipe, &options, &mut |_| {});
        assert!(marked.is_ok(), "{name}: {:?}", marked.err());
    }
}

#[test]
fn faults_are_errors_that_name_place_value_and_limit() {
    let machine = preset("S10");
    let fault = |recipe: &Recipe, options: &MarkOptions| {
        run(&machine, recipe, options).err().expect("an error").fault()
    };
    let options = classic();
    let mut recipe = at_speed(1e9, ClassicRecipe::default());
    let found = fault(&recipe, &options);
    assert_eq!(found.place, "pen \"default\": mark_speed");
    assert_eq!(found.value, "1000000000 mm/s");
    recipe.pens[0].pen = Pen { power_w: 25.0, ..Pen::default() };
    assert_eq!(fault(&recipe, &options).limit, "0 to 20 W");
    let late = ClassicRecipe { laser_off_delay_ns: Some(600_000), ..Default::default() };
    let found = fault(&at_speed(1000.0, late), &options);
    assert!(found.message.contains("laser off edge lies"), "{}", found.message);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Random strokes on a random machine with a random plant: no limit is passed, every mark is
    /// lit, and the energy is what power and time say.
    #[test]
    fn any_job_on_any_machine_keeps_the_invariants(
        points in prop::collection::vec((-15.0..15.0_f64, -15.0..15.0_f64), 4..30),
        preset_index in 0..12_usize,
        mark_speed_mm_s in 20.0..4000.0_f64,
        f1 in -0.03..0.03_f64,
        kt in -0.02..0.02_f64,
        keep in any::<bool>(),
    ) {
        let elements: String = points
            .chunks(3)
            .filter(|chunk| chunk.len() > 1)
            .map(|chunk| {
                let corners: Vec<String> =
                    chunk.iter().map(|(x, y)| format!("{} {}", x + 20.0, y + 20.0)).collect();
                format!(r#"<polyline points="{}"/>"#, corners.join(" "))
            })
            .collect();
        let recipe = at_speed(mark_speed_mm_s, ClassicRecipe::default());
        let job = drawing(&elements, &recipe);
        let options = MarkOptions {
            order: keep.then_some(Order::Keep),
            mismatch: Mismatch { f1, kt, ..Mismatch::default() },
            ..classic()
        };
        let machine = preset(machine::PRESETS[preset_index]);
        let marked = mark(&job, &machine, &recipe, &options, &mut |_| {}).unwrap();
        prop_assert_eq!(marked.plan.limits().violations, 0);
        prop_assert_eq!(marked.score.n_unlit_marks, 0);
        let power_w = Pen::default().power_w;
        prop_assert!((marked.score.energy_j / (power_w * marked.times.mark_s) - 1.0).abs() < 1e-6);
        prop_assert!((marked.dose.total_j() / marked.score.energy_j - 1.0).abs() < 1e-3);
        prop_assert!((marked.score.duration_s - marked.times.duration_s).abs() < 1e-8);
    }
}
