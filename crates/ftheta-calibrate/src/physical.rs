//! The head's own physics, fitted with priors: mounting errors first, then a smooth residual for
//! what no mounting error explains.
//!
//! Unknowns are the errors of mounting, each with the spread that a workshop leaves, and Chebyshev
//! coefficients of the residual. All data weigh in at once, so nine marks are not too few and ten
//! thousand not too many. How smooth the residual is and how noisy the marks are is itself taken
//! from the data, by the evidence.
//!
//! Source: `design/optics.md` B.6, with the noise level and single wrong marks found by evidence as
//! well.

mod evidence;
mod fit;
mod linearised;
mod parameters;
mod residual;

pub use fit::{Noise, Physical, fit};
pub use parameters::Estimate;
