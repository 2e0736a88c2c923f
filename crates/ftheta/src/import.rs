//! Reads drawings, recipes, patterns, pictures and measured points from files.

use crate::Error;
use ftheta_formats::camera_file::{self, CameraFile};
use ftheta_formats::picture_file::{self, PictureRead};
use ftheta_formats::{pattern_file, recipe, svg};
use ftheta_model::calibration::MeasuredPoint;
use ftheta_model::job::{Job, Shape};
use ftheta_model::pattern::Pattern;
use ftheta_model::recipe::Recipe;
use ftheta_model::warning::Imported;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Largest file that is read, bytes.
const N_BYTES_MAX: u64 = 256 << 20;

/// Reads a drawing as a job.
///
/// # Errors
/// If the file cannot be read, is of no known kind, or has nothing to mark.
pub fn drawing(
    path: &Path,
    recipe: &Recipe,
    options: &svg::SvgOptions,
) -> Result<Imported<Job>, Error> {
    let extension = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("svg" | "svgz") => svg::read(&bytes(path)?, recipe, options)
            .map_err(|source| Error::Svg { path: path.into(), source }),
        _ => Err(Error::Format { path: path.into(), expected: ".svg or .svgz" }),
    }
}

/// Reads the recipe in `file`, or the one beside the drawing, or else the default one.
///
/// A drawing `panel.svg` takes `panel.recipe.toml` in the same folder if it is there; returns
/// that path too.
///
/// # Errors
/// If the file cannot be read or is at fault.
pub fn recipe_for(drawing: &Path, file: Option<&Path>) -> Result<(Recipe, Option<PathBuf>), Error> {
    let beside = drawing.with_extension("recipe.toml");
    let path = match file {
        Some(path) => path,
        None if beside.is_file() => &beside,
        None => return Ok((Recipe::default(), None)),
    };
    let recipe = recipe::read(&path.display().to_string(), &text(path)?)?;
    Ok((recipe, Some(path.into())))
}

/// The bytes of a file, up to the limit.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let io = |source| Error::Io { path: path.into(), action: "read", source };
    let file = File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    // A pipe or device has no length, so the limit is on what is really read.
    let n_bytes = file.take(N_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(io)? as u64;
    if n_bytes > N_BYTES_MAX {
        return Err(Error::TooLarge { path: path.into(), n_bytes, limit: N_BYTES_MAX });
    }
    Ok(bytes)
}

/// The text of a file, up to the limit.
pub(crate) fn text(path: &Path) -> Result<String, Error> {
    String::from_utf8(bytes(path)?).map_err(|error| Error::Io {
        path: path.into(),
        action: "read as UTF-8 text",
        source: std::io::Error::new(std::io::ErrorKind::InvalidData, error.utf8_error()),
    })
}

/// The measured points of a file, in mm.
///
/// * `units_per_mm`: scale of the controller whose commands the file may hold instead of targets
///
/// # Errors
/// If the file is at fault, or holds commands and no scale is given.
pub fn measured_points(
    path: &Path,
    units_per_mm: Option<f64>,
) -> Result<Imported<Vec<MeasuredPoint>>, Error> {
    let Imported { value, warnings } =
        ftheta_formats::points::read(&path.display().to_string(), &bytes(path)?)?;
    let value = value.measured(units_per_mm).ok_or_else(|| Error::Units { path: path.into() })?;
    Ok(Imported { value, warnings })
}

/// The pattern of a file.
///
/// # Errors
/// If the file is at fault.
pub fn pattern(path: &Path) -> Result<Pattern, Error> {
    pattern_file::read(&bytes(path)?)
        .map_err(|source| Error::PatternFile { path: path.into(), source })
}

/// The picture of a PNG, JPEG or TIFF file.
///
/// # Errors
/// If the file cannot be read, or is no picture or not a whole one.
pub fn picture(path: &Path) -> Result<PictureRead, Error> {
    picture_file::read(&bytes(path)?)
        .map_err(|source| Error::PictureFile { path: path.into(), source })
}

/// The camera of a camera file.
///
/// # Errors
/// If the file is at fault.
pub fn camera_file(path: &Path) -> Result<CameraFile, Error> {
    camera_file::read(&bytes(path)?)
        .map_err(|source| Error::CameraFile { path: path.into(), source })
}

/// What a drawing beside a pattern letters on the sheet: `grid.svg` beside `grid.json`, its layer
/// `labels`; nothing if there is no such drawing.
///
/// # Errors
/// If the drawing is at fault.
pub fn labels_beside(pattern: &Path) -> Result<Vec<Shape>, Error> {
    let path = pattern.with_extension("svg");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let (recipe, _) = recipe_for(&path, None)?;
    let job = drawing(&path, &recipe, &svg::SvgOptions::default())?.value;
    let layers = job.layers.into_iter().filter(|layer| layer.name == "labels");
    Ok(layers.flat_map(|layer| layer.shapes).collect())
}
