//! Arguments of `ftheta calibrate` and `ftheta twin`.

use super::calibrate_delay::CalibrateDelay;
use super::photograph::TwinPhotograph;
use super::{noise, number, positive};
use clap::{Args, Subcommand, ValueEnum};
use ftheta::calibrate::calibrate::Model;
use ftheta::calibrate::picture::Placement;
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
    Field(Box<CalibrateField>),
    /// The laser's delays from a picture of the delay pattern.
    Delay(CalibrateDelay),
    /// A camera's lens from pictures of a printed sheet.
    Camera(CalibrateCamera),
    /// Follow what has moved since a table was made, by gain and offset from a few marks.
    Drift(CalibrateDrift),
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta calibrate field --machine S14-f420 --points grid.csv --out table.txt
  ftheta calibrate field --machine S14-f420 --points grid.csv --model polynomial --out table.cor
  ftheta calibrate field --machine S14-f420 --image photo.jpg --pattern grid.json \\
      --sheet-x-mm 270.6 --sheet-y-mm 269.3 --out table.txt
  ftheta calibrate field --machine F.toml --points high.csv --z-mm 20 --onto a.txt --out b.txt

The points are target_x_mm,target_y_mm,measured_x_mm,measured_y_mm[,round]. calibration.html,
written beside the table, shows what was found and what to do next.")]
pub struct CalibrateField {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Table of measured marks; with --image, of the rounds before.
    #[arg(long, value_name = "CSV", required_unless_present_any = ["image", "camera"])]
    pub points: Option<PathBuf>,
    #[command(flatten)]
    pub picture: PictureArguments,
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
    /// Height of the plane that the marks lie in above the nominal one, towards the head, mm; the
    /// plane joins those of --onto. Rounds without --marked-through count as marked nominally.
    #[arg(long, value_name = "Z", requires = "onto", value_parser = number)]
    pub z_mm: Option<f64>,
    /// Table that gets the plane of --z-mm, instead of its own of this height if it has one.
    #[arg(long, value_name = "TABLE", requires = "z_mm")]
    pub onto: Option<PathBuf>,
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

/// Pictures of a marked grid.
#[derive(Args)]
pub struct PictureArguments {
    /// Picture of the marked grid, PNG, JPEG or TIFF; several of the same plate are averaged.
    #[arg(long, value_name = "PICTURE", requires = "pattern")]
    pub image: Vec<PathBuf>,
    /// Take the picture with a camera of this computer, as /dev/video0.
    #[arg(long, value_name = "DEVICE", conflicts_with = "image", requires = "pattern")]
    pub camera: Option<String>,
    /// The pattern's .json, for pictures.
    #[arg(long, value_name = "JSON")]
    pub pattern: Option<PathBuf>,
    /// What the printed sheet's line along x measures, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sheet_x_mm: Option<f64>,
    /// What the printed sheet's line along y measures, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sheet_y_mm: Option<f64>,
    /// The camera's lens, and its view if it stands still, as `ftheta calibrate camera` wrote it.
    #[arg(long, value_name = "JSON")]
    pub camera_file: Option<PathBuf>,
    /// Side of a pixel, µm, of a flatbed scanner's picture; no sheet is needed then.
    #[arg(long, value_name = "S", value_parser = positive,
          conflicts_with_all = ["camera_file", "sheet_x_mm", "sheet_y_mm"])]
    pub um_per_px: Option<f64>,
    /// Whether the sheet lies true on the machine's axes, or was laid by hand.
    #[arg(long, value_enum, default_value = "marks")]
    pub placement: PlacementName,
    /// Table of the measured marks to write.
    #[arg(long, value_name = "CSV")]
    pub points_out: Option<PathBuf>,
}

#[derive(Args)]
#[command(after_help = "\
Example:
  ftheta calibrate camera --pattern grid.json --image a.jpg --image b.jpg --image c.jpg \\
      --sheet-x-mm 260.6 --sheet-y-mm 259.3 --out camera.json

Take the sheet of `ftheta pattern grid --fiducials` from above and tilted by 20 to 40° to several
sides, with the zoom and focus that the field will be photographed with. A camera that stands still
takes the field's plane first, and --keep-view keeps how it sees it: then a plate needs no sheet.")]
pub struct CalibrateCamera {
    /// The pattern's .json, whose sheet the pictures show.
    #[arg(long, value_name = "JSON")]
    pub pattern: PathBuf,
    /// A picture of the sheet; three and more.
    #[arg(long, value_name = "PICTURE", required = true)]
    pub image: Vec<PathBuf>,
    /// What the printed sheet's line along x measures, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sheet_x_mm: Option<f64>,
    /// What the printed sheet's line along y measures, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sheet_y_mm: Option<f64>,
    /// Also keep how the first picture's plane was seen.
    #[arg(long)]
    pub keep_view: bool,
    /// Camera file to write.
    #[arg(long, value_name = "JSON")]
    pub out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum PlacementName {
    /// Place and turn of the field are left as they are.
    Marks,
    /// The field is brought to the sheet.
    Sheet,
}

impl From<PlacementName> for Placement {
    fn from(name: PlacementName) -> Self {
        match name {
            PlacementName::Marks => Self::Marks,
            PlacementName::Sheet => Self::Sheet,
        }
    }
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
