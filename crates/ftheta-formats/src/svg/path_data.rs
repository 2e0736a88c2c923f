//! Path data, the `d` attribute, as curves.

use super::arc::append_svg_arc;
use kurbo::{BezPath, PathEl, Point, SvgArc, Vec2};
use svgtypes::{PathParser, PathSegment};

/// A path and how much of its data could be read.
#[derive(Debug, Default)]
pub struct PathData {
    /// The path up to the first error, as SVG wants it.
    pub path: BezPath,
    /// What is wrong and where, if anything is.
    pub error: Option<String>,
    /// Whether it was cut at the greatest number of elements.
    pub cut: bool,
}

/// Reads path data.
///
/// * `mm_per_unit`: greatest scale of the user units, sets the accuracy of arcs
/// * `n_elements_max`: reading stops beyond this many
pub fn parse(text: &str, mm_per_unit: f64, n_elements_max: usize) -> PathData {
    let mut pen = Pen {
        path: BezPath::new(),
        start: Point::ORIGIN,
        current: Point::ORIGIN,
        control: Point::ORIGIN,
        last: Last::Other,
        needs_move: true,
        mm_per_unit,
    };
    let mut data = PathData::default();
    for segment in PathParser::from(text) {
        match segment {
            Ok(segment) => pen.take(segment),
            Err(error) => {
                data.error = Some(error.to_string());
                break;
            }
        }
        if n_elements_max < pen.path.elements().len() {
            data.cut = true;
            break;
        }
    }
    data.path = pen.path;
    data
}

/// What the last segment was, for the control points of smooth curves.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Last {
    Cubic,
    Quadratic,
    Other,
}

struct Pen {
    path: BezPath,
    start: Point,
    current: Point,
    control: Point,
    last: Last,
    /// A move is written only before something is drawn, so none is left over.
    needs_move: bool,
    mm_per_unit: f64,
}

impl Pen {
    fn take(&mut self, segment: PathSegment) {
        let origin = if segment.is_abs() { Vec2::ZERO } else { self.current.to_vec2() };
        let at = |x: f64, y: f64| Point::new(x, y) + origin;
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                self.current = at(x, y);
                self.start = self.current;
                self.needs_move = true;
                self.last = Last::Other;
            }
            PathSegment::ClosePath { .. } => self.close(),
            PathSegment::LineTo { x, y, .. } => self.line_to(at(x, y)),
            PathSegment::HorizontalLineTo { x, .. } => {
                self.line_to(Point::new(x + origin.x, self.current.y));
            }
            PathSegment::VerticalLineTo { y, .. } => {
                self.line_to(Point::new(self.current.x, y + origin.y));
            }
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => {
                self.cubic_to(at(x1, y1), at(x2, y2), at(x, y));
            }
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
                let first = self.reflected_control(Last::Cubic);
                self.cubic_to(first, at(x2, y2), at(x, y));
            }
            PathSegment::Quadratic { x1, y1, x, y, .. } => {
                self.quadratic_to(at(x1, y1), at(x, y));
            }
            PathSegment::SmoothQuadratic { x, y, .. } => {
                let control = self.reflected_control(Last::Quadratic);
                self.quadratic_to(control, at(x, y));
            }
            PathSegment::EllipticalArc {
                rx, ry, x_axis_rotation, large_arc, sweep, x, y, ..
            } => self.arc_to(SvgArc {
                from: self.current,
                to: at(x, y),
                radii: Vec2::new(rx, ry),
                x_rotation: x_axis_rotation.to_radians(),
                large_arc,
                sweep,
            }),
        }
    }

    fn begin(&mut self) {
        if self.needs_move {
            self.path.move_to(self.current);
            self.needs_move = false;
        }
    }

    fn line_to(&mut self, end: Point) {
        self.begin();
        self.path.line_to(end);
        self.current = end;
        self.last = Last::Other;
    }

    fn cubic_to(&mut self, first: Point, second: Point, end: Point) {
        self.begin();
        self.path.curve_to(first, second, end);
        self.current = end;
        self.control = second;
        self.last = Last::Cubic;
    }

    fn quadratic_to(&mut self, control: Point, end: Point) {
        self.begin();
        self.path.quad_to(control, end);
        self.current = end;
        self.control = control;
        self.last = Last::Quadratic;
    }

    fn arc_to(&mut self, arc: SvgArc) {
        if arc.from != arc.to {
            self.begin();
            append_svg_arc(&mut self.path, &arc, self.mm_per_unit);
        }
        self.current = arc.to;
        self.last = Last::Other;
    }

    fn close(&mut self) {
        if !self.needs_move && !matches!(self.path.elements().last(), Some(PathEl::MoveTo(_))) {
            self.path.close_path();
        }
        self.current = self.start;
        self.needs_move = true;
        self.last = Last::Other;
    }

    fn reflected_control(&self, same: Last) -> Point {
        if self.last == same { self.current + (self.current - self.control) } else { self.current }
    }
}
