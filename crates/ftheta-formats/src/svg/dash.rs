//! Dashed lines: the dashes become subpaths.

use kurbo::{Affine, BezPath, Point};

/// Dashes of one element that are made; finer patterns are marked as full lines.
const N_DASHES_MAX: f64 = 1_000_000.0;

/// Cuts `path` into dashes; `None` if there would be too many.
///
/// * `dashes`: lengths of dashes and gaps in user units, not negative, their sum above zero
/// * `mm_per_unit`: greatest scale of the user units; lengths are measured to 1e-6 mm
pub fn dashed(path: &BezPath, dashes: &[f64], offset: f64, mm_per_unit: f64) -> Option<BezPath> {
    let period_mm = dashes.iter().sum::<f64>() * mm_per_unit;
    let n_dashes = polygon_length(path) * mm_per_unit / period_mm * dashes.len() as f64;
    if !(n_dashes <= N_DASHES_MAX && offset.is_finite()) {
        return None;
    }
    let dashes_mm: Vec<f64> = dashes.iter().map(|dash| dash * mm_per_unit).collect();
    let path_mm = Affine::scale(mm_per_unit) * path;
    let cut: BezPath = kurbo::dash(path_mm.iter(), offset * mm_per_unit, &dashes_mm).collect();
    Some(Affine::scale(1.0 / mm_per_unit) * cut)
}

/// Length of the polygon of all points, an upper bound of the path's.
fn polygon_length(path: &BezPath) -> f64 {
    let mut start = Point::ORIGIN;
    let mut current = Point::ORIGIN;
    let mut length = 0.0;
    for element in path.elements() {
        let points: &[Point] = match element {
            kurbo::PathEl::MoveTo(p) => {
                start = *p;
                current = *p;
                &[]
            }
            kurbo::PathEl::LineTo(p) => &[*p],
            kurbo::PathEl::QuadTo(p1, p2) => &[*p1, *p2],
            kurbo::PathEl::CurveTo(p1, p2, p3) => &[*p1, *p2, *p3],
            kurbo::PathEl::ClosePath => &[start],
        };
        for point in points {
            length += current.distance(*point);
            current = *point;
        }
    }
    length
}
