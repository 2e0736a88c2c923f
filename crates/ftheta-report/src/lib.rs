//! What the beam did against what was asked: figures, picture and report.

pub mod calibration_report;
pub mod delay_report;
pub mod jump_report;
pub mod pattern_report;
pub mod picture_view;
pub mod plate;
pub mod report;
pub mod score;

mod axes_view;
mod bars;
mod cards;
mod chart;
pub mod comparison;
mod contour;
mod coverage;
mod field_frame;
mod field_view;
mod histogram;
mod lettering;
mod light_view;
mod line_dose;
mod plot;
mod progress;
mod scatter;
mod segment_tree;
mod tally;
mod text;
mod track;
