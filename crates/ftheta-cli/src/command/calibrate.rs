//! `ftheta calibrate` and `ftheta twin`: from measured marks to a table, and rehearsals of it.

use crate::arguments::calibrate::{
    Calibrate, CalibrateAction, CalibrateDrift, CalibrateField, Twin, TwinAction, TwinMeasure,
};
use crate::command::{calibrate_camera, calibrate_delay, field_picture};
use crate::json;
use crate::progress::Progress;
use crate::screen::{note, say};
use ftheta::atlas_store::AtlasStore;
use ftheta::calibrate::accuracy::Spread;
use ftheta::calibrate::calibrate::{CalibrateOptions, Noise};
use ftheta::calibrate::table::Grid;
use ftheta::field_calibration::{
    FieldCalibration, FieldOptions, MarkedThrough, calibrate_drift, calibrate_field,
    calibrate_plane,
};
use ftheta::field_picture::FieldPicture;
use ftheta::formats::cor_file::CorVersion;
use ftheta::formats::points;
use ftheta::model::calibration::MeasuredPoint;
use ftheta::model::machine::Machine;
use ftheta::model::warning::{Imported, Warning};
use ftheta::output::write_file;
use ftheta::rehearsal::{self, MeasureOptions};
use ftheta::{Error, import, machines, tables};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Calibrates.
pub fn run(arguments: &Calibrate, as_json: bool) -> Result<(), Error> {
    match &arguments.action {
        CalibrateAction::Field(field) => run_field(field, as_json),
        CalibrateAction::Delay(delay) => calibrate_delay::run(delay, as_json),
        CalibrateAction::Camera(camera) => calibrate_camera::run(camera, as_json),
        CalibrateAction::Drift(drift) => run_drift(drift, as_json),
    }
}

/// Rehearses.
pub fn run_twin(arguments: &Twin, as_json: bool) -> Result<(), Error> {
    match &arguments.action {
        TwinAction::Measure(measure) => run_measure(measure, as_json),
        TwinAction::Photograph(photograph) => super::photograph::run(photograph, as_json),
    }
}

fn run_field(arguments: &CalibrateField, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let Measured { points, mut warnings, pictures } = measured(arguments)?;
    let through = arguments.marked_through.iter().map(|name| marked_through(name, &machine));
    let options = FieldOptions {
        calibrate: CalibrateOptions {
            model: arguments.model.into(),
            noise: Noise { sigma_mm: arguments.noise_um.map(|um| um * 1e-3) },
        },
        grid: Grid {
            n_nodes: arguments.grid.n_nodes(),
            interpolation: arguments.interpolation.into(),
        },
        marked_through: through.collect::<Result<_, _>>()?,
    };
    let field = match (arguments.z_mm, &arguments.onto) {
        (Some(z_mm), Some(path)) => {
            let onto = tables::read(path, &machine)?;
            calibrate_plane(&machine, &points, &options, (z_mm, &onto))
        }
        _ => calibrate_field(&machine, &points, &options),
    };
    let image = arguments.picture.image.first().map(AsRef::as_ref);
    let source = arguments.points.as_deref().or(image);
    let field = field.map_err(|error| error.of_points(source))?;
    warnings.extend(field.calibration.warnings.iter().cloned());
    tables::write(&field.table, &machine, &arguments.out, CorVersion::Two)?;
    let report = arguments.out.with_file_name("calibration.html");
    write_file(&report, field.report(&machine.name, &pictures).as_bytes())?;
    let mut files = vec![
        ("table", arguments.out.display().to_string()),
        ("report", report.display().to_string()),
    ];
    files.extend(
        arguments.picture.points_out.iter().map(|path| ("points", path.display().to_string())),
    );
    if as_json {
        let mut value = object(&field, &machine, &warnings, &files);
        if !pictures.is_empty() {
            value["pictures"] = pictures.iter().map(field_picture::object).collect();
        }
        json::print(&value);
        return Ok(());
    }
    pictures.iter().for_each(field_picture::print);
    print(&field, &warnings, &files);
    Ok(())
}

/// What a calibration is made from.
struct Measured {
    points: Vec<MeasuredPoint>,
    warnings: Vec<Warning>,
    pictures: Vec<FieldPicture>,
}

/// Points from the table, and from pictures as the round after it.
fn measured(arguments: &CalibrateField) -> Result<Measured, Error> {
    let table = arguments.points.as_deref();
    let table = table.map(|path| import::measured_points(path, arguments.units_per_mm));
    let Imported { value: mut points, mut warnings } =
        table.unwrap_or_else(|| Ok(Imported { value: Vec::new(), warnings: Vec::new() }))?;
    let pictures = field_picture::measure(&arguments.picture)?;
    let round = 1 + points.iter().map(|point| point.round).max().unwrap_or(0);
    let seen = ftheta::field_picture::points(&pictures, round);
    if let Some(path) = &arguments.picture.points_out {
        let rows = seen.iter().map(|(id, point)| {
            (id.as_str(), point.target_mm, point.round, Some(point.measured_mm))
        });
        write_file(path, points::write(rows).as_bytes())?;
    }
    points.extend(seen.into_iter().map(|(_, point)| point));
    warnings.extend(pictures.iter().flat_map(|picture| picture.warnings.clone()));
    Ok(Measured { points, warnings, pictures })
}

fn marked_through(name: &str, machine: &Machine) -> Result<MarkedThrough, Error> {
    Ok(match name {
        "nominal" => MarkedThrough::Nominal,
        "linear" => MarkedThrough::Linear,
        path => MarkedThrough::Table(Box::new(tables::read_any(Path::new(path), machine)?)),
    })
}

fn spread(spread: Spread) -> Value {
    json!({"rms": spread.rms_mm * 1e3, "max": spread.max_mm * 1e3})
}

