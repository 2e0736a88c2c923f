//! The project's own chores: ci, tidy, test, figures.

mod licence;
mod tidy;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

const HELP: &str = "\
cargo xtask COMMAND
  ci       everything that CI runs: format, clippy, tidy, licences, docs, test
  test     all tests, the examples and the main job
  tidy     layers, sizes, descriptions, words
  figures  the benches, printed as a table, calibrations, pictures, and a million transitions";

fn main() -> ExitCode {
    let command = std::env::args().nth(1).unwrap_or_default();
    let result = match command.as_str() {
        "ci" => ci(),
        "test" => test(),
        "tidy" => tidy::check(&root()),
        "figures" => figures(),
        _ => Err(HELP.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn ci() -> Result<(), String> {
    cargo(&["fmt", "--all", "--check"])?;
    step("tidy", || tidy::check(&root()))?;
    step("licences", || licence::check(&root()))?;
    // The profile of the tests, so that dependencies are compiled once.
    cargo(&["clippy", "--release", "--workspace", "--all-targets", "--", "-D", "warnings"])?;
    cargo(&["doc", "--release", "--workspace", "--no-deps", "--document-private-items"])?;
    test()
}

fn figures() -> Result<(), String> {
    cargo(&["bench", "--workspace"])?;
    let heads = ["--example", "04_calibration_figures", "20"];
    cargo(&[&["run", "--release", "--package", "ftheta"], &heads[..]].concat())?;
    let pictures = ["--example", "06_picture_figures", "50"];
    cargo(&[&["run", "--release", "--package", "ftheta"], &pictures[..]].concat())?;
    cargo(&["run", "--release", "--package", "ftheta-planner", "--example", "transitions"])
}

fn test() -> Result<(), String> {
    cargo(&["test", "--release", "--workspace", "--all-targets"])?;
    cargo(&["test", "--release", "--workspace", "--doc"])?;
    for example in ["01_mark_svg", "03_patent_loop", "05_two_photographs"] {
        cargo(&["run", "--release", "--package", "ftheta", "--example", example])?;
    }
    let out = root().join("target/xtask-mark");
    let out = out.to_string_lossy();
    cargo(&["run", "--release", "--", "mark", "gallery/panel.svg", "--out", &out])
}

/// The folder of the workspace.
fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().map_or_else(|| package.to_owned(), Path::to_owned)
}

fn cargo(arguments: &[&str]) -> Result<(), String> {
    step(&format!("cargo {}", arguments.join(" ")), || {
        let mut command = Command::new(env!("CARGO"));
        command.args(arguments).current_dir(root());
        if arguments[0] == "doc" {
            command.env("RUSTDOCFLAGS", "-D warnings");
        }
        match command.status() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(format!("cargo {} failed: {status}", arguments.join(" "))),
            Err(error) => Err(format!("cannot run cargo: {error}")),
        }
    })
}

fn step(name: &str, run: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
    eprintln!("xtask: {name}");
    let started = Instant::now();
    run()?;
    eprintln!("xtask: {name}: done in {:.1} s", started.elapsed().as_secs_f64());
    Ok(())
}
