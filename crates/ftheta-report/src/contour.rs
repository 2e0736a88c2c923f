//! A mark's exact curve as a very fine polyline that finds the nearest of its points.

use crate::segment_tree::{Line, Near, SegmentTree, foot};
use ftheta_model::flatten::flatten;
use kurbo::{BezPath, Point, Vec2};

/// Greatest distance of the polyline from the curve, mm.
const FLATTEN_MM: f64 = 2e-5;
/// Points of the curve whose distances differ by less lie on each other: what two polylines of the
/// same curve may, and the trace's rounding, mm.
pub const TIE_MM: f64 = 5e-5;
/// Segments whose ends round to the same multiples of this are one, mm.
const SAME_MM: f64 = 1e-7;
/// Least arc length around an end that is searched for where light went on or off, mm.
const REACH_MM: f64 = 0.75;
/// Most that the beam goes before the tree is searched again, mm, and how many segments are looked
/// at meanwhile.
const SLACK_MAX_MM: f64 = 0.02;
const N_AROUND: usize = 16;
/// Weight of the squared arc distance from an end against the squared distance. Only decides
/// between branches that lie on each other.
const TIE_WEIGHT: f64 = 1e-9;

/// A polyline with arc lengths and a tree of its segments.
pub struct Contour {
    points: Vec<Point>,
    /// Arc length up to each point, mm.
    arc_mm: Vec<f64>,
    /// Whether it ends where it starts; then arc positions go round.
    closed: bool,
    /// Segments that lie on each other, either way round, are one stack. Of each stack, its first
    /// passage; one more is the end.
    first_passages: Vec<usize>,
    /// Segments by stack, in order of arc length.
    passages: Vec<Passage>,
    /// Stack of every segment.
    stacks: Vec<usize>,
    tree: SegmentTree,
}

/// A segment of a stack.
#[derive(Clone, Copy)]
struct Passage {
    segment: usize,
    /// Against the first one.
    backwards: bool,
}

/// A point of the curve.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Arc position, mm; on a closed curve below 0 or above the length where the beam went round.
    pub at_mm: f64,
    /// Distance of the beam from it, mm.
    pub distance_mm: f64,
}

/// What of a curve is nearest to a beam.
#[derive(Clone, Debug)]
pub struct Nearest {
    /// Distance of the nearest point of the whole curve, mm.
    pub distance_mm: f64,
    /// Nearest points of all stacks that are as near.
    found: Vec<Near>,
    /// All stacks within a reach of where the beam was some steps ago: they are enough until it has
    /// gone so far that others may be nearer.
    around: Vec<Line>,
    centre: Point,
    reach_mm: f64,
    /// How much farther than the nearest they reach, mm.
    slack_mm: f64,
}

impl Default for Nearest {
    fn default() -> Self {
        Self {
            distance_mm: f64::INFINITY,
            found: Vec::new(),
            around: Vec::new(),
            centre: Point::ZERO,
            reach_mm: 0.0,
            slack_mm: SLACK_MAX_MM,
        }
    }
}

impl Nearest {
    /// Finds what of the stacks around is nearest.
    fn look(&mut self, beam: Point) {
        self.found.clear();
        let (mut best_sq, mut within_sq) = (f64::INFINITY, f64::INFINITY);
        for line in &self.around {
            let near = line.near(beam);
            if near.distance_sq <= within_sq {
                if near.distance_sq < best_sq {
                    best_sq = near.distance_sq;
                    within_sq = (best_sq.sqrt() + TIE_MM).powi(2);
                }
                self.found.push(near);
            }
        }
        if self.found.len() > 1 {
            self.found.retain(|near| near.distance_sq <= within_sq);
        }
        self.distance_mm = best_sq.sqrt();
    }
}

impl Contour {
    /// A curve of one subpath, within 0.02 µm of the exact one.
    pub fn new(curve: &BezPath) -> Self {
        let points = flattened(curve);
        let mut arc_mm = Vec::with_capacity(points.len());
        let mut at_mm = 0.0;
        arc_mm.push(0.0);
        for pair in points.windows(2) {
            at_mm += pair[0].distance(pair[1]);
            arc_mm.push(at_mm);
        }
        let closed = points.len() > 2 && points[0].distance(points[points.len() - 1]) < 1e-6;
        let (first_passages, passages) = stacked(&points);
        let mut stacks = vec![0; passages.len()];
        for stack in 0..first_passages.len() - 1 {
            for passage in &passages[first_passages[stack]..first_passages[stack + 1]] {
                stacks[passage.segment] = stack;
            }
        }
        let firsts = first_passages[..first_passages.len() - 1].iter();
        let segments = firsts.map(|&first| {
            let segment = passages[first].segment;
            [points[segment], points[segment + 1]]
        });
        let tree = SegmentTree::by_place(segments);
        Self { points, arc_mm, closed, first_passages, passages, stacks, tree }
    }

