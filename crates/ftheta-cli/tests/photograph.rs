//! The command line contract of `ftheta twin photograph`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

mod bench;

use bench::{Bench, number};
use serde_json::Value;
use std::fs;

#[test]
fn photographs_are_taken_with_their_truth_or_refused() {
    let bench = Bench::new();
    let pattern = bench.write(
        "delay.json",
        r#"{"kind": "delay", "field_mm": 50, "features": [
            {"id": "a", "kind": "line", "x1_mm": 0, "y1_mm": 0, "x2_mm": 3, "y2_mm": 0,
             "speed_mm_s": 4000, "power_ratio": 1},
            {"id": "x", "kind": "reference", "x1_mm": -1, "y1_mm": 2, "x2_mm": 4, "y2_mm": 2,
             "burned": false}]}"#,
    );
    let take = ["twin", "photograph", pattern.as_str(), "--machine", "S10-f160", "--head", "none"];
    let late = ["--laser-on-us", "50", "--laser-off-us", "-20", "--um-per-px", "40"];
    let files = ["--out", "d.jpg", "--truth", "d.json"];
    let (code, value) = bench.json(&[&take[..], &late, &files].concat());
    assert_eq!(code, 0, "{value}");
    assert!((number(&value, &["um_per_px"]) - 40.0).abs() < 1.0);
    let printed_mm = number(&value, &["sheet", "x_mm"]);
    assert!((0.003..0.1).contains(&(printed_mm - 5.0).abs()), "{printed_mm}");
    assert!(value["sheet"]["y_mm"].is_null());
    let bytes = fs::read(bench.path("d.jpg")).unwrap();
    let picture = ftheta::formats::picture_file::read(&bytes).unwrap().picture;
    assert_eq!(picture.width() as f64, number(&value, &["width_px"]));
    let truth: Value = serde_json::from_slice(&fs::read(bench.path("d.json")).unwrap()).unwrap();
    let line = &truth["ends"][0];
    assert_eq!(line["id"], "a");
    // 4 m/s, and a micrometre of jitter.
    assert!((number(line, &["from", "x_mm"]) - 0.2).abs() < 5e-3);
    assert!((number(line, &["to", "x_mm"]) - 2.92).abs() < 5e-3);
    let fault = bench.fault(&[&take[..], &["--out", "d.bmp"]].concat());
    assert!(fault["message"].as_str().unwrap().ends_with("expected .png or .jpg"), "{fault}");
}
