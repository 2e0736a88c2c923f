//! Pixels: even light, pieces that hang together, profiles across lines.

pub mod flat;
pub mod pieces;
pub mod strip;
