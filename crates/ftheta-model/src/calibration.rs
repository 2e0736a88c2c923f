//! What is measured to calibrate a head: where marks should be, and where they are.

use crate::space::FieldPoint;

/// A mark that was asked for at one place and measured at another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Where it should be, mm.
    pub target_mm: FieldPoint,
    /// Where it was found, mm.
    pub measured_mm: FieldPoint,
    /// Round of calibration that it was marked in, from 1.
    pub round: u32,
    /// Line of the file it was read from, from 1.
    pub line: u32,
}

/// A mark that was commanded in the units of a controller, and measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandedPoint {
    /// Commands of x and y, signed, zero in the field's centre, in the controller's units.
    pub command_units: [f64; 2],
    /// Where it was found, mm.
    pub measured_mm: FieldPoint,
    /// Round of calibration that it was marked in, from 1.
    pub round: u32,
    /// Line of the file it was read from, from 1.
    pub line: u32,
}

impl CommandedPoint {
    /// The same mark with the target that its command stands for.
    ///
    /// * `units_per_mm`: the controller's scale, above 0
    pub fn measured(&self, units_per_mm: f64) -> MeasuredPoint {
        let [x, y] = self.command_units.map(|units| units / units_per_mm);
        MeasuredPoint {
            target_mm: FieldPoint::new(x, y),
            measured_mm: self.measured_mm,
            round: self.round,
            line: self.line,
        }
    }
}
