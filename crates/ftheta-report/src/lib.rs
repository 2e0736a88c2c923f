//! What the beam did against what was asked: figures, picture and report.

pub mod score;

mod contour;
mod coverage;
mod histogram;
mod line_dose;
mod tally;
mod track;
