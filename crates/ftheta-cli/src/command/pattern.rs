//! `ftheta pattern`: patterns to judge or calibrate a head by.

use crate::arguments::pattern::{
    AxisName, DelayMethod, DelayPattern, GridPattern, IldaPattern, Pattern, PatternKind,
    SheetArguments, SquarePattern,
};
use crate::json;
use crate::progress::Progress;
use crate::screen::say;
use ftheta::atlas_store::AtlasStore;
use ftheta::formats::pattern_file;
use ftheta::mark::MarkOptions;
use ftheta::model::machine::Machine;
use ftheta::model::pattern::LaserDelays;
use ftheta::model::recipe::Pen;
use ftheta::output::{Output, write_file};
use ftheta::pattern::delay::{self, DelayOptions, LineAxis, Method};
use ftheta::pattern::fiducials;
use ftheta::pattern::grid::{self, GridOptions};
use ftheta::pattern::ilda::{Comparison, Ilda, PatternOptions, Way, compare};
use ftheta::pattern::sheet::{Sheet, SheetProcess};
use ftheta::pattern::square;
use ftheta::{Error, convert, machines};
use serde_json::{Value, json};
use std::path::Path;

/// Writes a pattern and shows what comes of it.
pub fn run(arguments: &Pattern, as_json: bool) -> Result<(), Error> {
    match &arguments.kind {
        PatternKind::Grid(grid) => run_grid(grid, as_json),
        PatternKind::Square(square) => run_square(square, as_json),
        PatternKind::Delay(delay) => run_delay(delay, as_json),
        PatternKind::Ilda(ilda) => run_ilda(ilda, as_json),
    }
}

fn run_grid(arguments: &GridPattern, as_json: bool) -> Result<(), Error> {
    let SheetArguments { machine, field, speed, power_w, out } = &arguments.sheet;
    let machine = machines::find(machine)?;
    let process = process(&machine, *speed, *power_w);
    let options = GridOptions {
        n_side: arguments.points,
        field_mm: *field,
        style: arguments.mark.into(),
        size_mm: arguments.size_mm,
        process,
    };
    let mut made = grid::sheet(&options, &machine)?;
    if arguments.fiducials {
        made = fiducials::around(made)?;
    }
    write_sheet(&made, out, as_json)
}

fn run_square(arguments: &SquarePattern, as_json: bool) -> Result<(), Error> {
    let SheetArguments { machine, field, speed, power_w, out } = &arguments.sheet;
    let machine = machines::find(machine)?;
    let process = process(&machine, *speed, *power_w);
    write_sheet(&square::sheet(*field, &process, &machine)?, out, as_json)
}

fn run_delay(arguments: &DelayPattern, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let method = match arguments.method {
        DelayMethod::Comb => Method::Comb,
        DelayMethod::Rectangle => Method::Rectangle,
    };
    let mut options = DelayOptions::usual(method, &machine);
    options.axis = match arguments.axis {
        AxisName::X => LineAxis::X,
        AxisName::Y => LineAxis::Y,
    };
    if !arguments.speeds.is_empty() {
        options.speeds_mm_s.clone_from(&arguments.speeds);
    }
    options.n_lines = arguments.lines.unwrap_or(options.n_lines);
    options.length_mm = arguments.length_mm.unwrap_or(options.length_mm);
    options.room_s = arguments.room_us * 1e-6;
    if let Some(preset_us) = arguments.preset_us {
        options.preset_s = preset_us.map(|us| us * 1e-6);
    }
    let set = arguments.on_us.zip(arguments.off_us);
    options.laser = set.map(|(on_us, off_us)| LaserDelays { on_us, off_us });
    options.power_w = arguments.power_w.unwrap_or(options.power_w);
    write_sheet(&delay::sheet(&options, &machine)?, &arguments.out, as_json)
}

/// The machine's usual settings, changed where the user says so.
fn process(machine: &Machine, speed: Option<f64>, power_w: Option<f64>) -> SheetProcess {
    let usual = SheetProcess::of(machine);
    SheetProcess {
        speed_mm_s: speed.unwrap_or(usual.speed_mm_s),
        power_w: power_w.unwrap_or(usual.power_w),
    }
}

fn write_sheet(sheet: &Sheet, out: &Path, as_json: bool) -> Result<(), Error> {
    let files = sheet.write(out)?;
    let pattern = &sheet.pattern;
    if as_json {
        json::print(&json!({
            "kind": pattern.kind,
            "machine": pattern.machine,
            "field_mm": pattern.field_mm,
            "features": pattern.features.len(),
            "points": sheet.places.len(),
            "sheet": sheet.printed.as_ref().map(|printed| json!({
                "paper": printed.paper,
                "line_mm": printed.line_mm,
            })),
            "files": json::files(&files),
        }));
        return Ok(());
    }
    let what = match sheet.places.len() {
        0 => format!("{} lines to photograph", pattern.features.len()),
        n_places => format!("{n_places} places to measure"),
    };
    say!("pattern  {}, {:.1} mm, {what}", pattern.kind, pattern.field_mm);
    if let Some(printed) = &sheet.printed {
        let (paper, line_mm) = (printed.paper, printed.line_mm);
        say!("sheet    print it on {paper} at 100 %, and measure both lines of {line_mm} mm");
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
    Ok(())
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
    let pattern = ilda.pattern(&machine, arguments.speed);
    write_file(&features, pattern_file::write(&pattern).as_bytes())?;
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
    json!({
        "machine": compared.planned.plan.machine.name,
        "field_mm": ilda.side_mm(),
        "ilda_points_per_s": compared.tuned_rate,
        "planned": way(&compared.ways[0]),
        "played": compared.ways[1..].iter().map(way).collect::<Vec<_>>(),
        "files": json::files(files),
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
