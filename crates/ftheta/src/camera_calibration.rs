//! A camera's lens from pictures of a printed sheet.

use crate::Error;
use crate::field_picture::Source;
use ftheta_calibrate::picture::camera::{N_PICTURES_MIN, fit_camera};
use ftheta_calibrate::picture::error::PictureError;
use ftheta_calibrate::picture::sheet::sheet_sightings;
use ftheta_formats::camera_file::CameraFile;
use ftheta_model::pattern::Pattern;
use thiserror::Error as ThisError;

/// Greatest relative deviation of the focal length, and what signs may be off, px rms.
const FOCAL_SD: f64 = 0.03;
const RMS_PX: f64 = 1.0;

/// A calibrated camera.
#[derive(Clone, Debug)]
pub struct CameraCalibration {
    /// The lens, and how the first picture's plane was seen.
    pub camera: CameraFile,
    /// What signs are off, px rms along one axis.
    pub rms_px: f64,
    /// Relative deviation of the focal length.
    pub focal_sd: f64,
    /// Signs in each picture.
    pub n_signs: Vec<usize>,
}

/// Why pictures give no camera.
#[derive(Clone, Debug, ThisError, PartialEq)]
#[non_exhaustive]
pub enum CameraCalibrationError {
    /// Too few pictures.
    #[error(
        "{n_pictures} pictures, the limit is {limit}: take the sheet from above and tilted by 20 to \
         40° to several sides, with the same zoom"
    )]
    Few {
        /// Pictures.
        n_pictures: usize,
        /// Fewest.
        limit: usize,
    },
    /// Pictures of different sizes.
    #[error(
        "{file} has {} x {} pixels, the first picture {} x {}: take all with the same camera and \
         settings, upright or all turned the same way", found[0], found[1], first[0], first[1]
    )]
    Sizes {
        /// The picture.
        file: String,
        /// Its size, px.
        found: [usize; 2],
        /// The first one's, px.
        first: [usize; 2],
    },
    /// Pictures that do not tell.
    #[error(
        "the focal length would be uncertain by {percent:.1} %, the limit is {limit_percent:.0} %: \
         tilt the camera by 20 to 40° in some of the pictures"
    )]
    Alike {
        /// Deviation, percent.
        percent: f64,
        /// Greatest, percent.
        limit_percent: f64,
    },
    /// Signs that no lens explains.
    #[error(
        "signs are {rms_px:.2} px off what one lens can see, the limit is {limit_px:.0} px: lay the \
         sheet flat, and take all pictures with the same zoom and focus"
    )]
    Bent {
        /// What is left, px rms.
        rms_px: f64,
        /// Greatest, px rms.
        limit_px: f64,
    },
}

impl CameraCalibrationError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Few { n_pictures, limit } => {
                ("pictures".into(), n_pictures.to_string(), limit.to_string())
            }
            Self::Sizes { file, found: [w, h], first: [width, height] } => {
                (file.clone(), format!("{w} x {h}"), format!("{width} x {height}"))
            }
            Self::Alike { percent, limit_percent } => {
                ("focal length, %".into(), format!("{percent:.1}"), limit_percent.to_string())
            }
            Self::Bent { rms_px, limit_px } => {
                ("signs, px".into(), format!("{rms_px:.2}"), limit_px.to_string())
            }
        }
    }
}

/// Calibrates a camera by pictures of a pattern's printed sheet.
///
/// * `sheet_mm`: what the sheet's printed lines along x and y measure, mm
///
/// # Errors
/// If a picture does not show the sheet, or they do not tell the lens.
pub fn calibrate_camera(
    sources: &[Source],
    pattern: &Pattern,
    sheet_mm: [Option<f64>; 2],
) -> Result<CameraCalibration, Error> {
    if sources.len() < N_PICTURES_MIN {
        let (n_pictures, limit) = (sources.len(), N_PICTURES_MIN);
        return Err(CameraCalibrationError::Few { n_pictures, limit }.into());
    }
    let mut all = Vec::with_capacity(sources.len());
    let mut first: Option<[usize; 2]> = None;
    for source in sources {
        let picture = source.read()?.picture;
        let found = [picture.width(), picture.height()];
        let first = *first.get_or_insert(found);
        if found != first {
            let file = source.path().display().to_string();
            return Err(CameraCalibrationError::Sizes { file, found, first }.into());
        }
        let in_picture =
            |error: PictureError| Error::Picture { path: source.path(), source: error };
        all.push(sheet_sightings(&picture, pattern, sheet_mm).map_err(in_picture)?);
    }
    let size_px = first.unwrap_or_default();
    let alike = |sd: f64| CameraCalibrationError::Alike {
        percent: 100.0 * sd,
        limit_percent: 100.0 * FOCAL_SD,
    };
    let fit = fit_camera(&all, size_px).ok_or_else(|| alike(f64::INFINITY))?;
    if fit.rms_px > RMS_PX {
        let (rms_px, limit_px) = (fit.rms_px, RMS_PX);
        return Err(CameraCalibrationError::Bent { rms_px, limit_px }.into());
    }
    if fit.focal_sd > FOCAL_SD || fit.focal_sd.is_nan() {
        return Err(alike(fit.focal_sd).into());
    }
    Ok(CameraCalibration {
        camera: CameraFile {
            lens: fit.lens,
            size_px: Some(size_px),
            view: fit.views.first().copied(),
        },
        rms_px: fit.rms_px,
        focal_sd: fit.focal_sd,
        n_signs: all.iter().map(Vec::len).collect(),
    })
}
