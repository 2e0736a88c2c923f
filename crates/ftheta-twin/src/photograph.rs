//! What a camera sees of a plate that the twin has burned.
//!
//! The plate is never a map of pixels: every pixel of the picture asks the burned segments
//! themselves how much of it is over the material's threshold. It shares the camera's geometry
//! with those who measure pictures, and nothing else.

mod burn;
mod camera;
mod grain;
mod print;
mod render;
mod sensor;

pub use burn::{Burn, Burner, Run, Segment};
pub use camera::{Camera, CameraOptions};
pub use print::{Print, Printer};
pub use render::{Look, Scene};
pub use sensor::{Sensor, expose};
