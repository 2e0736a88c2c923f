//! How far a curve's points are from the light that was meant for them.

use crate::contour::Contour;
use kurbo::Point;

/// Arc length to either side that is searched beyond four times the distance, mm.
const REACH_MM: f64 = 0.03;
/// Every how many samples the search looks farther than downhill.
const WIDE_EVERY: usize = 8;

/// Where the beam was while a mark's light was on, thinned.
#[derive(Debug, Default)]
pub struct BeamPath {
    points: Vec<Point>,
    /// Arc position of each point on the mark's curve, mm.
    at_mm: Vec<f64>,
    /// Longest way from one point to the next, mm.
    step_max_mm: f64,
}

impl BeamPath {
    /// Adds a place of the beam, unless it is nearer than `apart_mm` to the last one.
    pub fn add(&mut self, beam: Point, at_mm: f64, apart_mm: f64) {
        if let Some(last) = self.points.last() {
            let step_mm = last.distance(beam);
            if step_mm < apart_mm {
                return;
            }
            self.step_max_mm = self.step_max_mm.max(step_mm);
        }
        self.points.push(beam);
        self.at_mm.push(at_mm);
    }

    /// Distances in mm of points of `contour` every `step_mm` from the nearest lit beam.
    ///
    /// Between two places of the beam it is taken to go straight. Near the ends of a closed curve
    /// that was not lit from end to end, light from the other end counts as well.
    pub fn distances_mm(&self, contour: &Contour, step_mm: f64, n: usize) -> Vec<f64> {
        let last = self.points.len() - 1;
        let lit_mm = (self.at_mm[0], self.at_mm[last]);
        let mut near = 0;
        contour
            .samples(step_mm, n)
            .enumerate()
            .map(|(k, (at_mm, place))| {
                near = match k % WIDE_EVERY {
                    0 => self.nearest_around(place, near),
                    _ => self.nearest_downhill(place, near),
                };
                let mut distance_mm = self.distance_mm(near, place);
                if contour.is_closed() && (at_mm < lit_mm.0 || at_mm > lit_mm.1) {
                    let other_end = if at_mm < lit_mm.0 { last } else { 0 };
                    let other = self.nearest_around(place, other_end);
                    distance_mm = distance_mm.min(self.distance_mm(other, place));
                }
                distance_mm
            })
            .collect()
    }

    /// The point to which the distance only falls from `from` on.
    fn nearest_downhill(&self, place: Point, from: usize) -> usize {
        let distance_sq = |i: usize| self.points[i].distance_squared(place);
        let mut best = (distance_sq(from), from);
        while let Some(point) = self.points.get(best.1 + 1) {
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

    /// The nearest of the points around `from`.
    fn nearest_around(&self, place: Point, from: usize) -> usize {
        let from = self.nearest_downhill(place, from);
        let reach_mm = REACH_MM + 4.0 * self.points[from].distance(place);
        let n_reach = (reach_mm / self.step_max_mm.max(1e-9)) as usize + 2;
        let first = from.saturating_sub(n_reach);
        let end = self.points.len().min(from.saturating_add(n_reach));
        let mut best = (self.points[from].distance_squared(place), from);
        for (i, point) in self.points[first..end].iter().enumerate() {
            let distance_sq = point.distance_squared(place);
            if distance_sq < best.0 {
                best = (distance_sq, first + i);
            }
        }
        best.1
    }

    /// Distance of a place from the beam's way to or from its nearest point i.
    fn distance_mm(&self, i: usize, place: Point) -> f64 {
        let at = self.points[i];
        let off = place - at;
        let sides = [self.points.get(i + 1), self.points.get(i.wrapping_sub(1))];
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
}
