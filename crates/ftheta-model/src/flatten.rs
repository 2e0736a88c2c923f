//! Curves as points within a guaranteed distance.

use kurbo::{BezPath, ParamCurve, PathSeg, Point};

/// Visits points of `curve` such that the lines between them stay within `tolerance_mm` of it.
///
/// Every end of an element is visited exactly, so the place where two elements meet comes twice.
///
/// # Accuracy
/// Guaranteed, other than `kurbo::flatten`, whose estimate is exceeded by half near cusps: steps of
/// equal parameter h, of which each is off by at most h²/8 times the greatest second derivative.
pub fn flatten(curve: &BezPath, tolerance_mm: f64, mut visit: impl FnMut(Point)) {
    for segment in curve.segments() {
        visit(segment.start());
        // A cubic's second derivative is linear, so that it is greatest at one of its ends.
        let bend_mm = match segment {
            PathSeg::Line(_) => 0.0,
            PathSeg::Quad(q) => 2.0 * bend(q.p0, q.p1, q.p2),
            PathSeg::Cubic(c) => 6.0 * bend(c.p0, c.p1, c.p2).max(bend(c.p1, c.p2, c.p3)),
        };
        let n_steps = (bend_mm / (8.0 * tolerance_mm)).sqrt().ceil().max(1.0) as usize;
        for step in 1..n_steps {
            visit(segment.eval(step as f64 / n_steps as f64));
        }
        visit(segment.end());
    }
}

/// Length of a second difference.
fn bend(a: Point, b: Point, c: Point) -> f64 {
    (a.to_vec2() - 2.0 * b.to_vec2() + c.to_vec2()).hypot()
}
