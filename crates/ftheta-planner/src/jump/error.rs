//! Why a jump cannot be planned.

use thiserror::Error;

/// Why a jump cannot be planned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum JumpError {
    /// A parameter is out of range.
    #[error("{quantity} {value} is outside {low} to {high}")]
    Parameter {
        /// Which parameter, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// The linear program has no solution to the demanded accuracy.
    #[error("the linear program of {n_ticks} ticks of {tick_us} µs ended as {status}")]
    Unsolved {
        /// Ticks of the jump.
        n_ticks: usize,
        /// Period, µs.
        tick_us: f64,
        /// What the solver says.
        status: String,
    },
    /// No servo is known that would hold the axis.
    #[error("the scanner's servo cannot be built, or has a memory that outlasts a jump")]
    NoServo,
    /// The step is longer than what the greatest allowed number of ticks reaches.
    #[error("a step of {step_rad} rad needs more than {limit} ticks of {tick_us} µs")]
    TooLong {
        /// The step, rad.
        step_rad: f64,
        /// Greatest number of ticks.
        limit: usize,
        /// Period, µs.
        tick_us: f64,
    },
}

impl JumpError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Parameter { quantity, value, low, high } => {
                ((*quantity).into(), value.to_string(), format!("{low} to {high}"))
            }
            Self::Unsolved { n_ticks, status, .. } => {
                (format!("jump of {n_ticks} ticks"), status.clone(), "a solution".into())
            }
            Self::NoServo => ("scanner.servo".into(), "unknown".into(), "state feedback".into()),
            Self::TooLong { step_rad, limit, .. } => {
                ("jump".into(), format!("{step_rad} rad"), format!("{limit} ticks"))
            }
        }
    }
}
