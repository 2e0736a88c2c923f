//! What was ignored or changed, collected up to a limit.

use ftheta_model::warning::Warning;

/// Warnings that are kept; of the others only the number is told.
const N_WARNINGS_MAX: usize = 200;

/// Warnings in the order of the drawing.
#[derive(Debug, Default)]
pub struct Warnings {
    kept: Vec<Warning>,
    n_more: usize,
}

impl Warnings {
    /// Adds a warning, unless the same was given before.
    pub fn add(&mut self, place: impl Into<String>, message: impl Into<String>) {
        if self.kept.len() == N_WARNINGS_MAX {
            self.n_more += 1;
            return;
        }
        let warning = Warning::new(place, message);
        // An element that is used many times is reported once.
        if !self.kept.contains(&warning) {
            self.kept.push(warning);
        }
    }

    /// All warnings; the last one tells how many more there were.
    pub fn into_vec(mut self) -> Vec<Warning> {
        if self.n_more != 0 {
            let message = format!("and {} more warnings", self.n_more);
            self.kept.push(Warning::new("<svg>", message));
        }
        self.kept
    }
}
