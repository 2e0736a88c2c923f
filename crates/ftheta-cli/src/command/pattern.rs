//! `ftheta pattern`: patterns to judge or calibrate a head by.

use crate::arguments::{IldaPattern, Pattern, PatternKind};
use crate::json;
use crate::progress::Progress;
use crate::screen::say;
use ftheta::atlas_store::AtlasStore;
use ftheta::mark::MarkOptions;
use ftheta::model::recipe::Pen;
use ftheta::output::{Output, write_file};
use ftheta::pattern::{Comparison, Feature, Ilda, PatternOptions, Way, compare};
use ftheta::{Error, convert, machines};
use serde_json::{Value, json};

/// Writes a pattern and shows what comes of it.
pub fn run(arguments: &Pattern, as_json: bool) -> Result<(), Error> {
    match &arguments.kind {
        PatternKind::Ilda(ilda) => run_ilda(ilda, as_json),
    }
}

fn run_ilda(arguments: &IldaPattern, as_json: bool) -> Result<(), Error> {
    let mut progress = Progress::new("plan");
    let machine = machines::find(&arguments.machine)?;
    let ilda = Ilda::new(&machine, arguments.field);
    let mark = MarkOptions {
        atlas_store: AtlasStore::new(arguments.cache.clone()),
        tolerance_mm: arguments.tolerance_um * 1e-3,
        mismatch: arguments.mismatch,
        ..MarkOptions::default()
    };
    let pen = Pen { mark_speed_mm_s: arguments.speed, ..Pen::default() };
    let mut output = arguments.report.as_deref().map(Output::new).transpose()?;
    let options = PatternOptions { pen, points_per_s: arguments.points_per_s, mark };
    let compared = compare(&ilda, &machine, &options, &mut |stage| progress.observe(stage))?;
    convert::write(&ilda.job(options.pen), &Default::default(), &arguments.out)?;
    let features = arguments.out.with_extension("json");
    let described = description(&ilda, &machine.name, arguments.speed);
    write_file(&features, described.to_string().as_bytes())?;
    let mut files = vec![
        ("drawing", arguments.out.display().to_string()),
        ("features", features.display().to_string()),
    ];
    if let Some(output) = &mut output {
        files.extend(compared.add(output)?);
    }
    output.map(Output::publish).transpose()?;
    progress.finish();
    match as_json {
        true => json::print(&object(&ilda, &compared, &files)),
        false => print(&ilda, &compared, &files),
    }
    Ok(())
}

/// Every feature's nominal place.
fn description(ilda: &Ilda, machine: &str, speed_mm_s: f64) -> Value {
    let mut features = Vec::new();
    for (name, parts) in ilda.strokes() {
        for (index, part) in parts.iter().enumerate() {
            let id = if parts.len() > 1 { format!("{name}-{}", index + 1) } else { name.into() };
            features.push(match part {
                Feature::Line(line) => json!({
                    "id": id, "kind": "line",
                    "x1_mm": line.p0.x, "y1_mm": line.p0.y,
                    "x2_mm": line.p1.x, "y2_mm": line.p1.y,
                    "speed_mm_s": speed_mm_s, "power_ratio": 1.0,
                }),
                Feature::Circle(circle) => json!({
                    "id": id, "kind": "circle",
                    "x_mm": circle.center.x, "y_mm": circle.center.y, "radius_mm": circle.radius,
                    "speed_mm_s": speed_mm_s, "power_ratio": 1.0,
                }),
            });
        }
    }
    json!({"kind": "ilda", "field_mm": ilda.side_mm(), "machine": machine, "features": features})
}

fn object(ilda: &Ilda, compared: &Comparison, files: &[(&str, String)]) -> Value {
    let way = |way: &Way| {
        json!({
            "points_per_s": way.points_per_s,
            "duration_s": way.traced.duration_s,
            "error_um": {
                "max": way.traced.error_max_mm * 1e3,
                "rms": way.traced.error_rms_mm * 1e3,
            },
            "circle_ratio": way.traced.circle_ratio,
        })
    };
    let files: Value = files.iter().map(|(kind, path)| ((*kind).to_owned(), json!(path))).collect();
    json!({
        "machine": compared.planned.plan.machine.name,
        "field_mm": ilda.side_mm(),
        "ilda_points_per_s": compared.tuned_rate,
        "planned": way(&compared.ways[0]),
        "played": compared.ways[1..].iter().map(way).collect::<Vec<_>>(),
        "files": files,
    })
}

fn print(ilda: &Ilda, compared: &Comparison, files: &[(&str, String)]) {
    say!("pattern  {:.2} mm wide", ilda.side_mm());
    if let Some(rate) = compared.tuned_rate {
        say!("tuned    a small circle touches its square at {rate:.0} points/s");
    }
    for way in &compared.ways {
        let traced = &way.traced;
        say!(
            "{:38} {:8.2} ms, error {:9.2} µm max {:8.3} µm rms, circle {:.4}",
            way.name(),
            traced.duration_s * 1e3,
            traced.error_max_mm * 1e3,
            traced.error_rms_mm * 1e3,
            traced.circle_ratio
        );
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
}
