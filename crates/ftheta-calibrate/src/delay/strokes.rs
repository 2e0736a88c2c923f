//! Straight strokes of a picture, coarsely: pieces that are darker or brighter than what is around
//! them, long and thin.

use super::error::DelayError;
use crate::raster::flat::Flat;
use crate::raster::pieces::{Piece, pieces};
use ftheta_model::picture::{Picture, PixelPoint};

/// A stroke differs by this part of the contrast, and by so many deviations of the noise.
const THRESHOLD: f64 = 0.4;
const THRESHOLD_NOISE: f64 = 4.0;
/// Least contrast, in deviations of the noise.
const CONTRAST_NOISE: f64 = 6.0;
/// Least contrast, of full scale.
const CONTRAST_MIN: f64 = 0.02;
/// A stroke is so many times as long as wide, and at least so long.
const ELONGATION: f64 = 5.0;
const LENGTH_MIN_PX: f64 = 15.0;
/// Most pieces that are looked at: a picture of gravel has more.
const N_PIECES_MAX: usize = 400_000;

/// A straight stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its middle.
    pub centre: PixelPoint,
    /// Its direction in the picture, rad from x towards y, from -π/2 to π/2.
    pub direction_rad: f64,
    /// Length, px.
    pub length_px: f64,
    /// Width, px.
    pub width_px: f64,
    /// Whether it reaches the picture's border.
    pub cut: bool,
}

/// All strokes of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Strokes {
    /// The strokes.
    pub list: Vec<Stroke>,
    /// Whether they are brighter than what is around them.
    pub bright: bool,
    /// By how much they differ, of full scale.
    pub contrast: f64,
    /// Standard deviation of the noise between neighbouring pixels, of full scale.
    pub noise: f64,
}

/// Finds the strokes of a picture.
///
/// # Errors
/// If nothing stands out, or too much does.
pub fn strokes(picture: &Picture) -> Result<Strokes, DelayError> {
    let Flat { mut off, extremes: [low, high], noise, noise_left } = Flat::new(picture);
    let bright = high > -low;
    let contrast = high.max(-low);
    let limit = CONTRAST_MIN.max(CONTRAST_NOISE * noise_left);
    if contrast < limit {
        return Err(DelayError::NoContrast { contrast, noise, limit });
    }
    if !bright {
        off.iter_mut().for_each(|value| *value = -*value);
    }
    let threshold = (THRESHOLD * contrast).max(THRESHOLD_NOISE * noise_left);
    let pieces = pieces(&off, picture.width(), threshold as f32);
    if pieces.len() > N_PIECES_MAX {
        return Err(DelayError::Clutter { n_pieces: pieces.len(), limit: N_PIECES_MAX });
    }
    let (width, height) = (picture.width(), picture.height());
    let list = pieces.iter().filter_map(|piece| stroke(piece, width, height)).collect();
    Ok(Strokes { list, bright, contrast, noise })
}

/// The stroke that a piece is, if it is one.
fn stroke(piece: &Piece, width: usize, height: usize) -> Option<Stroke> {
    let (x, y) = (piece.x / piece.n, piece.y / piece.n);
    let xx = piece.xx / piece.n - x * x + 1.0 / 12.0;
    let yy = piece.yy / piece.n - y * y + 1.0 / 12.0;
    let xy = piece.xy / piece.n - x * y;
    let direction_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (middle, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let length_px = (12.0 * (middle + half)).sqrt();
    let width_px = (12.0 * (middle - half)).max(1.0).sqrt();
    let [left, right, top, bottom] = piece.bounds;
    let cut = left == 0 || top == 0 || right + 1 == width || bottom + 1 == height;
    let centre = PixelPoint::new(x, y);
    let long = length_px >= LENGTH_MIN_PX && length_px >= ELONGATION * width_px;
    long.then_some(Stroke { centre, direction_rad, length_px, width_px, cut })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_strokes_are_found_on_uneven_ground() {
        let (width, height) = (200, 120);
        let values = (0..width * height).map(|index| {
            let (x, y) = (index % width, index / width);
            let ground = 0.5 + 0.2 * x as f32 / width as f32;
            let on = (40..44).contains(&y) && (30..130).contains(&x)
                || (150..153).contains(&x) && (20..100).contains(&y);
            if on { ground - 0.4 } else { ground }
        });
        let picture = Picture::new(width, height, values.collect()).unwrap();
        let found = strokes(&picture).unwrap();
        assert!(!found.bright);
        let [flat, steep] = found.list[..] else { panic!("{found:?}") };
        let (flat, steep) =
            if flat.direction_rad.abs() < 0.1 { (flat, steep) } else { (steep, flat) };
        assert!(flat.centre.distance(PixelPoint::new(79.5, 41.5)) < 0.01, "{flat:?}");
        assert!((flat.length_px - 100.0).abs() < 0.5 && (flat.width_px - 4.0).abs() < 0.1);
        assert!(steep.centre.distance(PixelPoint::new(151.0, 59.5)) < 0.01, "{steep:?}");
    }

    #[test]
    fn an_empty_sheet_has_no_contrast() {
        let picture = Picture::new(50, 50, vec![0.5; 2500]).unwrap();
        assert!(matches!(strokes(&picture), Err(DelayError::NoContrast { .. })));
    }
}
