//! Measured points: where marks should be and where they are, from and to the tables people
//! measure in.
//!
//! Columns are found by name: `target_x_mm,target_y_mm,measured_x_mm,measured_y_mm[,round]`, in any
//! order. Tables of other programs are known by their names or shape: nominal places and errors,
//! commands in bits (`RTC-X`, `REAL-X`), measured places with hexadecimal galvo commands.

mod columns;
mod places;

pub use places::{AnglesRow, Place, read_angles, read_places};

use crate::text_table::error::TableError;
use crate::text_table::{Row, TextTable, decode};
use columns::{Columns, First, hex16};
use ftheta_model::calibration::{CommandedPoint, MeasuredPoint};
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::{Imported, Warning};
use std::collections::HashMap;

/// Most points of a file.
pub const N_POINTS_MAX: usize = 1_000_000;
/// Greatest coordinate of a place, mm.
const PLACE_MAX_MM: f64 = 1e6;
/// Greatest command.
const COMMAND_MAX: f64 = 2_147_483_648.0;
/// Most warnings of one kind.
const N_WARNINGS_MAX: usize = 10;

/// The points of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Points {
    /// Targets in mm.
    Measured(Vec<MeasuredPoint>),
    /// Commands of a controller, whose scale the file does not state.
    Commanded(Vec<CommandedPoint>),
}

impl Points {
    /// Points with targets in mm.
    ///
    /// * `units_per_mm`: scale of the controller that the commands were for
    ///
    /// Returns `None` for commands of unknown scale.
    pub fn measured(self, units_per_mm: Option<f64>) -> Option<Vec<MeasuredPoint>> {
        match self {
            Self::Measured(points) => Some(points),
            Self::Commanded(points) => {
                let scale = units_per_mm.filter(|scale| scale.is_finite() && *scale > 0.0)?;
                Some(points.iter().map(|point| point.measured(scale)).collect())
            }
        }
    }
}

/// Writes a table of marks: name, target and round of each, and where it was found; a mark without
/// is left to be filled in.
pub fn write<'a>(
    rows: impl IntoIterator<Item = (&'a str, FieldPoint, u32, Option<FieldPoint>)>,
) -> String {
    let mut out = String::from("target_x_mm,target_y_mm,measured_x_mm,measured_y_mm,round,mark\n");
    for (name, target, round, found) in rows {
        // A zero has no sign here, however it came about.
        let (x, y) = (target.x_mm + 0.0, target.y_mm + 0.0);
        let found = found.map(|found| format!("{:.6},{:.6}", found.x_mm, found.y_mm));
        let found = found.as_deref().unwrap_or(",");
        out.push_str(&format!("{x},{y},{found},{round},{name}\n"));
    }
    out
}

/// Reads measured points.
///
/// * `file`: its name, for messages
/// * returns points in the order of the file; rows without a measured place are left out and
///   counted in a warning, points of the same target and round are kept, with a warning
///
/// # Errors
/// The first thing that is wrong, with line, column and value.
///
/// # Limits
/// A million points, coordinates to 1e6 mm. Separator, decimal sign and, without names, the shape
/// are told from the first 200 rows.
pub fn read(file: &str, bytes: &[u8]) -> Result<Imported<Points>, TableError> {
    let text = decode(file, bytes)?;
    let table = TextTable::new(file, &text);
    if table.rows().next().is_none() {
        return Err(nothing(file, "no rows"));
    }
    let (columns, unused) = Columns::of(&table)?;
    let mut warnings = told(file, &table, &columns, &unused);
    let (mut points, mut n_empty) = (Vec::new(), 0);
    for row in table.rows() {
        table.check_width(&row, 1)?;
        match point(&table, &columns, &row)? {
            Some(_) if points.len() == N_POINTS_MAX => {
                let (file, line, limit) = (file.into(), row.line, N_POINTS_MAX);
                return Err(TableError::TooManyRows { file, line, limit });
            }
            Some(point) => points.push(point),
            None => n_empty += 1,
        }
    }
    if points.is_empty() {
        return Err(nothing(file, "no row with a measured place"));
    }
    if n_empty > 0 {
        let message = format!("rows left out for want of a measured place: {n_empty}");
        warnings.push(Warning::new(file, message));
    }
    warn_of_repeated(file, &points, &mut warnings);
    let value = match columns.first {
        First::Target => Points::Measured(points.iter().map(|point| point.measured(1.0)).collect()),
        First::Bits | First::Galvo => Points::Commanded(points),
    };
    Ok(Imported { value, warnings })
}

