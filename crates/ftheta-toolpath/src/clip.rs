//! Curves cut at the edge of the square field.

use crate::subpath::Subpath;
use kurbo::common::{solve_cubic, solve_quadratic};
use kurbo::{BezPath, Line, ParamCurve, PathSeg, Point, Rect, Shape};

/// Width of the edge that counts as inside, mm; covers rounding.
const EDGE_MM: f64 = 1e-9;

/// The parts of a curve inside the square `|x|, |y| <= half_mm`, in its direction.
///
/// Cut exactly, by parameter, so that what is left lies on the curve. A closed curve that is cut
/// becomes open ones.
pub fn cut_curve(subpath: Subpath, half_mm: f64) -> Vec<Subpath> {
    if holds(subpath.curve.control_box(), half_mm) {
        return vec![subpath];
    }
    let mut parts: Vec<Vec<PathSeg>> = Vec::new();
    let mut going_on = false;
    let mut starts_inside = false;
    let mut whole = true;
    for (i, segment) in subpath.curve.segments().enumerate() {
        for (t0, t1) in spans(&segment, half_mm) {
            let inside = is_inside(segment.eval(0.5 * (t0 + t1)), half_mm);
            starts_inside |= inside && i == 0 && t0 == 0.0;
            whole &= inside;
            if inside {
                if !going_on {
                    parts.push(Vec::new());
                }
                let part =
                    if (t0, t1) == (0.0, 1.0) { segment } else { segment.subsegment(t0..t1) };
                if let Some(last) = parts.last_mut() {
                    last.push(part);
                }
            }
            going_on = inside;
        }
    }
    if whole {
        return vec![subpath];
    }
    // A closed curve that starts inside was cut in two at its start for no reason.
    if subpath.closed && starts_inside && going_on && parts.len() > 1 {
        let first = parts.remove(0);
        if let Some(last) = parts.last_mut() {
            last.extend(first);
        }
    }
    parts.into_iter().map(|part| Subpath { curve: joined(&part), closed: false }).collect()
}

/// One curve of segments that follow each other, up to rounding at the cuts.
fn joined(part: &[PathSeg]) -> BezPath {
    let mut curve = BezPath::new();
    curve.move_to(part[0].start());
    for segment in part {
        curve.push(segment.as_path_el());
    }
    curve
}

/// The part of a line inside the square, if any has length.
///
/// Source: Liang and Barsky 1984 (parametric clipping).
pub fn cut_line(line: Line, half_mm: f64) -> Option<Line> {
    let (mut t0, mut t1) = (0.0f64, 1.0f64);
    let way = line.p1 - line.p0;
    for (from, step) in [(line.p0.x, way.x), (line.p0.y, way.y)] {
        if step == 0.0 {
            if from.abs() > half_mm {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half_mm - from) / step, (half_mm - from) / step);
        t0 = t0.max(a.min(b));
        t1 = t1.min(a.max(b));
    }
    let end = |t: f64, p: Point| {
        if t == 0.0 || t == 1.0 { p } else { line.eval(t) }
    };
    (t0 < t1).then(|| Line::new(end(t0, line.p0), end(t1, line.p1)))
}

/// The first of the points that lies outside the square.
pub fn first_outside(points: &[Point], half_mm: f64) -> Option<Point> {
    // A nanometre of slack: a drawing made to fit the field exactly does fit.
    let limit_mm = half_mm + 1e-6;
    points.iter().copied().find(|p| p.x.abs() > limit_mm || p.y.abs() > limit_mm)
}

fn holds(area: Rect, half_mm: f64) -> bool {
    area.x0 >= -half_mm && area.x1 <= half_mm && area.y0 >= -half_mm && area.y1 <= half_mm
}

fn is_inside(p: Point, half_mm: f64) -> bool {
    p.x.abs() <= half_mm + EDGE_MM && p.y.abs() <= half_mm + EDGE_MM
}

/// Neighbouring parameters between which the segment does not cross the edge.
fn spans(segment: &PathSeg, half_mm: f64) -> Vec<(f64, f64)> {
    let mut cuts = vec![0.0, 1.0];
    if !holds(segment.bounding_box(), half_mm) {
        let places = control_points(segment);
        for axis in 0..2 {
            let c = polynomial(&places, axis);
            for edge_mm in [-half_mm, half_mm] {
                cuts.extend(roots([c[0] - edge_mm, c[1], c[2], c[3]]));
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|b, a| *b - *a < 1e-9);
    if let Some(last) = cuts.last_mut() {
        *last = 1.0;
    }
    cuts.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

fn control_points(segment: &PathSeg) -> Vec<Point> {
    match *segment {
        PathSeg::Line(l) => vec![l.p0, l.p1],
        PathSeg::Quad(q) => vec![q.p0, q.p1, q.p2],
        PathSeg::Cubic(c) => vec![c.p0, c.p1, c.p2, c.p3],
    }
}

/// Coefficients of one coordinate by powers of the parameter.
fn polynomial(places: &[Point], axis: usize) -> [f64; 4] {
    let p: Vec<f64> = places.iter().map(|p| if axis == 0 { p.x } else { p.y }).collect();
    match p[..] {
        [a, b] => [a, b - a, 0.0, 0.0],
        [a, b, c] => [a, 2.0 * (b - a), a - 2.0 * b + c, 0.0],
        [a, b, c, d] => [a, 3.0 * (b - a), 3.0 * (a - 2.0 * b + c), d - 3.0 * c + 3.0 * b - a],
        _ => [0.0; 4],
    }
}

fn roots(c: [f64; 4]) -> Vec<f64> {
    let size = c.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    // A nearly vanished leading term only costs the solver digits.
    let solved: Vec<f64> = if c[3].abs() > 1e-9 * size {
        solve_cubic(c[0], c[1], c[2], c[3]).to_vec()
    } else if c[2].abs() > 1e-12 * size {
        solve_quadratic(c[0], c[1], c[2]).to_vec()
    } else {
        vec![-c[0] / c[1]]
    };
    solved.into_iter().map(|t| polished(c, t)).filter(|t| *t > 0.0 && *t < 1.0).collect()
}

/// Two steps of Newton, as far as they are steps.
fn polished(c: [f64; 4], mut t: f64) -> f64 {
    for _ in 0..2 {
        let value = c[0] + t * (c[1] + t * (c[2] + t * c[3]));
        let slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
        let step = value / slope;
        if step.is_finite() && step.abs() < 1e-3 {
            t -= step;
        }
    }
    t
}
