//! A path taken apart into single curves, and curves flattened.

use ftheta_model::flatten::flatten;
use kurbo::{BezPath, PathEl, Point};

/// Points nearer than this are one point, mm: a nanometre is nothing to a laser.
pub const SAME_PLACE_MM: f64 = 1e-6;

/// One connected curve, with an explicit last line where it is closed.
#[derive(Clone, Debug)]
pub struct Subpath {
    /// A single `MoveTo` and what follows; no `ClosePath`.
    pub curve: BezPath,
    /// Whether the last point is the first, exactly.
    pub closed: bool,
}

/// The subpaths of a path and how many of them had no length.
///
/// Open ones that go on where the one before ended are joined. With `fill` every one is closed.
pub fn subpaths(path: &BezPath, fill: bool) -> (Vec<Subpath>, usize) {
    let mut found = Vec::new();
    let mut n_empty = 0;
    let mut open = Builder::default();
    for &el in path.elements() {
        match el {
            PathEl::MoveTo(p) => {
                let joins = !fill && open.els.len() > 1 && open.at.distance(p) < SAME_PLACE_MM;
                if !joins || open.returns() {
                    n_empty += open.finish(fill, &mut found);
                    open = Builder::at(p);
                }
            }
            PathEl::ClosePath => {
                let start = open.start;
                open.drawn = true;
                n_empty += open.finish(true, &mut found);
                open = Builder::at(start);
            }
            PathEl::LineTo(p) => open.push(el, &[p]),
            PathEl::QuadTo(a, p) => open.push(el, &[a, p]),
            PathEl::CurveTo(a, b, p) => open.push(el, &[a, b, p]),
        }
    }
    n_empty += open.finish(fill, &mut found);
    (found, n_empty)
}

/// A curve as points within `tolerance_mm` of it, neighbours apart; fewer than two if it is nowhere
/// longer than a nanometre. Every end of an element of the curve is among the points.
pub fn flattened(curve: &BezPath, tolerance_mm: f64) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::with_capacity(curve.elements().len());
    let mut add = |p: Point| match points.last() {
        Some(last) if last.distance(p) < SAME_PLACE_MM => {}
        _ => points.push(p),
    };
    flatten(curve, tolerance_mm, &mut add);
    // The end must stay exact: a last point that was too near takes its neighbour's place.
    if let Some(end) = curve.elements().last().and_then(PathEl::end_point)
        && points.len() > 1
    {
        let at = points.len() - 1;
        points[at] = end;
    }
    points
}

#[derive(Default)]
struct Builder {
    els: Vec<PathEl>,
    start: Point,
    at: Point,
    /// Whether anything was asked for, even without length.
    drawn: bool,
}

impl Builder {
    fn at(start: Point) -> Self {
        Self { els: vec![PathEl::MoveTo(start)], start, at: start, drawn: false }
    }

    fn push(&mut self, el: PathEl, places: &[Point]) {
        self.drawn = true;
        if places.iter().any(|p| *p != self.at) {
            self.els.push(el);
            self.at = places[places.len() - 1];
        }
    }

    fn returns(&self) -> bool {
        self.els.len() > 1 && self.at.distance(self.start) < SAME_PLACE_MM
    }

    /// Adds the curve to `found`; returns 1 if there was one without length.
    fn finish(self, close: bool, found: &mut Vec<Subpath>) -> usize {
        let has_length =
            self.els.iter().flat_map(places).any(|p| p.distance(self.start) >= SAME_PLACE_MM);
        if !has_length {
            return usize::from(self.drawn);
        }
        let closed = close || self.returns();
        let returns = self.returns();
        let mut els = self.els;
        if closed && returns {
            let last = els.len() - 1;
            els[last] = ending_at(els[last], self.start);
        } else if closed {
            els.push(PathEl::LineTo(self.start));
        }
        found.push(Subpath { curve: BezPath::from_vec(els), closed });
        0
    }
}

fn places(el: &PathEl) -> impl Iterator<Item = Point> {
    let places = match *el {
        PathEl::MoveTo(p) | PathEl::LineTo(p) => [Some(p), None, None],
        PathEl::QuadTo(a, p) => [Some(a), Some(p), None],
        PathEl::CurveTo(a, b, p) => [Some(a), Some(b), Some(p)],
        PathEl::ClosePath => [None; 3],
    };
    places.into_iter().flatten()
}

fn ending_at(el: PathEl, end: Point) -> PathEl {
    match el {
        PathEl::QuadTo(a, _) => PathEl::QuadTo(a, end),
        PathEl::CurveTo(a, b, _) => PathEl::CurveTo(a, b, end),
        PathEl::MoveTo(_) | PathEl::LineTo(_) | PathEl::ClosePath => PathEl::LineTo(end),
    }
}
