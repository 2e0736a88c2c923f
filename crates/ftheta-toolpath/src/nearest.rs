//! The nearest of many places, of which some are switched off: a k-d tree.

use kurbo::{Point, Rect};

/// Places in one leaf; larger is slower to search, smaller slower to build.
const LEAF: usize = 8;

/// A k-d tree whose places can be taken out and put back.
pub struct NearestTree {
    /// Places in the order of the leaves, with the index they were given under.
    places: Vec<(Point, u32)>,
    active: Vec<bool>,
    /// Where each given place is in `places`.
    slot_of: Vec<u32>,
    /// Per node: bounding box and number of active places below. Children of i: 2i+1, 2i+2.
    nodes: Vec<(Rect, u32)>,
}

/// One step of a walk through the tree.
#[derive(Clone, Copy)]
struct Range {
    node: usize,
    lo: usize,
    hi: usize,
}

impl NearestTree {
    /// A tree over `points`, all of them active or none.
    pub fn new(points: &[Point], active: bool) -> Self {
        let n = points.len();
        let mut places: Vec<(Point, u32)> = points.iter().copied().zip(0u32..).collect();
        let n_leaves = n.div_ceil(LEAF).next_power_of_two();
        let mut nodes = vec![(Rect::ZERO, 0); 4 * n_leaves];
        let mut todo = vec![Range::all(n)];
        while let Some(range) = todo.pop() {
            let slice = &mut places[range.lo..range.hi];
            let Some(&(first, _)) = slice.first() else {
                continue;
            };
            let area = slice.iter().fold(Rect::from_points(first, first), |r, p| r.union_pt(p.0));
            let n_active = if active { slice.len() as u32 } else { 0 };
            nodes[range.node] = (area, n_active);
            if slice.len() > LEAF {
                let middle = slice.len() / 2;
                let key = |p: &(Point, u32)| {
                    if area.width() > area.height() { p.0.x } else { p.0.y }
                };
                slice.select_nth_unstable_by(middle, |a, b| {
                    key(a).total_cmp(&key(b)).then(a.1.cmp(&b.1))
                });
                todo.extend(range.halves());
            }
        }
        let mut slot_of = vec![0; n];
        for (slot, place) in places.iter().enumerate() {
            slot_of[place.1 as usize] = slot as u32;
        }
        Self { places, active: vec![active; n], slot_of, nodes }
    }

    /// Takes a place out, or puts it back.
    pub fn set_active(&mut self, index: u32, active: bool) {
        let slot = self.slot_of[index as usize] as usize;
        if self.active[slot] == active {
            return;
        }
        self.active[slot] = active;
        let mut range = Range::all(self.places.len());
        loop {
            let count = &mut self.nodes[range.node].1;
            *count = if active { *count + 1 } else { *count - 1 };
            if range.hi - range.lo <= LEAF {
                return;
            }
            let [left, right] = range.halves();
            range = if slot < left.hi { left } else { right };
        }
    }

    /// The active place nearest to `from`.
    pub fn nearest(&self, from: Point) -> Option<u32> {
        let mut best = (f64::INFINITY, u32::MAX);
        self.walk(Range::all(self.places.len()), from, &mut |place| {
            if place < best {
                best = place;
            }
            best.0
        });
        (best.1 != u32::MAX).then_some(best.1)
    }

    /// Up to `n` active places nearest to `from` that `wanted` accepts, nearest first.
    pub fn nearest_few(
        &self,
        from: Point,
        n: usize,
        wanted: impl Fn(u32) -> bool,
    ) -> Vec<(f64, u32)> {
        let mut best: Vec<(f64, u32)> = Vec::with_capacity(n + 1);
        self.walk(Range::all(self.places.len()), from, &mut |place| {
            if wanted(place.1) && (best.len() < n || place < best[n - 1]) {
                let at = best.partition_point(|other| *other < place);
                best.insert(at, place);
                best.truncate(n);
            }
            if best.len() < n { f64::INFINITY } else { best[n - 1].0 }
        });
        best
    }

    /// Visits active places, near boxes first; the visitor returns the squared distance within
    /// which it still wants to see some.
    fn walk(&self, range: Range, from: Point, visit: &mut impl FnMut((f64, u32)) -> f64) {
        let mut within = f64::INFINITY;
        let mut stack = vec![(0.0, range)];
        while let Some((distance_sq, range)) = stack.pop() {
            if distance_sq > within || self.nodes[range.node].1 == 0 {
                continue;
            }
            if range.hi - range.lo <= LEAF {
                for slot in range.lo..range.hi {
                    let (place, index) = self.places[slot];
                    if self.active[slot] {
                        within = visit((place.distance_squared(from), index));
                    }
                }
                continue;
            }
            let [left, right] =
                range.halves().map(|half| (distance_sq_to(self.nodes[half.node].0, from), half));
            // The nearer half is pushed last, so that it is searched first.
            if left.0 <= right.0 {
                stack.extend([right, left]);
            } else {
                stack.extend([left, right]);
            }
        }
    }
}

impl Range {
    fn all(n: usize) -> Self {
        Self { node: 0, lo: 0, hi: n }
    }

    fn halves(self) -> [Self; 2] {
        let middle = self.lo + (self.hi - self.lo) / 2;
        let half = |node, lo, hi| Self { node, lo, hi };
        [half(2 * self.node + 1, self.lo, middle), half(2 * self.node + 2, middle, self.hi)]
    }
}

fn distance_sq_to(area: Rect, from: Point) -> f64 {
    let x = (area.x0 - from.x).max(from.x - area.x1).max(0.0);
    let y = (area.y0 - from.y).max(from.y - area.y1).max(0.0);
    x * x + y * y
}
