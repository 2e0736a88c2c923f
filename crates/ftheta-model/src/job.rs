//! A job: shapes with pens, in field mm, without time.

use crate::recipe::Pen;
use kurbo::BezPath;

/// What is to be marked: layers of shapes, each shape with a pen.
#[derive(Clone, Debug, Default)]
pub struct Job {
    /// The pens that shapes refer to by index; marked in this order.
    pub pens: Vec<Pen>,
    /// Layers in the order of the drawing.
    pub layers: Vec<Layer>,
    /// Size of the page, mm; its centre lies on the field centre.
    pub page_mm: [f64; 2],
}

/// Shapes that belong together in the drawing.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    /// The drawing's own name for it; empty where it has none.
    pub name: String,
    /// Shapes in the order of the drawing.
    pub shapes: Vec<Shape>,
}

/// One curve or area of the drawing.
#[derive(Clone, Debug)]
pub struct Shape {
    /// The element it came from, for messages: `#id`, or `<tag> on line N`.
    pub source: String,
    /// Exact curves in field mm, y up. May hold several subpaths.
    pub path: BezPath,
    /// Marked along its curves, or filled.
    pub paint: Paint,
    /// Index into [`Job::pens`].
    pub pen_index: usize,
}

/// How a shape is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paint {
    /// Along the curve.
    Stroke,
    /// The inside, by the pen's hatch; every subpath is taken as closed.
    Fill(FillRule),
}

/// Which side of self-crossing curves is inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillRule {
    /// Winding number not zero.
    NonZero,
    /// Winding number odd.
    EvenOdd,
}

impl Job {
    /// All shapes of all layers, in the order of the drawing.
    pub fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.layers.iter().flat_map(|layer| &layer.shapes)
    }
}
