//! Jumps at the physical limit: the longest step in a number of ticks, shortest times, the atlas.
//!
//! A jump is laser-off motion from rest to rest; only arrival counts. All programs here are
//! linear, so a sequence for the longest step serves every shorter one by scaling
//! (`design/control.md` B, D1).

mod atlas;
mod axis;
mod brake;
mod error;
mod exact;
mod fan;
mod held;
mod limit;
mod polish;
mod program;
mod transition;

pub use atlas::{ATLAS_VERSION, Atlas, AtlasOptions, Jump, Level, N_LEVELS};
pub(crate) use axis::check as check_axis;
pub use axis::{Axis, AxisOptions, CurrentBound, Model, Reach};
pub use error::JumpError;
pub use exact::{Passage, fewest_ticks_between, fewest_ticks_of_passages};
pub use fan::Ask;
pub(crate) use limit::guess_s;
pub use limit::{fewest_ticks, limit_s, settle_limit_s};
pub use transition::{Route, Transition, Transitions};
