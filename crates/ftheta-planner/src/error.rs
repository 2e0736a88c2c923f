//! Why a toolpath cannot be planned.

use crate::jump::JumpError;
use ftheta_physics::audit::AuditError;
use ftheta_physics::servo::ServoError;
use thiserror::Error;

/// Why a toolpath cannot be planned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PlanError {
    /// There is nothing to do.
    #[error("the toolpath has no marks")]
    Empty,
    /// A setting is out of range for this machine.
    #[error("{place}: {quantity} {value} {unit} is outside {low} to {high} {unit}")]
    Setting {
        /// Pen or recipe section.
        place: String,
        /// Which setting.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
        /// Unit of all three.
        unit: &'static str,
    },
    /// More samples than a plan can hold.
    #[error("{place}: a segment of {value} samples exceeds the limit {limit}")]
    TooLong {
        /// Mark or jump.
        place: String,
        /// Samples needed.
        value: f64,
        /// Greatest number.
        limit: u32,
    },
    /// Light of one mark would run into the next.
    #[error(
        "mark {mark} ({origin}): its laser-off edge comes {value_us:.1} µs after the on edge of the \
         next mark; a longer mark delay or a shorter laser-off delay is needed"
    )]
    EdgesOverlap {
        /// Index of the mark.
        mark: usize,
        /// Its source in the drawing.
        origin: String,
        /// Overlap, µs.
        value_us: f64,
    },
    /// The on edge of the first mark would come before the first sample, or off before on.
    #[error(
        "mark {mark} ({origin}): laser edges at {on_us:.1} and {off_us:.1} µs are out of order"
    )]
    EdgesReversed {
        /// Index of the mark.
        mark: usize,
        /// Its source in the drawing.
        origin: String,
        /// On edge, µs from the first sample.
        on_us: f64,
        /// Off edge, µs from the first sample.
        off_us: f64,
    },
    /// A place that the optics cannot reach, on the way of a mark.
    #[error("the optics cannot reach ({x_mm:.3}, {y_mm:.3}) mm")]
    Unreachable {
        /// Place, mm.
        x_mm: f64,
        /// Place, mm.
        y_mm: f64,
    },
    /// A place that the focusing lens cannot put the focus on.
    #[error(
        "{place}: ({x_mm:.3}, {y_mm:.3}) mm needs the focusing lens at {travel_mm:.3} mm, the limit \
         is ±{limit_mm} mm"
    )]
    Focus {
        /// Mark.
        place: String,
        /// Place, mm.
        x_mm: f64,
        /// Place, mm.
        y_mm: f64,
        /// Travel of the lens, mm.
        travel_mm: f64,
        /// Greatest travel, mm.
        limit_mm: f64,
    },
    /// Motion that the angles leave no room for.
    #[error("{place}: the mirrors' angles leave no room to come to it at its speed")]
    NoRoom {
        /// Mark.
        place: String,
    },
    /// No voltage moves the mirror.
    #[error("the scanner's parameters leave a mirror that no voltage moves")]
    Immovable,
    /// The jump atlas cannot be built.
    #[error(transparent)]
    Jump(#[from] JumpError),
    /// The nominal servo cannot be built.
    #[error(transparent)]
    Servo(#[from] ServoError),
    /// The finished plan did not pass.
    #[error(transparent)]
    Audit(#[from] AuditError),
}

impl PlanError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Empty => ("toolpath".into(), "0 marks".into(), "1 mark".into()),
            Self::Setting { place, quantity, value, low, high, unit } => (
                format!("{place}: {quantity}"),
                format!("{value} {unit}"),
                format!("{low} to {high} {unit}"),
            ),
            Self::TooLong { place, value, limit } => {
                (place.clone(), value.to_string(), limit.to_string())
            }
            Self::EdgesOverlap { mark, origin, value_us } => {
                (format!("mark {mark} ({origin})"), format!("{value_us} µs"), "0 µs".into())
            }
            Self::EdgesReversed { mark, origin, on_us, off_us } => (
                format!("mark {mark} ({origin})"),
                format!("on {on_us} µs, off {off_us} µs"),
                "0 <= on <= off".into(),
            ),
            Self::Unreachable { x_mm, y_mm } => {
                ("optics".into(), format!("({x_mm:.3}, {y_mm:.3}) mm"), "the lens".into())
            }
            Self::Focus { place, travel_mm, limit_mm, .. } => (
                format!("{place}: focusing lens"),
                format!("{travel_mm:.3} mm"),
                format!("±{limit_mm} mm"),
            ),
            Self::NoRoom { place } => (place.clone(), "no motion".into(), "mirror angle".into()),
            Self::Immovable => ("scanner".into(), "immovable".into(), "movable".into()),
            Self::Jump(error) => error.fault(),
            Self::Servo(error) => error.fault(),
            Self::Audit(error) => error.fault(),
        }
    }
}
