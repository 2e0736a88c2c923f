//! The command line: one struct per command, help texts with an example each.

pub mod calibrate;
pub mod calibrate_delay;
pub mod field;
mod mismatch;
pub mod pattern;
pub mod photograph;

use calibrate::{Calibrate, Twin};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use field::Field;
use ftheta::jump::{Law, LawError};
use ftheta::model::plan::Planner;
use ftheta::planner::optimal::Corner;
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use mismatch::mismatch;
use pattern::Pattern;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Open software that moves laser beams with galvanometer mirrors.
#[derive(Parser)]
#[command(name = "ftheta", version, arg_required_else_help = true)]
#[command(after_help = "Example: ftheta mark panel.svg --machine S10 --out panel")]
pub struct Arguments {
    /// Print one JSON object on stdout and nothing else.
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Plan a drawing, mark it on the digital twin, and report what it did.
    Mark(Box<Mark>),
    /// Audit a plan file again: its id, its limits, its light.
    Verify(Verify),
    /// Show how fast a machine can jump, and how near each law comes to that on the twin.
    Jump(Jump),
    /// Mark one uniform turn of a circle or ellipse, or a spiral, on the twin, and measure how true
    /// it is.
    Circle(Circle),
    /// Write a pattern to judge a head by, and show on the twin what comes of it.
    Pattern(Pattern),
    /// Map places of the field to mirror angles, and back.
    Field(Field),
    /// Make a correction table from measured marks.
    Calibrate(Calibrate),
    /// Rehearse a calibration on a twin with hidden errors.
    Twin(Twin),
    /// Write a drawing as plain curves (.svg) or as the polylines that are marked (.csv), or a
    /// correction table as another kind of table.
    Convert(Convert),
    /// List, show and check machines.
    Machine(Machine),
    /// Print the completion script for a shell.
    #[command(after_help = "Example: ftheta completions bash > ~/.bash_completion.d/ftheta")]
    Completions {
        /// The shell.
        shell: Shell,
    },
}

#[derive(Args)]
#[command(allow_negative_numbers = true)] // so that their range is what is complained of
#[command(after_help = "\
Examples:
  ftheta mark panel.svg
  ftheta mark logo.svg --machine S14-f255 --fit 80 --speed 2000 --out logo
  ftheta mark text.svg --machine my-machine.toml --recipe steel.toml --mismatch f1=+0.03
  ftheta mark text.svg --speed 2000 --corner sky --against classic

A file NAME.recipe.toml beside NAME.svg is used unless --recipe names another.")]
pub struct Mark {
    /// Drawing: .svg or .svgz.
    pub input: PathBuf,
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Recipe file: pens, delays, text style.
    #[arg(long, value_name = "FILE")]
    pub recipe: Option<PathBuf>,
    /// Speed of all pens, mm/s, instead of the recipe's.
    #[arg(long, value_name = "MM_S", value_parser = positive)]
    pub speed: Option<f64>,
    /// How the motion is planned; without it the best that the machine's drive allows.
    #[arg(long, value_enum)]
    pub planner: Option<PlannerName>,

