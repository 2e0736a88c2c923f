//! A digital twin of a galvo machine: blocks in, the beam that they make out.
//!
//! It sees only what a device would see, and has parameters of its own.

mod beam;
mod draw;
mod exposure;
pub mod hidden_head;
mod lens;
mod light;
pub mod mismatch;
pub mod open_loop;
pub mod photograph;
mod pulses;
pub mod twin;
