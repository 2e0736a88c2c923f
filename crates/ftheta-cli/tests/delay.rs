//! The command line contract of `ftheta pattern delay` and `ftheta calibrate delay`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

mod bench;

use bench::{Bench, number};
use serde_json::Value;
use std::fs;

/// A comb small enough to be quick, at 30 µm/px.
fn comb(bench: &Bench) {
    let small = ["--speeds", "1000,3000,6000,9000", "--lines", "4", "--room-us", "150"];
    let pattern = ["pattern", "delay", "--machine", "S10-f255", "--out", "comb.svg"];
    let (code, value) = bench.json(&[&pattern[..], &small].concat());
    assert_eq!(code, 0, "{value}");
}

/// A picture of it; S10-f255 is how it was built.
fn photograph(bench: &Bench, machine: &str, seed: &str, out: &str, more: &[&str]) {
    let take = ["twin", "photograph", "comb.json", "--machine", machine, "--built-as", "S10-f255"];
    let late = ["--laser-on-us", "85", "--laser-off-us", "60", "--um-per-px", "30"];
    let files = ["--seed", seed, "--out", out];
    let (code, value) = bench.json(&[&take[..], &late, &files, more].concat());
    assert_eq!(code, 0, "{value}");
}

fn calibrate(bench: &Bench, image: &str, more: &[&str]) -> Value {
    let what = ["calibrate", "delay", "--image", image, "--pattern", "comb.json"];
    let (code, value) = bench.json(&[&what[..], more].concat());
    assert_eq!(code, 0, "{value}");
    value
}

#[test]
fn delays_are_measured_written_and_gone_in_the_second_picture() {
    let bench = Bench::new();
    comb(&bench);
    photograph(&bench, "S10-f255", "5", "first.png", &[]);
    let first = calibrate(&bench, "first.png", &["--machine", "S10-f255", "--out", "mine.toml"]);
    let set = number(&first, &["set", "on_us"]);
    assert!((number(&first, &["tau_on_us"]) - 85.0).abs() < 0.7, "{first}");
    assert!((number(&first, &["tau_off_us"]) - 60.0).abs() < 0.7, "{first}");
    assert!((number(&first, &["on_us"]) + number(&first, &["tau_on_us"]) - set).abs() < 1e-9);
    assert!(number(&first, &["tau_on_sd_us"]) < 0.7);
    assert_eq!(first["method"], "comb");
    assert!(first["advice"][0].as_str().unwrap().contains("again"), "{first}");
    let machine = fs::read_to_string(bench.path("mine.toml")).unwrap();
    let latency = machine.lines().find_map(|line| line.strip_prefix("on_latency_us = ")).unwrap();
    let latency_us: f64 = latency.parse().unwrap();
    assert!((latency_us + number(&first, &["on_us"])).abs() < 2e-3, "{latency_us} {first}");
    assert!(fs::read_to_string(bench.path("calibration.html")).unwrap().contains("85."));

    // Made again for the machine file: what is left is next to nothing.
    let again = ["pattern", "delay", "--machine", "mine.toml", "--out", "comb.svg"];
    let small = ["--speeds", "1000,3000,6000,9000", "--lines", "4", "--room-us", "150"];
    assert_eq!(bench.json(&[&again[..], &small].concat()).0, 0);
    photograph(&bench, "mine.toml", "6", "second.png", &[]);
    let second = calibrate(&bench, "second.png", &["--machine", "mine.toml", "--apply", "both"]);
    assert!(number(&second, &["tau_on_us"]).abs() < 0.8, "{second}");
    assert!(number(&second, &["tau_off_us"]).abs() < 0.8, "{second}");
    let total = number(&second, &["on_us"]);
    assert!((total + 105.0).abs() < 0.5, "{second}");
}

#[test]
fn pictures_without_delays_are_refused_and_nothing_is_written() {
    let bench = Bench::new();
    comb(&bench);
    photograph(&bench, "S10-f255", "7", "mirrored.jpg", &["--mirror"]);
    photograph(&bench, "S10-f255", "7", "good.png", &[]);
    let fault = |image: &str, pattern: &str| {
        let what = ["calibrate", "delay", "--image", image, "--pattern", pattern];
        let written = ["--machine", "S10", "--out", "new.toml"];
        let fault = bench.fault(&[&what[..], &written].concat());
        assert!(!bench.path("new.toml").exists() && !bench.path("calibration.html").exists());
        fault["message"].as_str().unwrap().to_owned()
    };
    assert!(fault("mirrored.jpg", "comb.json").contains("mirrored"));
    let bytes = fs::read(bench.path("good.png")).unwrap();
    bench.write("short.png", &bytes[..bytes.len() / 2]);
    assert!(fault("short.png", "comb.json").starts_with("short.png"));
    bench.write("text.png", b"no picture at all");
    assert!(fault("text.png", "comb.json").contains("text.png"));
    assert!(fault("missing.png", "comb.json").contains("missing.png"));
    assert!(fault("good.png", "missing.json").contains("missing.json"));
    let grid = [
        "pattern",
        "grid",
        "--machine",
        "S10",
        "--points",
        "9",
        "--field",
        "60",
        "--out",
        "grid.svg",
    ];
    assert_eq!(bench.json(&grid).0, 0);
    assert!(fault("good.png", "grid.json").contains("ftheta pattern delay"));
    let other = ["pattern", "delay", "--speeds", "2000,8000", "--lines", "9", "--out", "o.svg"];
    assert_eq!(bench.json(&other).0, 0);
    let message = fault("good.png", "o.json");
    assert!(message.contains(".json"), "{message}");
    let code = bench.run(&["calibrate", "delay", "--pattern", "comb.json"]).status.code();
    assert_eq!(code, Some(2));
}
