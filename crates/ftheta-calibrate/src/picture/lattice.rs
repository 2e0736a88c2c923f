//! Which mark of a grid is which, from how they lie to each other.
//!
//! From a first mark on, every neighbour is looked for where the way between the marks before
//! leads. So perspective, lens and a head's own errors may bend the grid as they like, marks may be
//! missing, and what is not in line is left alone.

use ftheta_model::picture::PixelPoint;
use std::collections::{HashMap, VecDeque};

/// A neighbour lies where it is expected to this part of the way, and beyond a gap.
const GATE: f64 = 0.22;
const GATE_BEYOND: f64 = 0.3;
/// A row beyond the grid has no more marks than this part of a whole one.
const STRAY: f64 = 0.3;
/// A mark is off the middle of its neighbours by no more than so many times the usual, and px.
const BENT: f64 = 8.0;
const BENT_PX: f64 = 1.5;
/// How much of a new way is taken over from the one before.
const KEPT: f64 = 0.5;

/// Marks that hang together: each with its column and row, counted from the first one.
pub type Lattice = HashMap<(i32, i32), usize>;

/// A mark on the way through the lattice.
struct Step {
    index: (i32, i32),
    mark: usize,
    /// From a column to the next, and from a row to the next, px.
    ways: [[f64; 2]; 2],
}

/// All lattices that the marks form, the largest first.
///
/// * `ways`: from a column, and a row, to the next one at a place, px
pub fn lattices(
    marks: &[PixelPoint],
    ways: &dyn Fn(PixelPoint) -> Option<[[f64; 2]; 2]>,
) -> Vec<Lattice> {
    let near = Near::new(marks, ways);
    let mut taken = vec![false; marks.len()];
    let mut all: Vec<Lattice> = Vec::new();
    for first in 0..marks.len() {
        if taken[first] {
            continue;
        }
        let Some(start) = ways(marks[first]) else { continue };
        all.push(grown(marks, &near, Step { index: (0, 0), mark: first, ways: start }, &mut taken));
    }
    // Equally large ones stay in the order of their first marks.
    all.sort_by_key(|lattice| std::cmp::Reverse(lattice.len()));
    all
}

fn grown(marks: &[PixelPoint], near: &Near, first: Step, taken: &mut [bool]) -> Lattice {
    taken[first.mark] = true;
    let mut lattice = Lattice::from([(first.index, first.mark)]);
    let mut queue = VecDeque::from([first]);
    while let Some(step) = queue.pop_front() {
        for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1)] {
            for n in [1, 2] {
                let (column, row) = step.index;
                let index = match axis {
                    0 => (column + sign * n, row),
                    _ => (column, row + sign * n),
                };
                if lattice.contains_key(&index) {
                    break;
                }
                let many = f64::from(sign * n);
                let way = step.ways[axis];
                let from = marks[step.mark];
                let expected =
                    PixelPoint::new(from.x_px + many * way[0], from.y_px + many * way[1]);
                let gate = if n == 1 { GATE } else { GATE_BEYOND } * way[0].hypot(way[1]);
                let Some(mark) = near.nearest(marks, expected, gate).filter(|&mark| !taken[mark])
                else {
                    continue;
                };
                let found =
                    [(marks[mark].x_px - from.x_px) / many, (marks[mark].y_px - from.y_px) / many];
                let mut ways = step.ways;
                ways[axis] = [0, 1].map(|index| KEPT * way[index] + (1.0 - KEPT) * found[index]);
                taken[mark] = true;
                lattice.insert(index, mark);
                queue.push_back(Step { index, mark, ways });
                break;
            }
        }
    }
    lattice
}

/// Marks by where they are.
struct Near {
    cell_px: f64,
    cells: HashMap<(i64, i64), Vec<usize>>,
}

impl Near {
    fn new(marks: &[PixelPoint], ways: &dyn Fn(PixelPoint) -> Option<[[f64; 2]; 2]>) -> Self {
        let longest = marks.iter().filter_map(|&mark| ways(mark)).flatten();
        let cell_px = longest.map(|[x, y]| x.hypot(y)).fold(8.0, f64::max);
        let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
        for (index, mark) in marks.iter().enumerate() {
            cells.entry(Self::cell(cell_px, *mark)).or_default().push(index);
        }
        Self { cell_px, cells }
    }

    fn cell(cell_px: f64, place: PixelPoint) -> (i64, i64) {
        ((place.x_px / cell_px).floor() as i64, (place.y_px / cell_px).floor() as i64)
    }

    fn nearest(&self, marks: &[PixelPoint], place: PixelPoint, limit_px: f64) -> Option<usize> {
        let (column, row) = Self::cell(self.cell_px, place);
        let around =
            (row - 1..=row + 1).flat_map(|r| (column - 1..=column + 1).map(move |c| (c, r)));
        let near = around.filter_map(|key| self.cells.get(&key)).flatten();
        let nearest = near.map(|&mark| (marks[mark].distance(place), mark));
        let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        (nearest.0 < limit_px).then_some(nearest.1)
    }
}

