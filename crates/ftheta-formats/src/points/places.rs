//! Lists of places, and of mirror angles.

use super::columns::plain;
use super::{N_POINTS_MAX, PLACE_MAX_MM};
use crate::text_table::error::TableError;
use crate::text_table::{Row, TextTable, decode};
use ftheta_model::space::{FieldPoint, MirrorAngles};

/// Greatest mirror angle that is read, degrees.
const ANGLE_MAX_DEG: f64 = 90.0;

/// A place of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where, mm.
    pub place_mm: FieldPoint,
    /// Height above the work plane, mm; `None` where the list has no such column.
    pub z_mm: Option<f64>,
    /// Line of the file, from 1.
    pub line: u32,
}

/// Mirror angles of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnglesRow {
    /// Mechanical, rad.
    pub angles: MirrorAngles,
    /// Line of the file, from 1.
    pub line: u32,
}

/// Reads places: columns `x_mm,y_mm[,z_mm]` by name, or two or three without names.
///
/// # Errors
/// The first thing that is wrong, with line, column and value.
pub fn read_places(file: &str, bytes: &[u8]) -> Result<Vec<Place>, TableError> {
    let names = ["x_mm", "y_mm", "z_mm"];
    let list = List { file, names: &names, n_needed: 2, limit: PLACE_MAX_MM };
    list.read(bytes, |line, values| Place {
        place_mm: FieldPoint::new(values[0], values[1]),
        z_mm: values.get(2).copied(),
        line,
    })
}

/// Reads mechanical mirror angles: columns `angle_x_deg,angle_y_deg` by name, or two without names.
///
/// # Errors
/// The first thing that is wrong, with line, column and value.
pub fn read_angles(file: &str, bytes: &[u8]) -> Result<Vec<AnglesRow>, TableError> {
    let names = ["angle_x_deg", "angle_y_deg"];
    let list = List { file, names: &names, n_needed: 2, limit: ANGLE_MAX_DEG };
    list.read(bytes, |line, values| AnglesRow {
        angles: MirrorAngles::new(values[0].to_radians(), values[1].to_radians()),
        line,
    })
}

/// A list of numbers by name.
struct List<'a> {
    file: &'a str,
    names: &'a [&'static str],
    n_needed: usize,
    limit: f64,
}

impl List<'_> {
    /// Reads the rows: a line and the values of the columns that are there.
    fn read<T>(
        &self,
        bytes: &[u8],
        row_of: impl Fn(u32, &[f64]) -> T,
    ) -> Result<Vec<T>, TableError> {
        let text = decode(self.file, bytes)?;
        let table = TextTable::new(self.file, &text);
        if table.rows().next().is_none() {
            return Err(TableError::NoRows {
                file: self.file.into(),
                found: "no rows".into(),
                expected: format!("rows of {}", self.expected()),
            });
        }
        let columns = self.columns(&table)?;
        let mut list = Vec::new();
        for row in table.rows() {
            table.check_width(&row, self.n_needed)?;
            if list.len() == N_POINTS_MAX {
                let (file, line, limit) = (self.file.into(), row.line, N_POINTS_MAX);
                return Err(TableError::TooManyRows { file, line, limit });
            }
            let mut values = [0.0; 3];
            for (value, (&index, name)) in values.iter_mut().zip(columns.iter().zip(self.names)) {
                *value = self.value(&table, &row, index, name)?;
            }
            let line = u32::try_from(row.line).unwrap_or(u32::MAX);
            list.push(row_of(line, &values[..columns.len()]));
        }
        Ok(list)
    }

    /// Its columns, for messages.
    fn expected(&self) -> String {
        let (needed, more) = self.names.split_at(self.n_needed);
        let more = more.iter().map(|name| format!(" and perhaps {name}")).collect::<String>();
        format!("{}{more}, each once", needed.join(", "))
    }

    /// Positions of the columns that are there, in the order of the names.
    fn columns(&self, table: &TextTable<'_>) -> Result<Vec<usize>, TableError> {
        let expected = || table.bad_columns(self.expected());
        let Some(header) = table.header() else {
            let n_columns = table.n_columns();
            let range = self.n_needed..=self.names.len();
            return if range.contains(&n_columns) {
                Ok((0..n_columns).collect())
            } else {
                Err(expected())
            };
        };
        let names: Vec<String> = header.cells.iter().map(|name| plain(name)).collect();
        let mut columns = Vec::new();
        for (part, name) in self.names.iter().enumerate() {
            let name = plain(name);
            let mut found = (0..names.len()).filter(|&index| names[index] == name);
            match (found.next(), found.next()) {
                (Some(index), None) => columns.push(index),
                (None, _) if part >= self.n_needed => break,
                _ => return Err(expected()),
            }
        }
        Ok(columns)
    }

    fn value(
        &self,
        table: &TextTable<'_>,
        row: &Row<'_>,
        index: usize,
        name: &str,
    ) -> Result<f64, TableError> {
        let value = table.need(row, index, name)?;
        let limit = self.limit;
        if value.abs() > limit {
            return Err(table.bad_cell(row, index, name, format!("-{limit} to {limit}")));
        }
        Ok(value)
    }
}
