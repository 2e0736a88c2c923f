//! Letters as curves: outlines of a font, or single strokes.

pub mod hershey;
pub mod outline;
pub mod system;

use kurbo::BezPath;

/// A line of text, set.
#[derive(Clone, Debug, Default)]
pub struct Lettering {
    /// Letters from left to right.
    pub letters: Vec<Letter>,
    /// Characters without a letter; nothing is marked for them.
    pub missing: Vec<char>,
    /// Characters that another stands for, such as a letter without its accent.
    pub replaced: Vec<char>,
}

/// One letter, in units of the font size (em), y up, the baseline's start at the origin.
#[derive(Clone, Debug)]
pub struct Letter {
    /// Where its character starts in the text, bytes.
    pub text_index: usize,
    /// Its curves, em.
    pub path: BezPath,
    /// From its start to the next letter's, em.
    pub advance_em: f64,
}
