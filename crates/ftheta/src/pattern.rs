//! Patterns to calibrate or judge a head by, each with the nominal places of its features.

pub mod delay;
pub mod error;
pub mod fiducials;
pub mod grid;
pub mod ilda;
pub mod sheet;
pub mod square;