    /// How planned marks take corners; if not given what costs least at each, and as sky where the
    /// laser can only be on or off.
    #[arg(long, value_enum)]
    pub corner: Option<CornerName>,
    /// Plan the job as classic too, with tuned delays and with skywriting, and compare.
    #[arg(long, value_enum, value_name = "PLANNER")]
    pub against: Option<AgainstName>,
    /// Part of the voltage that planned motion keeps for the servo's feedback, 0 to 0.9.
    #[arg(long, value_name = "R", default_value = "0.12", value_parser = reserve)]
    pub reserve: f64,
    /// Folder for what has been solved and tuned, kept for the next run; the system's cache if not
    /// given.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Greatest distance of the beam from a mark, µm.
    #[arg(long, value_name = "N", default_value = "10", value_parser = positive)]
    pub tolerance_um: f64,
    /// Order of the marks: short jumps, or as drawn; what the recipe says, else shortest.
    #[arg(long, value_enum)]
    pub order: Option<OrderName>,
    /// Scale the page so that its longest side is this long, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub fit: Option<f64>,
    /// Mark what fits of shapes that leave the field.
    #[arg(long)]
    pub clip: bool,
    /// Look for the drawing's fonts on this computer instead of using the bundled one.
    #[arg(long)]
    pub system_fonts: bool,
    /// Seed of the twin's noise.
    #[arg(long, value_name = "N", default_value = "1")]
    pub seed: u64,
    /// Errors of the twin's plant that the planner does not know of: f1, kt relative, zeta
    /// absolute, as in f1=+0.03,kt=-0.02,zeta=0.0025; what laser (laser_on_us, laser_off_us) and
    /// focusing lens (lens_us) are late by.
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true,
          value_parser = mismatch, allow_hyphen_values = true)]
    pub mismatch: Mismatch,
    /// Noise of the twin's position sensors, µm rms in the field.
    #[arg(long, value_name = "S", default_value = "0", value_parser = noise)]
    pub noise_um: f64,
    /// Correction table of the head, as `ftheta calibrate field` writes it.
    #[arg(long, value_name = "TABLE")]
    pub table: Option<PathBuf>,
    /// Height of the work plane above the nominal one, towards the head, mm; the machine file's
    /// `plane_mm` if not given.
    #[arg(long, value_name = "Z", value_parser = height, allow_hyphen_values = true)]
    pub z_mm: Option<f64>,
    /// Mark on a twin whose head has hidden errors, drawn from this seed.
    #[arg(long, value_name = "SEED")]
    pub head: Option<u64>,
    /// Folder for report.html, mark.png and plan.ftheta; out/NAME if not given.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Args)]
#[command(after_help = "Example: ftheta verify out/panel/plan.ftheta")]
pub struct Verify {
    /// Plan file, as `ftheta mark` writes it.
    pub plan: PathBuf,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta jump --machine S10 --step-deg 0.1,1,5 --out jumps
  ftheta jump --machine S10 --step-deg 1 --law bisection:8 --from-rad-s 20 --to-rad-s -10
  ftheta jump --machine S14 --step-deg 1 --law robust --mismatch f1=-0.03 --reserve 0")]
pub struct Jump {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Steps, degrees mechanical.
    #[arg(long, value_name = "D[,D...]", required = true, value_delimiter = ',',
          value_parser = positive)]
    pub step_deg: Vec<f64>,
    /// Motion laws to compare, or all: optimal, robust, residual, zv, zvd, asymmetric, s-curve,
    /// quintic, cycloid, bisection, trapezoid, fixed-step. A parameter follows a colon:
    /// bisection:8 (segments), bisection:120:current (keeping the current's limit as well),
    /// s-curve:fastest, quintic:fastest, cycloid:fastest (short, however long it rings).
    #[arg(long, value_name = "NAME[,NAME...]|all", value_delimiter = ',', default_value = "all",
          value_parser = laws)]
    pub law: Vec<Laws>,
    /// Speed at the start, rad/s mechanical.
    #[arg(long, value_name = "V", default_value = "0", value_parser = number)]
    pub from_rad_s: f64,
    /// Speed at the end, rad/s mechanical.
    #[arg(long, value_name = "V", default_value = "0", value_parser = number)]
    pub to_rad_s: f64,
    /// The mirror has arrived when it stays this near to the target, degrees.
    #[arg(long, value_name = "E", default_value = "0.002", value_parser = positive)]
    pub tolerance_deg: f64,
    /// Part of the voltage kept for the servo's feedback, 0 to 0.9.
    #[arg(long, value_name = "R", default_value = "0.12", value_parser = reserve)]
    pub reserve: f64,
    /// Period of the voltage, µs, instead of the machine's.
    #[arg(long, value_name = "P", value_parser = period)]
    pub period_us: Option<f64>,
    /// Errors of the twin's plant that the law does not know of, as in f1=+0.03,kt=-0.02; also
    /// zeta, laser_on_us and laser_off_us.
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true,
          value_parser = mismatch, allow_hyphen_values = true)]
    pub mismatch: Mismatch,
    /// Folder for jump.html, the comparison in pictures.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Laws that one name stands for.
