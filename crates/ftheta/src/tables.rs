//! Correction tables in files: our own, EZCAD's `.cor`, and grids as CSV.

use crate::output::write_file;
use crate::{Error, exchange, import};
use ftheta_formats::cor_file::{self, CorVersion, N_SIDE};
use ftheta_formats::{correction_file, grid_csv};
use ftheta_model::machine::Machine;
use ftheta_physics::correction::{CorrectionError, CorrectionTable};
use std::ffi::OsStr;
use std::path::Path;

/// Kinds of files that hold tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableKind {
    /// Our own, `.txt`.
    Own,
    /// EZCAD's, `.cor`.
    Cor,
    /// A grid of offsets, `.csv`.
    Grid,
}

impl TableKind {
    /// The kind by the name's end; `None` for any other.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension().map(OsStr::to_ascii_lowercase)?;
        match extension.to_str()? {
            "txt" => Some(Self::Own),
            "cor" => Some(Self::Cor),
            "csv" => Some(Self::Grid),
            _ => None,
        }
    }
}

/// Reads a correction table of this machine.
///
/// # Errors
/// If the file cannot be read, is damaged, or is for another machine's optics.
pub fn read(path: &Path, machine: &Machine) -> Result<CorrectionTable, Error> {
    let table = correction_file::read(&import::bytes(path)?)
        .map_err(|source| Error::CorrectionFile { path: path.into(), source })?;
    let checked = table.check_machine(&machine.name, &machine.optics);
    checked.map_err(|error| unusable(path, error))?;
    Ok(table)
}

/// Reads a correction table of this machine through which marks in its work plane stay within the
/// mirrors' limits.
///
/// # Errors
/// As [`read`], or if an angle or speed could leave its limit.
pub fn usable(path: &Path, machine: &Machine) -> Result<CorrectionTable, Error> {
    let table = read(path, machine)?.at_height(machine.optics.plane_mm);
    let checked = table.check_limits(&machine.scanner, &machine.optics);
    checked.map_err(|error| unusable(path, error))?;
    Ok(table)
}

fn unusable(path: &Path, error: CorrectionError) -> Error {
    Error::CorrectionFile { path: path.into(), source: error.into() }
}

/// Writes a table as our own kind of file, or as another.
///
/// # Errors
/// If the kind is not known, the table cannot be put into it, or the file cannot be written.
pub fn write(
    table: &CorrectionTable,
    machine: &Machine,
    path: &Path,
    version: CorVersion,
) -> Result<(), Error> {
    let exchanged = |source| Error::Exchange { path: path.into(), source };
    let content = match TableKind::of(path).unwrap_or(TableKind::Own) {
        TableKind::Own => correction_file::write(table).into_bytes(),
        TableKind::Cor => {
            let cor = exchange::cor(table, machine).map_err(exchanged)?;
            cor_file::write(&cor, version)
                .map_err(|source| Error::CorFile { path: path.into(), source })?
        }
        TableKind::Grid => {
            let half_width_mm = 0.5 * machine.optics.field_mm;
            let grid = exchange::offsets(table, machine, N_SIDE, half_width_mm);
            grid_csv::write(&grid.map_err(exchanged)?).into_bytes()
        }
    };
    write_file(path, &content)
}

/// Reads a table of any kind.
///
/// # Errors
/// If the kind is not known, or the file is at fault.
pub fn read_any(path: &Path, machine: &Machine) -> Result<CorrectionTable, Error> {
    let grid = match kind(path)? {
        TableKind::Own => return read(path, machine),
        TableKind::Cor => {
            let cor = cor_file::read(&import::bytes(path)?)
                .map_err(|source| Error::CorFile { path: path.into(), source })?;
            exchange::grid_of_cor(&cor)
        }
        TableKind::Grid => grid_csv::read(&path.display().to_string(), &import::bytes(path)?)?,
    };
    exchange::table(&grid, machine).map_err(|source| Error::Exchange { path: path.into(), source })
}

fn kind(path: &Path) -> Result<TableKind, Error> {
    let expected = ".txt (a correction table), .cor or .csv (a grid of offsets)";
    TableKind::of(path).ok_or_else(|| Error::Format { path: path.into(), expected })
}
