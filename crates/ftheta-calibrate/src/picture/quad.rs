//! Four-sided dark pieces: their corners, coarsely and to a small part of a pixel.

use crate::raster::strip::{crossing, straight};
use ftheta_model::picture::{Picture, PixelPoint};

/// A piece fills this part of the four-sided figure around it at least.
const FOUR_SIDED: f64 = 0.85;
/// Shortest side, px.
const SIDE_MIN_PX: f64 = 12.0;
/// Part of a side that is looked at, and how far to either side, by its length; steps, px.
const INSET: f64 = 0.12;
const REACH: f64 = 0.085;
const STEP_PX: f64 = 0.25;
/// Places along a side, and the part of them that must show an edge.
const N_PLACES: usize = 60;
const N_EDGES: f64 = 0.6;

/// The corners of a piece, clockwise in the picture; `None` if it is not four-sided.
///
/// * `runs`: y, first x, and one beyond the last, of each run of its pixels
pub fn corners_of(runs: &[[usize; 3]]) -> Option<[PixelPoint; 4]> {
    let hull = hull(runs);
    let area = area(&hull);
    // The longest diagonal, and what is farthest from it on either side.
    let mut longest = (0.0, 0, 0);
    for (from, a) in hull.iter().enumerate() {
        for (to, b) in hull.iter().enumerate().skip(from + 1) {
            let length = a.distance(*b);
            if length > longest.0 {
                longest = (length, from, to);
            }
        }
    }
    let (_, from, to) = longest;
    let (a, c) = (*hull.get(from)?, *hull.get(to)?);
    let side = |p: &PixelPoint| {
        (c.x_px - a.x_px) * (p.y_px - a.y_px) - (c.y_px - a.y_px) * (p.x_px - a.x_px)
    };
    let b = *hull.iter().min_by(|p, q| side(p).total_cmp(&side(q)))?;
    let d = *hull.iter().max_by(|p, q| side(p).total_cmp(&side(q)))?;
    // With y down, the side of negative area comes first clockwise.
    let corners = [a, b, c, d];
    let long = |index: usize| corners[index].distance(corners[(index + 1) % 4]) > SIDE_MIN_PX;
    let fits = self::area(&corners) > FOUR_SIDED * area && (0..4).all(long);
    fits.then_some(corners)
}

