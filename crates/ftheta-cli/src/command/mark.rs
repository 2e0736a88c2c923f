//! `ftheta mark`: the main job.

use crate::arguments::{AgainstName, Mark};
use crate::json;
use crate::progress::Progress;
use crate::screen::{note, say};
use ftheta::against::{Against, Column, WAYS, against};
use ftheta::atlas_store::AtlasStore;
use ftheta::focus_report::spot_growth;
use ftheta::formats::svg::SvgOptions;
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::machine::Scanner;
use ftheta::model::warning::Warning;
use ftheta::output::Output;
use ftheta::physics::audit::Limits;
use ftheta::planner::optimal::{Corner, near_scanner};
use ftheta::promise::Promise;
use ftheta::results::{self, About, delay_rows};
use ftheta::twin::hidden_head::hidden_head;
use ftheta::{Error, import, machines, tables};
use std::path::PathBuf;

/// Plans, plays, reports.
pub fn run(arguments: &Mark, as_json: bool) -> Result<(), Error> {
    let mut progress = Progress::new("import");
    let mut machine = machines::find(&arguments.machine)?;
    if let Some(z_mm) = arguments.z_mm {
        machine = machines::at_height(machine, z_mm)?;
    }
    let (recipe, recipe_path) = import::recipe_for(&arguments.input, arguments.recipe.as_deref())?;
    if let Some(path) = &recipe_path {
        note!("recipe   {}", path.display());
    }
    let svg_options = SvgOptions {
        system_fonts: arguments.system_fonts,
        fit_mm: arguments.fit,
        ..SvgOptions::default()
    };
    let drawing = import::drawing(&arguments.input, &recipe, &svg_options)?;
    let mut output = Output::new(&folder(arguments))?;
    let options = MarkOptions {
        speed_mm_s: arguments.speed,
        planner: arguments.planner.map(Into::into),
        corner: arguments.corner.map_or(Corner::Auto, Into::into),
        reserve: arguments.reserve,
        atlas_store: AtlasStore::new(arguments.cache.clone()),
        tolerance_mm: arguments.tolerance_um * 1e-3,
        order: arguments.order.map(Into::into),
        clip: arguments.clip,
        mismatch: arguments.mismatch,
        noise_mm: arguments.noise_um * 1e-3,
        seed: arguments.seed,
        table: arguments.table.as_deref().map(|path| tables::usable(path, &machine)).transpose()?,
        head: arguments.head.map(|seed| hidden_head(&machine.optics, seed)),
    };
    let marked = mark(&drawing.value, &machine, &recipe, &options, &mut |stage| {
        progress.observe(stage);
    })?;
    let mut compare = |AgainstName::Classic| {
        against(&drawing.value, &machine, &recipe, &options, &mut |stage| progress.observe(stage))
    };
    let against = arguments.against.map(&mut compare).transpose()?;
    progress.enter("write");
    let told = against.iter().flat_map(|against| &against.warnings);
    let warnings: Vec<Warning> =
        drawing.warnings.iter().chain(&marked.warnings).chain(told).cloned().collect();
    let about = About {
        job_name: &title(arguments),
        options: &options,
        has_corners: true,
        page_mm: drawing.value.page_mm,
        against: against.as_ref(),
        warnings: &warnings,
    };
    let files = results::add(&mut output, &marked, &about)?;
    output.publish()?;
    let stages = progress.finish();
    let duration_s = marked.score.duration_s;
    if let Some(against) = &against {
        note_delays(against);
    }
    if as_json {
        let mut object = json::marked(&marked, &warnings, &stages, &files);
        if let Some(against) = &against {
            object["against"] = json::against(against, duration_s);
        }
        json::print(&object);
    } else {
        print(&marked, &warnings, &stages, &files);
        against.iter().for_each(|against| print_against(against, duration_s));
    }
    Ok(())
}

/// The delays that were found, a line for each way.
fn note_delays(against: &Against) {
    for (way, column) in WAYS.iter().zip(&against.columns) {
        let rows = column.as_ref().map(|column| delay_rows(&column.settings)).unwrap_or_default();
        let rows = rows.iter().filter(|(_, value)| value != results::NONE);
        let rows: Vec<_> = rows.map(|(key, value)| format!("{key} {value}")).collect();
        if !rows.is_empty() {
            note!("{}: {}", way.name, rows.join(", "));
        }
    }
}

