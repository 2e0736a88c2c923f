//! A route shortened by reversals and moves of its parts, within a counted budget.
//!
//! Source: Bentley 1992, "Fast algorithms for geometric traveling salesman problems" (neighbour
//! lists, a queue of nodes to look at, array representation).

use crate::nearest::NearestTree;
use kurbo::Point;
use std::collections::VecDeque;

/// Neighbours that each end of a node looks at.
const N_NEIGHBOURS: usize = 10;
/// Longest part that is reversed or passed over; the cost of a step is proportional to it.
const SPAN_MAX: usize = 100_000;
/// Most nodes that are moved together.
const MOVE_MAX: usize = 3;
/// Gains below this are rounding, mm.
const GAIN_MM: f64 = 1e-9;

/// Something to be passed through from one end to the other, either way.
///
/// Holds its two ends; going from the first to the second is not turned.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node(pub [Point; 2]);

/// A path from a start through all nodes; where it ends is free.
pub struct Route<'a> {
    start: Point,
    nodes: Vec<Node>,
    /// Per node those that must come later.
    parents: &'a [Vec<u32>],
    turned: Vec<bool>,
    tour: Vec<u32>,
    place_of: Vec<u32>,
    /// Whether any node has a parent.
    nested: bool,
    /// Per end (2 · node + side): nearest ends of other nodes.
    near: Vec<u32>,
    moves_left: u64,
}

/// What lies at a place of the tour seen from one of its ends.
#[derive(Clone, Copy)]
struct Move {
    first: usize,
    n: usize,
    /// The nodes come to lie before the one that is at this place now.
    before: usize,
    reverse: bool,
}

impl<'a> Route<'a> {
    /// A route through `nodes` in the order of `tour`, none turned.
    ///
    /// * `parents`: per node those that must come later, and do in `tour`
    pub fn new(start: Point, nodes: Vec<Node>, tour: Vec<u32>, parents: &'a [Vec<u32>]) -> Self {
        let mut place_of = vec![0; nodes.len()];
        for (place, &node) in tour.iter().enumerate() {
            place_of[node as usize] = place as u32;
        }
        Self {
            start,
            turned: vec![false; nodes.len()],
            nested: parents.iter().any(|outer| !outer.is_empty()),
            parents,
            near: neighbours(&nodes),
            nodes,
            tour,
            place_of,
            moves_left: 0,
        }
    }

    /// Nodes in order, and whether they are gone through from their second end.
    pub fn tour(&self) -> impl Iterator<Item = (u32, bool)> {
        self.tour.iter().map(|&n| (n, self.turned[n as usize]))
    }

    /// Shortens until nothing helps or `moves_left`, places looked at or moved, is used up.
    pub fn improve(&mut self, moves_left: &mut u64) {
        self.moves_left = *moves_left;
        let mut waiting: VecDeque<u32> = self.tour.iter().copied().collect();
        let mut is_waiting = vec![true; self.nodes.len()];
        let mut changed = Vec::new();
        while let Some(node) = waiting.pop_front() {
            is_waiting[node as usize] = false;
            while self.moves_left > 0 && self.improve_at(node, &mut changed) {
                for place in changed.drain(..) {
                    let Some(&other) = self.tour.get(place) else {
                        continue;
                    };
                    if !is_waiting[other as usize] {
                        is_waiting[other as usize] = true;
                        waiting.push_back(other);
                    }
                }
            }
        }
        *moves_left = self.moves_left;
    }

    /// Makes the first gain found around a node; `changed` gets the places with new neighbours.
    fn improve_at(&mut self, node: u32, changed: &mut Vec<usize>) -> bool {
        let p = self.place_of[node as usize] as usize;
        let n = self.tour.len();
        let before_mm = self.exit(p.wrapping_sub(1)).distance(self.entry(p));
        if self.try_reverse(p, n - 1, changed) {
            return true;
        }
        let side = usize::from(self.turned[node as usize]);
        for k in 0..N_NEIGHBOURS {
            let Some((q, at_entry, distance_mm)) = self.neighbour(node, side, k) else {
                break;
            };
            if distance_mm >= before_mm {
                break;
            }
            if self.try_join_entry(p, q, at_entry, changed) {
                return true;
            }
        }
        if p + 1 == n {
            return false;
        }
        let after_mm = self.exit(p).distance(self.entry(p + 1));
        for k in 0..N_NEIGHBOURS {
            let Some((q, at_entry, distance_mm)) = self.neighbour(node, 1 - side, k) else {
                break;
            };
            if distance_mm >= after_mm {
                break;
            }
            if self.try_join_exit(p, q, at_entry, changed) {
                return true;
            }
        }
        false
    }

