//! Skywriting's legs: marks cut at their corners, so that none has to slow down.

use ftheta_model::toolpath::Mark;
use kurbo::{BezPath, ParamCurve, PathSeg, Point};

/// Places of the curve and of its flattened points nearer than this are the same, mm.
const SAME_PLACE_MM: f64 = 1e-6;

/// The legs of a mark in order: between them `is_corner` holds for the points before, at and after
/// a place where two elements of the curve meet.
///
/// # Limits
/// A flattened point within an element is never a corner, however sharp. Where the points do not
/// follow the curve any more, the rest stays whole.
pub(crate) fn legs(mark: Mark, is_corner: impl Fn(Point, Point, Point) -> bool) -> Vec<Mark> {
    let segments: Vec<PathSeg> = mark.curve.segments().collect();
    let points = &mark.points;
    let mut legs = Vec::new();
    let (mut first_segment, mut first_point, mut at) = (0, 0, 0);
    let mut push = |segments: &[PathSeg], points: &[Point]| {
        legs.push(Mark {
            curve: BezPath::from_path_segments(segments.iter().copied()),
            points: points.to_vec(),
            closed: false,
            pen_index: mark.pen_index,
            source: mark.source.clone(),
        });
    };
    for (index, segment) in segments.iter().enumerate() {
        let end = segment.end();
        let found = points[at + 1..].iter().position(|p| p.distance(end) <= SAME_PLACE_MM);
        let Some(n_before) = found else {
            break;
        };
        at += n_before + 1;
        let Some(&next) = points.get(at + 1) else {
            break;
        };
        if is_corner(points[at - 1], points[at], next) {
            push(&segments[first_segment..=index], &points[first_point..=at]);
            (first_segment, first_point) = (index + 1, at);
        }
    }
    if first_point == 0 {
        return vec![mark];
    }
    push(&segments[first_segment..], &points[first_point..]);
    legs
}

#[cfg(test)]
mod tests {
    use super::*;
    use ftheta_model::flatten::flatten;

    fn mark(path: &str) -> Mark {
        let curve = BezPath::from_svg(path).expect("a path");
        let mut points: Vec<Point> = Vec::new();
        flatten(&curve, 2e-3, |p| {
            if points.last() != Some(&p) {
                points.push(p);
            }
        });
        Mark { curve, points, closed: false, pen_index: 0, source: "#path".into() }
    }

    /// A corner turns by more than 30 degrees.
    fn sharp(from: Point, at: Point, to: Point) -> bool {
        let (a, b) = (at - from, to - at);
        a.dot(b) < 0.866 * a.hypot() * b.hypot()
    }

    #[test]
    fn legs_join_end_to_end_and_keep_the_whole_curve() {
        for (path, n_legs) in [
            ("M0 0 H1", 1),
            ("M0 0 H1 V1 H0 Z", 4),
            ("M0 0 H1 L2 0.1 L3 0.1 V1", 2),
            // An arc of two elements that meet smoothly, then a corner.
            ("M0 0 C0 1 1 2 2 2 S4 1 4 0 H0", 2),
        ] {
            let whole = mark(path);
            let legs = legs(whole.clone(), sharp);
            assert_eq!(legs.len(), n_legs, "{path}");
            assert_eq!((legs[0].start(), legs[n_legs - 1].end()), (whole.start(), whole.end()));
            assert!(legs.windows(2).all(|pair| pair[0].end() == pair[1].start()));
            let n_segments: usize = legs.iter().map(|leg| leg.curve.segments().count()).sum();
            assert_eq!(n_segments, whole.curve.segments().count());
            let length_mm: f64 = legs.iter().map(Mark::length_mm).sum();
            assert!((length_mm - whole.length_mm()).abs() < 1e-12);
        }
    }

    #[test]
    fn points_that_do_not_follow_the_curve_stay_whole() {
        let mut astray = mark("M0 0 H1 V1 H0");
        astray.points[1].x += 0.1;
        assert_eq!(legs(astray, sharp).len(), 1);
    }
}
