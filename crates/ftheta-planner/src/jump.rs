//! Jumps at the physical limit: the longest step in a number of ticks, shortest times, the atlas.
//!
//! A jump is laser-off motion from rest to rest; only arrival counts. All programs here are
//! linear, so a sequence for the longest step serves every shorter one by scaling
//! (`design/control.md` B, D1).

mod atlas;
mod axis;
mod error;
mod limit;
mod polish;
mod program;

pub use atlas::{Atlas, AtlasOptions, Jump};
pub use axis::{Axis, AxisOptions, CurrentBound, Model, Reach};
pub use error::JumpError;
pub(crate) use limit::guess_s;
pub use limit::{fewest_ticks, limit_s, settle_limit_s};
