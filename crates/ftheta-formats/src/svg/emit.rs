//! From an element's curves to shapes with paint and pen.

use super::dash::dashed;
use super::drawing::Node;
use super::error::SvgError;
use super::geometry::Geometry;
use super::paint::Paint as StylePaint;
use super::walk::{Context, Reader};
use ftheta_model::job::{Paint, Shape};
use kurbo::{BezPath, PathEl, Point};

/// Coordinates beyond this are taken for a mistake, mm.
const COORDINATE_MAX_MM: f64 = 1e6;
/// Strokes wider than this are told of: only their centre line is marked, mm.
const WIDE_MM: f64 = 0.5;

/// Marks the curves of a shape element.
///
/// # Errors
/// If there are too many curves.
pub fn shape<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    geometry: Geometry,
    context: &Context<'a>,
) -> Result<(), SvgError> {
    let faulty = geometry.fault.is_some();
    reader.warn_of_fault(node, geometry.fault);
    if geometry.cut {
        return Err(too_many_curves(reader, node));
    }
    if geometry.path.is_empty() {
        reader.tally.n_dropped += 1;
        let may_be_empty = matches!(node.tag_name().name(), "path" | "polyline" | "polygon");
        if !faulty && !may_be_empty {
            let place = reader.drawing.place(node);
            reader.warnings.add(place, "its size is not above 0, left out");
        }
        return Ok(());
    }
    mark(reader, node, &geometry.path, geometry.area, context)
}

/// Marks curves with the fill and stroke of `context`, the fill first.
///
/// * `path`: curves in user units
/// * `area`: whether they can be filled
///
/// # Errors
/// If there are too many curves.
pub fn mark<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    path: &BezPath,
    area: bool,
    context: &Context<'a>,
) -> Result<(), SvgError> {
    let style = &context.style;
    let mut visible = false;
    let fill = if area && encloses(path) {
        color_of(reader, node, style.visible_fill(), context)
    } else {
        None
    };
    if let Some(color_rgb) = fill {
        visible = true;
        reader.tally.n_white_areas += usize::from(color_rgb == [255; 3]);
        let paint = (Paint::Fill(style.fill_rule), color_rgb);
        add(reader, node, path.clone(), paint, context)?;
    }
    if let Some(color_rgb) = color_of(reader, node, style.visible_stroke(), context) {
        visible = true;
        let line = with_dashes(reader, node, path, context);
        let width_mm = style.stroke_width * context.mm_per_unit();
        if WIDE_MM < width_mm {
            reader.tally.n_wide_strokes += 1;
            reader.tally.widest_stroke_mm = reader.tally.widest_stroke_mm.max(width_mm);
        }
        add(reader, node, line, (Paint::Stroke, color_rgb), context)?;
    }
    if !visible {
        reader.tally.n_invisible += 1;
    }
    Ok(())
}

fn color_of<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    paint: StylePaint<'a>,
    context: &Context<'a>,
) -> Option<[u8; 3]> {
    if context.transparent {
        return None;
    }
    let (color_rgb, message) = match paint {
        StylePaint::None => return None,
        StylePaint::Color(color_rgb) => return Some(color_rgb),
        StylePaint::Server { color_rgb, id } => {
            let [red, green, blue] = color_rgb;
            let color = format!("#{red:02x}{green:02x}{blue:02x}");
            (Some(color_rgb), format!("paint \"{id}\" is taken as the plain colour {color}"))
        }
        StylePaint::Missing(id) => {
            (None, format!("paint \"{id}\" is not in this file, taken as none"))
        }
    };
    reader.warnings.add(reader.drawing.place(node), message);
    color_rgb
}

fn with_dashes<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    path: &BezPath,
    context: &Context<'a>,
) -> BezPath {
    let style = &context.style;
    // What is out of reach is left out later on; its length cannot be measured.
    if style.dashes.is_empty() || !within_reach(&(context.field_from_user * path.clone())) {
        return path.clone();
    }
    let cut = dashed(path, &style.dashes, style.dash_offset, context.mm_per_unit());
    cut.unwrap_or_else(|| {
        let message = "more than a million dashes, marked as a full line";
        reader.warnings.add(reader.drawing.place(node), message);
        path.clone()
    })
}

fn add<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    mut path: BezPath,
    (paint, color_rgb): (Paint, [u8; 3]),
    context: &Context<'a>,
) -> Result<(), SvgError> {
    path.apply_affine(context.field_from_user);
    let bounds = path.control_box();
    let fault = if path.is_empty() || !within_reach(&path) {
        Some("coordinates beyond 1 km or not finite, left out")
    } else if bounds.width() == 0.0 && bounds.height() == 0.0 {
        Some("a single point without length, left out")
    } else {
        None
    };
    if let Some(fault) = fault {
        reader.tally.n_dropped += 1;
        reader.warnings.add(reader.drawing.place(node), fault);
        return Ok(());
    }
    reader.tally.n_path_elements += path.elements().len();
    if reader.limits.n_path_elements_max < reader.tally.n_path_elements {
        return Err(too_many_curves(reader, node));
    }
    let pen_index = reader.marking.pen_index(color_rgb, context.scope);
    let shape = Shape { source: reader.drawing.place(node), path, paint, pen_index };
    reader.marking.add(context.scope, shape);
    Ok(())
}

/// Whether all points of a path in field mm are finite and at places that make sense.
fn within_reach(path: &BezPath) -> bool {
    let bounds = path.control_box();
    let corners = [bounds.x0, bounds.y0, bounds.x1, bounds.y1];
    path.is_finite() && corners.into_iter().all(|value| value.abs() <= COORDINATE_MAX_MM)
}

/// Whether any subpath can have an inside. A plain line has none, though SVG fills it by default:
/// it would be marked twice.
fn encloses(path: &BezPath) -> bool {
    path.subpaths().any(|elements| {
        let curved = |element: &PathEl| matches!(element, PathEl::QuadTo(..) | PathEl::CurveTo(..));
        let mut points = elements.iter().filter_map(PathEl::end_point);
        let Some(first) = points.next() else {
            return false;
        };
        let second = points.find(|point| *point != first);
        elements.iter().any(curved)
            || second.is_some_and(|second| points.any(|third| off_line(first, second, third)))
    })
}

fn off_line(a: Point, b: Point, c: Point) -> bool {
    (b - a).cross(c - a) != 0.0
}

fn too_many_curves<'a>(reader: &Reader<'a, '_>, node: Node<'a>) -> SvgError {
    SvgError::TooMany {
        place: reader.drawing.place(node),
        what: "path elements",
        limit: reader.limits.n_path_elements_max,
    }
}
