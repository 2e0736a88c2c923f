//! Which closed contours lie inside which.

use kurbo::{Point, Rect};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// For each contour those it lies in, without the ones that follow from another of them.
///
/// Told by three of a contour's points, so contours that cross are mostly not nested. Identical
/// ones are not nested either.
///
/// * `contours`: closed polygons, last point equal to the first, mm
pub fn parents(contours: &[&[Point]]) -> Vec<Vec<u32>> {
    let boxes: Vec<Rect> = contours.iter().map(|points| bounds(points)).collect();
    let areas: Vec<f64> = contours.iter().map(|points| area_mm2(points)).collect();
    let tree = RTree::bulk_load(
        boxes
            .iter()
            .enumerate()
            .map(|(i, b)| {
                let corners = Rectangle::from_corners([b.x0, b.y0], [b.x1, b.y1]);
                GeomWithData::new(corners, i)
            })
            .collect(),
    );
    let by_area = |a: &usize, b: &usize| areas[*a].total_cmp(&areas[*b]).then(a.cmp(b));
    let mut large_first: Vec<usize> = (0..contours.len()).collect();
    large_first.sort_by(|a, b| by_area(b, a));
    let mut slabs: Vec<Option<Slabs>> = contours.iter().map(|_| None).collect();
    let mut parents: Vec<Vec<u32>> = vec![Vec::new(); contours.len()];
    // For which inner contour an outer one was found to follow from another.
    let mut follows_for = vec![usize::MAX; contours.len()];
    for i in large_first {
        let b = boxes[i];
        let corner = AABB::from_corners([b.x0, b.y0], [b.x0, b.y0]);
        let mut around: Vec<usize> = tree
            .locate_in_envelope_intersecting(corner)
            .map(|found| found.data)
            .filter(|&outer| areas[outer] > areas[i] && holds(boxes[outer], b))
            .collect();
        around.sort_by(by_area);
        let n = contours[i].len();
        let probes = [0, n / 3, 2 * n / 3].map(|at| contours[i][at]);
        for outer in around {
            if follows_for[outer] == i {
                continue;
            }
            let slabs = slabs[outer].get_or_insert_with(|| Slabs::new(contours[outer]));
            if probes.iter().all(|&p| slabs.holds(contours[outer], p)) {
                parents[i].push(outer as u32);
                let mut above = vec![outer as u32];
                while let Some(next) = above.pop() {
                    let farther = parents[next as usize].iter().copied();
                    above.extend(farther.filter(|&f| follows_for[f as usize] != i));
                    follows_for[next as usize] = i;
                }
            }
        }
    }
    parents
}

/// Edges of a polygon by horizontal bands, so that a point meets few of them.
struct Slabs {
    y0: f64,
    height: f64,
    bands: Vec<Vec<u32>>,
}

impl Slabs {
    fn new(points: &[Point]) -> Self {
        let area = bounds(points);
        let total = area.height().max(f64::MIN_POSITIVE);
        let heights: f64 = points.windows(2).map(|e| (e[1].y - e[0].y).abs() / total).sum();
        // As many bands as keep the lists below four entries per edge.
        let n_edges = points.len() as f64;
        let n = (3.0 * n_edges / heights.max(1e-9)).clamp(1.0, n_edges) as usize;
        let mut slabs = Self { y0: area.y0, height: total / n as f64, bands: vec![Vec::new(); n] };
        for (i, edge) in points.windows(2).enumerate() {
            let lo = slabs.band(edge[0].y.min(edge[1].y));
            let hi = slabs.band(edge[0].y.max(edge[1].y));
            for band in &mut slabs.bands[lo..=hi] {
                band.push(i as u32);
            }
        }
        slabs
    }

    fn band(&self, y: f64) -> usize {
        // A negative quotient becomes 0 in the cast.
        (((y - self.y0) / self.height) as usize).min(self.bands.len() - 1)
    }

    /// Even-odd rule on a ray to the right.
    fn holds(&self, points: &[Point], p: Point) -> bool {
        let crossings = self.bands[self.band(p.y)].iter().filter(|&&i| {
            let (a, b) = (points[i as usize], points[i as usize + 1]);
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        });
        crossings.count() % 2 == 1
    }
}

fn bounds(points: &[Point]) -> Rect {
    points.iter().fold(Rect::from_points(points[0], points[0]), |r, &p| r.union_pt(p))
}

fn holds(outer: Rect, inner: Rect) -> bool {
    outer.x0 <= inner.x0 && outer.y0 <= inner.y0 && inner.x1 <= outer.x1 && inner.y1 <= outer.y1
}

fn area_mm2(points: &[Point]) -> f64 {
    let twice: f64 = points.windows(2).map(|e| (e[0] - points[0]).cross(e[1] - points[0])).sum();
    0.5 * twice.abs()
}
