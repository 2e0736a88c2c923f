//! A toolpath: vectors in the order in which they are marked, without time.

use crate::recipe::Pen;
use kurbo::{BezPath, Point};

/// Marks in order; what lies between the end of one and the start of the next is a jump.
#[derive(Clone, Debug, Default)]
pub struct Toolpath {
    /// Pens that marks refer to by index.
    pub pens: Vec<Pen>,
    /// Marks in the order and direction in which they are made.
    pub marks: Vec<Mark>,
}

/// One stroke of the beam with the laser on.
#[derive(Clone, Debug)]
pub struct Mark {
    /// The exact curve, one subpath, from its start to its end, field mm.
    pub curve: BezPath,
    /// The same flattened: two points or more, neighbours apart, field mm.
    pub points: Vec<Point>,
    /// Whether it ends where it starts.
    pub closed: bool,
    /// Index into [`Toolpath::pens`].
    pub pen_index: usize,
    /// The element it came from, for messages.
    pub source: String,
}

impl Mark {
    /// Where the mark starts.
    pub fn start(&self) -> Point {
        self.points[0]
    }

    /// Where the mark ends.
    pub fn end(&self) -> Point {
        self.points[self.points.len() - 1]
    }

    /// Length of the flattened curve, mm.
    pub fn length_mm(&self) -> f64 {
        self.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }
}

impl Toolpath {
    /// Length of all jumps between marks, mm, without the way to the first and from the last.
    pub fn jump_length_mm(&self) -> f64 {
        self.marks.windows(2).map(|pair| pair[0].end().distance(pair[1].start())).sum()
    }
}
