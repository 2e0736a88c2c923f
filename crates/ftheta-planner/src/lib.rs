//! From vectors to mirror motion and laser edges on one tick grid, and to the words sent.
//!
//! Deterministic: the same toolpath and machine give the same plan, bit for bit.

mod builder;
pub mod circle;
pub mod classic;
mod convex;
pub mod corner;
mod error;
pub mod jump;
pub mod law;
pub mod optimal;
pub mod render;
pub mod solved;

pub use error::PlanError;
