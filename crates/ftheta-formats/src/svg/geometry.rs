//! Basic shapes and paths as curves in user units.

use super::arc::{append_arc, set_last_point};
use super::drawing::{Node, plain_attribute};
use super::length::{self, Direction, LengthBase};
use super::path_data;
use kurbo::{Arc, BezPath, Point, Vec2};
use std::f64::consts::{FRAC_PI_2, TAU};
use svgtypes::NumberListParser;

/// An element's curves, and what could not be read of them.
#[derive(Debug, Default)]
pub struct Geometry {
    /// Curves in user units.
    pub path: BezPath,
    /// Whether the element can be filled.
    pub area: bool,
    /// What was left out or changed, one sentence.
    pub fault: Option<String>,
    /// Whether path data was cut at the greatest number of elements.
    pub cut: bool,
}

/// What the geometry of an element depends on, apart from its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// What relative lengths refer to.
    pub base: LengthBase,
    /// Greatest scale of the user units, sets the accuracy of arcs.
    pub mm_per_unit: f64,
    /// Path elements that may still be made.
    pub n_elements_max: usize,
}

/// The geometry of a shape element; `None` for other elements.
pub fn of(node: Node<'_>, tag: &str, scale: &Scale) -> Option<Geometry> {
    let mut lengths = Lengths { node, base: scale.base, fault: None };
    let mut geometry = match tag {
        "path" => path(node, scale),
        "rect" => rect(&mut lengths, scale.mm_per_unit),
        "circle" => {
            let r = lengths.size("r", Direction::Any);
            ellipse(&mut lengths, Vec2::new(r, r), scale.mm_per_unit)
        }
        "ellipse" => {
            let rx = lengths.optional_size("rx", Direction::X);
            let ry = lengths.optional_size("ry", Direction::Y);
            let radii = Vec2::new(rx.or(ry).unwrap_or(0.0), ry.or(rx).unwrap_or(0.0));
            ellipse(&mut lengths, radii, scale.mm_per_unit)
        }
        "line" => line(&mut lengths),
        "polyline" => polyline(node, scale, false),
        "polygon" => polyline(node, scale, true),
        _ => return None,
    };
    geometry.fault = geometry.fault.or(lengths.fault);
    Some(geometry)
}

/// Reads an element's lengths and remembers the first fault.
pub struct Lengths<'a> {
    /// The element.
    pub node: Node<'a>,
    /// What relative lengths refer to.
    pub base: LengthBase,
    /// What was wrong, if anything was.
    pub fault: Option<String>,
}

impl Lengths<'_> {
    /// A length in user units, zero if it is not there.
    pub fn get(&mut self, name: &str, direction: Direction) -> f64 {
        self.optional(name, direction).unwrap_or(0.0)
    }

    /// A length in user units.
    pub fn optional(&mut self, name: &str, direction: Direction) -> Option<f64> {
        let text = plain_attribute(self.node, name).filter(|text| *text != "auto")?;
        match length::parse(text) {
            Some((length, unit_known)) => {
                if !unit_known {
                    self.note(format!("unknown unit in {name}=\"{text}\", taken as px"));
                }
                Some(self.base.user_units(length, direction))
            }
            None => {
                self.note(format!("{name}=\"{text}\" is no length, taken as 0"));
                Some(0.0)
            }
        }
    }

    fn size(&mut self, name: &str, direction: Direction) -> f64 {
        self.optional_size(name, direction).unwrap_or(0.0)
    }

    fn optional_size(&mut self, name: &str, direction: Direction) -> Option<f64> {
        let size = self.optional(name, direction)?;
        if size < 0.0 {
            self.note(format!("{name} is negative, so it is left out"));
        }
        Some(size)
    }

    fn note(&mut self, fault: String) {
        self.fault.get_or_insert(fault);
    }
}

fn path(node: Node<'_>, scale: &Scale) -> Geometry {
    let text = plain_attribute(node, "d").unwrap_or("");
    if text == "none" {
        return Geometry::default();
    }
    let data = path_data::parse(text, scale.mm_per_unit, scale.n_elements_max);
    Geometry {
        path: data.path,
        area: true,
        fault: data.error.map(|error| format!("bad path data, kept up to the error: {error}")),
        cut: data.cut,
    }
}

