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
    /// Way of the beam up to each point, mm.
    way_mm: Vec<f64>,
    /// Arc position on the mark's curve that each point is nearest to, mm.
    at_mm: Vec<f64>,
}

impl BeamPath {
    /// Adds a place of the beam, unless it is nearer than `apart_mm` to the last one.
    pub fn add(&mut self, beam: Point, at_mm: f64, apart_mm: f64) {
        let step_mm = self.points.last().map(|last| last.distance(beam));
        if step_mm.is_some_and(|step_mm| step_mm < apart_mm) {
            return;
        }
        let way_mm = self.way_mm.last().copied().unwrap_or(0.0) + step_mm.unwrap_or(0.0);
        self.way_mm.push(way_mm);
        self.at_mm.push(at_mm);
        self.points.push(beam);
    }

    /// Distances in mm of points of `contour` every `step_mm` from the nearest lit beam.
    ///
    /// Between two places of the beam it is taken to go straight. Near the seam of a closed curve
    /// light from its other end counts as well.
    pub fn distances_mm(&self, contour: &Contour, step_mm: f64, n: usize) -> Vec<f64> {
        let last = self.points.len() - 1;
        let length_mm = contour.length_mm();
        let (mut near, mut passing, mut before_mm) = (0, 0, f64::INFINITY);
        contour
            .samples(step_mm, n)
            .enumerate()
            .map(|(k, (at_mm, place))| {
                while passing < last && self.at_mm[passing + 1] <= at_mm {
                    passing += 1;
                }
                near = self.nearest_downhill(place, near);
                let mut distance_mm = self.distance_mm(near, place);
                // Beside a sharp turn, downhill may have led back along the branch before it.
                let other = self.nearest_downhill(place, passing);
                if other != near && self.distance_mm(other, place) < distance_mm {
                    near = other;
                    distance_mm = self.distance_mm(near, place);
                }
                // A distance that grows quickly may be one to a branch that is being left.
                let grows = distance_mm > before_mm + 0.5 * step_mm;
                if grows || k % WIDE_EVERY == 0 {
                    near = self.nearest_around(place, near);
                    distance_mm = self.distance_mm(near, place);
                }
                distance_mm = distance_mm.min(self.distance_to_step_mm(passing, place));
                before_mm = distance_mm;
                let seam_mm = at_mm.min(length_mm - at_mm);
                if contour.is_closed() && seam_mm < REACH_MM + 4.0 * distance_mm {
                    let other_end = if at_mm < 0.5 * length_mm { last } else { 0 };
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
        let distance_sq = |i: usize| self.points[i].distance_squared(place);
        let mut best = (distance_sq(from), from);
        let reach_mm = REACH_MM + 4.0 * best.0.sqrt();
        let (lo_mm, hi_mm) = (self.way_mm[from] - reach_mm, self.way_mm[from] + reach_mm);
        let before = (0..from).rev().take_while(|&i| self.way_mm[i] >= lo_mm);
        let after = (from + 1..self.points.len()).take_while(|&i| self.way_mm[i] <= hi_mm);
        for i in before.chain(after) {
            let found_sq = distance_sq(i);
            if found_sq < best.0 {
                best = (found_sq, i);
            }
        }
        best.1
    }

    /// Distance of a place from the beam's way to or from its nearest point i.
    fn distance_mm(&self, i: usize, place: Point) -> f64 {
        let at = self.points[i];
        let goes_on = self.points.get(i + 1).is_some_and(|&next| (place - at).dot(next - at) > 0.0);
        match i {
            i if goes_on => self.distance_to_step_mm(i, place),
            0 => at.distance(place),
            i => self.distance_to_step_mm(i - 1, place),
        }
    }

    /// Distance of a place from the step that begins at point i.
    fn distance_to_step_mm(&self, i: usize, place: Point) -> f64 {
        let off = place - self.points[i];
        let Some(&to) = self.points.get(i + 1) else {
            return off.hypot2().sqrt();
        };
        let way = to - self.points[i];
        let t = (off.dot(way) / way.hypot2()).clamp(0.0, 1.0);
        (off - t * way).hypot2().sqrt()
    }
}
