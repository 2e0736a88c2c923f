//! The spaces a position can be in, as types that do not mix.

/// A place in the working field, mm, y up, origin on the optical axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldPoint {
    /// mm, moved mostly by the X mirror.
    pub x_mm: f64,
    /// mm, moved mostly by the Y mirror.
    pub y_mm: f64,
}

/// Mechanical mirror angles, rad; the beam turns by twice as much.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MirrorAngles {
    /// Mechanical angle of the mirror that moves x, rad.
    pub x_rad: f64,
    /// Mechanical angle of the mirror that moves y, rad.
    pub y_rad: f64,
}

/// Signed output words, one per axis; zero is the optical axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DacCodes {
    /// Word of the mirror that moves x.
    pub x: i32,
    /// Word of the mirror that moves y.
    pub y: i32,
}

impl FieldPoint {
    /// A place from its two coordinates in mm.
    pub const fn new(x_mm: f64, y_mm: f64) -> Self {
        Self { x_mm, y_mm }
    }
}

impl From<kurbo::Point> for FieldPoint {
    fn from(point: kurbo::Point) -> Self {
        Self::new(point.x, point.y)
    }
}

impl From<FieldPoint> for kurbo::Point {
    fn from(point: FieldPoint) -> Self {
        Self::new(point.x_mm, point.y_mm)
    }
}

impl MirrorAngles {
    /// A mirror position from its two mechanical angles in rad.
    pub const fn new(x_rad: f64, y_rad: f64) -> Self {
        Self { x_rad, y_rad }
    }
}