    /// Where it starts.
    pub fn start(&self) -> Point {
        self.points[0]
    }

    /// Length of the whole, mm.
    pub fn length_mm(&self) -> f64 {
        self.arc_mm[self.arc_mm.len() - 1]
    }

    /// Whether it ends where it starts.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Places every `step_mm` from 0 on, in order, each with the number of times that the curve
    /// passes it; those that it has passed before are left out.
    pub fn samples(&self, step_mm: f64, n: usize) -> impl Iterator<Item = (usize, Point)> {
        let mut i = 0;
        (0..n).filter_map(move |k| {
            let at_mm = (k as f64 * step_mm).min(self.length_mm());
            while i + 2 < self.points.len() && self.arc_mm[i + 1] < at_mm {
                i += 1;
            }
            let passages = self.passages_of(self.stacks[i]);
            (passages[0].segment == i).then(|| (passages.len(), self.place(i, at_mm)))
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
        let start = Foot { at_mm: 0.0, distance_mm: off_mm };
        self.nearest_around(beam, 0.0, REACH_MM + 4.0 * off_mm).unwrap_or(start)
    }

    /// The point nearest to `beam` around the end, unless `foot` is much nearer elsewhere.
    pub fn nearest_to_end(&self, beam: Point, foot: Foot) -> Foot {
        let reach_mm = REACH_MM + 4.0 * foot.distance_mm;
        match self.nearest_around(beam, self.length_mm(), reach_mm) {
            Some(found) if found.distance_mm <= 2.0 * foot.distance_mm + TIE_MM => found,
            _ => foot,
        }
    }

    /// Finds what of the whole curve is nearest to `beam`; quick where it was near before.
    pub fn find_nearest(&self, beam: Point, nearest: &mut Nearest) {
        nearest.look(beam);
        let gone_mm = beam.distance(nearest.centre);
        if nearest.distance_mm + TIE_MM + gone_mm > nearest.reach_mm {
            let Nearest { around, slack_mm, .. } = nearest;
            match around.len() {
                n if n > 2 * N_AROUND => *slack_mm *= 0.5,
                n if n < N_AROUND => *slack_mm = (1.5 * *slack_mm).min(SLACK_MAX_MM),
                _ => {}
            }
            around.clear();
            let mut best_sq = nearest.distance_mm * nearest.distance_mm;
            let reach_mm = |best_sq: f64| best_sq.sqrt() + TIE_MM + *slack_mm;
            let mut within_sq = reach_mm(best_sq).powi(2);
            self.tree.search(beam, within_sq, |line, near| {
                if near.distance_sq < best_sq {
                    best_sq = near.distance_sq;
                    within_sq = reach_mm(best_sq).powi(2);
                }
                around.push(*line);
                within_sq
            });
            (nearest.centre, nearest.reach_mm) = (beam, reach_mm(best_sq));
            nearest.look(beam);
        }
    }

    /// The arc position of what was found nearest, if there is one that is passed once; the one of
    /// a closed curve that is nearest to an expected place, mm.
    pub fn only(&self, nearest: &Nearest, expected_mm: f64) -> Option<f64> {
        let [near] = nearest.found[..] else { return None };
        let [passage] = *self.passages_of(near.index) else { return None };
        let at_mm = self.arc_at_mm(passage, near.share);
        let turns = match self.closed {
            true => ((expected_mm - at_mm) / self.length_mm()).round(),
            false => 0.0,
        };
        Some(at_mm + turns * self.length_mm())
    }

    /// Visits arc positions of what was found nearest to `beam`: of each stack, the last one up to
    /// an expected place and the first one after it, mm.
    pub fn around(
        &self,
        beam: Point,
        nearest: &Nearest,
        expected_mm: f64,
        mut visit: impl FnMut(f64),
    ) {
        let turn = if self.closed { (expected_mm / self.length_mm()).floor() } else { 0.0 };
        let within_mm = expected_mm - turn * self.length_mm();
        for near in &nearest.found {
            let passages = self.passages_of(near.index);
            let at_mm = |index: usize| self.arc_at_mm(passages[index], near.share);
            let n = passages.len();
            let after = match n {
                1 => usize::from(at_mm(0) <= within_mm),
                _ => passages
                    .partition_point(|&passage| self.arc_at_mm(passage, near.share) <= within_mm),
            };
            let before = match after {
                0 => self.closed.then_some((n - 1, turn - 1.0)),
                _ => Some((after - 1, turn)),
            };
            let after = match after < n {
                true => Some((after, turn)),
                false => self.closed.then_some((0, turn + 1.0)),
            };
            for (index, turn) in [before, after].into_iter().flatten() {
                if self.is_nearest(passages[index], near, beam) {
                    visit(at_mm(index) + turn * self.length_mm());
                }
            }
        }
    }

    /// Whether a segment's nearest point is not merely its end, from where the next one is nearer.
    fn is_nearest(&self, passage: Passage, near: &Near, beam: Point) -> bool {
        let Passage { segment, backwards } = passage;
        let share = if backwards { 1.0 - near.share } else { near.share };
        let n = self.points.len() - 1;
        let next = match share {
            _ if share <= 0.0 => segment.checked_sub(1).or(self.closed.then_some(n - 1)),
            _ if share >= 1.0 && segment + 1 < n => Some(segment + 1),
            _ if share >= 1.0 && self.closed => Some(0),
            _ => None,
        };
        // But for what rounding makes of nanometres.
        let least_sq = near.distance_sq * (1.0 - 1e-9) - 1e-18;
        next.is_none_or(|next| self.foot(next, beam).1 >= least_sq)
    }

    /// The point nearest to `beam` within `reach_mm` of arc from a place.
    fn nearest_around(&self, beam: Point, middle_mm: f64, reach_mm: f64) -> Option<Foot> {
        let length_mm = self.length_mm();
        let (turns, reach_mm) = match self.closed {
            true => (-1..=1, reach_mm.min(0.5 * length_mm)),
            false => (0..=0, reach_mm),
        };
        let mut best: Option<(f64, Foot)> = None;
        for turn in turns {
            let shift_mm = f64::from(turn) * length_mm;
            let from_mm = middle_mm - reach_mm - shift_mm;
            let to_mm = middle_mm + reach_mm - shift_mm;
            let first = self.arc_mm.partition_point(|&at_mm| at_mm < from_mm).saturating_sub(1);
            for i in first..self.points.len() - 1 {
                if self.arc_mm[i] > to_mm {
                    break;
                }
                let segment_mm = self.arc_mm[i + 1] - self.arc_mm[i];
                // A long segment may reach out of the window, to where the curve crosses itself.
                let low = ((from_mm - self.arc_mm[i]) / segment_mm).max(0.0);
                let high = ((to_mm - self.arc_mm[i]) / segment_mm).min(1.0);
                if low > high {
                    continue;
                }
                let share = self.foot(i, beam).0.max(low).min(high);
                let at_mm = self.arc_mm[i] + share * segment_mm;
                let off = self.points[i].lerp(self.points[i + 1], share) - beam;
                let at_mm = at_mm + shift_mm;
                let cost = off.hypot2() + TIE_WEIGHT * (at_mm - middle_mm).powi(2);
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, Foot { at_mm, distance_mm: off.hypot() }));
                }
            }
        }
        best.map(|(_, foot)| foot)
    }

    fn passages_of(&self, stack: usize) -> &[Passage] {
        &self.passages[self.first_passages[stack]..self.first_passages[stack + 1]]
    }

    fn arc_at_mm(&self, passage: Passage, share: f64) -> f64 {
        let Passage { segment, backwards } = passage;
        let share = if backwards { 1.0 - share } else { share };
        self.arc_mm[segment] + share * (self.arc_mm[segment + 1] - self.arc_mm[segment])
    }

    fn foot(&self, i: usize, beam: Point) -> (f64, f64) {
        foot(self.points[i], self.points[i + 1] - self.points[i], beam)
    }

    fn place(&self, i: usize, at_mm: f64) -> Point {
        let length_mm = self.arc_mm[i + 1] - self.arc_mm[i];
        let t = (at_mm - self.arc_mm[i]) / length_mm;
        self.points[i].lerp(self.points[i + 1], t)
    }

    fn tangent(&self, i: usize) -> Vec2 {
        (self.points[i + 1] - self.points[i]).normalize()
    }
}

/// Segments that lie on each other together: first passages of the stacks, and passages.
fn stacked(points: &[Point]) -> (Vec<usize>, Vec<Passage>) {
    let key = |p: Point| [(p.x / SAME_MM).round() as i64, (p.y / SAME_MM).round() as i64];
    let keys: Vec<[i64; 2]> = points.iter().map(|&p| key(p)).collect();
    let ends = |segment: usize| {
        let (from, to) = (keys[segment], keys[segment + 1]);
        if to < from { [to, from] } else { [from, to] }
    };
    let mut order: Vec<usize> = (0..points.len() - 1).collect();
    order.sort_unstable_by_key(|&segment| (ends(segment), segment));
    let mut firsts = Vec::with_capacity(points.len());
    let mut passages: Vec<Passage> = Vec::with_capacity(points.len());
    for (index, &segment) in order.iter().enumerate() {
        let first = match firsts.last() {
            Some(&first) if ends(order[first]) == ends(segment) => order[first],
            _ => {
                firsts.push(index);
                segment
            }
        };
        passages.push(Passage { segment, backwards: keys[first] != keys[segment] });
    }
    firsts.push(passages.len());
    (firsts, passages)
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
