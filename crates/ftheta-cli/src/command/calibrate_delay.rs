//! `ftheta calibrate delay`: the laser's delays from a picture.

use crate::arguments::calibrate_delay::CalibrateDelay;
use crate::json;
use crate::screen::{note, say};
use ftheta::calibrate::delay::Method;
use ftheta::calibrate::delay::growth::Growth;
use ftheta::delay_calibration::{DelayCalibration, calibrate_delay};
use ftheta::field_picture::Source;
use ftheta::formats::machine::to_toml;
use ftheta::model::machine::Machine;
use ftheta::model::pattern::{LaserDelays, Pattern};
use ftheta::model::warning::Warning;
use ftheta::output::write_file;
use ftheta::{Error, import, machines};
use serde_json::{Value, json};
use std::path::Path;

/// The machine where none is known.
const GUESSED: &str = "S10";

/// Measures delays, and writes them into a machine file if asked to.
pub fn run(arguments: &CalibrateDelay, as_json: bool) -> Result<(), Error> {
    let pattern = import::pattern(&arguments.pattern)?;
    let (machine, guessed) = machine(arguments, &pattern)?;
    let source = match (&arguments.camera, &arguments.image) {
        (Some(device), _) => Source::Device(device.clone()),
        (None, image) => Source::File(image.clone().unwrap_or_default()),
    };
    let picture = source.read()?;
    let mut found = calibrate_delay(&picture, &pattern, &machine, arguments.method.map(Into::into))
        .map_err(|error| Error::Delay { path: source.path(), source: error })?;
    if guessed {
        let text = format!("the pattern names no machine that is known here: {GUESSED} is taken");
        found.warnings.push(Warning::new("machine", text));
    }
    let (applied, left) = found.applied(&machine, arguments.apply.into());
    let beside = arguments.out.as_deref().or(arguments.image.as_deref());
    let report = beside.unwrap_or(Path::new("")).with_file_name("calibration.html");
    let mut files = Vec::new();
    if let Some(out) = &arguments.out {
        write_file(out, to_toml(&applied).as_bytes())?;
        files.push(("machine", out.display().to_string()));
    }
    let page = found.report(&picture.picture, &machine.name);
    write_file(&report, page.as_bytes())?;
    files.push(("report", report.display().to_string()));
    match as_json {
        true => json::print(&object(&found, left, &machine.name, &files)),
        false => print(&found, left, &files),
    }
    Ok(())
}

/// The machine that the pattern was marked with, and whether it had to be guessed; a user's own is
/// known by its file alone.
fn machine(arguments: &CalibrateDelay, pattern: &Pattern) -> Result<(Machine, bool), Error> {
    let named = arguments.machine.as_deref().or(pattern.machine.as_deref());
    match (named.map(machines::find), &arguments.machine, &arguments.out) {
        (Some(Ok(machine)), ..) => Ok((machine, false)),
        // A comb can be measured without, as long as nothing is written.
        (None, ..) | (Some(Err(_)), None, None) => Ok((machines::find(GUESSED)?, true)),
        (Some(Err(error)), ..) => Err(error),
    }
}

fn object(
    found: &DelayCalibration,
    left: LaserDelays,
    machine: &str,
    files: &[(&str, String)],
) -> Value {
    let delays = &found.delays;
    let [on_sd, off_sd, mean_sd] = delays.sd_s.map(|s| s * 1e6);
    let scene = &delays.scene;
    let comb = delays.method == Method::Comb;
    let rejected = found.rejects().into_iter();
    let rejected: Vec<Value> =
        rejected.map(|(id, end, why)| json!({"id": id, "end": end, "why": why})).collect();
    json!({
        "machine": machine,
        "method": if comb { "comb" } else { "rectangle" },
        "tau_on_us": delays.tau_on_s * 1e6,
        "tau_off_us": delays.tau_off_s * 1e6,
        "tau_on_sd_us": on_sd,
        "tau_off_sd_us": off_sd,
        "tau_mean_us": 0.5e6 * (delays.tau_on_s + delays.tau_off_s),
        "tau_mean_sd_us": mean_sd,
        "set": {"on_us": found.set.on_us, "off_us": found.set.off_us},
        "on_us": found.settings.on_us,
        "off_us": found.settings.off_us,
        "left": {"on_us": left.on_us, "off_us": left.off_us},
        "acceleration_m_s2": delays.acceleration_mm_s2.map(|a| a * 1e-3),
        "growth_model": matches!(delays.growth, Growth::Modelled { .. }),
        "patent": delays.patent_s.map(|[on, off]| json!({
            "tau_on_us": on * 1e6,
            "tau_off_us": off * 1e6,
            "bias_us": (on - delays.tau_on_s) * 1e6,
        })),
        "lines": delays.lines.len(),
        "rejected": rejected,
        "rms_um": comb.then_some(delays.rms_mm * 1e3),
        "picture": {
            "um_per_px": scene.mm_per_px * 1e3,
            "blur_px": scene.blur_px,
            "contrast": scene.contrast,
            "noise": scene.noise,
            "view_rms_px": scene.view_rms_px,
            "references": scene.references,
            "upside_down": scene.upside_down,
            "bright": scene.bright,
        },
        "advice": found.advice,
        "warnings": found.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "files": json::files(files),
    })
}

fn print(found: &DelayCalibration, left: LaserDelays, files: &[(&str, String)]) {
    for warning in &found.warnings {
        note!("warning: {warning}");
    }
    let delays = &found.delays;
    let [on_sd, off_sd, mean_sd] = delays.sd_s.map(|s| s * 1e6);
    let [on, off] = [delays.tau_on_s * 1e6, delays.tau_off_s * 1e6];
    say!("late     on {on:.2} ± {on_sd:.2} µs, off {off:.2} ± {off_sd:.2} µs");
    say!("mean     {:.2} ± {mean_sd:.2} µs", 0.5 * (on + off));
    if let Some([patent_on, patent_off]) = delays.patent_s.map(|both| both.map(|s| s * 1e6)) {
        say!("patent   on {patent_on:.2} µs, off {patent_off:.2} µs by its own formula");
    }
    let LaserDelays { on_us, off_us } = found.settings;
    say!("set      on {on_us:.2} µs, off {off_us:.2} µs, positive is later");
    if left.on_us.abs().max(left.off_us.abs()) > 1e-3 {
        say!("left     on {:.2} µs, off {:.2} µs with --apply mirrors", left.on_us, left.off_us);
    }
    let n_rejected = found.rejects().len();
    let (n_lines, um_per_px) = (delays.lines.len(), delays.scene.mm_per_px * 1e3);
    let rms = match delays.method {
        Method::Comb => format!(", {:.1} µm rms", delays.rms_mm * 1e3),
        Method::Rectangle => String::new(),
    };
    say!("lines    {n_lines} at {um_per_px:.1} µm/px, {n_rejected} ends left out{rms}");
    for advice in &found.advice {
        say!("next     {advice}");
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
}