    /// Place of the k-th neighbour of a node's end, whether it is met at its entry, and how far.
    fn neighbour(&mut self, node: u32, side: usize, k: usize) -> Option<(usize, bool, f64)> {
        let end = 2 * node as usize + side;
        let other = self.near[end * N_NEIGHBOURS + k];
        if other == u32::MAX {
            return None;
        }
        self.moves_left = self.moves_left.saturating_sub(1);
        let (other_node, other_side) = ((other / 2) as usize, (other % 2) as usize);
        let from = self.nodes[node as usize].0[side];
        let to = self.nodes[other_node].0[other_side];
        let at_entry = (other_side == 1) == self.turned[other_node];
        Some((self.place_of[other_node] as usize, at_entry, from.distance(to)))
    }

    /// Tries what puts the entry of place p next to an end of place q.
    fn try_join_entry(&mut self, p: usize, q: usize, entry: bool, out: &mut Vec<usize>) -> bool {
        let is_point = self.is_point(q);
        if (entry || is_point) && self.try_reverse(p.min(q), p.max(q) - 1, out) {
            return true;
        }
        (1..=MOVE_MAX).any(|n| {
            let here = |before, reverse| Move { first: p, n, before, reverse };
            (entry || is_point) && self.try_move(here(q, true), out)
                || (!entry || is_point)
                    && (self.try_move(here(q + 1, false), out)
                        || q + 1 >= n
                            && self.try_move(
                                Move { first: q + 1 - n, n, before: p, reverse: false },
                                out,
                            ))
        })
    }

    /// Tries what puts the exit of place p next to an end of place q.
    fn try_join_exit(&mut self, p: usize, q: usize, entry: bool, out: &mut Vec<usize>) -> bool {
        let is_point = self.is_point(q);
        if (!entry || is_point) && self.try_reverse(p.min(q) + 1, p.max(q), out) {
            return true;
        }
        (1..=MOVE_MAX).any(|n| {
            let here =
                |before, reverse| Move { first: (p + 1).wrapping_sub(n), n, before, reverse };
            p + 1 >= n
                && ((!entry || is_point) && self.try_move(here(q + 1, true), out)
                    || (entry || is_point) && self.try_move(here(q, false), out))
                || (entry || is_point)
                    && self.try_move(Move { first: q, n, before: p + 1, reverse: false }, out)
        })
    }

    fn try_reverse(&mut self, i: usize, j: usize, changed: &mut Vec<usize>) -> bool {
        if i > j || j - i >= SPAN_MAX {
            return false;
        }
        let (from, to) = (self.exit(i.wrapping_sub(1)), j + 1);
        let mut gain_mm = from.distance(self.entry(i)) - from.distance(self.exit(j));
        if to < self.tour.len() {
            gain_mm += self.exit(j).distance(self.entry(to));
            gain_mm -= self.entry(i).distance(self.entry(to));
        }
        if gain_mm < GAIN_MM {
            return false;
        }
        self.spend(j - i);
        if self.has_nested_pair(i, j) {
            return false;
        }
        self.turn_over(i, j);
        changed.extend([i.wrapping_sub(1), i, j, to]);
        true
    }

    fn try_move(&mut self, m: Move, changed: &mut Vec<usize>) -> bool {
        let (i, end) = (m.first, m.first + m.n);
        let passed = m.before.abs_diff(i);
        if end > self.tour.len() || (i <= m.before && m.before <= end) || passed > SPAN_MAX {
            return false;
        }
        let (entry, exit) = (self.entry(i), self.exit(end - 1));
        let (new_entry, new_exit) = if m.reverse { (exit, entry) } else { (entry, exit) };
        let left = self.exit(i.wrapping_sub(1));
        let target = self.exit(m.before.wrapping_sub(1));
        let mut gain_mm = left.distance(entry) - target.distance(new_entry);
        if end < self.tour.len() {
            let right = self.entry(end);
            gain_mm += exit.distance(right) - left.distance(right);
        }
        if m.before < self.tour.len() {
            let next = self.entry(m.before);
            gain_mm += target.distance(next) - new_exit.distance(next);
        }
        if gain_mm < GAIN_MM {
            return false;
        }
        self.spend(passed);
        if self.breaks_nesting(m) {
            return false;
        }
        let (lo, hi) = (i.min(m.before), end.max(m.before));
        let part = &mut self.tour[lo..hi];
        let now = if m.before < i {
            part.rotate_right(m.n);
            m.before
        } else {
            part.rotate_left(m.n);
            m.before - m.n
        };
        self.renumber(lo, hi);
        if m.reverse {
            self.turn_over(now, now + m.n - 1);
        }
        let gap = if m.before < i { end } else { i };
        changed.extend([now.wrapping_sub(1), now, now + m.n - 1, now + m.n]);
        changed.extend([gap.wrapping_sub(1), gap]);
        true
    }

