//! File syntax of ftheta: SVG drawings, machine and recipe files, plan files.

pub mod atlas_file;
pub mod cache_key;
pub mod camera_file;
pub mod cor_file;
pub mod correction_file;
pub mod delays_file;
mod encoding;
pub mod grid_csv;
pub mod kept_file;
pub mod machine;
pub mod mechanism;
pub mod motion_law;
pub mod pattern_file;
pub mod picture_file;
pub mod plan_file;
pub mod points;
pub mod print_file;
pub mod recipe;
pub mod solved_file;
pub mod svg;
pub mod svg_write;
pub mod text;
pub mod text_table;
pub mod toml_table;