fn object(
    field: &FieldCalibration,
    machine: &Machine,
    warnings: &[Warning],
    files: &[(&str, String)],
) -> Value {
    let calibration = &field.calibration;
    let outlier = |&index: &usize| {
        let (mark, off) = (&field.marks[index], calibration.left_out_mm[index]);
        json!({
            "line": mark.line,
            "round": mark.round,
            "target_x_mm": mark.target.x_mm,
            "target_y_mm": mark.target.y_mm,
            "error_um": off.norm() * 1e3,
        })
    };
    let mut parameters: Map<String, Value> = calibration
        .parameters
        .iter()
        .map(|estimate| {
            let value =
                json!({"value": estimate.value, "sigma": estimate.sigma, "unit": estimate.unit});
            (estimate.name.to_owned(), value)
        })
        .collect();
    for (name, value) in &calibration.coefficients {
        parameters.insert(name.clone(), json!({"value": value, "unit": "mm"}));
    }
    let axes = &calibration.axes;
    json!({
        "machine": machine.name,
        "model": calibration.model.name(),
        "why": calibration.why,
        "points": field.marks.len(),
        "rounds": calibration.n_rounds,
        "planes_mm": field.table.planes().iter().map(|plane| plane.z_mm).collect::<Vec<_>>(),
        "outliers": calibration.outliers.iter().map(outlier).collect::<Vec<_>>(),
        "axes": {
            "swapped": axes.swapped,
            "x_reversed": axes.x_reversed,
            "y_reversed": axes.y_reversed,
            "first_mirror": format!("{:?}", axes.first_mirror).to_lowercase(),
            "margin": axes.margin,
        },
        "before_um": spread(calibration.before),
        "after_um": spread(calibration.after),
        "left_out_um": calibration.left_out.map(spread),
        "expected_um": spread(calibration.expected),
        "noise_um": calibration.noise_mm * 1e3,
        "parameters": parameters,
        "advice": field.advice,
        "warnings": warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "files": json::files(files),
    })
}

fn print(field: &FieldCalibration, warnings: &[Warning], files: &[(&str, String)]) {
    for warning in warnings {
        note!("warning: {warning}");
    }
    let calibration = &field.calibration;
    let line = |name: &str, spread: Spread| {
        say!("{name:8} {:.1} µm rms, {:.1} µm max", spread.rms_mm * 1e3, spread.max_mm * 1e3);
    };
    say!("model    {} ({})", calibration.model.name(), calibration.why);
    for &index in &calibration.outliers {
        let (mark, off) = (&field.marks[index], calibration.left_out_mm[index]);
        let (x, y, um) = (mark.target.x_mm, mark.target.y_mm, off.norm() * 1e3);
        say!("left out line {}: the mark at ({x}, {y}) mm is {um:.0} µm off", mark.line);
    }
    line("before", calibration.before);
    line("after", calibration.after);
    line("expected", calibration.expected);
    for advice in &field.advice {
        say!("next     {advice}");
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
}

fn run_drift(arguments: &CalibrateDrift, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let table = tables::read(&arguments.table, &machine)?;
    let Imported { value: points, warnings } = import::measured_points(&arguments.points, None)?;
    let (table, found) = calibrate_drift(&machine, table, &points)
        .map_err(|error| error.of_points(Some(&arguments.points)))?;
    tables::write(&table, &machine, &arguments.out, CorVersion::Two)?;
    let drift = table.drift();
    let out = arguments.out.display().to_string();
    if as_json {
        json::print(&json!({
            "machine": machine.name,
            "points": points.len(),
            "before_um": spread(found.before),
            "after_um": spread(found.after),
            "gain": drift.gain,
            "offset_rad": drift.offset_rad,
            "warnings": warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "files": {"table": out},
        }));
    } else {
        warnings.iter().for_each(|warning| note!("warning: {warning}"));
        say!("before   {:.1} µm rms", found.before.rms_mm * 1e3);
        say!("after    {:.1} µm rms", found.after.rms_mm * 1e3);
        say!("gain     {:.6}, {:.6}", drift.gain[0], drift.gain[1]);
        let [x, y] = drift.offset_rad.map(f64::to_degrees);
        say!("offset   {x:.5}°, {y:.5}°");
        say!("table    {out}");
    }
    Ok(())
}

fn run_measure(arguments: &TwinMeasure, as_json: bool) -> Result<(), Error> {
    let mut progress = Progress::new("plan");
    let machine = machines::find(&arguments.machine)?;
    let path = &arguments.pattern;
    let pattern = import::pattern(path)?;
    let built_as = arguments.built_as.as_deref().map(machines::find).transpose()?;
    let table =
        arguments.table.as_deref().map(|path| tables::usable(path, &machine)).transpose()?;
    let options = MeasureOptions {
        true_optics: built_as.as_ref().unwrap_or(&machine).optics.clone(),
        seed: arguments.seed,
        noise_mm: arguments.noise_um * 1e-3,
        table,
        round: arguments.round,
        planner: None,
        atlas_store: AtlasStore::new(arguments.cache.clone()),
    };
    let points =
        rehearsal::measure(&pattern, &machine, &options, &mut |stage| progress.observe(stage))?;
    rehearsal::write(&points, path, &arguments.out)?;
    progress.finish();
    let out = arguments.out.display().to_string();
    if as_json {
        json::print(&json!({
            "machine": machine.name,
            "points": points.len(),
            "round": arguments.round,
            "noise_um": arguments.noise_um,
            "seed": arguments.seed,
            "files": {"points": out},
        }));
    } else {
        say!("{} marks measured on the head of seed {}: {out}", points.len(), arguments.seed);
    }
    Ok(())
}
