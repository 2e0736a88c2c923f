//! Line segments of a plane, found by place.

use kurbo::{Point, Rect, Vec2};

/// Segments in one leaf of the tree.
const LEAF: usize = 8;

/// Segments sorted by place, with bounding boxes.
pub struct SegmentTree {
    /// In the order of the leaves.
    lines: Vec<Line>,
    /// Bounding boxes of ranges of lines. Children of i: 2i+1, 2i+2.
    boxes: Vec<Rect>,
}

/// A segment, and which it is.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    from: Point,
    way: Vec2,
    index: usize,
}

/// The point of a segment that is nearest to a place.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// The segment's index.
    pub index: usize,
    /// Where on it the point is, 0 to 1.
    pub share: f64,
    /// Square of the distance, mm².
    pub distance_sq: f64,
}

impl SegmentTree {
    /// One segment or more, by their ends, sorted by place: for those that lie on each other.
    pub fn by_place(segments: impl Iterator<Item = [Point; 2]>) -> Self {
        Self::new(segments, |lines, half| {
            let area = lines.iter().map(Line::area).reduce(|a, b| a.union(b)).unwrap_or_default();
            let wide = area.width() > area.height();
            let middle = |line: &Line| {
                let at = line.from + 0.5 * line.way;
                if wide { at.x } else { at.y }
            };
            lines.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        })
    }

    /// One segment or more, by their ends, in the order that they have: quick to make.
    pub fn in_order(segments: impl Iterator<Item = [Point; 2]>) -> Self {
        Self::new(segments, |_, _| {})
    }

    /// * `part`: puts those of the first half before the others
    fn new(
        segments: impl Iterator<Item = [Point; 2]>,
        part: impl Copy + Fn(&mut [Line], usize),
    ) -> Self {
        let line = |(index, [from, to]): (usize, [Point; 2])| Line { from, way: to - from, index };
        let mut lines: Vec<Line> = segments.enumerate().map(line).collect();
        let n_leaves = lines.len().div_ceil(LEAF).next_power_of_two();
        let mut boxes = vec![Rect::ZERO; 4 * n_leaves];
        fill(&mut boxes, 0, &mut lines, part);
        Self { lines, boxes }
    }

    /// Looks at segments nearer than a reach, which `look` may shorten.
    ///
    /// * `reach_sq`: square of the reach, mm²
    /// * `look`: returns the square of the reach from then on
    pub fn search(
        &self,
        place: Point,
        mut reach_sq: f64,
        mut look: impl FnMut(&Line, Near) -> f64,
    ) {
        let mut stack = [(0usize, 0usize, 0usize, 0.0); 64];
        stack[0] = (0, 0, self.lines.len(), 0.0);
        let mut n_waiting = 1;
        while n_waiting > 0 {
            n_waiting -= 1;
            let (node, lo, hi, off_sq) = stack[n_waiting];
            if off_sq > reach_sq {
                continue;
            }
            if hi - lo <= LEAF {
                for line in &self.lines[lo..hi] {
                    let near = line.near(place);
                    if near.distance_sq <= reach_sq {
                        reach_sq = look(line, near);
                    }
                }
                continue;
            }
            let middle = lo + (hi - lo) / 2;
            let (left, right) = (2 * node + 1, 2 * node + 2);
            let left = (left, lo, middle, distance_sq(self.boxes[left], place));
            let right = (right, middle, hi, distance_sq(self.boxes[right], place));
            // The nearer one is looked at first.
            let (far, near) = if left.3 > right.3 { (left, right) } else { (right, left) };
            for child in [far, near] {
                if child.3 <= reach_sq {
                    stack[n_waiting] = child;
                    n_waiting += 1;
                }
            }
        }
    }
}

/// Fills in the box of a node and those below it; returns it.
fn fill(
    boxes: &mut [Rect],
    node: usize,
    lines: &mut [Line],
    part: impl Copy + Fn(&mut [Line], usize),
) -> Rect {
    let area = if lines.len() <= LEAF {
        lines.iter().map(Line::area).reduce(|a, b| a.union(b)).unwrap_or_default()
    } else {
        let half = lines.len() / 2;
        part(lines, half);
        let (left, right) = lines.split_at_mut(half);
        fill(boxes, 2 * node + 1, left, part).union(fill(boxes, 2 * node + 2, right, part))
    };
    boxes[node] = area;
    area
}

impl Line {
    fn area(&self) -> Rect {
        Rect::from_points(self.from, self.from + self.way)
    }

    /// Its point nearest to a place.
    #[inline]
    pub fn near(&self, place: Point) -> Near {
        let (share, distance_sq) = foot(self.from, self.way, place);
        Near { index: self.index, share, distance_sq }
    }
}

/// Where on the segment from a point along a way the nearest point to a place is, 0 to 1, and the
/// square of its distance, mm².
#[inline]
pub fn foot(from: Point, way: Vec2, place: Point) -> (f64, f64) {
    let share = (place - from).dot(way) / way.hypot2();
    // A segment without a length has its start.
    let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
    (share, (from + share * way).distance_squared(place))
}

fn distance_sq(area: Rect, p: Point) -> f64 {
    let x = (area.x0 - p.x).max(p.x - area.x1).max(0.0);
    let y = (area.y0 - p.y).max(p.y - area.y1).max(0.0);
    x * x + y * y
}