fn nothing(file: &str, found: &str) -> TableError {
    let expected = "rows of target and measured place".into();
    TableError::NoRows { file: file.into(), found: found.into(), expected }
}

/// How the table was understood, where that is not plain from names.
fn told(file: &str, table: &TextTable<'_>, columns: &Columns, unused: &[String]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if table.header().is_none() {
        let n_columns = table.n_columns();
        let named: Vec<String> = columns
            .names
            .iter()
            .zip(columns.pairs)
            .map(|(n, i)| format!("{n} in {}", i + 1))
            .collect();
        let message = format!("{n_columns} columns without names, taken as {}", named.join(", "));
        warnings.push(Warning::new(file, message));
    }
    if !unused.is_empty() {
        let message = format!("columns {} are not used", unused.join(", "));
        warnings.push(Warning::new(file, message));
    }
    if let Some((line, _)) = table.settings.first() {
        let message = format!("{} lines that set a value are not used", table.settings.len());
        warnings.push(Warning::new(format!("{file}:{line}"), message));
    }
    warnings
}

/// The point of a row, its target as a command; `None` if it has not been measured.
fn point(
    table: &TextTable<'_>,
    columns: &Columns,
    row: &Row<'_>,
) -> Result<Option<CommandedPoint>, TableError> {
    let is_empty = |index: usize| row.cells.get(index).is_none_or(|cell| cell.is_empty());
    let [_, _, u, v] = columns.pairs;
    if is_empty(u) && is_empty(v) {
        return Ok(None);
    }
    let mut values = [0.0; 4];
    for (part, value) in values.iter_mut().enumerate() {
        *value = coordinate(table, columns, row, part)?;
    }
    let [x, y, u, v] = values;
    let round = match columns.round {
        Some(index) => round(table, row, index)?,
        None => 1,
    };
    let measured_mm = match columns.errors {
        true => FieldPoint::new(x + u, y + v),
        false => FieldPoint::new(u, v),
    };
    // Files are read up to 256 MiB, so that lines fit.
    let line = u32::try_from(row.line).unwrap_or(u32::MAX);
    Ok(Some(CommandedPoint { command_units: [x, y], measured_mm, round, line }))
}

/// One of the four numbers of a row.
fn coordinate(
    table: &TextTable<'_>,
    columns: &Columns,
    row: &Row<'_>,
    part: usize,
) -> Result<f64, TableError> {
    let (index, name) = (columns.pairs[part], columns.names[part]);
    if part < 2 && columns.first == First::Galvo {
        let cell = row.cells.get(index).map_or("", |cell| cell.as_ref());
        let expected = "a hexadecimal number of 16 bits";
        let word = hex16(cell).ok_or_else(|| table.bad_cell(row, index, name, expected))?;
        return Ok(f64::from(word) - 32_768.0);
    }
    let limit = if part < 2 && columns.first == First::Bits { COMMAND_MAX } else { PLACE_MAX_MM };
    let value = table.need(row, index, name)?;
    if value.abs() > limit {
        return Err(table.bad_cell(row, index, name, format!("-{limit} to {limit}")));
    }
    Ok(value)
}

fn round(table: &TextTable<'_>, row: &Row<'_>, index: usize) -> Result<u32, TableError> {
    let value = table.number(row, index, "round").ok().flatten();
    let whole = value.filter(|round| round.fract() == 0.0 && (1.0..=1e6).contains(round));
    // In range, so that the conversion is exact.
    whole
        .map(|round| round as u32)
        .ok_or_else(|| table.bad_cell(row, index, "round", "a whole number, 1 to 1000000"))
}

/// Warns of points that have target and round of another.
fn warn_of_repeated(file: &str, points: &[CommandedPoint], warnings: &mut Vec<Warning>) {
    let mut seen = HashMap::new();
    let mut n_repeated = 0;
    for point in points {
        // Adding zero makes one of the two zeros.
        let place = point.command_units.map(|value| (value + 0.0).to_bits());
        let first = *seen.entry((place, point.round)).or_insert(point.line);
        if first == point.line {
            continue;
        }
        n_repeated += 1;
        if n_repeated <= N_WARNINGS_MAX {
            let place = format!("{file}:{}", point.line);
            let message = format!("same target and round as line {first}; both are kept");
            warnings.push(Warning::new(place, message));
        }
    }
    if n_repeated > N_WARNINGS_MAX {
        let n_more = n_repeated - N_WARNINGS_MAX;
        let message = format!("{n_more} more rows repeat target and round of another");
        warnings.push(Warning::new(file, message));
    }
}
