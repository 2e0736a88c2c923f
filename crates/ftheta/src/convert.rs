//! Writes jobs in other formats.

use crate::Error;
use crate::output::write_file;
use ftheta_formats::svg_write;
use ftheta_model::job::Job;
use ftheta_model::recipe::Recipe;
use ftheta_toolpath::lay::{LayOptions, Order, lay};
use std::ffi::OsStr;
use std::path::Path;

/// Writes a job as `.svg` (plain curves in mm) or `.csv` (the polylines that are marked, in
/// drawing order: `mark,pen,x_mm,y_mm`).
///
/// # Errors
/// If the kind of file is not known, the job cannot be laid, or the file cannot be written.
pub fn write(job: &Job, recipe: &Recipe, path: &Path) -> Result<(), Error> {
    let extension = path.extension().map(OsStr::to_ascii_lowercase);
    let content = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("svg") => svg_write::to_svg(job),
        Some("csv") => polylines(job, recipe)?,
        _ => return Err(Error::Format { path: path.into(), expected: ".svg or .csv to write" }),
    };
    write_file(path, content.as_bytes())
}

/// Checks that a drawing is to be written to a file of its kind.
///
/// # Errors
/// If its name does not end in `.svg`.
pub fn check_svg(path: &Path) -> Result<(), Error> {
    match path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg")) {
        true => Ok(()),
        false => Err(Error::Format { path: path.into(), expected: ".svg to write" }),
    }
}

fn polylines(job: &Job, recipe: &Recipe) -> Result<String, Error> {
    let options = LayOptions {
        flatten_tolerance_mm: recipe.flatten_tolerance_mm.unwrap_or(0.002),
        order: Order::Keep,
        // A drawing may be converted whatever the field.
        half_field_mm: f64::INFINITY,
        ..LayOptions::default()
    };
    let toolpath = lay(job, &options)?.value;
    let mut out = String::from("mark,pen,x_mm,y_mm\n");
    for (index, mark) in toolpath.marks.iter().enumerate() {
        for point in &mark.points {
            out.push_str(&format!("{index},{},{},{}\n", mark.pen_index, point.x, point.y));
        }
    }
    Ok(out)
}
