//! The commands: each reads its arguments, calls the library, prints.

pub mod calibrate;
pub mod calibrate_camera;
pub mod calibrate_delay;
pub mod circle;
pub mod convert;
pub mod field;
pub mod field_picture;
pub mod jump;
pub mod machine;
pub mod mark;
pub mod mechanism;
pub mod pattern;
pub mod photograph;
pub mod verify;

use crate::arguments::Arguments;
use crate::screen::say;
use clap::CommandFactory;
use clap_complete::Shell;

/// Prints the completion script of a shell.
pub fn completions(shell: Shell) {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "ftheta", &mut script);
    say!("{}", String::from_utf8_lossy(&script).trim_end());
}
