//! The nouns of ftheta: job, machine, toolpath, plan, block and trace, with their units.
//!
//! Data and invariants only: no file, clock, thread or random number is touched here. Lengths are
//! mm, angles mechanical rad, times s or integer ns; public names carry the unit last.

pub mod block;
pub mod calibration;
pub mod dose;
pub mod flatten;
pub mod job;
pub mod machine;
pub mod pattern;
pub mod picture;
pub mod plan;
pub mod recipe;
pub mod space;
pub mod tag;
pub mod toolpath;
pub mod trace;
pub mod warning;
