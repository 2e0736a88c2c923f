//! The comb for delays as it is drawn and marked, and light whose delays are the machine file's.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::machine::preset;
use ftheta::formats::svg;
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::machine::Machine;
use ftheta::model::pattern::FeatureShape;
use ftheta::model::recipe::Recipe;
use ftheta::pattern::delay::{self, DelayOptions, LineAxis, Method};
use ftheta::twin::mismatch::Mismatch;
use kurbo::Shape as _;

fn machine() -> Machine {
    preset("S14-f420").unwrap().unwrap()
}

/// The comb is marked as it is measured: in its order, in its directions, at its speeds, with the
/// same energy a length, and with free ways between lines and references.
#[test]
fn a_delay_comb_is_marked_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("delay.svg");
    let machine = machine();
    let options = DelayOptions {
        speeds_mm_s: vec![1000.0, 4000.0],
        n_lines: 3,
        axis: LineAxis::Y,
        ..DelayOptions::usual(Method::Comb, &machine)
    };
    let made = delay::sheet(&options, &machine).unwrap();
    let files = made.write(&out).unwrap();
    assert_eq!(
        files.iter().map(|file| file.0).collect::<Vec<_>>(),
        ["drawing", "recipe", "features"]
    );
    let (recipe, _) = ftheta::import::recipe_for(&out, None).unwrap();
    assert!(recipe.keep_order);
    let job = ftheta::import::drawing(&out, &recipe, &svg::SvgOptions::default()).unwrap().value;
    let features = ftheta::import::pattern(&out.with_extension("json")).unwrap().features;
    assert_eq!(features.len(), 2 * 2 * 3 + 4);
    let mut n_lines = 0;
    for (feature, shape) in features.iter().zip(&job.layers[0].shapes) {
        let pen = &job.pens[shape.pen_index];
        let bounds = shape.path.bounding_box();
        match &feature.shape {
            FeatureShape::Line { from_mm, to_mm, process } => {
                let first = shape.path.elements()[0].end_point().unwrap();
                let last = shape.path.elements()[1].end_point().unwrap();
                assert!(first.distance((*from_mm).into()) < 1e-9);
                assert!(last.distance((*to_mm).into()) < 1e-9);
                assert_eq!(pen.mark_speed_mm_s, process.speed_mm_s);
                let by_length = pen.power_w / pen.mark_speed_mm_s;
                assert!((by_length - 10.0 / 4000.0).abs() < 1e-9, "{pen:?}");
                assert!(bounds.width() < 1e-9 && (bounds.height() - 4.0).abs() < 1e-9);
                n_lines += 1;
            }
            FeatureShape::Reference { burned: true, .. } => {
                assert!(pen.mark_speed_mm_s <= 500.0, "{pen:?}");
                // Beyond where a line ends that is 250 µs late, on either side.
                let away = bounds.y0.abs().min(bounds.y1.abs());
                assert!(away > 2.0 + 1.0 || bounds.height() > 1.0, "{bounds:?}");
            }
            other => unreachable!("{other:?} is not of a comb"),
        }
    }
    assert_eq!(n_lines, 12);
    // And a machine marks it, lines first to last.
    let options = MarkOptions { order: None, ..MarkOptions::default() };
    let marked = mark(&job, &machine, &recipe, &options, &mut |_| {}).unwrap();
    assert!(marked.score.contour_error_um.max < 10.0, "{:?}", marked.score.contour_error_um);
}

#[test]
fn delay_patterns_that_cannot_be_measured_are_refused() {
    let machine = machine();
    let refused = |method, change: &dyn Fn(&mut DelayOptions)| {
        let mut options = DelayOptions::usual(method, &machine);
        change(&mut options);
        delay::sheet(&options, &machine).unwrap_err().to_string()
    };
    let comb = Method::Comb;
    for (error, expected) in [
        (refused(comb, &|o| o.speeds_mm_s = vec![1e3]), "--speeds is 1 of them, expected 2 to 20"),
        (refused(comb, &|o| o.speeds_mm_s[2] = 2e5), "--speeds is 200000 mm/s"),
        (refused(comb, &|o| o.n_lines = 0), "--lines is 0"),
        (refused(comb, &|o| o.length_mm = 0.1), "--length-mm is 0.1 mm"),
        (refused(comb, &|o| o.n_lines = 100), "field"),
        (refused(Method::Rectangle, &|o| o.preset_s = [2e-3, 0.0]), "--preset-us"),
        (refused(Method::Rectangle, &|o| o.speeds_mm_s = vec![1e3, 2e3]), "--speeds is 2 of them"),
    ] {
        assert!(error.contains(expected), "{error}: {expected}");
    }
}

/// Two lines on a machine whose laser has these latencies and whose mirrors this delay, µs.
fn marked(on_us: i64, off_us: i64, mirrors_us: i64, late_ns: [i64; 2]) -> Marked {
    let mut machine = machine();
    machine.laser.on_latency_ns = on_us * 1000;
    machine.laser.off_latency_ns = off_us * 1000;
    machine.laser.mirror_delay_ns = mirrors_us * 1000;
    let text = r#"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm"
        viewBox="0 0 40 40" fill="none" stroke="black"><path d="M5 5h20"/><path d="M25 9h-20"/></svg>"#;
    let recipe = Recipe::default();
    let job = svg::read(text.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
    let mismatch = Mismatch { late_ns, ..Mismatch::default() };
    let options = MarkOptions { mismatch, speed_mm_s: Some(2000.0), ..MarkOptions::default() };
    mark(&job, &machine, &recipe, &options, &mut |_| {}).unwrap()
}

/// What the machine file says of delays is made up for, whatever its sign, and what it does not
/// say shows at the ends of lines.
#[test]
fn known_delays_do_not_show() {
    let end_um = |marked: &Marked| marked.score.end_error_um.max;
    let good_um = end_um(&marked(20, 15, 0, [0; 2]));
    for (on_us, off_us, mirrors_us) in [(-40, -55, 0), (85, -60, 0), (20, 15, 50), (0, 0, -30)] {
        let found_um = end_um(&marked(on_us, off_us, mirrors_us, [0; 2]));
        assert!((found_um - good_um).abs() < 0.1, "{on_us} {off_us} {mirrors_us}: {found_um} µm");
    }
    // 2 m/s times 85 µs at the starts; then 60 µs at the stops.
    let late_um = end_um(&marked(20, 15, 0, [85_000, 0]));
    assert!((late_um - 170.0).abs() < 5.0, "{late_um}");
    let early_um = end_um(&marked(20, 15, 0, [0, -60_000]));
    assert!((early_um - 120.0).abs() < 5.0, "{early_um}");
}
