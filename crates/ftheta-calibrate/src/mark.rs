//! A measured mark.

use ftheta_model::space::{FieldPoint, MirrorAngles};

/// Where a mark should be, what the mirrors were told, and where it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where it should be, mm.
    pub target: FieldPoint,
    /// Mechanical angles commanded, rad.
    pub command: MirrorAngles,
    /// Where it was measured, mm.
    pub measured: FieldPoint,
    /// Round of measurement, from 1.
    pub round: u32,
    /// Line of its file.
    pub line: u32,
}
