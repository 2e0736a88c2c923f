//! Dashed lines: the dashes become subpaths.

use kurbo::{Affine, BezPath, Point};

/// Dashes of one element that are made; finer patterns are marked as full lines.
const N_DASHES_MAX: f64 = 1_000_000.0;

/// Cuts `path` into dashes; `None` if there would be too many, or it is too large to measure.
///
/// * `dashes`: lengths of dashes and gaps in user units, not negative, their sum above zero
/// * `mm_per_unit`: greatest scale of the user units; lengths are measured to 1e-6 mm
pub fn dashed(path: &BezPath, dashes: &[f64], offset: f64, mm_per_unit: f64) -> Option<BezPath> {
    let path_mm = Affine::scale(mm_per_unit) * path;
    let dashes_mm: Vec<f64> = dashes.iter().map(|dash| dash * mm_per_unit).collect();
    let offset_mm = offset * mm_per_unit;
    let period_mm: f64 = dashes_mm.iter().sum();
    let n_dashes = polygon_length(&path_mm) / period_mm * dashes.len() as f64;
    let finite = offset_mm.is_finite() && period_mm.is_finite();
    if !(finite && n_dashes <= N_DASHES_MAX) {
        return None;
    }
    // Rounding could hinder progress; a dash has a start and an end, or the path's own elements.
    let n_elements_max = 2 * N_DASHES_MAX as usize + 2 * path.elements().len();
    let cut: BezPath =
        kurbo::dash(path_mm.iter(), offset_mm, &dashes_mm).take(n_elements_max).collect();
    let complete = cut.elements().len() < n_elements_max;
    complete.then(|| Affine::scale(1.0 / mm_per_unit) * cut)
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
