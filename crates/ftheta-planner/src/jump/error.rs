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
