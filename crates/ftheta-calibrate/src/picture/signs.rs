//! Printed signs in a picture: which they are, and where their corners are.

use super::quad::{corners_of, refined};
use crate::raster::flat::Flat;
use crate::raster::pieces::{Piece, pieces_with_runs};
use ftheta_model::picture::{Picture, PixelPoint};
use ftheta_model::tag::{CODES, N_CELLS, N_DATA, turned};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A sign is darker than its surroundings by this part of the picture's contrast.
const DARK: f64 = 0.35;
/// Smallest and greatest side of the box around a sign, px and by the picture's shorter side.
const BOX_MIN_PX: usize = 18;
const BOX_MAX: f64 = 0.4;
/// Box of a sign: greatest ratio of its sides, least part of it that is dark.
const BOX_RATIO: f64 = 2.2;
const BOX_DARK: f64 = 0.22;
/// White has to be brighter than black by this, of full scale.
const WHITE_OVER_BLACK: f64 = 0.08;
/// Cells of the border that may be misread, and of the code: codes differ in eleven.
const N_BORDER_WRONG: usize = 3;
const N_CODE_WRONG: u32 = 3;

/// A sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sign {
    /// Its number in the family.
    pub number: usize,
    /// Its corners: upper left, upper right, lower right, lower left of the upright sign.
    pub corners: [PixelPoint; 4],
    /// Whether it is seen from behind.
    pub mirrored: bool,
}

/// All signs of a picture, in the order of rows of its pixels.
pub fn find_signs(picture: &Picture, flat: &Flat) -> Vec<Sign> {
    let (width, height) = (picture.width(), picture.height());
    let dark: Vec<f32> = flat.off.iter().map(|value| -value).collect();
    let contrast = -flat.extremes[0];
    let threshold = (DARK * contrast).max(4.0 * flat.noise_left);
    let box_max = (BOX_MAX * width.min(height) as f64) as usize;
    let found = pieces_with_runs(&dark, width, threshold as f32);
    let like = found.iter().filter(|(piece, _)| is_like(piece, box_max));
    like.filter_map(|(_, runs)| sign(picture, runs)).collect()
}

fn is_like(piece: &Piece, box_max: usize) -> bool {
    let [left, right, top, bottom] = piece.bounds;
    let (width, height) = (right + 1 - left, bottom + 1 - top);
    let (short, long) = (width.min(height), width.max(height));
    short >= BOX_MIN_PX
        && long <= box_max
        && long as f64 <= BOX_RATIO * short as f64
        && piece.n >= BOX_DARK * (width * height) as f64
}

fn sign(picture: &Picture, runs: &[[usize; 3]]) -> Option<Sign> {
    let corners = refined(picture, corners_of(runs)?)?;
    let (code, mirrored_code) = read(picture, &corners)?;
    // Seen from behind, the left half of each row is the right one.
    for (read, mirrored) in [(code, false), (mirrored_code, true)] {
        for (number, &known) in CODES.iter().enumerate() {
            let mut code = known;
            for turns in 0..4 {
                if (code ^ read).count_ones() <= N_CODE_WRONG {
                    // Turned clockwise, the upper left corner is the next one.
                    let corners = std::array::from_fn(|index| corners[(index + turns) % 4]);
                    return Some(Sign { number, corners, mirrored });
                }
                code = turned(code);
            }
        }
    }
    None
}

/// The code of a sign as it is seen, and as it would be in a mirror; `None` if it has no black
/// border on white.
fn read(picture: &Picture, corners: &[PixelPoint; 4]) -> Option<(u64, u64)> {
    let map = square_to(corners)?;
    let n = N_CELLS as f64;
    let at = |column: f64, row: f64| {
        // A few places of a cell, away from its border.
        let places = [(0.0, 0.0), (-0.2, -0.2), (0.2, -0.2), (-0.2, 0.2), (0.2, 0.2)];
        let sum: f64 = places
            .iter()
            .map(|(x, y)| {
                let place = map * Vector3::new((column + x) / n, (row + y) / n, 1.0);
                let pixel = PixelPoint::new(place.x / place.z, place.y / place.z);
                f64::from(picture.at(pixel))
            })
            .sum();
        sum / places.len() as f64
    };
    let along = (0..N_CELLS).map(|index| index as f64 + 0.5);
    let around = |off: f64| {
        let far = n - off;
        along.clone().flat_map(move |t| [(t, off), (t, far), (off, t), (far, t)])
    };
    let mean = |places: &mut dyn Iterator<Item = (f64, f64)>| {
        let values: Vec<f64> = places.map(|(x, y)| at(x, y)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let (black, white) = (mean(&mut around(0.5)), mean(&mut around(-0.45)));
    if white - black < WHITE_OVER_BLACK {
        return None;
    }
    let middle = 0.5 * (black + white);
    if around(0.5).filter(|&(x, y)| at(x, y) > middle).count() > 2 * N_BORDER_WRONG {
        return None;
    }
    let (mut code, mut mirrored) = (0_u64, 0_u64);
    for row in 0..N_DATA {
        for column in 0..N_DATA {
            let is_white =
                |column: usize| u64::from(at(column as f64 + 1.5, row as f64 + 1.5) > middle);
            code = code << 1 | is_white(column);
            mirrored = mirrored << 1 | is_white(N_DATA - 1 - column);
        }
    }
    Some((code, mirrored))
}

/// The projective map from the unit square, y down, to four corners; `None` if they are on a line.
pub fn square_to(corners: &[PixelPoint; 4]) -> Option<Matrix3<f64>> {
    let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let mut matrix = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    for (index, ((u, v), corner)) in square.into_iter().zip(corners).enumerate() {
        let (x, y) = (corner.x_px, corner.y_px);
        let rows = [
            [u, v, 1.0, 0.0, 0.0, 0.0, -u * x, -v * x],
            [0.0, 0.0, 0.0, u, v, 1.0, -u * y, -v * y],
        ];
        for (off, row) in rows.into_iter().enumerate() {
            for (column, value) in row.into_iter().enumerate() {
                matrix[(2 * index + off, column)] = value;
            }
        }
        right[2 * index] = x;
        right[2 * index + 1] = y;
    }
    let h = matrix.lu().solve(&right)?;
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0))
}
