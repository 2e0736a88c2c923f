//! Elliptical arcs as cubic curves.

use kurbo::{Arc, BezPath, Point, SvgArc, Vec2};

/// Greatest distance of a cubic from its arc, mm; far below the laser spot and any mirror's step.
const TOLERANCE_MM: f64 = 1e-6;
/// Keeps the number of cubics per turn near 100 for circles of any size.
const RELATIVE_TOLERANCE: f64 = 1e-12;

/// Appends an arc as SVG paths describe it; the path's current point is its start.
///
/// * `mm_per_unit`: greatest scale of the user units, sets the accuracy
pub fn append_svg_arc(path: &mut BezPath, arc: &SvgArc, mm_per_unit: f64) {
    // kurbo takes radii below 1e-5 for a line; in mm that is far below any mark.
    let scaled = SvgArc {
        from: scale(arc.from, mm_per_unit),
        to: scale(arc.to, mm_per_unit),
        radii: arc.radii * mm_per_unit,
        ..*arc
    };
    match Arc::from_svg_arc(&scaled) {
        Some(found) if is_finite(&found) => {
            append(path, &found, 1.0 / mm_per_unit);
            set_last_point(path, arc.to);
        }
        _ => path.line_to(arc.to),
    }
}

/// Appends an arc in user units; the path's current point is its start.
pub fn append_arc(path: &mut BezPath, arc: Arc, mm_per_unit: f64) {
    let scaled =
        Arc { center: scale(arc.center, mm_per_unit), radii: arc.radii * mm_per_unit, ..arc };
    append(path, &scaled, 1.0 / mm_per_unit);
}

/// Makes the path end exactly where the drawing says, whatever the arc's sines were rounded to.
pub fn set_last_point(path: &mut BezPath, end: Point) {
    if let Some(kurbo::PathEl::CurveTo(_, _, last)) = path.elements_mut().last_mut() {
        *last = end;
    }
}

fn append(path: &mut BezPath, arc_mm: &Arc, units_per_mm: f64) {
    let radius_mm = arc_mm.radii.x.max(arc_mm.radii.y);
    let tolerance_mm = TOLERANCE_MM.max(RELATIVE_TOLERANCE * radius_mm);
    arc_mm.to_cubic_beziers(tolerance_mm, |p1, p2, p3| {
        path.curve_to(scale(p1, units_per_mm), scale(p2, units_per_mm), scale(p3, units_per_mm));
    });
}

fn scale(point: Point, factor: f64) -> Point {
    (point.to_vec2() * factor).to_point()
}

fn is_finite(arc: &Arc) -> bool {
    let finite = |vector: Vec2| vector.x.is_finite() && vector.y.is_finite();
    finite(arc.center.to_vec2())
        && finite(arc.radii)
        && arc.start_angle.is_finite()
        && arc.sweep_angle.is_finite()
}
