//! The command line contract: one JSON object, exit codes, errors with place, value and limit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

mod bench;

use bench::{Bench, number};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

const DRAWING: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="30mm" height="20mm"
    viewBox="0 0 30 20" fill="none" stroke="black"><rect id="frame" x="5" y="5" width="20"
    height="10"/><image id="photo" href="x.png"/></svg>"#;

#[test]
fn mark_writes_its_files_and_one_object() {
    let bench = Bench::new();
    bench.write("frame.svg", DRAWING);
    let (code, value) = bench.json(&["mark", "frame.svg", "--out", "result"]);
    assert_eq!(code, 0);
    assert!((number(&value, &["plan", "marked_mm"]) - 60.0).abs() < 1e-6);
    for path in [
        ["plan", "period_us"],
        ["plan", "samples"],
        ["plan", "duration_s"],
        ["plan", "mark_s"],
        ["plan", "jump_s"],
        ["plan", "marks"],
        ["plan", "jumps"],
        ["plan", "planning_s"],
        ["limits", "angle"],
        ["limits", "speed"],
        ["limits", "voltage"],
        ["limits", "current"],
        ["limits", "heat"],
        ["limits", "violations"],
        ["twin", "duration_s"],
        ["twin", "stray_energy_ratio"],
    ] {
        number(&value, &path);
    }
    for (group, keys) in [
        ("contour_error_um", &["max", "p99", "rms"][..]),
        ("coverage_error_um", &["max", "p99"]),
        ("end_error_um", &["max", "p99"]),
        ("dose_ratio", &["min", "p01", "p99", "max"]),
    ] {
        for key in keys {
            number(&value, &["twin", group, key]);
        }
    }
    let warnings = value["warnings"].to_string();
    assert!(warnings.contains("#photo"), "{warnings}");
    for (kind, name) in [("plan", "plan.ftheta"), ("image", "mark.png"), ("report", "report.html")]
    {
        let path = Path::new("result").join(name);
        assert_eq!(value["files"][kind].as_str(), path.to_str());
        assert!(bench.path("result").join(name).is_file());
    }
    let (code, verified) = bench.json(&["verify", "result/plan.ftheta"]);
    assert_eq!((code, &verified["plan"]["id"]), (0, &value["plan"]["id"]));
    assert_eq!(verified["limits"], value["limits"]);
}

