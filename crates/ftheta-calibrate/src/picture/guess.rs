//! How large marks are in a picture and which way they stand, where nothing else tells.

use super::candidates::Shape;
use crate::raster::flat::Flat;
use crate::raster::pieces::{Piece, pieces_with_runs};
use ftheta_model::pattern::MarkStyle;
use ftheta_model::picture::PixelPoint;

/// A piece differs from its surroundings by such a part of the contrast.
const THRESHOLDS: [f64; 3] = [0.35, 0.2, 0.12];
/// Smallest side of the box around a mark, px.
const BOX_MIN_PX: usize = 7;
/// Sides of that box differ by this factor at most.
const BOX_RATIO: f64 = 1.5;
/// What a dot fills of its box, and a cross of its at most.
const DOT_FILLS: [f64; 2] = [0.62, 0.95];
const CROSS_FILLS: f64 = 0.45;
/// How well a cross' pixels agree on the direction of its arms, from 0 to 1.
const AGREE: f64 = 0.7;
/// Marks are as large as the usual one to this part.
const SIZE: f64 = 0.35;
/// Fewest marks to guess from.
const N_MIN: usize = 4;
const EVEN: f64 = 0.3;

/// How marks look in the middle of the picture, and how far they are from each other.
#[derive(Clone, Copy, Debug)]
pub struct Guess {
    /// A mark.
    pub shape: Shape,
    /// From a column to the next, and from a row to the next, px.
    pub ways_px: [[f64; 2]; 2],
}

/// Guesses from marks that stand alone, dark or bright; `None` if there are too few.
pub fn guess(flat: &Flat, width: usize, style: MarkStyle) -> Option<Guess> {
    let [low, high] = flat.extremes;
    let contrast = high.max(-low);
    let dark: Vec<f32> = flat.off.iter().map(|value| -value).collect();
    let mut marks: Vec<(PixelPoint, f64)> = Vec::new();
    // Beside black print what is burned differs little.
    for share in THRESHOLDS {
        let threshold = (share * contrast).max(4.0 * flat.noise_left) as f32;
        for values in [&dark, &flat.off] {
            let all = pieces_with_runs(values, width, threshold);
            let found = all.iter().filter_map(|(piece, runs)| mark(piece, runs, style));
            let found = alike(found.collect());
            if found.len() > marks.len() {
                marks = found;
            }
        }
    }
    if marks.len() < N_MIN {
        return None;
    }
    let usual = marks[marks.len() / 2].1;
    let (pitch_px, direction) = neighbours(&marks)?;
    let (sin, cos) = direction.sin_cos();
    let axes = |length: f64| [[length * cos, length * sin], [length * sin, -length * cos]];
    let shape = Shape { style, arms_px: axes(0.5 * usual) };
    Some(Guess { shape, ways_px: axes(pitch_px) })
}

/// Those of about the usual size, the smallest first.
fn alike(mut marks: Vec<(PixelPoint, f64)>) -> Vec<(PixelPoint, f64)> {
    marks.sort_by(|a, b| a.1.total_cmp(&b.1));
    let usual = marks.get(marks.len() / 2).map_or(0.0, |mark| mark.1);
    marks.retain(|(_, size)| (size / usual - 1.0).abs() < SIZE);
    marks
}

/// The middle and size of a piece that looks like a mark.
fn mark(piece: &Piece, runs: &[[usize; 3]], style: MarkStyle) -> Option<(PixelPoint, f64)> {
    let [left, right, top, bottom] = piece.bounds;
    let (width, height) = (right + 1 - left, bottom + 1 - top);
    let (short, long) = (width.min(height), width.max(height));
    if short < BOX_MIN_PX || long as f64 > BOX_RATIO * short as f64 {
        return None;
    }
    let fills = piece.n / (width * height) as f64;
    let middle = PixelPoint::new(0.5 * (left + right) as f64, 0.5 * (top + bottom) as f64);
    let size = 0.5 * (width + height) as f64;
    let like = match style {
        MarkStyle::Dot => (DOT_FILLS[0]..DOT_FILLS[1]).contains(&fills),
        MarkStyle::Cross => fills < CROSS_FILLS && four_arms(middle, size, runs) > AGREE,
    };
    like.then_some((middle, size))
}

/// How much pixels away from the middle lie in four directions, from 0 to 1.
fn four_arms(middle: PixelPoint, size: f64, runs: &[[usize; 3]]) -> f64 {
    let (mut cos, mut sin, mut n) = (0.0, 0.0, 0.0);
    for &[y, from, to] in runs {
        for x in from..to {
            let (u, v) = (x as f64 - middle.x_px, y as f64 - middle.y_px);
            if u.hypot(v) > 0.2 * size {
                let angle = 4.0 * v.atan2(u);
                (cos, sin, n) = (cos + angle.cos(), sin + angle.sin(), n + 1.0);
            }
        }
    }
    f64::hypot(cos, sin) / f64::max(n, 1.0)
}

/// Usual distance to the nearest other mark, and the direction of the grid within a quarter turn.
fn neighbours(marks: &[(PixelPoint, f64)]) -> Option<(f64, f64)> {
    let mut nearest: Vec<(f64, f64)> = Vec::with_capacity(marks.len());
    for (index, (here, _)) in marks.iter().enumerate() {
        let others = marks.iter().enumerate().filter(|(other, _)| *other != index);
        let found =
            others.min_by(|(_, a), (_, b)| a.0.distance(*here).total_cmp(&b.0.distance(*here)));
        let (_, (there, _)) = found?;
        let angle = (there.y_px - here.y_px).atan2(there.x_px - here.x_px);
        nearest.push((there.distance(*here), angle));
    }
    nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let pitch = nearest[nearest.len() / 2].0;
    let even = nearest.iter().filter(|(far, _)| (far / pitch - 1.0).abs() < EVEN);
    let (mut cos, mut sin) = (0.0, 0.0);
    for (_, angle) in even {
        cos += (4.0 * angle).cos();
        sin += (4.0 * angle).sin();
    }
    Some((pitch, 0.25 * f64::atan2(sin, cos)))
}