#[derive(Clone)]
pub struct Laws(pub Vec<Law>);

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta convert logo.svg logo-curves.svg --fit 80
  ftheta convert table.txt mine.cor --machine S14-f255
  ftheta convert mine.cor table.txt --machine S14-f255")]
pub struct Convert {
    /// Drawing: .svg or .svgz. Or a correction table: .txt (ours), .cor (EZCAD) or .csv (a grid of
    /// offsets).
    pub input: PathBuf,
    /// File to write: .svg or .csv for a drawing; .txt, .cor or .csv for a table.
    pub output: PathBuf,
    /// Machine of a table: preset (see `ftheta machine list`) or machine file.
    #[arg(long, value_name = "NAME|FILE")]
    pub machine: Option<String>,
    /// Write a .cor file in the older layout, version 1.
    #[arg(long)]
    pub cor_1: bool,
    /// Recipe file: text style, pens, hatch.
    #[arg(long, value_name = "FILE")]
    pub recipe: Option<PathBuf>,
    /// Scale the page so that its longest side is this long, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub fit: Option<f64>,
}

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta machine list
  ftheta machine show S14-f255 > my-machine.toml
  ftheta machine check my-machine.toml")]
pub struct Machine {
    #[command(subcommand)]
    pub action: MachineAction,
}

#[derive(Subcommand)]
pub enum MachineAction {
    /// List the presets.
    List,
    /// Print a machine file, to start one's own from.
    Show {
        /// Preset or machine file.
        machine: String,
    },
    /// Check a machine file and print what follows from it.
    Check {
        /// Preset or machine file.
        machine: String,
    },
    /// Find the modes of a mechanism by finite elements, and how far each turns the mirror.
    Mechanism(Mechanism),
}

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta machine mechanism gallery/s10-mechanism.toml --machine S10 --out mine.toml
  ftheta machine mechanism gallery/s10-mechanism.toml --law law.csv --response mirror.csv")]
pub struct Mechanism {
    /// Mechanism file: rotor, shaft, mount, mirror, bearings.
    pub file: PathBuf,
    /// Preset or machine file that gives what the mechanism does not say.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Machine file to write, with the mechanism's inertias and torsional mode.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Motion law that the rotor follows: lines of time_us,angle_deg after a line that says so.
    #[arg(long, value_name = "FILE")]
    pub law: Option<PathBuf>,
    /// File for what the mirror does meanwhile.
    #[arg(long, value_name = "FILE", requires = "law")]
    pub response: Option<PathBuf>,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta circle --radius-mm 0.5 --speed 2000 --machine S10-f160
  ftheta circle --radius-mm 2 --ellipse 2 --speed 3000 --out ellipse
  ftheta circle --radius-mm 0.5 --turns 20 --pitch-mm 0.05 --speed 2000")]
pub struct Circle {
    /// Radius, mm; of an ellipse the one along x, of a spiral the one at its start.
    #[arg(long, value_name = "R", value_parser = positive)]
    pub radius_mm: f64,
    /// Speed of the beam, mm/s.
    #[arg(long, value_name = "MM_S", value_parser = positive)]
    pub speed: f64,
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Radius along x over radius along y, 0.05 to 20.
    #[arg(long, value_name = "RATIO", default_value = "1", value_parser = ratio)]
    pub ellipse: f64,
    /// Turns of an Archimedean spiral, whole or not.
    #[arg(long, value_name = "N", value_parser = positive, requires = "pitch_mm",
          conflicts_with = "ellipse")]
    pub turns: Option<f64>,
    /// By how much the spiral's radius grows every turn, mm; below 0 it falls.
    #[arg(long, value_name = "P", requires = "turns", value_parser = number,
          allow_hyphen_values = true)]
    pub pitch_mm: Option<f64>,
    /// Its centre, mm.
    #[arg(long, value_name = "X,Y", default_value = "0,0", value_parser = pair)]
    pub centre_mm: [f64; 2],
    /// Part of the voltage that run-in and run-out keep for the servo's feedback, 0 to 0.9.
    #[arg(long, value_name = "R", default_value = "0.12", value_parser = reserve)]
    pub reserve: f64,
    /// Half of this is what a motor off the nominal one may be off after the run-in, µm.
    #[arg(long, value_name = "N", default_value = "10", value_parser = positive)]
    pub tolerance_um: f64,
    /// Errors of the twin's plant that the plan does not know of, as in f1=+0.03,kt=-0.02; also
    /// zeta, laser_on_us and laser_off_us.
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true,
          value_parser = mismatch, allow_hyphen_values = true)]
    pub mismatch: Mismatch,
    /// Folder for report.html, mark.png and plan.ftheta.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum PlannerName {
    /// Marks at constant dose, between them the fastest motion that motors and resonance allow.
    Optimal,
    /// What RTC- and EZCAD-type controllers do: constant speed and delays.
    Classic,
}

