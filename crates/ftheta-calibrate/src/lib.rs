//! From measured marks to a model of the head, its expected accuracy, and a correction table.
//!
//! [`calibrate::calibrate`] is the entry: marks in, a [`calibrate::Calibration`] out, which says
//! what it found and makes tables.

pub mod accuracy;
pub mod axes;
pub mod calibrate;
pub mod delay;
pub mod error;
mod levenberg;
pub mod mark;
mod physical;
pub mod picture;
mod raster;
pub mod sanity;
mod surface;
pub mod table;