/// The convex hull of pixels' corners, clockwise in the picture.
fn hull(runs: &[[usize; 3]]) -> Vec<PixelPoint> {
    let mut points: Vec<PixelPoint> = Vec::with_capacity(4 * runs.len());
    for &[y, from, to] in runs {
        for (x, y) in [(from, y), (to, y), (from, y + 1), (to, y + 1)] {
            points.push(PixelPoint::new(x as f64 - 0.5, y as f64 - 0.5));
        }
    }
    points.sort_by(|a, b| a.x_px.total_cmp(&b.x_px).then(a.y_px.total_cmp(&b.y_px)));
    points.dedup();
    let turn = |o: PixelPoint, a: PixelPoint, b: PixelPoint| {
        (a.x_px - o.x_px) * (b.y_px - o.y_px) - (a.y_px - o.y_px) * (b.x_px - o.x_px)
    };
    let half = |points: &mut dyn Iterator<Item = PixelPoint>| {
        let mut chain: Vec<PixelPoint> = Vec::new();
        for point in points {
            while chain.len() > 1
                && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

fn area(corners: &[PixelPoint]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let cross = |(a, b): (&PixelPoint, &PixelPoint)| a.x_px * b.y_px - a.y_px * b.x_px;
    0.5 * corners.iter().zip(next).map(cross).sum::<f64>()
}

/// The corners where straight lines along the four edges meet; `None` if an edge does not show.
pub fn refined(picture: &Picture, corners: [PixelPoint; 4]) -> Option<[PixelPoint; 4]> {
    let mut corners = corners;
    for _ in 0..2 {
        let mut lines = [([0.0; 2], [0.0; 2]); 4];
        for (index, line) in lines.iter_mut().enumerate() {
            *line = edge_line(picture, corners[index], corners[(index + 1) % 4])?;
        }
        for (index, corner) in corners.iter_mut().enumerate() {
            *corner = crossing(lines[(index + 3) % 4], lines[index])?;
        }
    }
    Some(corners)
}

/// A place on the edge between two corners, black on its right, and its direction.
fn edge_line(picture: &Picture, from: PixelPoint, to: PixelPoint) -> Option<([f64; 2], [f64; 2])> {
    let length = from.distance(to);
    let [x, y] = [(to.x_px - from.x_px) / length, (to.y_px - from.y_px) / length];
    let reach = (REACH * length).max(2.5);
    let n = (reach / STEP_PX) as i32;
    let mut points = Vec::with_capacity(N_PLACES);
    for index in 0..N_PLACES {
        let share = INSET + (1.0 - 2.0 * INSET) * (index as f64 + 0.5) / N_PLACES as f64;
        let t = share * length;
        // Clockwise with y down the inside is to the right: from inside to outside.
        let profile: Vec<f64> = (-n..=n)
            .map(|step| {
                let off = f64::from(step) * STEP_PX;
                let at = PixelPoint::new(from.x_px + t * x + off * y, from.y_px + t * y - off * x);
                f64::from(picture.at(at))
            })
            .collect();
        points.extend(crossing_of(&profile).map(|at| (t, (at - f64::from(n)) * STEP_PX)));
    }
    if (points.len() as f64) < N_EDGES * N_PLACES as f64 {
        return None;
    }
    let (height, slope) = straight(&points);
    let norm = slope.hypot(1.0);
    let place = [from.x_px + height * y, from.y_px - height * x];
    Some((place, [(x + slope * y) / norm, (y - slope * x) / norm]))
}

/// Where a profile from black to white is half way, as an index.
fn crossing_of(profile: &[f64]) -> Option<f64> {
    let side = profile.len() / 4;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
    let (black, white) = (mean(&profile[..side]), mean(&profile[profile.len() - side..]));
    if white - black < 0.05 {
        return None;
    }
    // As much as is black of it: that is where a sharp edge would be, whatever the blur.
    let dark: f64 = profile.iter().map(|value| (white - value) / (white - black)).sum();
    let at = dark - 0.5;
    (at > side as f64 * 0.5 && at < profile.len() as f64 - 0.5 * side as f64).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dark figure of four corners, each pixel by how much of it is covered.
    fn drawn(corners: &[(f64, f64); 4]) -> Picture {
        let inside = |x: f64, y: f64| {
            (0..4).all(|index| {
                let ((ax, ay), (bx, by)) = (corners[index], corners[(index + 1) % 4]);
                (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0
            })
        };
        let n = 16;
        let values = (0..100 * 100).map(|index| {
            let (x, y) = ((index % 100) as f64, (index / 100) as f64);
            let places = (0..n * n).map(|place| {
                let off = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
                f64::from(u8::from(inside(x + off(place % n), y + off(place / n))))
            });
            (0.8 - 0.7 * places.sum::<f64>() / (n * n) as f64) as f32
        });
        Picture::new(100, 100, values.collect()).unwrap()
    }

    #[test]
    fn corners_are_found_to_hundredths_of_a_pixel() {
        let known = [(22.3, 18.1), (79.4, 25.7), (74.2, 80.9), (17.6, 72.4)];
        let picture = drawn(&known);
        let dark: Vec<f32> = picture.values().iter().map(|value| 0.5 - value).collect();
        let found = crate::raster::pieces::pieces_with_runs(&dark, 100, 0.0);
        let coarse = corners_of(&found[0].1).unwrap();
        let fine = refined(&picture, coarse).unwrap();
        for (x, y) in known {
            let nearest = fine.iter().map(|corner| corner.distance(PixelPoint::new(x, y)));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.03, "{x} {y}: {nearest} {fine:?}");
        }
    }

    #[test]
    fn a_triangle_is_not_four_sided() {
        let runs: Vec<[usize; 3]> = (0..50).map(|y| [y, 10, 11 + y]).collect();
        assert!(corners_of(&runs).is_none());
    }
}
