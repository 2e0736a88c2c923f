//! A mark's exact curve as a very fine polyline that finds the nearest of its points.

use ftheta_model::flatten::flatten;
use kurbo::{BezPath, Point, Rect, Vec2};

/// Greatest distance of the polyline from the curve, mm.
const FLATTEN_MM: f64 = 2e-5;
/// Segments in one leaf of the tree.
const LEAF: usize = 8;
/// Least arc length to either side of the expected place that is searched, mm.
const REACH_MM: f64 = 0.75;
/// Distance from which on the whole curve is searched, mm.
const NEAR_MM: f64 = 0.004;
/// Weight of the squared arc distance from the expected place against the squared distance. Only
/// decides between branches that lie on each other.
const TIE_WEIGHT: f64 = 1e-9;

/// A polyline with arc lengths and a tree of bounding boxes.
pub struct Contour {
    points: Vec<Point>,
    /// Arc length up to each point, mm.
    arc_mm: Vec<f64>,
    /// Whether it ends where it starts; then arc positions go round.
    closed: bool,
    /// Bounding boxes of ranges of segments. Children of i: 2i+1, 2i+2.
    boxes: Vec<Rect>,
}

/// A point of the curve.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Arc position, mm; on a closed curve below 0 or above the length where the beam went round.
    pub at_mm: f64,
    /// Distance of the beam from it, mm.
    pub distance_mm: f64,
    /// The polyline's segment it lies on.
    segment: usize,
}

/// A search under way, and the best point found.
struct Query {
    beam: Point,
    expected_mm: f64,
    /// Whole turns around a closed curve, mm.
    shift_mm: f64,
    /// Arc positions that are searched, before the shift, mm.
    window_mm: (f64, f64),
    /// Weight of the squared arc distance from the expected place.
    tie_weight: f64,
    cost: f64,
    foot: Foot,
}

impl Query {
    fn new(beam: Point, expected_mm: f64, tie_weight: f64) -> Self {
        Self {
            beam,
            expected_mm,
            shift_mm: 0.0,
            window_mm: (0.0, 0.0),
            tie_weight,
            cost: f64::INFINITY,
            foot: Foot { at_mm: expected_mm, distance_mm: f64::INFINITY, segment: 0 },
        }
    }
}

impl Contour {
    /// A curve of one subpath, within 0.02 µm of the exact one.
    pub fn new(curve: &BezPath) -> Self {
        let mut contour = Self::through(flattened(curve));
        let points = &contour.points;
        contour.closed = points.len() > 2 && points[0].distance(points[points.len() - 1]) < 1e-6;
        contour
    }

    /// An open polyline through two points or more, neighbours apart.
    pub fn through(points: Vec<Point>) -> Self {
        let mut arc_mm = Vec::with_capacity(points.len());
        let mut at_mm = 0.0;
        arc_mm.push(0.0);
        for pair in points.windows(2) {
            at_mm += pair[0].distance(pair[1]);
            arc_mm.push(at_mm);
        }
        let n_leaves = points.len().div_ceil(LEAF).next_power_of_two();
        let boxes = vec![Rect::ZERO; 4 * n_leaves];
        let mut contour = Self { points, arc_mm, closed: false, boxes };
        contour.fill_boxes();
        contour
    }

    /// The points of the polyline.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The segment nearest to `place`, and its distance, mm; looked for around `likely` first.
    pub fn nearest_segment(&self, place: Point, likely: usize) -> (usize, f64) {
        let mut query = Query::new(place, self.arc_mm[likely], 0.0);
        self.search(&mut query, f64::INFINITY, likely.min(self.points.len() - 2));
        (query.foot.segment, query.foot.distance_mm)
    }

    /// Length of the whole, mm.
    pub fn length_mm(&self) -> f64 {
        self.arc_mm[self.arc_mm.len() - 1]
    }

    /// Whether it ends where it starts.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Places every `step_mm` from 0 on, in order.
    pub fn samples(&self, step_mm: f64, n: usize) -> impl Iterator<Item = (f64, Point)> {
        let mut i = 0;
        (0..n).map(move |k| {
            let at_mm = (k as f64 * step_mm).min(self.length_mm());
            while i + 2 < self.points.len() && self.arc_mm[i + 1] < at_mm {
                i += 1;
            }
            (at_mm, self.place(i, at_mm))
        })
    }

