//! Camera files: a lens as OpenCV names its numbers, and the view of a camera that stands still.

use ftheta_model::picture::PixelPoint;
use ftheta_physics::camera::{CameraLens, View};
use nalgebra::Matrix3;
use serde_json::{Value, json};
use thiserror::Error;

/// Greatest focal length and centre, px, and greatest coefficient of a lens.
const PIXELS_MAX: f64 = 1e6;
const BENDING_MAX: f64 = 1e3;
/// Names that others give to the coefficients k1, k2, p1, p2, k3.
const DISTORTION: [&str; 4] =
    ["dist_coeffs", "distortion_coefficients", "distortion_coeffs", "dist_coeff"];

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraFile {
    /// Its lens.
    pub lens: CameraLens,
    /// Width and height of its pictures, if it says so.
    pub size_px: Option<[usize; 2]>,
    /// How it sees the plane of the field, if it stands still.
    pub view: Option<View>,
}

/// What is wrong with a camera file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraFileError {
    /// Not JSON.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line from 1.
        line: usize,
        /// Column from 1.
        column: usize,
        /// What the JSON parser says.
        message: String,
    },
    /// A value that is missing or cannot be.
    #[error("{place} is {found}, expected {expected}")]
    Value {
        /// Which.
        place: &'static str,
        /// What is there.
        found: String,
        /// What is allowed.
        expected: &'static str,
    },
}

impl CameraFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Syntax { line, column, message } => {
                (format!("line {line}, column {column}"), message.clone(), "JSON".into())
            }
            Self::Value { place, found, expected } => {
                ((*place).into(), found.clone(), (*expected).into())
            }
        }
    }
}

/// Reads a camera file; nested lists and OpenCV's `{"data": [...]}` are both matrices.
///
/// # Errors
/// If it is no JSON, or a number is missing or out of range.
pub fn read(bytes: &[u8]) -> Result<CameraFile, CameraFileError> {
    let root: Value = serde_json::from_slice(bytes).map_err(|error| CameraFileError::Syntax {
        line: error.line(),
        column: error.column(),
        // The parser says the place once more at the end.
        message: error.to_string().split(" at line ").next().unwrap_or_default().into(),
    })?;
    let expected = "3 x 3 numbers, focal lengths above 0";
    let matrix = numbers(&root["camera_matrix"]);
    let wrong = |place, value: &Value, expected| {
        let found = if value.is_null() { "missing".into() } else { shortened(&value.to_string()) };
        CameraFileError::Value { place, found, expected }
    };
    let [fx, _, x_px, _, fy, y_px, ..] = matrix[..] else {
        return Err(wrong("camera_matrix", &root["camera_matrix"], expected));
    };
    let in_range = [fx, fy].iter().all(|f| (1.0..=PIXELS_MAX).contains(f))
        && [x_px, y_px].iter().all(|c| c.abs() <= PIXELS_MAX)
        && matrix.len() == 9;
    if !in_range {
        return Err(wrong("camera_matrix", &root["camera_matrix"], expected));
    }
    let name = DISTORTION.into_iter().find(|name| !root[name].is_null()).unwrap_or(DISTORTION[0]);
    let mut bending = numbers(&root[name]);
    let plausible = bending.iter().all(|k| k.abs() <= BENDING_MAX);
    if !(4..=5).contains(&bending.len()) || !plausible {
        return Err(wrong(name, &root[name], "k1, k2, p1, p2 and perhaps k3"));
    }
    bending.resize(5, 0.0);
    let lens = CameraLens {
        focal_px: [fx, fy],
        centre_px: PixelPoint::new(x_px, y_px),
        radial: [bending[0], bending[1], bending[4]],
        tangential: [bending[2], bending[3]],
    };
    let size_px = match numbers(&root["image_size"])[..] {
        [width, height] if width >= 1.0 && height >= 1.0 => Some([width as usize, height as usize]),
        _ => None,
    };
    let view = match &root["view"] {
        Value::Null => None,
        value => {
            let entries = numbers(value);
            let homography = (entries.len() == 9).then(|| Matrix3::from_row_slice(&entries));
            let invertible = homography.filter(|h| h.try_inverse().is_some());
            let homography =
                invertible.ok_or_else(|| wrong("view", value, "3 x 3 numbers of a view"))?;
            Some(View { lens, homography })
        }
    };
    Ok(CameraFile { lens, size_px, view })
}

/// All numbers of nested lists, or none if there is anything else.
fn numbers(value: &Value) -> Vec<f64> {
    let value = if value["data"].is_null() { value } else { &value["data"] };
    let Value::Array(entries) = value else { return Vec::new() };
    let mut all = Vec::new();
    for entry in entries {
        match entry {
            Value::Number(number) => all.extend(number.as_f64()),
            Value::Array(_) => all.extend(numbers(entry)),
            _ => return Vec::new(),
        }
    }
    all
}

fn shortened(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// Writes a camera file.
pub fn write(camera: &CameraFile) -> String {
    let lens = &camera.lens;
    let ([fx, fy], PixelPoint { x_px, y_px }) = (lens.focal_px, lens.centre_px);
    let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
    let mut value = json!({
        "camera_matrix": [[fx, 0.0, x_px], [0.0, fy, y_px], [0.0, 0.0, 1.0]],
        "dist_coeffs": [k1, k2, p1, p2, k3],
    });
    if let Some(size_px) = camera.size_px {
        value["image_size"] = json!(size_px);
    }
    if let Some(view) = camera.view {
        let rows: Vec<Vec<f64>> =
            view.homography.row_iter().map(|row| row.iter().copied().collect()).collect();
        value["view"] = json!(rows);
    }
    // Numbers always have a JSON form: all are finite.
    serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let lens = CameraLens {
            focal_px: [3123.5, 3120.25],
            centre_px: PixelPoint::new(2010.5, 1490.125),
            radial: [0.1, -0.2, 0.05],
            tangential: [1e-3, -2e-3],
        };
        let homography = Matrix3::new(1.0, 0.1, 2.0, 0.0, -1.0, 3.0, 0.001, 0.002, 300.0);
        let view = Some(View { lens, homography });
        let camera = CameraFile { lens, size_px: Some([4000, 3000]), view };
        assert_eq!(read(write(&camera).as_bytes()), Ok(camera));
        let others = br#"{"camera_matrix": {"rows": 3, "cols": 3, "data": [900, 0, 320, 0, 901, 240, 0, 0, 1]},
            "distortion_coefficients": {"data": [0.1, 0.2, 0.3, 0.4]}}"#;
        let camera = read(others).unwrap();
        assert_eq!(camera.lens.focal_px, [900.0, 901.0]);
        assert_eq!((camera.lens.radial, camera.lens.tangential), ([0.1, 0.2, 0.0], [0.3, 0.4]));
    }

    #[test]
    fn faulty_files_name_what_is_wrong() {
        let error = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(error("{").starts_with("line 1, column 1"));
        assert!(error("{}").starts_with("camera_matrix is missing"));
        let matrix = r#""camera_matrix": [[9,0,1],[0,9,1],[0,0,1]]"#;
        assert!(error(&format!("{{{matrix}}}")).starts_with("dist_coeffs is missing"));
        let lens =
            format!(r#"{{{matrix}, "dist_coeffs": [0,0,0,0], "view": [[1,1,1],[1,1,1],[1,1,1]]}}"#);
        assert!(error(&lens).starts_with("view is"));
        assert!(error(r#"{"camera_matrix": [[0,0,1],[0,9,1],[0,0,1]]}"#).contains("above 0"));
    }
}
