//! Marks that go on where the one before ends, as one.

use super::path::angle;
use ftheta_model::toolpath::Mark;
use kurbo::{BezPath, ParamCurve, ParamCurveDeriv, PathEl, PathSeg, Vec2};

/// Ends that are nearer than this touch, mm.
const TOUCH_MM: f64 = 1e-3;
/// The same, as a part of the tolerance: the second mark's start is moved so far.
const TOUCH_SHARE: f64 = 0.1;
/// Greatest turn from one mark to the next, rad.
const TURN_MAX_RAD: f64 = std::f64::consts::PI / 180.0;
/// A segment shorter than this has no direction, mm.
const LENGTH_MIN_MM: f64 = 1e-6;

/// Marks of one pen that touch end to start, in one direction, are made one, so that the beam flows
/// on; the others stay what they are.
///
/// * `tolerance_mm`: of the plan
pub(super) fn joined(marks: impl IntoIterator<Item = Mark>, tolerance_mm: f64) -> Vec<Mark> {
    let touch_mm = TOUCH_MM.min(TOUCH_SHARE * tolerance_mm);
    let mut all: Vec<Mark> = Vec::new();
    for mut mark in marks {
        match all.last_mut() {
            Some(last) if goes_on(last, &mut mark, touch_mm) => append(last, mark),
            _ => all.push(mark),
        }
    }
    all
}

/// Whether a mark goes on where another one ends; then it begins exactly there.
fn goes_on(before: &Mark, mark: &mut Mark, touch_mm: f64) -> bool {
    let (Some(end), Some(start)) = (before.points.last(), mark.points.first()) else {
        return false;
    };
    if before.pen_index != mark.pen_index || start.distance(*end) > touch_mm {
        return false;
    }
    let Some(last) = last_segment(&before.curve) else { return false };
    let mut elements = mark.curve.elements().to_vec();
    match elements.first_mut() {
        Some(PathEl::MoveTo(start)) => *start = last.end(),
        _ => return false,
    }
    let moved = BezPath::from_vec(elements);
    let Some(first) = moved.segments().next() else { return false };
    let (Some(arriving), Some(leaving)) = (direction(&last, 1.0), direction(&first, 0.0)) else {
        return false;
    };
    // A curve that closes itself would close elsewhere.
    let closes = moved.elements().contains(&PathEl::ClosePath);
    let fits = angle(arriving, leaving).abs() <= TURN_MAX_RAD
        && (!closes || start.distance(last.end()) < LENGTH_MIN_MM);
    if fits {
        mark.points[0] = last.end();
        mark.curve = moved;
    }
    fits
}

/// The last segment of a curve, the one that closes it included.
fn last_segment(curve: &BezPath) -> Option<PathSeg> {
    let n_elements = curve.elements().len();
    match curve.elements().last()? {
        PathEl::ClosePath => curve.segments().last(),
        _ => curve.get_seg(n_elements - 1),
    }
}

/// Appends a mark to another one that ends where it begins.
fn append(before: &mut Mark, mark: Mark) {
    let elements = before.curve.elements_mut();
    if elements.last() == Some(&PathEl::ClosePath) {
        // Closed by a line of its own, so that the path may go on.
        let segments: Vec<PathSeg> = before.curve.segments().collect();
        before.curve = BezPath::from_path_segments(segments.into_iter());
    }
    let next: Vec<PathSeg> = mark.curve.segments().collect();
    for segment in next {
        before.curve.push(segment.as_path_el());
    }
    before.points.extend(mark.points.into_iter().skip(1));
    before.closed = false;
    if !before.source.ends_with(GOES_ON) && before.source != mark.source {
        before.source.push_str(GOES_ON);
    }
}

/// What the source of a mark has that is made of several.
const GOES_ON: &str = " and what goes on from it";

/// Direction at an end of a segment.
fn direction(segment: &PathSeg, at: f64) -> Option<Vec2> {
    let cubic = segment.to_cubic();
    let derivative = cubic.deriv();
    let own = derivative.eval(at).to_vec2();
    let near = || derivative.eval(at + (0.5 - at) * 2e-3).to_vec2();
    let found = if own.hypot() > LENGTH_MIN_MM { own } else { near() };
    (found.hypot() > LENGTH_MIN_MM).then_some(found)
}
