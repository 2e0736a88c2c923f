//! What a reader noticed and went on from.

use std::fmt;

/// Something in the input that was ignored or changed, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The place: an element's id, a line, a key.
    pub place: String,
    /// What was done about it, one sentence without a full stop.
    pub message: String,
}

/// A value that was read, with what could not be kept of the input.
#[derive(Clone, Debug)]
pub struct Imported<T> {
    /// What was read.
    pub value: T,
    /// What was ignored or changed, in the order of the input.
    pub warnings: Vec<Warning>,
}

impl Warning {
    /// A warning about `place`.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: place.into(), message: message.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}
