//! From shapes to vectors in order: flatten, hatch, clip, and the shortest way round.
//!
//! Geometry only: nothing here knows time, mirrors or lasers. Lengths are mm, y is up, and the same
//! job and options give the same toolpath bit for bit.

pub mod error;
pub mod lay;

mod clip;
mod hatch;
mod improve;
mod nearest;
mod nest;
mod order;
mod subpath;
mod unit;
