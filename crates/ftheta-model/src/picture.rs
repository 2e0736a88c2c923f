//! A picture as it is measured: one brightness a pixel.

use crate::space::FieldPoint;
use thiserror::Error;

/// A place in a picture, pixels; x right, y down, (0, 0) the centre of the upper left pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelPoint {
    /// Right, px.
    pub x_px: f64,
    /// Down, px.
    pub y_px: f64,
}

/// A grey picture; 0 is black and 1 white, as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Something found in a picture: what it is, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Where it is in the field or on the sheet, mm.
    pub place_mm: FieldPoint,
    /// Where it is in the picture.
    pub pixel: PixelPoint,
}

/// Rows that do not make a picture.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{n_values} values are no picture of {width} x {height} pixels")]
pub struct PictureSizeError {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values that there are.
    pub n_values: usize,
}

impl PixelPoint {
    /// A place from its two coordinates in px.
    pub const fn new(x_px: f64, y_px: f64) -> Self {
        Self { x_px, y_px }
    }

    /// Distance to another place, px.
    pub fn distance(self, other: Self) -> f64 {
        (self.x_px - other.x_px).hypot(self.y_px - other.y_px)
    }
}

impl Picture {
    /// A picture from its rows, the upper one first.
    ///
    /// # Errors
    /// If there are not `width · height` values, or none.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self, PictureSizeError> {
        let n_values = values.len();
        if n_values == 0 || width.checked_mul(height) != Some(n_values) {
            return Err(PictureSizeError { width, height, n_values });
        }
        Ok(Self { width, height, values })
    }

    /// Pixels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// A row, counted from above; panics beyond the last.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// Brightness between pixels, bilinear; beyond the border that of the border.
    pub fn at(&self, place: PixelPoint) -> f32 {
        let x = place.x_px.clamp(0.0, (self.width - 1) as f64);
        let y = place.y_px.clamp(0.0, (self.height - 1) as f64);
        let (left, up) = (x as usize, y as usize);
        let (right, down) = ((left + 1).min(self.width - 1), (up + 1).min(self.height - 1));
        let (share_x, share_y) = ((x - left as f64) as f32, (y - up as f64) as f32);
        let (above, below) = (self.row(up), self.row(down));
        let between = |row: &[f32]| row[left] + share_x * (row[right] - row[left]);
        let above = between(above);
        above + share_y * (between(below) - above)
    }

    /// Whether a place is on the picture.
    pub fn contains(&self, place: PixelPoint) -> bool {
        (0.0..=(self.width - 1) as f64).contains(&place.x_px)
            && (0.0..=(self.height - 1) as f64).contains(&place.y_px)
    }
}
