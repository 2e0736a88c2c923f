//! Arguments of `ftheta twin photograph`.

use super::{noise, number, pair, positive, within};
use clap::{Args, ValueEnum};
use ftheta::photograph::PowerRule;
use std::path::PathBuf;

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta twin photograph delay.json --machine S10-f160 --laser-on-us 85 --laser-off-us 60 \\
      --out delay.png
  ftheta twin photograph grid.json --machine S14-f420 --seed 7 --out grid.jpg

Lettering in a drawing beside the pattern (grid.svg beside grid.json) is burned too.")]
pub struct TwinPhotograph {
    /// The pattern's .json.
    #[arg(value_name = "PATTERN")]
    pub pattern: PathBuf,
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Machine as it really is, for its optics and the latencies of its laser; --machine if not
    /// given.
    #[arg(long, value_name = "NAME|FILE")]
    pub built_as: Option<String>,
    /// Seed of the head's hidden errors, the print, the camera and the noise.
    #[arg(long, value_name = "N", default_value = "1")]
    pub seed: u64,
    /// Head: from the seed, or none for a perfect one.
    #[arg(long, value_enum, default_value = "hidden")]
    pub head: HeadName,
    /// Correction table to mark through.
    #[arg(long, value_name = "TABLE")]
    pub table: Option<PathBuf>,
    /// How late light appears with the settings in the pattern, µs.
    #[arg(long, value_name = "T", default_value = "0", value_parser = lateness)]
    pub laser_on_us: f64,
    /// How late light ends, µs.
    #[arg(long, value_name = "T", default_value = "0", value_parser = lateness)]
    pub laser_off_us: f64,
    /// Peak dose of the fastest line over the material's threshold.
    #[arg(long, value_name = "D", default_value = "3", value_parser = dose)]
    pub dose: f64,
    /// How power goes with speed; if not given as the pattern says, or where it says nothing so
    /// that the dose is the same.
    #[arg(long, value_enum)]
    pub power: Option<PowerName>,
    /// By how much the dose of the fastest line is too large and that of the slowest too small,
    /// percent.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = slope)]
    pub dose_slope: f64,
    /// How far each line is off its place, µm rms.
    #[arg(long, value_name = "S", default_value = "1", value_parser = noise)]
    pub jitter_um: f64,
    /// 1/e² diameter of the spot, µm; the machine's if not given.
    #[arg(long, value_name = "D", value_parser = positive)]
    pub spot_um: Option<f64>,
    /// Peak dose at the start of a cross' arms, over that of the arm.
    #[arg(long, value_name = "K", default_value = "1", value_parser = share_of_many)]
    pub overburn: f64,
    /// Marks and lines that are missing, percent.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = percent)]
    pub missing: f64,
    /// The burned is brighter than the plate.
    #[arg(long)]
    pub bright: bool,
    /// By how much print is too large along x and y, percent; from the seed if not given.
    #[arg(long, value_name = "X,Y", value_parser = pair)]
    pub print_error: Option<[f64; 2]>,
    /// How far each printed sign is off on top of that, µm rms.
    #[arg(long, value_name = "S", default_value = "15", value_parser = noise)]
    pub print_noise_um: f64,
    /// Where the printed sheet lies in the field, mm.
    #[arg(long, value_name = "X,Y", default_value = "0,0", value_parser = pair)]
    pub sheet_mm: [f64; 2],
    /// How the printed sheet is turned, degrees.
    #[arg(long, value_name = "A", default_value = "0", value_parser = number)]
    pub sheet_deg: f64,
    /// Side of a pixel on the plate, µm; 20 where nothing is printed, else what shows the sheet.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub um_per_px: Option<f64>,
    /// Size of the picture; as large as needed where nothing is printed, else 12.
    #[arg(long, value_name = "N", value_parser = megapixels)]
    pub megapixels: Option<f64>,
    /// Tilt of the camera, degrees; 1 to 4 from the seed if not given.
    #[arg(long, value_name = "A", value_parser = tilt)]
    pub tilt_deg: Option<f64>,
    /// Turn of the camera, degrees.
    #[arg(long, value_name = "A", default_value = "0", value_parser = number)]
    pub turn_deg: f64,
    /// Take the picture through a mirror.
    #[arg(long)]
    pub mirror: bool,
    /// Distortion of the lens, over that of a phone; 0 is none.
    #[arg(long, value_name = "K", default_value = "1", value_parser = share_of_many)]
    pub distortion: f64,
    /// Blur, px rms.
    #[arg(long, value_name = "S", default_value = "0.8", value_parser = blur)]
    pub blur_px: f64,
    /// Noise of a white pixel, of full scale.
    #[arg(long, value_name = "S", default_value = "0.02", value_parser = noise_of_full)]
    pub noise: f64,
    /// Light on the sensor; from about 1.3 on it is too much.
    #[arg(long, value_name = "K", default_value = "1", value_parser = positive)]
    pub exposure: f64,
    /// Unevenness of the light, over that of a lamp beside the plate.
    #[arg(long, value_name = "K", default_value = "1", value_parser = share_of_many)]
    pub unevenness: f64,
    /// Light of a reflection on the plate; from about 1 on it hides what is there.
    #[arg(long, value_name = "K", default_value = "0", value_parser = share_of_many)]
    pub glare: f64,
    /// Unevenness of the material, over that of anodised aluminium.
    #[arg(long, value_name = "K", default_value = "1", value_parser = share_of_many)]
    pub texture: f64,
    /// Gamma of the picture's shades.
    #[arg(long, value_name = "G", default_value = "1", value_parser = gamma)]
    pub gamma: f64,
    /// Specks and fibres on the plate.
    #[arg(long, value_name = "N", default_value = "0",
          value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub dirt: u32,
    /// Quality of a JPEG, 1 to 100.
    #[arg(long, value_name = "Q", default_value = "92",
          value_parser = clap::value_parser!(u8).range(1..=100))]
    pub quality: u8,
    /// Picture to write: .png or .jpg.
    #[arg(long, value_name = "PNG|JPG")]
    pub out: PathBuf,
    /// File for the true places of everything in the picture.
    #[arg(long, value_name = "JSON")]
    pub truth: Option<PathBuf>,
}

/// The head on the twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HeadName {
    /// With errors drawn from the seed.
    Hidden,
    /// A perfect one.
    None,
}

/// How power goes with speed.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum PowerName {
    /// As the pattern's power ratios say.
    Stated,
    /// The same for all lines.
    Constant,
    /// In proportion to the speed.
    Proportional,
}

impl From<PowerName> for PowerRule {
    fn from(name: PowerName) -> Self {
        match name {
            PowerName::Stated => Self::Stated,
            PowerName::Constant => Self::Constant,
            PowerName::Proportional => Self::Proportional,
        }
    }
}

fn lateness(text: &str) -> Result<f64, String> {
    within(number(text)?, -5000.0..=5000.0)
}

fn dose(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.1..=1000.0)
}

fn slope(text: &str) -> Result<f64, String> {
    within(number(text)?, -90.0..=90.0)
}

fn percent(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=100.0)
}

fn share_of_many(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=20.0)
}

fn megapixels(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.01..=100.0)
}

fn tilt(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=60.0)
}

fn blur(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=50.0)
}

fn noise_of_full(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.0..=1.0)
}

fn gamma(text: &str) -> Result<f64, String> {
    within(number(text)?, 0.2..=5.0)
}