    /// How far `beam` is outside the start: positive before it, negative past it, along the curve.
    pub fn before_start_mm(&self, beam: Point, foot: Foot) -> f64 {
        let along_mm = self.tangent(0).dot(self.points[0] - beam);
        if foot.at_mm <= 0.0 && !self.closed { along_mm.max(0.0) } else { -foot.at_mm }
    }

    /// How far `beam` is past the end: positive beyond it, negative short of it, along the curve.
    pub fn past_end_mm(&self, beam: Point, foot: Foot) -> f64 {
        let last = self.points.len() - 1;
        let along_mm = self.tangent(last - 1).dot(beam - self.points[last]);
        if foot.at_mm >= self.length_mm() && !self.closed {
            along_mm.max(0.0)
        } else {
            foot.at_mm - self.length_mm()
        }
    }

    /// The point nearest to `beam` within 0.75 mm of arc, and four times `off_mm`, from the start.
    pub fn nearest_to_start(&self, beam: Point, off_mm: f64) -> Foot {
        let start = Foot { at_mm: 0.0, distance_mm: off_mm, segment: 0 };
        self.nearest_within(beam, start, 0.0, REACH_MM + 4.0 * off_mm)
    }

    /// The point nearest to `beam` around the end, unless `foot` is much nearer elsewhere.
    pub fn nearest_to_end(&self, beam: Point, foot: Foot) -> Foot {
        let ahead_mm = self.length_mm() - foot.at_mm;
        let reach_mm = REACH_MM + 4.0 * foot.distance_mm;
        let found = self.nearest_within(beam, foot, ahead_mm, reach_mm);
        if found.distance_mm <= 2.0 * foot.distance_mm { found } else { foot }
    }

    /// The point nearest to `beam`, which went on by `ahead_mm` from where `before` was nearest.
    ///
    /// # Limits
    /// While the beam is within 4 µm, only 0.75 mm of arc to either side are searched, so that it
    /// stays on its branch where the curve comes near itself. Beyond that the whole curve is.
    pub fn nearest(&self, beam: Point, before: Foot, ahead_mm: f64) -> Foot {
        let near = self.nearest_within(beam, before, ahead_mm, REACH_MM);
        if near.distance_mm < NEAR_MM {
            return near;
        }
        let any = self.nearest_within(beam, before, ahead_mm, f64::INFINITY);
        if any.distance_mm < near.distance_mm { any } else { near }
    }

    fn nearest_within(&self, beam: Point, before: Foot, ahead_mm: f64, reach_mm: f64) -> Foot {
        let length_mm = self.length_mm();
        let expected_mm = before.at_mm + ahead_mm;
        let mut query = Query::new(beam, expected_mm, TIE_WEIGHT);
        query.foot = before;
        if !self.closed {
            self.search(&mut query, reach_mm, before.segment);
            return query.foot;
        }
        let reach_mm = reach_mm.min(0.5 * length_mm);
        let turn = (expected_mm / length_mm).floor();
        for shift in [turn, turn - 1.0, turn + 1.0] {
            query.shift_mm = shift * length_mm;
            let at_mm = expected_mm - query.shift_mm;
            if at_mm + reach_mm >= 0.0 && at_mm - reach_mm <= length_mm {
                self.search(&mut query, reach_mm, before.segment);
            }
        }
        query.foot
    }

