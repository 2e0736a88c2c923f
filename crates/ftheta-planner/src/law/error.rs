//! Why a law gives no motion.

use crate::jump::JumpError;
use thiserror::Error;

/// Why a law gives no motion.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LawError {
    /// No law of this name.
    #[error("unknown law \"{name}\", known are {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// The parameter behind a law's colon is not one of its.
    #[error("\"{parameter}\" is no parameter of law {law}, {expected}")]
    LawParameter {
        /// The law.
        law: String,
        /// What stood behind the colon.
        parameter: String,
        /// What can.
        expected: &'static str,
    },
    /// A number is out of range.
    #[error("{law}: {quantity} {value} is outside {low} to {high}")]
    Parameter {
        /// The law.
        law: String,
        /// Which number, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// The law cannot start or end at speed.
    #[error("{law} moves from rest to rest, not from {from_rad_s} to {to_rad_s} rad/s")]
    RestOnly {
        /// The law.
        law: String,
        /// Speed at the start, rad/s.
        from_rad_s: f64,
        /// Speed at the end, rad/s.
        to_rad_s: f64,
    },
    /// The angles leave no room to stop and turn.
    #[error(
        "no motion of up to 2000 ticks takes the step of {step_rad} rad about the centre between \
         these speeds within ±{angle_max_rad} rad"
    )]
    NoRoom {
        /// The step, rad.
        step_rad: f64,
        /// Greatest angle, either sign, rad.
        angle_max_rad: f64,
    },
    /// More periods than are allowed would be needed.
    #[error("{law}: a step of {step_rad} rad needs more than {limit} periods of {period_us} µs")]
    TooLong {
        /// The law.
        law: String,
        /// The step, rad.
        step_rad: f64,
        /// Greatest number of periods.
        limit: u32,
        /// Period, µs.
        period_us: f64,
    },
    /// A linear program failed or was asked too much.
    #[error(transparent)]
    Jump(#[from] JumpError),
}
