//! `ftheta circle`: one uniform turn or a spiral, exact through optics and servo.

use super::mark::print_limits;
use crate::arguments::Circle;
use crate::json;
use crate::progress::Progress;
use crate::screen::say;
use ftheta::circle::{Circled, Ellipse, Round, Spiral, circle};
use ftheta::mark::MarkOptions;
use ftheta::model::recipe::Pen;
use ftheta::output::Output;
use ftheta::results::{self, About};
use ftheta::{Error, machines};
use serde_json::{Value, json};

/// Plans, plays, measures.
pub fn run(arguments: &Circle, as_json: bool) -> Result<(), Error> {
    let mut progress = Progress::new("plan");
    let machine = machines::find(&arguments.machine)?;
    let radius_mm = arguments.radius_mm;
    let radii_mm = [radius_mm, radius_mm / arguments.ellipse];
    let round = match (arguments.turns, arguments.pitch_mm) {
        (Some(turns), Some(pitch_mm)) => Round::Spiral(Spiral {
            centre: <(f64, f64)>::from(arguments.centre_mm).into(),
            radius_mm,
            pitch_mm,
            turns,
            speed_mm_s: arguments.speed,
        }),
        _ => Round::Ellipse(Ellipse::new(arguments.centre_mm, radii_mm, arguments.speed)),
    };
    let options = MarkOptions {
        reserve: arguments.reserve,
        tolerance_mm: arguments.tolerance_um * 1e-3,
        mismatch: arguments.mismatch,
        ..MarkOptions::default()
    };
    let mut output = arguments.out.as_deref().map(Output::new).transpose()?;
    let observer = &mut |stage| progress.observe(stage);
    let circled = circle(&machine, &round, Pen::default(), &options, observer)?;
    let mut files = Vec::new();
    if let Some(output) = &mut output {
        let (side_mm, job_name) = match round {
            Round::Ellipse(_) => (2.2 * radius_mm, "circle"),
            Round::Spiral(spiral) => {
                let last_mm = radius_mm + spiral.pitch_mm * spiral.turns;
                (2.2 * radius_mm.max(last_mm), "spiral")
            }
        };
        let about = About {
            job_name,
            options: &options,
            has_corners: false,
            page_mm: [side_mm; 2],
            warnings: &[],
            against: None,
        };
        files = results::add(output, &circled.marked, &about)?;
    }
    output.map(Output::publish).transpose()?;
    progress.finish();
    match as_json {
        true => json::print(&object(&circled, &files)),
        false => print(&circled, &files),
    }
    Ok(())
}

fn object(circled: &Circled, files: &[(&'static str, String)]) -> Value {
    let Circled { marked, roundness, run_in_s, run_out_s, turn_s } = circled;
    let [slowest, fastest] = roundness.speed_ratio;
    let files: Value = files.iter().map(|(kind, path)| ((*kind).to_owned(), json!(path))).collect();
    json!({
        "machine": marked.plan.machine.name,
        "plan": marked.plan.id().to_string(),
        "radius_error_um": {
            "max": roundness.error_max_mm * 1e3,
            "rms": roundness.error_rms_mm * 1e3,
        },
        "speed_ratio": {"min": slowest, "max": fastest},
        "run_in_s": run_in_s,
        "turn_s": turn_s,
        "run_out_s": run_out_s,
        "duration_s": run_in_s + turn_s + run_out_s,
        "limits": json::limits(marked.plan.limits()),
        "files": files,
    })
}

fn print(circled: &Circled, files: &[(&'static str, String)]) {
    let Circled { marked, roundness, run_in_s, run_out_s, turn_s } = circled;
    say!("plan     {} on {}", marked.plan.id(), marked.plan.machine.name);
    say!(
        "time     run-in {:.1} µs, turn {:.1} µs, run-out {:.1} µs",
        run_in_s * 1e6,
        turn_s * 1e6,
        run_out_s * 1e6
    );
    print_limits(marked.plan.limits());
    let [slowest, fastest] = roundness.speed_ratio;
    say!(
        "twin     radius error {:.3} µm max, {:.3} µm rms; speed {slowest:.5} to {fastest:.5}",
        roundness.error_max_mm * 1e3,
        roundness.error_rms_mm * 1e3
    );
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
}