fn line(lengths: &mut Lengths<'_>) -> Geometry {
    let mut end =
        |x: &str, y: &str| Point::new(lengths.get(x, Direction::X), lengths.get(y, Direction::Y));
    let mut path = BezPath::new();
    path.move_to(end("x1", "y1"));
    path.line_to(end("x2", "y2"));
    Geometry { path, ..Geometry::default() }
}

fn polyline(node: Node<'_>, scale: &Scale, closed: bool) -> Geometry {
    let text = plain_attribute(node, "points").unwrap_or("");
    let mut geometry = Geometry { area: true, ..Geometry::default() };
    let path = &mut geometry.path;
    let mut numbers = NumberListParser::from(text);
    while let Some(x) = numbers.next() {
        let (Ok(x), Some(Ok(y))) = (x, numbers.next()) else {
            geometry.fault = Some("bad points, kept up to the error".into());
            break;
        };
        if path.elements().is_empty() {
            path.move_to((x, y));
        } else {
            path.line_to((x, y));
        }
        if scale.n_elements_max < path.elements().len() {
            geometry.cut = true;
            break;
        }
    }
    if path.elements().len() < 2 {
        path.truncate(0);
    } else if closed {
        path.close_path();
    }
    geometry
}

fn ellipse(lengths: &mut Lengths<'_>, radii: Vec2, mm_per_unit: f64) -> Geometry {
    let center = Point::new(lengths.get("cx", Direction::X), lengths.get("cy", Direction::Y));
    let mut path = BezPath::new();
    if 0.0 < radii.x && 0.0 < radii.y {
        let start = center + Vec2::new(radii.x, 0.0);
        path.move_to(start);
        append_arc(&mut path, Arc::new(center, radii, 0.0, TAU, 0.0), mm_per_unit);
        set_last_point(&mut path, start);
        path.close_path();
    }
    Geometry { path, area: true, ..Geometry::default() }
}

fn rect(lengths: &mut Lengths<'_>, mm_per_unit: f64) -> Geometry {
    let x = lengths.get("x", Direction::X);
    let y = lengths.get("y", Direction::Y);
    let width = lengths.size("width", Direction::X);
    let height = lengths.size("height", Direction::Y);
    let rx = lengths.optional("rx", Direction::X).filter(|r| 0.0 <= *r);
    let ry = lengths.optional("ry", Direction::Y).filter(|r| 0.0 <= *r);
    let radii = Vec2::new(
        rx.or(ry).unwrap_or(0.0).min(0.5 * width),
        ry.or(rx).unwrap_or(0.0).min(0.5 * height),
    );
    let mut path = BezPath::new();
    if 0.0 < width && 0.0 < height {
        let corners = [
            Point::new(x, y),
            Point::new(x + width, y),
            Point::new(x + width, y + height),
            Point::new(x, y + height),
        ];
        if 0.0 < radii.x && 0.0 < radii.y {
            rounded(&mut path, corners, radii, mm_per_unit);
        } else {
            path.move_to(corners[0]);
            corners[1..].iter().for_each(|corner| path.line_to(*corner));
            path.close_path();
        }
    }
    Geometry { path, area: true, ..Geometry::default() }
}

/// A rectangle with quarter ellipses as corners, in the order and direction that SVG states.
fn rounded(path: &mut BezPath, corners: [Point; 4], radii: Vec2, mm_per_unit: f64) {
    // From each corner, the way along its edge in to where the straight part begins.
    let along = [
        Vec2::new(radii.x, 0.0),
        Vec2::new(0.0, radii.y),
        Vec2::new(-radii.x, 0.0),
        Vec2::new(0.0, -radii.y),
    ];
    path.move_to(corners[0] + along[0]);
    for index in 1..=4 {
        let corner = corners[index % 4];
        let (arriving, leaving) = (along[index - 1], along[index % 4]);
        path.line_to(corner - arriving);
        let start_angle = FRAC_PI_2 * (index as f64 - 2.0);
        let center = corner - arriving + leaving;
        append_arc(path, Arc::new(center, radii, start_angle, FRAC_PI_2, 0.0), mm_per_unit);
        set_last_point(path, corner + leaving);
    }
    path.close_path();
}
