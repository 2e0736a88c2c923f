//! The command line contract of `ftheta pattern grid --fiducials`, `ftheta calibrate field --image`
//! and `ftheta calibrate camera`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

mod bench;

use bench::{Bench, number};
use serde_json::Value;
use std::fs;

fn grid(bench: &Bench) {
    let what = ["pattern", "grid", "--machine", "S14-f420", "--points", "81", "--field", "120"];
    let (code, value) = bench.json(&[&what[..], &["--fiducials", "--out", "grid.svg"]].concat());
    assert_eq!((code, &value["sheet"]["paper"]), (0, &Value::from("A4")), "{value}");
    let pdf = fs::read(bench.path("grid.sheet.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.4"));
    assert!(fs::read_to_string(bench.path("grid.sheet.svg")).unwrap().contains("width=\"210mm\""));
}

/// Takes a picture; returns what a caliper reads on the sheet.
fn photograph(bench: &Bench, out: &str, more: &[&str]) -> [String; 2] {
    let take = ["twin", "photograph", "grid.json", "--machine", "S14-f420", "--seed", "9"];
    let small = ["--megapixels", "4", "--out", out];
    let (code, value) = bench.json(&[&take[..], &small, more].concat());
    assert_eq!(code, 0, "{value}");
    ["x_mm", "y_mm"].map(|axis| number(&value, &["sheet", axis]).to_string())
}

const FIELD: [&str; 8] =
    ["calibrate", "field", "--machine", "S14-f420", "--pattern", "grid.json", "--out", "table.txt"];

#[test]
fn a_photograph_becomes_a_table_and_a_second_one_checks_it() {
    let bench = Bench::new();
    grid(&bench);
    let [x, y] = photograph(&bench, "one.jpg", &[]);
    let sheet = ["--sheet-x-mm", x.as_str(), "--sheet-y-mm", y.as_str(), "--placement", "sheet"];
    let one = ["--image", "one.jpg", "--points-out", "round-1.csv"];
    let (code, value) = bench.json(&[&FIELD[..], &sheet, &one].concat());
    assert_eq!((code, &value["points"]), (0, &Value::from(81)), "{value}");
    assert!(number(&value, &["before_um", "rms"]) > 300.0, "{value}");
    assert!(number(&value, &["after_um", "rms"]) < 5.0, "{value}");
    let picture = &value["pictures"][0];
    assert_eq!(picture["signs"], 40, "{picture}");
    assert_eq!(picture["marks"].as_array().unwrap().len(), 81);
    let page = fs::read_to_string(bench.path("calibration.html")).unwrap();
    assert!(page.contains("data:image/jpeg;base64,") && page.contains("sign 39"));

    // Marked through the table the field is true, as a second picture and both rounds say.
    let [x, y] = photograph(&bench, "two.png", &["--table", "table.txt", "--turn-deg", "180"]);
    let sheet = ["--sheet-x-mm", x.as_str(), "--sheet-y-mm", y.as_str(), "--placement", "sheet"];
    let two =
        ["--image", "two.png", "--points", "round-1.csv", "--marked-through", "nominal,table.txt"];
    let (code, value) = bench.json(&[&FIELD[..], &sheet, &two].concat());
    assert_eq!((code, &value["rounds"]), (0, &Value::from(2)), "{value}");
    assert_eq!(value["points"], 162);
}

#[test]
fn a_camera_that_stands_still_needs_no_sheet() {
    let bench = Bench::new();
    grid(&bench);
    let mut sheet = [String::new(), String::new()];
    for (name, tilt, turn) in
        [("a.jpg", "0", "0"), ("b.jpg", "30", "0"), ("c.jpg", "28", "120"), ("d.jpg", "32", "240")]
    {
        sheet = photograph(&bench, name, &["--tilt-deg", tilt, "--turn-deg", turn]);
    }
    let [x, y] = &sheet;
    let size = ["--sheet-x-mm", x.as_str(), "--sheet-y-mm", y.as_str()];
    let camera =
        ["calibrate", "camera", "--pattern", "grid.json", "--keep-view", "--out", "camera.json"];
    let images = ["--image", "a.jpg", "--image", "b.jpg", "--image", "c.jpg", "--image", "d.jpg"];
    let (code, value) = bench.json(&[&camera[..], &size, &images].concat());
    assert_eq!(code, 0, "{value}");
    assert!(number(&value, &["focal_sd_px"]) < 0.01 * number(&value, &["focal_px"]), "{value}");
    assert!(number(&value, &["rms_px"]) < 0.5, "{value}");
    // With the kept view signs do not matter: they are taken out of the pattern.
    let text = fs::read_to_string(bench.path("grid.json")).unwrap();
    let mut pattern: Value = serde_json::from_str(&text).unwrap();
    let features = pattern["features"].as_array_mut().unwrap();
    features.retain(|feature| feature["kind"] == "cross");
    bench.write("grid.json", pattern.to_string());
    let seen = ["--image", "a.jpg", "--camera-file", "camera.json"];
    let (code, value) = bench.json(&[&FIELD[..], &seen].concat());
    assert_eq!((code, &value["points"]), (0, &Value::from(81)), "{value}");
    assert!(number(&value, &["after_um", "rms"]) < 5.0, "{value}");

    let fault = |more: &[&str]| {
        let fault = bench.fault(&[&FIELD[..], more].concat());
        fault["message"].as_str().unwrap().to_owned()
    };
    assert!(fault(&["--image", "a.jpg"]).contains("--fiducials"));
    let fewer = bench.fault(&[&camera[..], &size, &images[..4]].concat());
    assert_eq!(fewer["value"], "2", "{fewer}");
    bench.write("bad.json", "{}");
    assert!(fault(&["--image", "a.jpg", "--camera-file", "bad.json"]).contains("camera_matrix"));
    bench.write("text.jpg", b"no picture");
    assert!(fault(&["--image", "text.jpg", "--camera-file", "camera.json"]).contains("text.jpg"));
    let none = bench.run(&["calibrate", "field", "--out", "t.txt"]).status.code();
    assert_eq!(none, Some(2));
}
