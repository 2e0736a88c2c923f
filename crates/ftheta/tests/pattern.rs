//! The ILDA test pattern, planned and played.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::mark::MarkOptions;
use ftheta::pattern::ilda::{CIRCLE_GAIN, Ilda, PatternOptions, compare, tuned_rate};
use ftheta_formats::machine::preset;
use ftheta_model::recipe::Pen;

fn options(mark_speed_mm_s: f64, points_per_s: f64) -> PatternOptions {
    let pen = Pen { mark_speed_mm_s, ..Pen::default() };
    PatternOptions { pen, points_per_s, mark: MarkOptions::default() }
}

#[test]
fn the_planned_pattern_is_true_where_played_points_are_not() {
    let machine = preset("S10-f160").unwrap().unwrap();
    let ilda = Ilda::new(&machine, None);
    // Eight optical degrees of a lens whose image height is the angle times its focal length.
    assert!((ilda.side_mm() - 160.0 * 8_f64.to_radians()).abs() < 1e-9);
    let compared = compare(&ilda, &machine, &options(3000.0, 30e3), &mut |_| {}).unwrap();
    let [planned, fast, slow] = &compared.ways[..] else { panic!("{} ways", compared.ways.len()) };
    assert!(planned.traced.error_max_mm <= 0.010, "{:?}", planned.traced);
    assert!((planned.traced.circle_ratio - 1.0).abs() < 1e-3, "{:?}", planned.traced);
    assert!(slow.traced.error_max_mm > 20.0 * planned.traced.error_max_mm, "{:?}", slow.traced);
    assert!(fast.traced.error_max_mm > slow.traced.error_max_mm, "{:?}", fast.traced);
}

/// At the rate at which the servo's answer is the pattern's, the circle touches the square, if the
/// pattern is so small that the motors stand it.
#[test]
fn a_small_circle_touches_the_square_at_the_tuned_rate() {
    let machine = preset("S10-f160").unwrap().unwrap();
    let ilda = Ilda::new(&machine, Some(2.0));
    let rate = tuned_rate(&machine).unwrap();
    let compared = compare(&ilda, &machine, &options(500.0, rate), &mut |_| {}).unwrap();
    let ratio = compared.ways[1].traced.circle_ratio;
    assert!((ratio - CIRCLE_GAIN).abs() < 0.03, "{rate}: {ratio}");
}
