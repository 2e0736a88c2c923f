//! Printing that does not mind a reader who has gone: `ftheta machine list | head -1`.

use std::fmt::Arguments;
use std::io::Write;

/// A line on stdout.
pub fn result(line: Arguments<'_>) {
    // A closed pipe is the reader's choice and no fault of the command.
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A line on stderr.
pub fn message(line: Arguments<'_>) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints a line of the result.
macro_rules! say {
    ($($part:tt)*) => { $crate::screen::result(format_args!($($part)*)) };
}

/// Prints a line beside the result.
macro_rules! note {
    ($($part:tt)*) => { $crate::screen::message(format_args!($($part)*)) };
}

pub(crate) use {note, say};