impl From<PlannerName> for Planner {
    fn from(name: PlannerName) -> Self {
        match name {
            PlannerName::Optimal => Self::Optimal,
            PlannerName::Classic => Self::Classic,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub enum AgainstName {
    /// The classic planner, its delays tuned to the tolerance.
    Classic,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum OrderName {
    /// Short jumps; marks may be reversed, inner contours come first.
    Shortest,
    /// The drawing's own order and directions.
    Keep,
}

impl From<OrderName> for Order {
    fn from(name: OrderName) -> Self {
        match name {
            OrderName::Shortest => Self::Shortest,
            OrderName::Keep => Self::Keep,
        }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|value| {
        if value > 0.0 { Ok(value) } else { Err(format!("{value} is not greater than 0")) }
    })
}

fn ratio(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.05..=20.0)
}

fn rate(text: &str) -> Result<f64, String> {
    within(number(text)?, 100.0..=1e6)
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let (x, y) = text.split_once(',').ok_or_else(|| format!("\"{text}\" is not two numbers"))?;
    Ok([number(x)?, number(y)?])
}

fn noise(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=1e4)
}

fn reserve(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=0.9)
}

fn period(text: &str) -> Result<f64, String> {
    within(number(text)?, 1.0..=100.0)
}

fn laws(text: &str) -> Result<Laws, String> {
    match text.trim() {
        "all" => Ok(Laws(Law::ALL.to_vec())),
        name => {
            name.parse().map(|law| Laws(vec![law])).map_err(|error: LawError| error.to_string())
        }
    }
}

fn within(value: f64, range: RangeInclusive<f64>) -> Result<f64, String> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(format!("{value} is outside {} to {}", range.start(), range.end()))
}

fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))?;
    if value.is_finite() { Ok(value) } else { Err(format!("{value} is not finite")) }
}

/// Height of a work plane, mm.
fn height(text: &str) -> Result<f64, String> {
    within(number(text)?, -1e4..=1e4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}

/// How corners are taken.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum CornerName {
    /// Stop in the corner; power follows the speed.
    Exact,
    /// Stay within the tolerance without a stop; power follows the speed.
    Blend,
    /// Run out, turn with the laser off, run in at mark speed.
    Sky,
}

impl From<CornerName> for Corner {
    fn from(name: CornerName) -> Self {
        match name {
            CornerName::Exact => Self::Exact,
            CornerName::Blend => Self::Blend,
            CornerName::Sky => Self::Sky,
        }
    }
}