    /// Searches the segments within `reach_mm` of arc from the expected place, near `likely` first.
    fn search(&self, query: &mut Query, reach_mm: f64, likely: usize) {
        let n = self.points.len() - 1;
        let at_mm = query.expected_mm - query.shift_mm;
        let (from_mm, to_mm) = (at_mm - reach_mm, at_mm + reach_mm);
        query.window_mm = (from_mm, to_mm);
        let outside = |lo: usize, hi: usize| self.arc_mm[hi] < from_mm || to_mm < self.arc_mm[lo];
        if n <= 3 {
            (0..n).filter(|&i| !outside(i, i + 1)).for_each(|i| self.look_at(i, query));
            return;
        }
        let mut i = likely;
        while i + 1 < n && self.arc_mm[i + 1] < at_mm {
            i += 1;
        }
        while i > 0 && at_mm < self.arc_mm[i] {
            i -= 1;
        }
        for near in i.saturating_sub(1)..(i + 2).min(n) {
            if !outside(near, near + 1) {
                self.look_at(near, query);
            }
        }
        let mut stack = [(0usize, 0usize, 0usize); 64];
        stack[0] = (0, 0, n);
        let mut n_waiting = 1;
        while n_waiting > 0 {
            n_waiting -= 1;
            let (node, lo, hi) = stack[n_waiting];
            if outside(lo, hi) || distance_sq(self.boxes[node], query.beam) >= query.cost {
                continue;
            }
            if hi - lo <= LEAF {
                (lo..hi).filter(|&i| !outside(i, i + 1)).for_each(|i| self.look_at(i, query));
                continue;
            }
            let middle = lo + (hi - lo) / 2;
            stack[n_waiting] = (2 * node + 1, lo, middle);
            stack[n_waiting + 1] = (2 * node + 2, middle, hi);
            n_waiting += 2;
        }
    }

    fn look_at(&self, i: usize, query: &mut Query) {
        let from = self.points[i];
        let way = self.points[i + 1] - from;
        let length_mm = self.arc_mm[i + 1] - self.arc_mm[i];
        // A long segment may reach out of the window, to where the curve crosses itself.
        let lo = ((query.window_mm.0 - self.arc_mm[i]) / length_mm).max(0.0);
        let hi = ((query.window_mm.1 - self.arc_mm[i]) / length_mm).min(1.0);
        let t = (query.beam - from).dot(way) / (length_mm * length_mm);
        let t = t.max(lo).min(hi);
        let distance_sq = (from + t * way).distance_squared(query.beam);
        if distance_sq > query.cost {
            return;
        }
        let at_mm = self.arc_mm[i] + t * length_mm + query.shift_mm;
        let ahead_mm = at_mm - query.expected_mm;
        let cost = distance_sq + query.tie_weight * ahead_mm * ahead_mm;
        if cost < query.cost {
            query.cost = cost;
            query.foot = Foot { at_mm, distance_mm: distance_sq.sqrt(), segment: i };
        }
    }

    fn place(&self, i: usize, at_mm: f64) -> Point {
        let length_mm = self.arc_mm[i + 1] - self.arc_mm[i];
        let t = (at_mm - self.arc_mm[i]) / length_mm;
        self.points[i].lerp(self.points[i + 1], t)
    }

    fn tangent(&self, i: usize) -> Vec2 {
        (self.points[i + 1] - self.points[i]).normalize()
    }

    fn fill_boxes(&mut self) {
        let mut todo = vec![(0, 0, self.points.len() - 1)];
        while let Some((node, lo, hi)) = todo.pop() {
            let first = Rect::from_points(self.points[lo], self.points[lo]);
            let points = &self.points[lo..=hi];
            self.boxes[node] = points.iter().fold(first, |area, &p| area.union_pt(p));
            if hi - lo > LEAF {
                let middle = lo + (hi - lo) / 2;
                todo.push((2 * node + 1, lo, middle));
                todo.push((2 * node + 2, middle, hi));
            }
        }
    }
}

/// Two points or more; neighbours are apart, unless the whole curve has no length.
fn flattened(curve: &BezPath) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    let mut add = |p: Point| match points.last() {
        Some(last) if last.distance(p) < 1e-9 => {}
        _ => points.push(p),
    };
    flatten(curve, FLATTEN_MM, &mut add);
    // A curve that is a single place still has a direction.
    let at = points.last().copied().unwrap_or_default();
    while points.len() < 2 {
        points.push(at + Vec2::new(1e-9 * points.len() as f64, 0.0));
    }
    points
}

fn distance_sq(area: Rect, p: Point) -> f64 {
    let x = (area.x0 - p.x).max(p.x - area.x1).max(0.0);
    let y = (area.y0 - p.y).max(p.y - area.y1).max(0.0);
    x * x + y * y
}