fn print_against(against: &Against, duration_s: f64) {
    for (way, column) in WAYS.iter().zip(&against.columns) {
        let Some(Column { score, .. }) = column else {
            say!("against  {:12} no delays keep the tolerance", way.name);
            continue;
        };
        say!(
            "against  {:12} {:.2} ms, {:.3} of this; contour error {:.1} µm max, ends {:.1} µm max, \
             coverage {:.1} µm max",
            way.name,
            score.duration_s * 1e3,
            score.duration_s / duration_s,
            score.contour_error_um.max,
            score.end_error_um.max,
            score.coverage_error_um.max
        );
    }
}

fn title(arguments: &Mark) -> String {
    let stem = arguments.input.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

fn folder(arguments: &Mark) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| PathBuf::from("out").join(title(arguments)))
}

fn print(marked: &Marked, warnings: &[Warning], stages: &[(&str, f64)], files: &[(&str, String)]) {
    for warning in warnings {
        note!("warning: {warning}");
    }
    let (times, score) = (&marked.times, &marked.score);
    say!(
        "plan     {} on {}: {} marks of {:.1} mm, {} jumps",
        marked.plan.id(),
        marked.plan.machine.name,
        marked.plan.marks.len(),
        times.marked_mm,
        times.n_jumps
    );
    say!(
        "time     {:.3} s: {:.3} s marking, {:.3} s dark, of which {:.3} s waiting",
        times.duration_s,
        times.mark_s,
        times.jump_s,
        times.delay_s
    );
    print_limits(marked.plan.limits());
    if let Some(promise) = &marked.promise {
        print_promise(promise, &marked.plan.machine.scanner);
    }
    say!(
        "twin     contour error {:.1} µm max, {:.1} µm p99; ends {:.1} µm max; coverage {:.1} µm max",
        score.contour_error_um.max,
        score.contour_error_um.p99,
        score.end_error_um.max,
        score.coverage_error_um.max
    );
    if let Some(dose) = score.dose_ratio {
        say!(
            "dose     {:.3} to {:.3} (p1 to p99), {:.3} max; stray energy {:.2} %",
            dose.p01,
            dose.p99,
            dose.max,
            score.stray_energy_ratio * 100.0
        );
    }
    if let Some(pulses) = score.pulse_spacing_ratio {
        say!(
            "pulses   {:.3} to {:.3} of their pitch apart (p1 to p99), {:.3} at least",
            pulses.p01,
            pulses.p99,
            pulses.min
        );
    }
    if let Some(focus) = score.focus_error_um {
        let growth = spot_growth(&marked.plan.machine, 1e-3 * focus.max);
        say!(
            "focus    off by {:.3} mm max, {:.3} mm p99: spot at most {:.1} % larger",
            1e-3 * focus.max,
            1e-3 * focus.p99,
            100.0 * growth
        );
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
    let stages: Vec<String> =
        stages.iter().map(|(name, time_s)| format!("{name} {time_s:.2} s")).collect();
    say!("took     {}", stages.join(", "));
}

/// One line of what a plan promises.
fn print_promise(promise: &Promise, scanner: &Scanner) {
    let near = near_scanner(scanner).kt_uncertainty;
    let wide = match near > scanner.kt_uncertainty {
        true => format!(", {:.1} µm with ±{} %", promise.kt_near_mm * 1e3, near * 100.0),
        false => String::new(),
    };
    say!(
        "promise  contour error {:.1} µm as planned, {:.1} µm with f1 ±{} %, {:.1} µm with Kt ±{} %{wide}",
        promise.planned_mm * 1e3,
        promise.f1_mm * 1e3,
        scanner.f1_uncertainty * 100.0,
        promise.kt_mm * 1e3,
        scanner.kt_uncertainty * 100.0
    );
}

/// One line of peaks.
pub fn print_limits(limits: &Limits) {
    say!(
        "limits   angle {:.0} %, speed {:.1} %, voltage {:.0} %, current {:.0} %, heat {:.1} %",
        limits.angle * 100.0,
        limits.speed * 100.0,
        limits.voltage * 100.0,
        limits.current * 100.0,
        limits.heat * 100.0
    );
}
