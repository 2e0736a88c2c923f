//! How far a curve's points are from the light that was meant for them.

use crate::contour::Contour;
use crate::segment_tree::SegmentTree;
use kurbo::{Point, Vec2};

/// Every how many samples the whole beam is searched.
const WIDE_EVERY: usize = 16;
/// Growth of the distance since the last such search from which on it is searched again: what
/// grows may be the distance to a branch that is being left.
const GROWTH: f64 = 1.02;

/// Where the beam was while a mark's light was on, thinned.
#[derive(Debug, Default)]
pub struct BeamPath {
    points: Vec<Point>,
}

impl BeamPath {
    /// Adds a place of the beam, unless it is nearer than `apart_mm` to the last one.
    pub fn add(&mut self, beam: Point, apart_mm: f64) {
        if self.points.last().is_none_or(|last| last.distance(beam) >= apart_mm) {
            self.points.push(beam);
        }
    }

    /// Distances in mm of points of `contour` every `step_mm` from the nearest lit beam, each with
    /// the number of times that the curve passes the point.
    ///
    /// Between two places of the beam it is taken to go straight.
    ///
    /// # Accuracy
    /// Every sixteenth distance is exact; others may be too large by 2 % and a quarter step.
    pub fn into_distances_mm(
        mut self,
        contour: &Contour,
        step_mm: f64,
        n: usize,
    ) -> Vec<(usize, f64)> {
        let first = self.points[0];
        if self.points.len() == 1 {
            // A beam that stood still is a very short way.
            self.points.push(first + Vec2::new(1e-9, 0.0));
        }
        let points = &self.points;
        let tree = SegmentTree::in_order(points.windows(2).map(|pair| [pair[0], pair[1]]));
        let (mut near, mut wide_mm) = (0, 0.0);
        contour
            .samples(step_mm, n)
            .enumerate()
            .map(|(k, (n_passages, place))| {
                near = downhill(points, place, near);
                let mut distance_mm = distance_mm(points, place, near);
                if k % WIDE_EVERY == 0 || distance_mm > GROWTH * wide_mm + 0.25 * step_mm {
                    let mut nearest_sq = distance_mm * distance_mm;
                    tree.search(place, nearest_sq, |_, found| {
                        if found.distance_sq < nearest_sq {
                            (nearest_sq, near) = (found.distance_sq, found.index);
                        }
                        nearest_sq
                    });
                    distance_mm = nearest_sq.sqrt();
                    wide_mm = distance_mm;
                }
                (n_passages, distance_mm)
            })
            .collect()
    }
}

/// The point to which the distance from `place` only falls from point `from` on.
fn downhill(points: &[Point], place: Point, from: usize) -> usize {
    let distance_sq = |i: usize| points[i].distance_squared(place);
    let mut best = (distance_sq(from), from);
    while let Some(point) = points.get(best.1 + 1) {
        let next_sq = point.distance_squared(place);
        if next_sq > best.0 {
            break;
        }
        best = (next_sq, best.1 + 1);
    }
    while best.1 > 0 && distance_sq(best.1 - 1) < best.0 {
        best = (distance_sq(best.1 - 1), best.1 - 1);
    }
    best.1
}

/// Distance of a place from the way to or from its nearest point i.
fn distance_mm(points: &[Point], place: Point, i: usize) -> f64 {
    let at = points[i];
    let off = place - at;
    let sides = [points.get(i + 1), points.get(i.wrapping_sub(1))];
    for &to in sides.into_iter().flatten() {
        let way = to - at;
        let along = off.dot(way);
        if along > 0.0 {
            let t = (along / way.hypot2()).min(1.0);
            return (off - t * way).hypot2().sqrt();
        }
    }
    off.hypot2().sqrt()
}
