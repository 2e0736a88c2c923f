//! The ftheta command: a drawing in, a marked field out.

mod arguments;
mod command;
mod json;
mod progress;
mod screen;

use crate::screen::note;
use arguments::{Arguments, Command};
use clap::Parser;
use ftheta::Error;
use ftheta::toolpath::error::LayError;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let json = arguments.json;
    let result = match arguments.command {
        Command::Mark(mark) => command::mark::run(&mark, json),
        Command::Verify(verify) => command::verify::run(&verify, json),
        Command::Jump(jump) => command::jump::run(&jump, json),
        Command::Circle(circle) => command::circle::run(&circle, json),
        Command::Convert(convert) => command::convert::run(&convert, json),
        Command::Calibrate(calibrate) => command::calibrate::run(&calibrate, json),
        Command::Twin(twin) => command::calibrate::run_twin(&twin, json),
        Command::Field(field) => command::field::run(&field, json),
        Command::Pattern(pattern) => command::pattern::run(&pattern, json),
        Command::Machine(machine) => command::machine::run(&machine, json),
        Command::Completions { shell } => {
            command::completions(shell);
            Ok(())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let fault = error.fault();
            if json {
                json::print(&json::fault(&fault));
            } else {
                note!("error: {}", fault.message);
                if let Error::Lay(LayError::OutsideField { .. }) = error {
                    note!("hint: --clip marks what fits, --fit MM scales the page");
                }
            }
            ExitCode::FAILURE
        }
    }
}
