//! What the beam did against what was asked: figures, picture and report.

pub mod plate;
pub mod score;

mod contour;
mod coverage;
mod histogram;
mod lettering;
mod line_dose;
mod tally;
mod track;
