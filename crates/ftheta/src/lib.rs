//! Open software that moves laser beams with galvanometer mirrors.
//!
//! A drawing in, a marked field out: [`import::drawing`] reads a file as a job, [`mark::mark`]
//! lays, plans, audits and plays it on the digital twin, [`results::add`] writes what came of it.

pub mod against;
pub mod atlas_store;
pub mod camera;
pub mod camera_calibration;
pub mod circle;
pub mod convert;
pub mod delay_calibration;
pub mod error;
pub mod exchange;
pub mod field;
pub mod field_calibration;
pub mod field_picture;
pub mod focus_report;
pub mod import;
pub mod jump;
pub mod jump_results;
mod lit;
pub mod machines;
pub mod mark;
pub mod mechanism;
pub mod output;
pub mod pattern;
pub mod photograph;
mod planning;
pub mod promise;
pub mod rehearsal;
mod report_picture;
pub mod results;
pub mod tables;
pub mod verify;

pub use error::{Error, Fault};
pub use ftheta_calibrate as calibrate;
pub use ftheta_formats as formats;
pub use ftheta_model as model;
pub use ftheta_physics as physics;
pub use ftheta_planner as planner;
pub use ftheta_report as report;
pub use ftheta_toolpath as toolpath;
pub use ftheta_twin as twin;
