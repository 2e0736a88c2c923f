//! Arguments of `ftheta calibrate delay`.

use super::pattern::DelayMethod;
use clap::{Args, ValueEnum};
use ftheta::calibrate::delay::Method;
use ftheta::delay_calibration::Apply;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta calibrate delay --image photo.jpg --pattern delay.json
  ftheta calibrate delay --image photo.jpg --pattern delay.json --machine mine.toml --out new.toml

Take the picture square on and sharp, 20 to 40 µm a pixel, with light that leaves the plate below
white. calibration.html, written beside the machine file or the picture, shows what was found.")]
pub struct CalibrateDelay {
    /// Picture of the marked pattern, PNG, JPEG or TIFF.
    #[arg(long, value_name = "PICTURE", required_unless_present = "camera")]
    pub image: Option<PathBuf>,
    /// Take the picture with a camera of this computer, as /dev/video0.
    #[arg(long, value_name = "DEVICE", conflicts_with = "image")]
    pub camera: Option<String>,
    /// The pattern's .json.
    #[arg(long, value_name = "JSON")]
    pub pattern: PathBuf,
    /// Lines at several speeds, or the rectangle; as the pattern is if not given.
    #[arg(long, value_enum)]
    pub method: Option<DelayMethod>,
    /// Preset or machine file that the pattern was marked with; the pattern's if not given.
    #[arg(long, value_name = "NAME|FILE")]
    pub machine: Option<String>,
    /// What the delays are put down to.
    #[arg(long, value_enum, default_value = "laser")]
    pub apply: ApplyName,
    /// Machine file to write, with the new timing.
    #[arg(long, value_name = "TOML")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum ApplyName {
    /// The laser alone: both its latencies.
    Laser,
    /// The mirrors alone, by the mean of both; the difference stays.
    Mirrors,
    /// The mean to the mirrors, the difference to the laser.
    Both,
}

impl From<ApplyName> for Apply {
    fn from(name: ApplyName) -> Self {
        match name {
            ApplyName::Laser => Self::Laser,
            ApplyName::Mirrors => Self::Mirrors,
            ApplyName::Both => Self::Both,
        }
    }
}

impl From<DelayMethod> for Method {
    fn from(name: DelayMethod) -> Self {
        match name {
            DelayMethod::Comb => Self::Comb,
            DelayMethod::Rectangle => Self::Rectangle,
        }
    }
}
