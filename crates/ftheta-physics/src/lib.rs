//! Pure mathematics of a galvo machine: motors, servo, optics, laser, and the audit of a plan.
//!
//! Functions of their arguments only. SI units and rad inside kernels; mm in the field.

pub mod along;
pub mod audit;
pub mod axis_loop;
pub mod camera;
pub mod correction;
pub mod envelope;
pub mod focus;
pub mod follow;
pub mod galvo;
pub mod grid_map;
pub mod head;
pub mod lossy;
pub mod map_table;
pub mod mechanism;
pub mod modal;
pub mod optics;
pub mod plan;
pub mod servo;