    /// Whether some node and its parent both lie in the places i to j.
    fn has_nested_pair(&self, i: usize, j: usize) -> bool {
        self.nested
            && self.tour[i..=j]
                .iter()
                .any(|&node| self.parent_places(node).any(|place| (i..=j).contains(&place)))
    }

    fn breaks_nesting(&self, m: Move) -> bool {
        if !self.nested {
            return false;
        }
        let end = m.first + m.n;
        let lies_in = |node: u32, lo: usize, hi: usize| {
            self.parent_places(node).any(|place| (lo..hi).contains(&place))
        };
        let mut moved = self.tour[m.first..end].iter();
        if m.reverse && moved.clone().any(|&node| lies_in(node, m.first, end)) {
            return true;
        }
        if m.before > end {
            moved.any(|&node| lies_in(node, end, m.before))
        } else {
            let passed = &self.tour[m.before..m.first];
            passed.iter().any(|&node| lies_in(node, m.first, end))
        }
    }

    fn parent_places(&self, node: u32) -> impl Iterator<Item = usize> {
        let parents = self.parents[node as usize].iter();
        parents.map(|&parent| self.place_of[parent as usize] as usize)
    }

    fn turn_over(&mut self, i: usize, j: usize) {
        self.tour[i..=j].reverse();
        for &node in &self.tour[i..=j] {
            self.turned[node as usize] ^= true;
        }
        self.renumber(i, j + 1);
    }

    fn renumber(&mut self, lo: usize, hi: usize) {
        for place in lo..hi {
            self.place_of[self.tour[place] as usize] = place as u32;
        }
    }

    fn spend(&mut self, n_places: usize) {
        self.moves_left = self.moves_left.saturating_sub(n_places as u64);
    }

    fn entry(&self, place: usize) -> Point {
        let node = self.tour[place] as usize;
        self.nodes[node].0[usize::from(self.turned[node])]
    }

    /// Where the route leaves a place; before the first (index -1, wrapped) it is the start.
    fn exit(&self, place: usize) -> Point {
        match self.tour.get(place) {
            Some(&node) => {
                let node = node as usize;
                self.nodes[node].0[usize::from(!self.turned[node])]
            }
            None => self.start,
        }
    }

    /// Whether both ends are one place, so that only the first is in the neighbour lists.
    fn is_point(&self, place: usize) -> bool {
        let ends = self.nodes[self.tour[place] as usize].0;
        ends[0] == ends[1]
    }
}

/// For every end (2 · node + side) the nearest ends of other nodes.
fn neighbours(nodes: &[Node]) -> Vec<u32> {
    let mut ends = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        ends.push((node.0[0], 2 * i as u32));
        if node.0[0] != node.0[1] {
            ends.push((node.0[1], 2 * i as u32 + 1));
        }
    }
    let places: Vec<Point> = ends.iter().map(|end| end.0).collect();
    let tree = NearestTree::new(&places, true);
    let mut near = vec![u32::MAX; 2 * nodes.len() * N_NEIGHBOURS];
    for &(place, end) in &ends {
        let found =
            tree.nearest_few(place, N_NEIGHBOURS, |other| ends[other as usize].1 / 2 != end / 2);
        let n_sides =
            if nodes[end as usize / 2].0[0] == nodes[end as usize / 2].0[1] { 2 } else { 1 };
        for side in 0..n_sides {
            let list = &mut near[(end as usize + side) * N_NEIGHBOURS..][..N_NEIGHBOURS];
            for (slot, &(_, other)) in list.iter_mut().zip(&found) {
                *slot = ends[other as usize].1;
            }
        }
    }
    near
}
