//! Arguments of `ftheta calibrate` and `ftheta twin`.

use super::calibrate_delay::CalibrateDelay;
use super::photograph::TwinPhotograph;
use super::{noise, positive};
use clap::{Args, Subcommand, ValueEnum};
use ftheta::calibrate::calibrate::Model;
use ftheta::physics::grid_map::Interpolation;
use std::path::PathBuf;

#[derive(Args)]
pub struct Calibrate {
    #[command(subcommand)]
    pub action: CalibrateAction,
}

#[derive(Subcommand)]
pub enum CalibrateAction {
    /// A correction table from measured marks.
    Field(CalibrateField),
    /// The laser's delays from a picture of the delay pattern.
    Delay(CalibrateDelay),
    /// Follow what has moved since a table was made, by gain and offset from a few marks.
    Drift(CalibrateDrift),
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta calibrate field --machine S14-f420 --points grid.csv --out table.txt
  ftheta calibrate field --machine S14-f420 --points grid.csv --model polynomial --out table.cor

The points are target_x_mm,target_y_mm,measured_x_mm,measured_y_mm[,round]. calibration.html,
written beside the table, shows what was found and what to do next.")]
pub struct CalibrateField {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Table of measured marks.
    #[arg(long, value_name = "CSV")]
    pub points: PathBuf,
    /// What the error of the field is described by.
    #[arg(long, value_enum, default_value = "auto")]
    pub model: ModelName,
    /// Noise of each measured coordinate, µm rms; estimated if not given.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub noise_um: Option<f64>,
    /// What each round was marked through, in order: nominal, linear, or a table. Without it the
    /// first round is nominal, and each later one went through the table that the rounds before
    /// it give.
    #[arg(long, value_name = "nominal|linear|TABLE", value_delimiter = ',')]
    pub marked_through: Vec<String>,
    /// Units of the controller by mm, for points given as its commands.
    #[arg(long, value_name = "K", value_parser = positive)]
    pub units_per_mm: Option<f64>,
    /// Nodes of the table along each side.
    #[arg(long, value_enum, default_value = "65")]
    pub grid: GridSize,
    /// How the table is read between its nodes.
    #[arg(long, value_enum, default_value = "catmull-rom")]
    pub interpolation: InterpolationName,
    /// Table to write: .txt, .cor (EZCAD) or .csv (grid of offsets).
    #[arg(long, value_name = "TABLE")]
    pub out: PathBuf,
}

#[derive(Args)]
#[command(after_help = "\
Example:
  ftheta calibrate drift --machine S14-f420 --table table.txt --points four.csv --out new.txt

The marks are made through the table; four near the field's corners do.")]
pub struct CalibrateDrift {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// The table they were marked through.
    #[arg(long, value_name = "TABLE")]
    pub table: PathBuf,
    /// Table of measured marks.
    #[arg(long, value_name = "CSV")]
    pub points: PathBuf,
    /// Table to write.
    #[arg(long, value_name = "TABLE")]
    pub out: PathBuf,
}

#[derive(Args)]
pub struct Twin {
    #[command(subcommand)]
    pub action: TwinAction,
}

#[derive(Subcommand)]
pub enum TwinAction {
    /// Mark a pattern on a twin whose head has hidden errors, and measure it there.
    Measure(TwinMeasure),
    /// Burn a pattern on such a twin, and take a photograph of it.
    Photograph(Box<TwinPhotograph>),
}

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta twin measure --machine S14-f420 --pattern grid.json --noise-um 10 --seed 7 --out grid.csv
  ftheta twin measure --machine S14-f420 --pattern grid.json --seed 7 --table table.txt --round 2 \\
      --out round-2.csv")]
pub struct TwinMeasure {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// The pattern's .json.
    #[arg(long, value_name = "JSON")]
    pub pattern: PathBuf,
    /// Noise of each measured coordinate, µm rms.
    #[arg(long, value_name = "S", default_value = "10", value_parser = noise)]
    pub noise_um: f64,
    /// Seed of the head's hidden errors and of the noise.
    #[arg(long, value_name = "N", default_value = "1")]
    pub seed: u64,
    /// Machine whose optics the head was built with, where --machine does not know them all.
    #[arg(long, value_name = "NAME|FILE")]
    pub built_as: Option<String>,
    /// Correction table to mark through.
    #[arg(long, value_name = "TABLE")]
    pub table: Option<PathBuf>,
    /// Round of measurement, written into the table of marks.
    #[arg(long, value_name = "R", default_value = "1",
          value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub round: u32,
    /// Folder for what has been solved, kept for the next run; the system's cache if not given.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Table of marks to write.
    #[arg(long, value_name = "CSV")]
    pub out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum ModelName {
    /// The physical model from nine marks on, unless the marks speak against it.
    Auto,
    /// The head's mounting errors with priors, and a smooth residual.
    Physical,
    /// A polynomial, its degree chosen by leaving marks out.
    Polynomial,
    /// Cubic splines over 4 × 4 zones.
    Zones,
    /// Scale and pincushion, then nine points.
    NinePoint,
    /// Scale and pincushion of each axis.
    Scale,
}

impl From<ModelName> for Option<Model> {
    fn from(name: ModelName) -> Self {
        match name {
            ModelName::Auto => None,
            ModelName::Physical => Some(Model::Physical),
            ModelName::Polynomial => Some(Model::Polynomial),
            ModelName::Zones => Some(Model::Zones),
            ModelName::NinePoint => Some(Model::NinePoint),
            ModelName::Scale => Some(Model::Scale),
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub enum GridSize {
    /// 65 × 65 nodes.
    #[value(name = "65")]
    Coarse,
    /// 129 × 129 nodes.
    #[value(name = "129")]
    Fine,
}

impl GridSize {
    /// Nodes along a side.
    pub fn n_nodes(self) -> usize {
        match self {
            Self::Coarse => 65,
            Self::Fine => 129,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub enum InterpolationName {
    /// From sixteen nodes.
    CatmullRom,
    /// From four nodes.
    Bilinear,
}

impl From<InterpolationName> for Interpolation {
    fn from(name: InterpolationName) -> Self {
        match name {
            InterpolationName::CatmullRom => Self::CatmullRom,
            InterpolationName::Bilinear => Self::Bilinear,
        }
    }
}
