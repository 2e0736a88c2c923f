//! Measured points from pictures of a marked grid, instead of a ruler.

use crate::report_picture::Part;
use crate::{Error, camera, import};
use ftheta_calibrate::picture::error::PictureError;
use ftheta_calibrate::picture::{FieldSeen, PictureOptions, find_field};
use ftheta_formats::picture_file::PictureRead;
use ftheta_model::calibration::MeasuredPoint;
use ftheta_model::pattern::Pattern;
use ftheta_model::picture::Picture;
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::Warning;
use ftheta_report::picture_view::{Sight, SightKind};
use std::path::PathBuf;

/// Where a picture comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A file.
    File(PathBuf),
    /// A camera of this computer.
    Device(String),
}

impl Source {
    /// Takes or reads the picture.
    ///
    /// # Errors
    /// If there is no such file or camera, or no picture in it.
    pub fn read(&self) -> Result<PictureRead, Error> {
        match self {
            Self::File(path) => import::picture(path),
            Self::Device(device) => Ok(camera::take(device)?),
        }
    }

    /// What it is called in messages.
    pub fn path(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Device(device) => device.into(),
        }
    }
}

/// A picture of a grid, and the marks in it.
#[derive(Clone, Debug)]
pub struct FieldPicture {
    /// Where it came from.
    pub path: PathBuf,
    /// The picture.
    pub picture: Picture,
    /// What was found.
    pub seen: FieldSeen,
    /// What was noticed.
    pub warnings: Vec<Warning>,
}

impl FieldPicture {
    /// The picture for a report.
    pub(crate) fn part(&self) -> Option<Part> {
        let seen = &self.seen;
        let n_found = seen.marks.iter().filter(|mark| mark.pixel.is_some()).count();
        let caption = format!(
            "{}: {n_found} of {} marks, {:.1} µm/px",
            self.path.display(),
            seen.marks.len(),
            seen.mm_per_px * 1e3
        );
        Part::whole(&caption, &self.picture)
    }

    /// What was found in it: marks, signs, where marks are missing, and what is none.
    pub(crate) fn sights(&self) -> Vec<Sight> {
        let seen = &self.seen;
        let sight = |kind, places, label: String| Sight { kind, places, label };
        let marks = seen.marks.iter().filter_map(|mark| match mark.pixel {
            Some(pixel) => Some(sight(SightKind::Used, vec![pixel], mark.id.clone())),
            None => {
                let expected = seen.view?.pixel(mark.target_mm)?;
                let label = format!("{} was not found about here", mark.id);
                Some(sight(SightKind::LeftOut, vec![expected], label))
            }
        });
        let signs = seen.signs.iter().map(|sign| {
            let kind = if sign.kept { SightKind::Used } else { SightKind::LeftOut };
            sight(kind, sign.corners.to_vec(), format!("sign {}", sign.number))
        });
        let extra = seen.extra.iter().map(|pixel| {
            sight(SightKind::Extra, vec![*pixel], "looks like a mark, and is not in line".into())
        });
        marks.chain(signs).chain(extra).collect()
    }
}

/// Finds the marks of a pattern in a picture.
///
/// # Errors
/// If there is no picture, or it does not show the pattern well enough.
pub fn measure(
    source: &Source,
    pattern: &Pattern,
    options: &PictureOptions,
) -> Result<FieldPicture, Error> {
    let read = source.read()?;
    let path = source.path();
    let in_picture = |source: PictureError| Error::Picture { path: path.clone(), source };
    let seen = find_field(&read.picture, pattern, options).map_err(in_picture)?;
    let name = path.display().to_string();
    let mut warnings: Vec<Warning> =
        read.notes.iter().map(|note| Warning::new(&name, note.clone())).collect();
    let missing: Vec<&str> = seen
        .marks
        .iter()
        .filter(|mark| mark.measured_mm.is_none())
        .map(|mark| mark.id.as_str())
        .collect();
    if !missing.is_empty() {
        let n_named = missing.len().min(10);
        let more = if missing.len() > n_named { " and more" } else { "" };
        let text = format!(
            "{} of {} marks were not found: {}{more}",
            missing.len(),
            seen.marks.len(),
            missing[..n_named].join(", ")
        );
        warnings.push(Warning::new(&name, text));
    }
    let n_bad = seen.signs.iter().filter(|sign| !sign.kept).count();
    if n_bad > 0 {
        let text = format!("{n_bad} of {} signs do not fit the others", seen.signs.len());
        warnings.push(Warning::new(&name, text));
    }
    if !seen.oriented {
        let text = "nothing in it tells which way it lies: x is taken to run to the right and y up, \
                    and that it is not mirrored is taken for granted";
        warnings.push(Warning::new(&name, text));
    }
    Ok(FieldPicture { path, picture: read.picture, seen, warnings })
}

/// The marks' places, from all pictures of the same plate together: names and points.
///
/// * `round`: of calibration
pub fn points(pictures: &[FieldPicture], round: u32) -> Vec<(String, MeasuredPoint)> {
    let Some(first) = pictures.first() else { return Vec::new() };
    let mut points = Vec::new();
    for (index, mark) in first.seen.marks.iter().enumerate() {
        let places: Vec<FieldPoint> =
            pictures.iter().filter_map(|picture| picture.seen.marks[index].measured_mm).collect();
        if places.is_empty() {
            continue;
        }
        let middle = |of: fn(&FieldPoint) -> f64| middle(places.iter().map(of).collect());
        let measured_mm = FieldPoint::new(middle(|p| p.x_mm), middle(|p| p.y_mm));
        // The header is line 1 of the table that these points make.
        let line = points.len() as u32 + 2;
        let point = MeasuredPoint { target_mm: mark.target_mm, measured_mm, round, line };
        points.push((mark.id.clone(), point));
    }
    points
}

/// The mean without the farthest on either side, where there are enough.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let inner = if values.len() > 3 { &values[1..values.len() - 1] } else { &values[..] };
    inner.iter().sum::<f64>() / inner.len() as f64
}
