//! A beam that goes along a curve: how far it is off, and how far it has come.

use kurbo::{BezPath, PathEl, Point};

/// Curves are flattened to this part of the tolerance.
const FLATTEN_SHARE: f64 = 0.02;
/// How far from the expected arc length a nearest point is looked for, in tolerances.
const AHEAD: f64 = 3.0;
/// What being away from the expected arc length counts, against being off the curve.
const AWAY: f64 = 0.005;

/// Follows a beam along a curve that may come back to where it has been.
#[derive(Clone, Debug, Default)]
pub struct Along {
    points: Vec<Point>,
    /// Arc length at each point, mm.
    lengths_mm: Vec<f64>,
    reach_mm: f64,
    leg: usize,
    at_mm: f64,
    /// Arc length where the beam should be by the way it has made, mm, and its last place.
    expected_mm: f64,
    last: Option<Point>,
}

impl Along {
    /// Before the beam's first place.
    ///
    /// * `tolerance_mm`: about how far the beam may be off
    ///
    /// # Accuracy
    /// The curve within 2 % of the tolerance.
    pub fn new(curve: &BezPath, tolerance_mm: f64) -> Self {
        let mut points: Vec<Point> = Vec::new();
        kurbo::flatten(curve, FLATTEN_SHARE * tolerance_mm, |element| match element {
            PathEl::MoveTo(point) | PathEl::LineTo(point) => points.push(point),
            PathEl::ClosePath => points.extend(points.first().copied()),
            PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
        });
        let mut length_mm = 0.0;
        let mut before = points.first().copied().unwrap_or_default();
        let lengths_mm = points
            .iter()
            .map(|&point| {
                length_mm += before.distance(point);
                before = point;
                length_mm
            })
            .collect();
        Self { points, lengths_mm, reach_mm: AHEAD * tolerance_mm, ..Self::default() }
    }

    /// Length of the curve, mm.
    pub fn length_mm(&self) -> f64 {
        self.lengths_mm.last().copied().unwrap_or(0.0)
    }

    /// Arc length that the beam has come to, mm.
    pub fn at_mm(&self) -> f64 {
        self.at_mm
    }

    /// Takes the beam's next place; returns its distance from the curve, mm.
    ///
    /// Where the curve comes back to a place, the beam is where its way so far says.
    pub fn distance_mm(&mut self, place: Point) -> f64 {
        self.expected_mm += self.last.map_or(0.0, |last| last.distance(place));
        self.last = Some(place);
        let mut nearest = (f64::INFINITY, f64::INFINITY, self.leg, self.at_mm);
        for index in self.leg..self.points.len().saturating_sub(1) {
            if index > self.leg && self.lengths_mm[index] > self.expected_mm + self.reach_mm {
                break;
            }
            let (from, to) = (self.points[index], self.points[index + 1]);
            let square = (to - from).hypot2();
            let share = match square > 0.0 {
                true => ((place - from).dot(to - from) / square).clamp(0.0, 1.0),
                false => 0.0,
            };
            let off_mm = from.lerp(to, share).distance(place);
            let at_mm = self.lengths_mm[index] + share * square.sqrt();
            let far = (at_mm - self.expected_mm).abs() > self.reach_mm;
            if far && nearest.1 < f64::INFINITY {
                continue;
            }
            let cost = off_mm.hypot(AWAY * (at_mm - self.expected_mm));
            if cost < nearest.0 {
                nearest = (cost, off_mm, index, at_mm);
            }
        }
        let (_, off_mm, leg, at_mm) = nearest;
        self.leg = leg;
        if at_mm > self.at_mm {
            (self.at_mm, self.expected_mm) = (at_mm, at_mm);
        }
        off_mm
    }
}
