//! What the beam did against what was asked: figures, picture and report.
