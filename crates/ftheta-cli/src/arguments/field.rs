//! Arguments of `ftheta field`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

#[derive(Args)]
pub struct Field {
    #[command(subcommand)]
    pub action: FieldAction,
}

#[derive(Subcommand)]
pub enum FieldAction {
    /// The mirrors' angles for places, or with --inverse the places for angles.
    Map(FieldMap),
}

#[derive(Args)]
#[command(after_help = "\
Examples:
  ftheta field map --machine S14-f420 --points places.csv --out angles.csv
  ftheta field map --machine S14-f420 --table table.txt --inverse --points a.csv --out b.csv

Places are columns x_mm,y_mm[,z_mm]; angles are columns angle_x_deg,angle_y_deg, mechanical.
focus_mm is where the focusing lens stands from the middle of its travel, on a machine with
[optics.focus]; on others how much farther than in the centre the focus has to be, for a head
without an F-theta lens and for places with z_mm.")]
pub struct FieldMap {
    /// Preset (see `ftheta machine list`) or machine file.
    #[arg(long, default_value = "S10", value_name = "NAME|FILE")]
    pub machine: String,
    /// Correction table, as `ftheta calibrate field` writes it.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// List of places, or of angles.
    #[arg(long, value_name = "CSV")]
    pub points: PathBuf,
    /// File to write: x_mm,y_mm,angle_x_deg,angle_y_deg[,focus_mm].
    #[arg(long, value_name = "CSV")]
    pub out: PathBuf,
    /// From angles to places.
    #[arg(long)]
    pub inverse: bool,
}
