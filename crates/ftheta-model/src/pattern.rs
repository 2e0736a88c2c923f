//! A pattern to calibrate or judge a head by: where every feature of it should be.

use crate::space::FieldPoint;

/// A pattern as it was asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// `grid`, `square`, `ilda`, `delay`, `circle`.
    pub kind: String,
    /// Side of the field that it fills, mm.
    pub field_mm: f64,
    /// Its features, in the order in which they are marked.
    pub features: Vec<Feature>,
    /// Name of the machine that it was made for; `None` if it is not stated.
    pub machine: Option<String>,
    /// Delays that it is marked with; `None` if they are not stated.
    pub laser: Option<LaserDelays>,
}

/// Delay settings of the laser's edges; later is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LaserDelays {
    /// Of the edge that switches on, µs.
    pub on_us: f64,
    /// Of the edge that switches off, µs.
    pub off_us: f64,
}

/// A part of a pattern that can be found in what was marked.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its name, one of its own in the pattern.
    pub id: String,
    /// What it is and where.
    pub shape: FeatureShape,
}

/// What a feature is.
#[derive(Clone, Debug, PartialEq)]
pub enum FeatureShape {
    /// A line, from where the beam should switch on to where it should switch off.
    Line {
        /// The first end, mm.
        from_mm: FieldPoint,
        /// The other end, mm.
        to_mm: FieldPoint,
        /// How it is marked.
        process: LineProcess,
    },
    /// A circle.
    Circle {
        /// Its centre, mm.
        centre_mm: FieldPoint,
        /// Its radius, mm.
        radius_mm: f64,
        /// How it is marked.
        process: LineProcess,
    },
    /// A cross or dot of a grid.
    Mark(GridMark),
    /// A sign that is told from others by a code.
    Fiducial {
        /// The kind of sign.
        family: String,
        /// Which of them.
        code: String,
        /// Its centre, mm.
        place_mm: FieldPoint,
        /// Its side, mm.
        size_mm: f64,
        /// Whether the beam makes it.
        burned: bool,
    },
    /// A line of known length.
    Reference {
        /// One end, mm.
        from_mm: FieldPoint,
        /// The other end, mm.
        to_mm: FieldPoint,
        /// Whether the beam makes it.
        burned: bool,
    },
}

/// How a line is marked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineProcess {
    /// Speed of the beam, mm/s.
    pub speed_mm_s: f64,
    /// Power over the pattern's power.
    pub power_ratio: f64,
}

/// A mark of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridMark {
    /// Cross or dot.
    pub style: MarkStyle,
    /// Its centre, mm.
    pub place_mm: FieldPoint,
    /// From tip to tip of a cross, or diameter of a dot, mm.
    pub size_mm: f64,
    /// Row, from 0 at the smallest y.
    pub row: u32,
    /// Column, from 0 at the smallest x.
    pub column: u32,
}

/// What a mark of a grid looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkStyle {
    /// Two lines along x and y.
    Cross,
    /// A filled disc.
    Dot,
}

impl Pattern {
    /// The marks of its grid.
    pub fn marks(&self) -> impl Iterator<Item = (&str, &GridMark)> {
        self.features.iter().filter_map(|feature| match &feature.shape {
            FeatureShape::Mark(mark) => Some((feature.id.as_str(), mark)),
            _ => None,
        })
    }
}
