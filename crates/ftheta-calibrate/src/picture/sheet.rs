//! A printed sheet in a picture: its signs, and where their corners are on the paper.

use super::error::PictureError;
use super::signs::{Sign, find_signs};
use super::{PictureOptions, contrast};
use crate::raster::flat::Flat;
use ftheta_model::pattern::{FeatureShape, Pattern};
use ftheta_model::picture::{Picture, PixelPoint, Sighting};
use ftheta_model::space::FieldPoint;
use ftheta_model::tag;

/// Fewest signs, and the share of the sheet's, that a view is fitted to.
const N_SIGNS_MIN: usize = 4;
const SIGNS_SHARE: f64 = 0.5;
/// With a lens that is not known there have to be more.
const N_SIGNS_FREE: usize = 8;
/// Printers are no farther off than this, percent.
const PRINT_PERCENT: f64 = 3.0;

/// Signs in a picture, where their corners are on the sheet, and how many are enough.
pub struct SignsFound {
    /// The signs.
    pub found: Vec<Sign>,
    /// Corners of each on the sheet and in the picture.
    pub sightings: Vec<Vec<Sighting>>,
    /// How many are enough.
    pub limit: usize,
}

/// Finds the signs of a pattern's sheet.
///
/// # Errors
/// If there are too few, or they are not the sheet's.
pub fn signs_of(
    picture: &Picture,
    flat: &Flat,
    pattern: &Pattern,
    options: &PictureOptions,
) -> Result<SignsFound, PictureError> {
    let fiducials = fiducials(pattern);
    if fiducials.is_empty() {
        return Err(PictureError::NoScale);
    }
    let scale = sheet_scale(pattern, options.sheet_mm)?;
    let found = find_signs(picture, flat);
    let sightings = sign_sightings(&found, &fiducials, scale)?;
    let n_least = if options.lens.is_some() { N_SIGNS_MIN } else { N_SIGNS_FREE };
    let limit = n_least.max((SIGNS_SHARE * fiducials.len() as f64) as usize);
    if sightings.len() < limit {
        let (n_found, n_signs) = (sightings.len(), fiducials.len());
        return Err(PictureError::FewSigns { n_found, n_signs, limit });
    }
    Ok(SignsFound { found, sightings, limit })
}

/// Corners of a sheet's signs in a picture, sign by sign.
///
/// * `sheet_mm`: what the sheet's printed lines along x and y measure, mm
///
/// # Errors
/// If there are too few signs, or they are not the sheet's.
pub fn sheet_sightings(
    picture: &Picture,
    pattern: &Pattern,
    sheet_mm: [Option<f64>; 2],
) -> Result<Vec<Vec<Sighting>>, PictureError> {
    let flat = Flat::new(picture);
    contrast(&flat)?;
    let options = PictureOptions { sheet_mm, ..PictureOptions::default() };
    Ok(signs_of(picture, &flat, pattern, &options)?.sightings)
}

/// Printed signs of a pattern: number, centre and side, mm.
pub fn fiducials(pattern: &Pattern) -> Vec<(usize, FieldPoint, f64)> {
    let printed = pattern.features.iter().filter_map(|feature| match &feature.shape {
        FeatureShape::Fiducial { family, code, place_mm, size_mm, burned: false }
            if family == tag::FAMILY =>
        {
            Some((code.parse().ok()?, *place_mm, *size_mm))
        }
        _ => None,
    });
    printed.collect()
}

/// Corners of the signs as they lie on the printed sheet.
///
/// # Errors
/// If a sign is not the sheet's, there twice, or mirrored.
fn sign_sightings(
    found: &[Sign],
    fiducials: &[(usize, FieldPoint, f64)],
    scale: [f64; 2],
) -> Result<Vec<Vec<Sighting>>, PictureError> {
    let n_mirrored = found.iter().filter(|sign| sign.mirrored).count();
    if 2 * n_mirrored > found.len() {
        return Err(PictureError::Mirrored);
    }
    let mut groups = Vec::with_capacity(found.len());
    for (index, sign) in found.iter().enumerate() {
        let number = sign.number;
        if found[..index].iter().any(|other| other.number == number) {
            return Err(PictureError::SignTwice { number });
        }
        let known = fiducials.iter().find(|(known, ..)| *known == number);
        let (_, centre, side_mm) = known.ok_or(PictureError::StrangeSign { number })?;
        let half = 0.5 * side_mm;
        let corners = [(-half, half), (half, half), (half, -half), (-half, -half)];
        let sighting = |((dx, dy), pixel): ((f64, f64), &PixelPoint)| Sighting {
            place_mm: FieldPoint::new(scale[0] * (centre.x_mm + dx), scale[1] * (centre.y_mm + dy)),
            pixel: *pixel,
        };
        groups.push(corners.into_iter().zip(&sign.corners).map(sighting).collect());
    }
    Ok(groups)
}

/// Printed over drawn length along x and y.
///
/// # Errors
/// If a line that is there was not measured, or cannot have this length.
fn sheet_scale(pattern: &Pattern, sheet_mm: [Option<f64>; 2]) -> Result<[f64; 2], PictureError> {
    let mut scale = [1.0; 2];
    for (index, axis) in ['x', 'y'].into_iter().enumerate() {
        let Some(nominal_mm) = printed_line_mm(pattern, index) else { continue };
        let measured_mm = sheet_mm[index].ok_or(PictureError::SheetSize { axis, nominal_mm })?;
        scale[index] = measured_mm / nominal_mm;
        let limit_percent = PRINT_PERCENT;
        if (scale[index] - 1.0).abs() * 100.0 > limit_percent || !scale[index].is_finite() {
            let wrong =
                PictureError::WrongSheetSize { axis, nominal_mm, measured_mm, limit_percent };
            return Err(wrong);
        }
    }
    Ok(scale)
}

/// Length of the longest printed reference line along x (0) or y (1), mm.
fn printed_line_mm(pattern: &Pattern, axis: usize) -> Option<f64> {
    let lines = pattern.features.iter().filter_map(|feature| match &feature.shape {
        FeatureShape::Reference { from_mm, to_mm, burned: false } => {
            let (dx, dy) = (to_mm.x_mm - from_mm.x_mm, to_mm.y_mm - from_mm.y_mm);
            (usize::from(dy.abs() > dx.abs()) == axis).then_some(dx.hypot(dy))
        }
        _ => None,
    });
    lines.reduce(f64::max)
}
