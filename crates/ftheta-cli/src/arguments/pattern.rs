//! Arguments of `ftheta pattern`.

use super::{mismatch, pair, positive, rate};
use clap::{Args, Subcommand, ValueEnum};
use ftheta::model::pattern::MarkStyle;
use ftheta::pattern::grid::N_SIDE_MAX;
use ftheta::twin::mismatch::Mismatch;
use std::path::PathBuf;

#[derive(Args)]
pub struct Pattern {
    #[command(subcommand)]
    pub kind: PatternKind,
}

#[derive(Subcommand)]
pub enum PatternKind {
    /// A grid of crosses or dots with labels, and a table to fill in: what `ftheta calibrate field`
    /// needs.
    Grid(GridPattern),
    /// A square with a cross through its centre: nine places for a ruler.
    Square(SquarePattern),
    /// Lines both ways at several speeds, whose ends show the laser's delays: what
    /// `ftheta calibrate delay` needs.
    Delay(DelayPattern),
    /// The ILDA test pattern: planned, beside what comes of its points played at a constant rate.
    Ilda(IldaPattern),
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(
    after_help = "Example: ftheta pattern ilda --machine S10-f160 --out ilda.svg --report ilda"
)]
pub struct IldaPattern {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Side of the pattern, mm; eight optical degrees if not given.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub field: Option<f64>,
    /// Drawing to write, .svg; the features' nominal places go beside it, .json.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Folder for pattern.html and plan.ftheta.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Speed at which the pattern is planned, mm/s.
    #[arg(long, value_name = "MM_S", default_value = "3000", value_parser = positive)]
    pub speed: f64,
    /// Rate at which its points are played, 1/s.
    #[arg(long, value_name = "N", default_value = "30000", value_parser = rate)]
    pub points_per_s: f64,
    /// Greatest distance of the planned beam from the pattern, µm.
    #[arg(long, value_name = "N", default_value = "10", value_parser = positive)]
    pub tolerance_um: f64,
    /// Folder for what has been solved and tuned, kept for the next run; the system's cache if not
    /// given.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Errors of the twin's plant that the plan does not know of, as in f1=+0.03,kt=-0.02.
    #[arg(long, value_name = "LIST", default_value = "", hide_default_value = true,
          value_parser = mismatch, allow_hyphen_values = true)]
    pub mismatch: Mismatch,
}

#[derive(Args)]
pub struct SheetArguments {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Distance of the outermost places, mm.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub field: f64,
    /// Speed of the beam, mm/s; 1000 if not given.
    #[arg(long, value_name = "MM_S", value_parser = positive)]
    pub speed: Option<f64>,
    /// Power, W; 10, or what the laser has, if not given.
    #[arg(long, value_name = "W", value_parser = positive)]
    pub power_w: Option<f64>,
    /// Drawing to write, .svg; beside it go the nominal places (.json), the table to fill in (.csv)
    /// and the recipe (.recipe.toml).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta pattern grid --machine S14-f420 --points 25 --field 280 --out grid.svg
  ftheta mark grid.svg --machine S14-f420")]
pub struct GridPattern {
    #[command(flatten)]
    pub sheet: SheetArguments,
    /// Number of marks: the square of an odd number, 9 to 4225.
    #[arg(long, value_name = "N", value_parser = n_side)]
    pub points: u32,
    /// Crosses or dots.
    #[arg(long, value_enum, default_value = "cross")]
    pub mark: MarkName,
    /// From tip to tip of a cross, or diameter of a dot, mm; derived from their distance if not
    /// given.
    #[arg(long, value_name = "S", value_parser = positive)]
    pub size_mm: Option<f64>,
    /// Also a sheet to be printed (.sheet.pdf, .sheet.svg), with signs around the grid by which a
    /// photograph can be measured: `ftheta calibrate field --image`.
    #[arg(long)]
    pub fiducials: bool,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(
    after_help = "Example: ftheta pattern square --machine S14-f420 --field 280 --out square.svg"
)]
pub struct SquarePattern {
    #[command(flatten)]
    pub sheet: SheetArguments,
}

#[derive(Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "\
Examples:
  ftheta pattern delay --machine S14-f255 --out delay.svg
  ftheta mark delay.svg --machine S14-f255
  ftheta calibrate delay --image photo.jpg --pattern delay.json --machine S14-f255 --out mine.toml

Mark it in the field's centre. Another controller marks the same drawing: in its order and
directions, each colour with the speed and power that the recipe names; say with --on-us and
--off-us how its laser delays are set meanwhile.")]
pub struct DelayPattern {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Lines at several speeds, or the open rectangle of one speed.
    #[arg(long, value_enum, default_value = "comb")]
    pub method: DelayMethod,
    /// Axis along which the lines run.
    #[arg(long, value_enum, default_value = "x")]
    pub axis: AxisName,
    /// Speeds, mm/s; 1000 to 10000 if not given, 5000 for a rectangle.
    #[arg(long, value_name = "V,V,…", value_delimiter = ',', value_parser = positive)]
    pub speeds: Vec<f64>,
    /// Lines of each speed each way; 10 if not given, 1 for a rectangle.
    #[arg(long, value_name = "N")]
    pub lines: Option<u32>,
    /// Length of a line, mm; 4 if not given, 10 for a rectangle.
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub length_mm: Option<f64>,
    /// Delays that there is room for, either way, µs.
    #[arg(long, value_name = "T", default_value = "250", value_parser = positive)]
    pub room_us: f64,
    /// Light goes on and off so much later on purpose, µs, so that a rectangle's gaps show; 0 if
    /// not given, 200,-200 for a rectangle.
    #[arg(long, value_name = "ON,OFF", allow_hyphen_values = true, value_parser = pair)]
    pub preset_us: Option<[f64; 2]>,
    /// Setting of the laser-on delay meanwhile, µs, positive is later; as the machine file has it.
    #[arg(long, value_name = "T", requires = "off_us")]
    pub on_us: Option<f64>,
    /// Setting of the laser-off delay meanwhile, µs.
    #[arg(long, value_name = "T", requires = "on_us")]
    pub off_us: Option<f64>,
    /// Power at the fastest speed, W; 10, or what the laser has, if not given. Slower lines have
    /// less, so that all have the same dose.
    #[arg(long, value_name = "W", value_parser = positive)]
    pub power_w: Option<f64>,
    /// Drawing to write, .svg; beside it go the nominal places (.json) and the recipe
    /// (.recipe.toml).
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DelayMethod {
    /// Lines both ways at several speeds: separates on and off, and what ends grow by.
    Comb,
    /// Two lines between slow sides, of one speed: what the patent describes.
    Rectangle,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum AxisName {
    /// Along x.
    X,
    /// Along y.
    Y,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum MarkName {
    /// Two lines: found best in pictures and with a ruler.
    Cross,
    /// A filled disc.
    Dot,
}

impl From<MarkName> for MarkStyle {
    fn from(name: MarkName) -> Self {
        match name {
            MarkName::Cross => Self::Cross,
            MarkName::Dot => Self::Dot,
        }
    }
}

/// Marks along a side from their number.
fn n_side(text: &str) -> Result<u32, String> {
    let n_points: u32 =
        text.trim().parse().map_err(|_| format!("\"{text}\" is no whole number"))?;
    let n_side = n_points.isqrt();
    let fits = n_side * n_side == n_points && n_side % 2 == 1 && (3..=N_SIDE_MAX).contains(&n_side);
    fits.then_some(n_side).ok_or_else(|| {
        format!("{n_points} is not the square of an odd number from 3 to {N_SIDE_MAX}")
    })
}