/// Takes off outermost columns and rows with few marks while there are more than `size` of them:
/// dirt or lettering that happens to be in line.
pub fn trim(lattice: &mut Lattice, size: [usize; 2]) {
    loop {
        let (low, found) = extent(lattice);
        let Some(axis) = (0..2).find(|&axis| found[axis] > size[axis]) else { return };
        let at = |key: &(i32, i32)| [key.0, key.1][axis];
        let count = |line: i32| lattice.keys().filter(|key| at(key) == line).count();
        let (first, last) = (low[axis], low[axis] + found[axis] as i32 - 1);
        let line = if count(first) < count(last) { first } else { last };
        if count(line) as f64 > STRAY * size[1 - axis] as f64 {
            return;
        }
        lattice.retain(|key, _| at(key) != line);
    }
}

/// Takes off marks that are off the middle of their neighbours, the worst first: lettering or dirt
/// in the place of a mark.
pub fn smooth(lattice: &mut Lattice, marks: &[PixelPoint]) {
    let bent = |lattice: &Lattice, &(column, row): &(i32, i32)| {
        let at = |c: i32, r: i32| lattice.get(&(column + c, row + r)).map(|&mark| marks[mark]);
        let here = at(0, 0)?;
        let pairs = [(1, 0), (0, 1)].into_iter().filter_map(|(c, r)| at(c, r).zip(at(-c, -r)));
        let off = pairs.map(|(a, b)| {
            let (x_px, y_px) = (0.5 * (a.x_px + b.x_px), 0.5 * (a.y_px + b.y_px));
            here.distance(PixelPoint::new(x_px, y_px))
        });
        off.reduce(f64::min)
    };
    let mut sizes: Vec<f64> = lattice.keys().filter_map(|key| bent(lattice, key)).collect();
    if sizes.is_empty() {
        return;
    }
    let middle = sizes.len() / 2;
    let limit_px = (BENT * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1).max(BENT_PX);
    for _ in 0..lattice.len() / 10 {
        let worst = lattice.keys().filter_map(|key| Some((bent(lattice, key)?, *key)));
        let worst = worst.filter(|(off, _)| *off > limit_px);
        // Keys come in any order, and the result must not hang on it.
        let Some((_, key)) = worst.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else {
            return;
        };
        lattice.remove(&key);
    }
}

/// First column and row of a lattice, and how many there are of each.
pub fn extent(lattice: &Lattice) -> ([i32; 2], [usize; 2]) {
    let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
    for &(column, row) in lattice.keys() {
        for (axis, value) in [column, row].into_iter().enumerate() {
            low[axis] = low[axis].min(value);
            high[axis] = high[axis].max(value);
        }
    }
    (low, [0, 1].map(|axis| (high[axis] - low[axis] + 1).max(0) as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bent grid of 9 by 7 with gaps, and dirt.
    #[test]
    fn a_bent_grid_with_gaps_and_dirt_is_indexed() {
        let at = |c: i32, r: i32| {
            let (x, y) = (f64::from(c), f64::from(r));
            let scale = 1.0 + 0.02 * x;
            PixelPoint::new(300.0 + 40.0 * x + 2.0 * y + 0.4 * x * x, 500.0 - scale * 38.0 * y)
        };
        let mut marks = Vec::new();
        let mut known = Vec::new();
        for r in 0..7 {
            for c in 0..9 {
                if (c, r) != (3, 3) && (c, r) != (4, 3) && (c, r) != (8, 0) {
                    marks.push(at(c, r));
                    known.push((c, r));
                }
            }
        }
        for dirt in [(317.0, 480.0), (401.0, 391.0), (900.0, 20.0)] {
            marks.push(PixelPoint::new(dirt.0, dirt.1));
        }
        let found = lattices(&marks, &|_| Some([[41.0, 0.0], [0.0, -39.0]]));
        let largest = &found[0];
        assert_eq!(largest.len(), known.len());
        // What is off its neighbours goes, and nothing else.
        let (mut smoothed, mut bent) = (largest.clone(), marks.clone());
        smooth(&mut smoothed, &marks);
        assert_eq!(smoothed.len(), known.len());
        bent[20].y_px += 6.0;
        smooth(&mut smoothed, &bent);
        assert_eq!(smoothed.len() + 1, known.len());
        assert!(!smoothed.values().any(|&mark| mark == 20));
        let (low, size) = extent(largest);
        assert_eq!(size, [9, 7]);
        for (&(c, r), &mark) in largest {
            assert_eq!(known[mark], (c - low[0], r - low[1]));
        }
    }
}
