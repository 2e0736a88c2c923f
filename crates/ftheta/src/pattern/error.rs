//! Why a pattern cannot be made.

use thiserror::Error;

/// Why a pattern cannot be made.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PatternError {
    /// Larger than the machine's field.
    #[error(
        "a field of {field_mm} mm with marks of {size_mm} mm reaches over {reach_mm} mm, the \
         machine's field is {limit_mm} mm"
    )]
    Field {
        /// Side of the pattern's field, mm.
        field_mm: f64,
        /// Size of the marks on its border, mm.
        size_mm: f64,
        /// Side that both need, mm.
        reach_mm: f64,
        /// Side of the machine's field, mm.
        limit_mm: f64,
    },
    /// A delay pattern that reaches beyond the machine's field.
    #[error(
        "the pattern is {reach_mm:.1} mm wide or high, the machine's field is {limit_mm} mm: take \
         fewer or slower lines, or less room"
    )]
    DelayField {
        /// Its longer side, mm.
        reach_mm: f64,
        /// Side of the machine's field, mm.
        limit_mm: f64,
    },
    /// A sheet larger than paper.
    #[error(
        "the sheet would be {reach_mm:.0} mm wide, the largest paper is {limit_mm:.0} mm: take a \
         smaller --field"
    )]
    Paper {
        /// Its side, mm.
        reach_mm: f64,
        /// Shorter side of the paper, mm.
        limit_mm: f64,
    },
    /// An option out of its range.
    #[error("{option} is {value} {unit}, expected {} to {}", limits[0], limits[1])]
    Option {
        /// Which.
        option: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Its range.
        limits: [f64; 2],
    },
    /// Marks that come too near to each other.
    #[error(
        "marks of {size_mm} mm are too large, {limit_mm} mm is the limit with {pitch_mm} mm between centres"
    )]
    Size {
        /// Size of a mark, mm.
        size_mm: f64,
        /// Distance of neighbouring centres, mm.
        pitch_mm: f64,
        /// Greatest size, mm.
        limit_mm: f64,
    },
    /// Marks smaller than the beam can draw.
    #[error(
        "marks of {size_mm} mm are too small for a spot of {spot_mm} mm, {limit_mm} mm is the limit"
    )]
    TooSmall {
        /// Size of a mark, mm.
        size_mm: f64,
        /// Diameter of the spot, mm.
        spot_mm: f64,
        /// Smallest size, mm.
        limit_mm: f64,
    },
    /// No room for labels.
    #[error(
        "{n_side} x {n_side} marks on {field_mm} mm leave room for labels of {letter_mm:.3} mm, \
         {limit_mm:.3} mm is the limit"
    )]
    Points {
        /// Marks along a side.
        n_side: u32,
        /// Side of the pattern's field, mm.
        field_mm: f64,
        /// Size of the letters that fit, mm.
        letter_mm: f64,
        /// Smallest size of a letter that can be read, mm.
        limit_mm: f64,
    },
    /// Not a grid with a mark in its centre.
    #[error("{n_side} marks along a side, expected an odd number from 3 to 65")]
    Side {
        /// What was asked for.
        n_side: u32,
    },
}

impl PatternError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let mm = |value: &f64| format!("{value} mm");
        match self {
            Self::Field { reach_mm, limit_mm, .. } => {
                ("--field".into(), mm(reach_mm), mm(limit_mm))
            }
            Self::Size { size_mm, limit_mm, .. } | Self::TooSmall { size_mm, limit_mm, .. } => {
                ("--size-mm".into(), mm(size_mm), mm(limit_mm))
            }
            Self::Points { letter_mm, limit_mm, .. } => {
                ("--points".into(), mm(letter_mm), mm(limit_mm))
            }
            Self::Paper { reach_mm, limit_mm } => ("--field".into(), mm(reach_mm), mm(limit_mm)),
            Self::DelayField { reach_mm, limit_mm } => ("field".into(), mm(reach_mm), mm(limit_mm)),
            Self::Option { option, value, unit, limits: [least, most] } => (
                (*option).into(),
                format!("{value} {unit}").trim().into(),
                format!("{least} to {most}"),
            ),
            Self::Side { n_side } => ("--points".into(), n_side.to_string(), "odd, 3 to 65".into()),
        }
    }
}
