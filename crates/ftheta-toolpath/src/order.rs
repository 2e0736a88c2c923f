//! The short way round the units of one pen.

use crate::improve::{Node, Route};
use crate::nearest::NearestTree;
use crate::nest;
use crate::unit::{Pose, Unit};
use kurbo::Point;

/// Entries of a contour that the first search looks at; all are looked at later.
const ENTRIES_MAX: usize = 64;

/// A unit in the order, and how it is gone through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Which unit.
    pub unit_index: usize,
    /// Which of its poses.
    pub pose_index: usize,
}

/// All units once, so that the jumps from `start` on are short.
///
/// Greedy nearest neighbour first, then improved by reversals and moves (2-opt, Or-opt) until
/// `moves_left` is used up. A contour comes before the one it lies in.
pub fn shortest(units: &[Unit], start: Point, moves_left: &mut u64) -> Vec<Stop> {
    let poses = Poses::new(units);
    let parents = unit_parents(units);
    let stops = greedy(&poses, &parents, start);
    let mut plan = Plan { units, poses, start, stops };
    for _ in 0..2 {
        plan.improve(&parents, moves_left);
        plan.settle();
    }
    plan.stops
}

/// The units as they come, as drawn.
pub fn kept(units: &[Unit]) -> Vec<Stop> {
    (0..units.len()).map(|unit_index| Stop { unit_index, pose_index: 0 }).collect()
}

/// Whether every contour comes before the one it lies in.
pub fn respects_nesting(units: &[Unit], stops: &[Stop]) -> bool {
    let mut place_of = vec![0; units.len()];
    for (place, stop) in stops.iter().enumerate() {
        place_of[stop.unit_index] = place;
    }
    unit_parents(units)
        .iter()
        .enumerate()
        .all(|(i, outer)| outer.iter().all(|&o| place_of[i] < place_of[o as usize]))
}

/// Length of all jumps inside and between the units, mm, without the way to the first.
pub fn jump_length_mm(units: &[Unit], stops: &[Stop]) -> f64 {
    let mut length_mm = 0.0;
    let mut from: Option<Point> = None;
    for stop in stops {
        let unit = &units[stop.unit_index];
        let pose = unit.pose(stop.pose_index);
        length_mm += f64::from(unit.n_passes) * pose.inside_mm;
        length_mm += from.map_or(0.0, |from| from.distance(pose.entry));
        from = Some(pose.exit);
    }
    length_mm
}

/// Every pose of every unit, computed once.
struct Poses {
    all: Vec<Pose>,
    /// Where each unit's poses start in `all`, and the end.
    first: Vec<usize>,
}

struct Plan<'a> {
    units: &'a [Unit],
    poses: Poses,
    start: Point,
    stops: Vec<Stop>,
}

impl Poses {
    fn new(units: &[Unit]) -> Self {
        let mut all = Vec::new();
        let mut first = vec![0];
        for unit in units {
            all.extend((0..unit.n_poses()).map(|i| unit.pose(i)));
            first.push(all.len());
        }
        Self { all, first }
    }

    fn of(&self, unit_index: usize) -> &[Pose] {
        &self.all[self.first[unit_index]..self.first[unit_index + 1]]
    }

    fn at(&self, stop: Stop) -> Pose {
        self.of(stop.unit_index)[stop.pose_index]
    }
}

impl Plan<'_> {
    fn improve(&mut self, parents: &[Vec<u32>], moves_left: &mut u64) {
        let mut nodes = vec![Node::default(); self.stops.len()];
        for &stop in &self.stops {
            let pose = self.poses.at(stop);
            nodes[stop.unit_index] = Node([pose.entry, pose.exit]);
        }
        let tour = self.stops.iter().map(|stop| stop.unit_index as u32);
        let mut pose_of = vec![0; self.stops.len()];
        for stop in &self.stops {
            pose_of[stop.unit_index] = stop.pose_index;
        }
        let mut route = Route::new(self.start, nodes, tour.collect(), parents);
        route.improve(moves_left);
        self.stops = route
            .tour()
            .map(|(node, turned)| {
                let unit_index = node as usize;
                let pose_index = match turned {
                    true => self.units[unit_index].turned(pose_of[unit_index]),
                    false => pose_of[unit_index],
                };
                Stop { unit_index, pose_index }
            })
            .collect();
    }

    /// Chooses every unit's pose anew, between the neighbours it now has.
    fn settle(&mut self) {
        let mut from = self.start;
        for at in 0..self.stops.len() {
            let next = self.stops.get(at + 1).map(|&stop| self.poses.at(stop).entry);
            let stop = &mut self.stops[at];
            let cost = |pose: &Pose| {
                let onward = next.map_or(0.0, |next| pose.exit.distance(next));
                let n_passes = f64::from(self.units[stop.unit_index].n_passes);
                from.distance(pose.entry) + n_passes * pose.inside_mm + onward
            };
            let poses = self.poses.of(stop.unit_index);
            let mut best = (cost(&poses[stop.pose_index]), stop.pose_index);
            for (i, pose) in poses.iter().enumerate() {
                let length = cost(pose);
                if length < best.0 - 1e-9 {
                    best = (length, i);
                }
            }
            stop.pose_index = best.1;
            from = poses[best.1].exit;
        }
    }
}

/// The closed units that each closed unit lies in.
fn unit_parents(units: &[Unit]) -> Vec<Vec<u32>> {
    let closed: Vec<usize> = (0..units.len()).filter(|&i| units[i].is_closed()).collect();
    let contours: Vec<_> = closed.iter().map(|&i| &units[i].marks[0].points[..]).collect();
    let mut parents = vec![Vec::new(); units.len()];
    for (&unit, outer) in closed.iter().zip(nest::parents(&contours)) {
        parents[unit] = outer.iter().map(|&o| closed[o as usize] as u32).collect();
    }
    parents
}

fn greedy(poses: &Poses, parents: &[Vec<u32>], start: Point) -> Vec<Stop> {
    let n = parents.len();
    let mut n_inner = vec![0u32; n];
    for &outer in parents.iter().flatten() {
        n_inner[outer as usize] += 1;
    }
    let mut entries: Vec<Stop> = Vec::new();
    let mut first = vec![0];
    for unit_index in 0..n {
        let n_poses = poses.of(unit_index).len();
        let step = n_poses.div_ceil(ENTRIES_MAX);
        entries
            .extend((0..n_poses).step_by(step).map(|pose_index| Stop { unit_index, pose_index }));
        first.push(entries.len());
    }
    let places: Vec<Point> = entries.iter().map(|&stop| poses.at(stop).entry).collect();
    let mut tree = NearestTree::new(&places, true);
    let entries_of = |unit: usize| (first[unit] as u32)..(first[unit + 1] as u32);
    for outer in (0..n).filter(|&i| n_inner[i] > 0) {
        entries_of(outer).for_each(|i| tree.set_active(i, false));
    }
    let mut stops = Vec::with_capacity(n);
    let mut from = start;
    while let Some(found) = tree.nearest(from) {
        let stop = entries[found as usize];
        entries_of(stop.unit_index).for_each(|i| tree.set_active(i, false));
        from = poses.at(stop).exit;
        stops.push(stop);
        for &outer in &parents[stop.unit_index] {
            let outer = outer as usize;
            n_inner[outer] -= 1;
            if n_inner[outer] == 0 {
                entries_of(outer).for_each(|i| tree.set_active(i, true));
            }
        }
    }
    assert!(stops.len() == n, "nesting by area has no cycle");
    stops
}