#[test]
fn mark_against_classic_compares_and_a_second_run_gives_the_same_bytes() {
    let bench = Bench::new();
    bench.write("frame.svg", DRAWING);
    let mut pages = Vec::new();
    let mut objects = Vec::new();
    for out in ["first", "second"] {
        let arguments =
            ["mark", "frame.svg", "--against", "classic", "--cache", "kept", "--out", out];
        let (code, value) = bench.json(&arguments);
        assert_eq!(code, 0, "{value}");
        pages.push(fs::read_to_string(bench.path(out).join("report.html")).unwrap());
        objects.push(value["against"].clone());
    }
    assert_eq!(objects[0], objects[1]);
    assert!(pages[0] == pages[1], "reports differ");
    let against = &objects[0];
    assert!(pages[0].contains("Against the classic planner"));
    for key in ["plan", "twin", "delays", "speedup"] {
        assert_eq!(against[key], against["columns"]["a"][key], "{key}");
    }
    assert!(number(against, &["twin", "contour_error_um", "max"]) <= 10.0);
    assert!(number(against, &["columns", "b", "twin", "coverage_error_um", "max"]) <= 10.0);
    assert!(number(against, &["columns", "sky_a", "delays", "sky_run_in_us"]) > 0.0);
    assert!(number(against, &["speedup"]) > 0.5);
    let refused = bench.run(&["mark", "frame.svg", "--against", "optimal"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn shapes_outside_the_field_are_named_or_clipped() {
    let bench = Bench::new();
    bench.write("frame.svg", DRAWING.replace("x=\"5\"", "x=\"95\""));
    let error = bench.fault(&["mark", "frame.svg"]);
    assert!(error["where"].as_str().unwrap().contains("#frame"), "{error}");
    assert!(error["limit"].as_str().unwrap().contains("60.5"), "{error}");
    assert!(!bench.path("out").join("frame").join("plan.ftheta").exists());
    let inside = DRAWING.replace("x=\"5\"", "x=\"65\"");
    bench.write("frame.svg", inside);
    let (code, value) = bench.json(&["mark", "frame.svg", "--clip"]);
    assert_eq!(code, 0);
    assert!(value["warnings"].to_string().contains("#frame"), "{value}");
}

#[test]
fn faulty_drawings_are_errors_without_output() {
    let bench = Bench::new();
    let deep = "<g>".repeat(100_000);
    let big = format!("<svg xmlns='http://www.w3.org/2000/svg'>{deep}");
    let with = |body: &str| {
        format!("<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'>{body}</svg>")
    };
    let cases: [(&str, Vec<u8>); 9] = [
        ("empty", Vec::new()),
        ("binary", (0..=255).cycle().take(5000).collect()),
        ("cut", DRAWING.as_bytes()[..150].to_vec()),
        ("deep", big.into_bytes()),
        ("loop", with("<g id='a'><use href='#a'/></g>").into_bytes()),
        ("nothing", with("").into_bytes()),
        ("nan", with("<path stroke='red' d='M0 0 L NaN 3'/>").into_bytes()),
        ("huge", with("<path stroke='red' d='M0 0 L 1e300 3'/>").into_bytes()),
        ("png", b"\x89PNG\r\n\x1a\n".to_vec()),
    ];
    for (name, bytes) in cases {
        let file = format!("{name}.svg");
        bench.write(&file, bytes);
        bench.fault(&["mark", &file, "--out", "nowhere"]);
        assert!(!bench.path("nowhere").join("plan.ftheta").exists(), "{name}");
    }
    let error = bench.fault(&["mark", "huge.svg"]);
    assert!(error["message"].as_str().unwrap().contains("<path> on line 1"), "{error}");
    bench.fault(&["mark", "missing.svg"]);
    bench.fault(&["mark", "."]);
}

#[test]
fn faulty_settings_name_file_line_and_limit() {
    let bench = Bench::new();
    bench.write("frame.svg", DRAWING);
    let error = bench.fault(&["mark", "frame.svg", "--machine", "S99"]);
    assert!(error["message"].as_str().unwrap().contains("S10-f163"), "{error}");
    bench.write("m.toml", "[scanner]\nrotor_inertia = 3\n");
    let error = bench.fault(&["mark", "frame.svg", "--machine", "m.toml"]);
    assert_eq!(error["where"], "m.toml:1", "{error}");
    bench.write("frame.recipe.toml", "[[pen]]\npower_w = 50\n");
    let error = bench.fault(&["mark", "frame.svg"]);
    assert_eq!((&error["value"], &error["limit"]), (&"50 W".into(), &"0 to 20 W".into()));
    fs::remove_file(bench.path("frame.recipe.toml")).unwrap();
    let error = bench.fault(&["mark", "frame.svg", "--speed", "1e8", "--planner", "classic"]);
    assert!(error["where"].as_str().unwrap().contains("mark_speed"), "{error}");
    bench.write("a-file", "");
    bench.fault(&["mark", "frame.svg", "--out", "a-file/below"]);
}

#[test]
fn plan_files_that_were_touched_are_refused() {
    let bench = Bench::new();
    bench.write("frame.svg", DRAWING);
    assert_eq!(bench.json(&["mark", "frame.svg", "--out", "result"]).0, 0);
    let text = fs::read_to_string(bench.path("result/plan.ftheta")).unwrap();
    bench.write("cut.ftheta", &text[..text.len() / 2]);
    bench.write("changed.ftheta", text.replace("power_max_w = 20", "power_max_w = 30"));
    bench.write("other.ftheta", "hello");
    let error = bench.fault(&["verify", "changed.ftheta"]);
    assert!(error["message"].as_str().unwrap().contains("id"), "{error}");
    bench.fault(&["verify", "cut.ftheta"]);
    bench.fault(&["verify", "other.ftheta"]);
}

/// A run that is killed in the middle leaves no file that looks whole.
#[test]
fn killed_runs_leave_nothing_that_looks_whole() {
    let bench = Bench::new();
    let area = DRAWING.replace("fill=\"none\"", "");
    bench.write("area.svg", area);
    // Hours of marking, so that it cannot be done before it is killed.
    bench.write("area.recipe.toml", "[[pen]]\nhatch_spacing_mm = 0.002\nmark_speed_mm_s = 10\n");
    let mut child = Command::new(env!("CARGO_BIN_EXE_ftheta"))
        .args(["mark", "area.svg", "--out", "result"])
        .current_dir(bench.path(""))
        .spawn()
        .unwrap();
    let result = bench.path("result");
    while !result.is_dir() {
        assert!(child.try_wait().unwrap().is_none(), "ended by itself");
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    for entry in fs::read_dir(result).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(name.starts_with('.'), "{name} was left");
    }
}

#[test]
fn usage_errors_exit_with_two() {
    let bench = Bench::new();
    for arguments in [
        &["mark"][..],
        &["mark", "x.svg", "--speed", "-3"],
        &["mark", "x.svg", "--speed", "nan"],
        &["mark", "x.svg", "--mismatch", "f9=1"],
        &["mark", "x.svg", "--order", "random"],
        &["fly"],
    ] {
        assert_eq!(bench.run(arguments).status.code(), Some(2), "{arguments:?}");
    }
    assert_eq!(bench.run(&["mark", "--help"]).status.code(), Some(0));
}

/// Limits are those of the reference table (`design/control.md` B), and the optimal law arrives
/// within a tick of the limit, at rest.
#[test]
fn jump_compares_laws_with_the_limit() {
    let bench = Bench::new();
    let (code, value) =
        bench.json(&["jump", "--step-deg", "0.1,1", "--reserve", "0", "--law", "optimal,robust"]);
    assert_eq!(code, 0);
    for (index, limit_us, rigid_us) in [(0, 211.6, 144.7), (1, 342.4, 328.6)] {
        let step = &value["steps"][index];
        assert!((number(step, &["limit_s"]) * 1e6 / limit_us - 1.0).abs() < 1e-3, "{step}");
        assert!((number(step, &["limit_rigid_s"]) * 1e6 / rigid_us - 1.0).abs() < 1e-3);
        let optimal = &step["laws"][0];
        assert_eq!(optimal["law"], "optimal");
        assert_eq!(number(optimal, &["settle_s"]), 0.0);
        assert!(number(optimal, &["total_s"]) < number(step, &["limit_s"]) + 1e-5);
        for key in ["plan_s", "ratio", "peak_voltage_ratio", "residual_deg", "heat_a2s"] {
            number(optimal, &[key]);
        }
        assert!(number(optimal, &["peak_current_ratio"]) <= 1.0);
    }
    bench.fault(&["jump", "--machine", "S10", "--step-deg", "30"]);
    let (_, value) = bench.json(&["jump", "--step-deg", "1", "--law", "zv", "--out", "jumps"]);
    assert_eq!(value["files"]["report"], "jumps/jump.html");
    let page = fs::read_to_string(bench.path("jumps").join("jump.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    assert!(page.contains("1° over time"));
    let law = "bisection:8,zv";
    let arguments = ["jump", "--step-deg", "1", "--law", law, "--from-rad-s", "-3"];
    let (_, value) = bench.json(&arguments);
    let laws = &value["steps"][0]["laws"];
    assert_eq!((&laws[0]["law"], &laws[0]["settle_s"]), (&"bisection:8".into(), &0.0.into()));
    assert!(laws[1]["total_s"].is_null());
    assert!(laws[1]["reason"].as_str().unwrap().contains("from rest to rest, not from -3 to 0"));
    for law in ["ruckig", "bisection:2"] {
        assert_eq!(bench.run(&["jump", "--step-deg", "1", "--law", law]).status.code(), Some(2));
    }
    assert_eq!(bench.run(&["jump", "--step-deg", "x"]).status.code(), Some(2));
}

#[test]
fn machines_are_listed_shown_and_checked() {
    let bench = Bench::new();
    let (_, list) = bench.json(&["machine", "list"]);
    assert_eq!(list["machines"].as_array().unwrap().len(), 12);
    let (_, shown) = bench.json(&["machine", "show", "S14-f420"]);
    bench.write("mine.toml", shown["toml"].as_str().unwrap());
    let (code, checked) = bench.json(&["machine", "check", "mine.toml"]);
    assert_eq!(code, 0);
    assert!((number(&checked, &["servo_lag_us"]) - 224.7).abs() < 0.01);
    let completions = bench.run(&["completions", "bash"]);
    assert!(String::from_utf8(completions.stdout).unwrap().contains("--mismatch"));
}

#[test]
fn mechanisms_become_machines() {
    let bench = Bench::new();
    let text = include_str!("../../../gallery/s10-mechanism.toml");
    let file = bench.write("parts.toml", text);
    let (code, found) = bench.json(&["machine", "mechanism", &file, "--out", "mine.toml"]);
    assert_eq!(code, 0, "{found}");
    let frequency_hz = number(&found, &["two_inertias", "torsional_mode_hz"]);
    assert!((frequency_hz / 5200.0 - 1.0).abs() < 0.01, "{found}");
    let torsion = found["modes"].as_array().unwrap().iter().find(|mode| mode["kind"] == "torsion");
    assert!(number(torsion.unwrap(), &["drive"]) < -0.9, "{found}");
    let (code, checked) = bench.json(&["machine", "check", "mine.toml"]);
    assert_eq!((code, checked["name"].as_str()), (0, Some("mine")), "{checked}");
    let law = "time_us,angle_deg\n0,0\n100,0.1\n200,0.4\n300,0.7\n400,0.8\n500,0.8\n";
    bench.write("law.csv", law);
    let arguments = ["machine", "mechanism", &file, "--law", "law.csv", "--response", "out.csv"];
    let (code, found) = bench.json(&arguments);
    assert_eq!(code, 0, "{found}");
    let lag_urad = number(&found, &["response", "mirror_error_max_urad"]);
    assert!(lag_urad > 100.0 && lag_urad < 10_000.0, "{found}");
    let response = fs::read_to_string(bench.path("out.csv")).unwrap();
    assert_eq!(response.lines().count(), law.lines().count(), "{response}");
    bench.write("law.csv", law.replace("300", "100"));
    let fault = bench.fault(&arguments);
    assert_eq!((&fault["where"], &fault["value"]), (&"law.csv:5".into(), &"\"100,0.7\"".into()));
    bench.write("bad.toml", text.replace("length_mm = 4\n", "length_mm = 0\n"));
    let fault = bench.fault(&["machine", "mechanism", "bad.toml"]);
    assert_eq!((&fault["value"], &fault["limit"]), (&"0".into(), &"0.01 to 1000".into()));
}

#[test]
fn a_circle_is_true_and_uniform() {
    let bench = Bench::new();
    let (code, value) = bench.json(&[
        "circle",
        "--radius-mm",
        "0.5",
        "--speed",
        "2000",
        "--machine",
        "S10-f160",
        "--out",
        "round",
    ]);
    assert_eq!(code, 0, "{value}");
    assert!(value["radius_error_um"]["max"].as_f64().unwrap() <= 0.5, "{value}");
    assert!(value["speed_ratio"]["min"].as_f64().unwrap() >= 0.999, "{value}");
    assert!(value["speed_ratio"]["max"].as_f64().unwrap() <= 1.001, "{value}");
    assert!(value["run_in_s"].as_f64().unwrap() < 1e-3, "{value}");
    for name in ["report.html", "mark.png", "plan.ftheta"] {
        assert!(bench.path("round").join(name).exists(), "{name}");
    }
    let (code, verified) = bench.json(&["verify", "round/plan.ftheta"]);
    assert_eq!(code, 0, "{verified}");
    let spiral = ["circle", "--radius-mm=0.5", "--turns=3", "--pitch-mm=-0.1", "--speed=2000"];
    let (code, value) = bench.json(&spiral);
    assert_eq!(code, 0, "{value}");
    assert!(value["radius_error_um"]["max"].as_f64().unwrap() <= 0.5, "{value}");
    let fault = bench.fault(&["circle", "--radius-mm", "0.5", "--speed", "50000"]);
    assert!(fault["where"].as_str().unwrap().starts_with("circle"), "{fault}");
}

#[test]
fn a_pattern_is_written_and_compared() {
    let bench = Bench::new();
    let (code, value) = bench.json(&[
        "pattern",
        "ilda",
        "--machine",
        "S10-f160",
        "--field",
        "5",
        "--speed",
        "1000",
        "--out",
        "ilda.svg",
        "--report",
        "ilda",
        "--cache",
        "cache",
    ]);
    assert_eq!(code, 0, "{value}");
    assert!(value["planned"]["error_um"]["max"].as_f64().unwrap() <= 10.0, "{value}");
    assert_eq!(value["played"].as_array().unwrap().len(), 2, "{value}");
    let features: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("ilda.json")).unwrap()).unwrap();
    assert_eq!(features["kind"], "ilda");
    assert_eq!(features["features"].as_array().unwrap().len(), 15);
    assert!(bench.path("ilda").join("pattern.html").exists());
    // The drawing is one like any other.
    let (code, converted) = bench.json(&["convert", "ilda.svg", "ilda.csv"]);
    assert_eq!(code, 0, "{converted}");
}

#[test]
fn grids_to_measure_are_written_whole_or_refused() {
    let bench = Bench::new();
    let grid = ["pattern", "grid", "--machine", "S14-f420", "--out", "grid.svg", "--points"];
    let (code, value) = bench.json(&[&grid[..], &["25", "--field", "280"]].concat());
    assert_eq!((code, &value["points"]), (0, &25.into()), "{value}");
    let pattern = fs::read_to_string(bench.path("grid.json")).unwrap();
    let pattern: Value = serde_json::from_str(&pattern).unwrap();
    let corner = &pattern["features"][24];
    assert_eq!((&corner["kind"], &corner["id"]), (&"cross".into(), &"E5".into()));
    assert_eq!((number(corner, &["x_mm"]), number(corner, &["y_mm"])), (140.0, 140.0));
    assert_eq!(pattern["laser"]["on_us"], -20.0);
    let csv = fs::read_to_string(bench.path("grid.csv")).unwrap();
    assert_eq!(csv.lines().count(), 26);
    // The drawing is one like any other, and the recipe beside it is found.
    let mark = ["mark", "grid.svg", "--machine", "S14-f420", "--planner", "classic"];
    let (code, marked) = bench.json(&mark);
    assert_eq!((code, &marked["limits"]["violations"]), (0, &0.into()), "{marked}");
    let fault = bench.fault(&[&grid[..], &["25", "--field", "335"]].concat());
    assert_eq!((&fault["value"], &fault["limit"]), (&"343 mm".into(), &"336 mm".into()));
    for points in ["10", "4", "16", "4489", "x"] {
        let run = bench.run(&[&grid[..], &[points, "--field", "280"]].concat());
        assert_eq!(run.status.code(), Some(2), "{points}");
    }
    let square = ["pattern", "square", "--machine", "S14-f420", "--field", "120", "--out", "s.svg"];
    assert_eq!(bench.json(&square).1["kind"], "square");
}

#[test]
fn places_are_mapped_and_tables_converted() {
    let bench = Bench::new();
    bench.write("places.csv", "x_mm;y_mm\n0;0\n10,5;-20\n");
    let map = ["field", "map", "--machine", "S10-f160", "--points"];
    let (code, value) = bench.json(&[&map[..], &["places.csv", "--out", "angles.csv"]].concat());
    assert_eq!((code, &value["points"]), (0, &2.into()), "{value}");
    let back = [&map[..], &["angles.csv", "--out", "back.csv", "--inverse"]].concat();
    assert_eq!(bench.json(&back).0, 0);
    let back = fs::read_to_string(bench.path("back.csv")).unwrap();
    let row: Vec<f64> =
        back.lines().nth(2).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!((row[0] - 10.5).abs() < 1e-8 && (row[1] + 20.0).abs() < 1e-8, "{back}");
    bench.write("far.csv", "x_mm,y_mm\n0,0\n0,900\n");
    let fault = bench.fault(&[&map[..], &["far.csv", "--out", "none.csv"]].concat());
    assert_eq!(fault["where"], "far.csv: line 3");
    assert!(!bench.path("none.csv").exists());
    let header = "row,column,x_mm,y_mm,offset_x_mm,offset_y_mm\n";
    let nodes = (0..9).map(|index: i32| {
        let (row, column) = (index / 3, index % 3);
        format!("{row},{column},{},{},0.1,-0.2\n", 60 * (column - 1), 60 * (row - 1))
    });
    bench.write("grid.csv", header.to_owned() + &nodes.collect::<String>());
    for pair in [["grid.csv", "table.txt"], ["table.txt", "mine.cor"], ["mine.cor", "again.txt"]] {
        let arguments = [&["convert"], &pair[..], &["--machine", "S10-f160"]].concat();
        assert_eq!(bench.json(&arguments).0, 0, "{pair:?}");
    }
    let corrected = ["places.csv", "--table", "again.txt", "--out", "angles.csv"];
    assert_eq!(bench.json(&[&map[..], &corrected[..]].concat()).1["corrected"], true);
    let angles = fs::read_to_string(bench.path("angles.csv")).unwrap();
    // 0.1 and -0.2 mm of twice the focal length, in whole units of the .cor file.
    let centre: Vec<f64> =
        angles.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    let unit_deg = (120.0f64 / 65536.0 / 320.0).to_degrees();
    assert!((centre[2] - (0.1f64 / 320.0).to_degrees()).abs() < unit_deg, "{angles}");
    assert!((centre[3] + (0.2f64 / 320.0).to_degrees()).abs() < unit_deg, "{angles}");
    let fault = bench.fault(&["convert", "table.txt", "mine.cor", "--machine", "S10-f163"]);
    assert!(fault["message"].as_str().unwrap().contains("S10-f160"), "{fault}");
    bench.fault(&["convert", "table.txt", "mine.cor"]);
}
