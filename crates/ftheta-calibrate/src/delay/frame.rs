//! The strokes of a picture as rows along the pattern's lines, and columns across them.

use super::strokes::Stroke;
use ftheta_model::picture::PixelPoint;
use std::f64::consts::{FRAC_PI_2, PI};

/// Strokes within this of the main direction run along it, within that of its normal across, rad.
const ALONG_RAD: f64 = 0.09;
const ACROSS_RAD: f64 = 0.12;
/// Steps in which the main direction is looked for, rad.
const DIRECTION_STEP_RAD: f64 = 0.01;
/// Pieces of a line are no farther apart than this part of the longer one.
const GAP: f64 = 0.25;
/// Strokes of this part of each other's length are about as long.
const AS_LONG: f64 = 0.6;
/// Columns have to span this part of the rows' extent.
const COLUMN_LENGTH: f64 = 0.6;

/// Strokes in one row.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Where it lies across, px.
    pub across_px: f64,
    /// Where it begins and ends along, px.
    pub along_px: [f64; 2],
    /// Its width, px.
    pub width_px: f64,
}

/// The picture turned so that its strokes run along the first coordinate.
pub struct Frame {
    /// The first coordinate's direction in the picture, rad.
    pub direction_rad: f64,
    /// Strokes along.
    pub rows: Vec<Found>,
    /// Strokes beside those of the rows, about as long.
    pub n_beside: usize,
    /// Strokes across that are as long as all rows are wide.
    pub columns: Vec<Found>,
}

impl Frame {
    /// Strokes about this direction.
    pub fn new(strokes: &[Stroke], direction: f64) -> Self {
        let near = strokes.iter().filter(|s| between(s.direction_rad, direction).abs() < ALONG_RAD);
        let weighed =
            near.map(|s| (s.length_px, s.length_px * between(s.direction_rad, direction)));
        let (weight, sum) = weighed.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        let mut direction_rad = direction + if weight > 0.0 { sum / weight } else { 0.0 };
        // To the right, as pictures are mostly taken; down where it is steep.
        if direction_rad > FRAC_PI_2 {
            direction_rad -= PI;
        }
        let (sin, cos) = direction_rad.sin_cos();
        let turned = |s: &Stroke| {
            let PixelPoint { x_px, y_px } = s.centre;
            let [along, across] = [cos * x_px + sin * y_px, cos * y_px - sin * x_px];
            let half = 0.5 * s.length_px;
            Found {
                across_px: across,
                along_px: [along - half, along + half],
                width_px: s.width_px,
            }
        };
        let of = |direction: f64, limit: f64| {
            move |s: &&Stroke| between(s.direction_rad, direction).abs() < limit
        };
        let rows: Vec<_> =
            strokes.iter().filter(of(direction_rad, ALONG_RAD)).map(turned).collect();
        let across = strokes.iter().filter(of(direction_rad + FRAC_PI_2, ACROSS_RAD));
        let columns: Vec<_> = across
            .map(|s| {
                let found = turned(s);
                let middle = 0.5 * (found.along_px[0] + found.along_px[1]);
                let half = 0.5 * s.length_px;
                let along_px = [found.across_px - half, found.across_px + half];
                Found { across_px: middle, along_px, width_px: s.width_px }
            })
            .collect();
        let (rows, n_beside) = in_rows(rows);
        let span = match rows[..] {
            [first, .., last] => last.across_px - first.across_px,
            _ => 0.0,
        };
        let (mut columns, _) = in_rows(columns);
        columns.retain(|column| column.length_px() > COLUMN_LENGTH * span);
        Self { direction_rad, rows, n_beside, columns }
    }
}

/// The angle between two directions of lines, rad, -π/2 to π/2.
fn between(a: f64, b: f64) -> f64 {
    (a - b + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2
}

/// How many strokes run in the direction in which most do, and that direction, rad.
pub fn main_direction(strokes: &[Stroke]) -> (usize, f64) {
    let n_near = |direction: f64| {
        strokes.iter().filter(|s| between(s.direction_rad, direction).abs() < ALONG_RAD).count()
    };
    let n_steps = (PI / DIRECTION_STEP_RAD) as i32;
    let tried = (0..n_steps).map(|step| f64::from(step) * DIRECTION_STEP_RAD - FRAC_PI_2);
    // The first of the best, so that the result does not hang on rounding.
    let best = tried.map(|direction| (n_near(direction), direction));
    best.fold((0, 0.0), |best, here| if here.0 > best.0 { here } else { best })
}

/// Joins what lies in one row, and counts what stands beside, about as long.
fn in_rows(mut found: Vec<Found>) -> (Vec<Found>, usize) {
    let mut n_beside = 0;
    found.sort_by(|a, b| a.across_px.total_cmp(&b.across_px));
    let mut rows: Vec<Found> = Vec::new();
    for piece in found {
        if let Some(row) = rows.last_mut()
            && piece.across_px - row.across_px < row.width_px.max(piece.width_px)
        {
            // Beside a line stands lettering, which is no part of it.
            let gap =
                (piece.along_px[0] - row.along_px[1]).max(row.along_px[0] - piece.along_px[1]);
            let longer = piece.length_px() > row.length_px();
            let [short, long] = [row.length_px(), piece.length_px()];
            let (short, long) = (short.min(long), short.max(long));
            if gap > GAP * long {
                n_beside += usize::from(short > AS_LONG * long);
                if longer {
                    *row = piece;
                }
                continue;
            }
            if longer {
                (row.across_px, row.width_px) = (piece.across_px, piece.width_px);
            }
            row.along_px =
                [row.along_px[0].min(piece.along_px[0]), row.along_px[1].max(piece.along_px[1])];
            continue;
        }
        rows.push(piece);
    }
    (rows, n_beside)
}

impl Found {
    fn length_px(&self) -> f64 {
        self.along_px[1] - self.along_px[0]
    }
}
