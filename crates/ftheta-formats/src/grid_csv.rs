//! Correction grids as CSV: `row,column,x_mm,y_mm,offset_x_mm,offset_y_mm`, a square of nodes.

use crate::text_table::error::TableError;
use crate::text_table::{Row, TextTable, decode};
use std::fmt::Write;

const NAMES: [&str; 6] = ["row", "column", "x_mm", "y_mm", "offset_x_mm", "offset_y_mm"];
/// Most nodes along a side.
const N_SIDE_MAX: usize = 1025;
/// Nodes may be this far from where an even grid has them, in parts of its pitch: files round.
const UNEVEN_MAX: f64 = 0.002;

/// Offsets on an even square grid about the field's centre.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetGrid {
    /// Nodes along each side, at least 2.
    pub n_side: usize,
    /// From the centre to the outermost nodes, mm.
    pub half_width_mm: f64,
    /// Offsets x, y of all nodes, mm: rows of rising y, in each row x rising.
    pub offsets_mm: Vec<[f64; 2]>,
}

impl OffsetGrid {
    /// Coordinate of a row or column, mm.
    pub fn coordinate_mm(&self, index: usize) -> f64 {
        let steps = (self.n_side - 1) as f64;
        self.half_width_mm * (2.0 * index as f64 - steps) / steps
    }
}

/// The grid as CSV; numbers are the shortest that read back as the same.
pub fn write(grid: &OffsetGrid) -> String {
    let mut out = NAMES.join(",") + "\n";
    for (index, [x, y]) in grid.offsets_mm.iter().enumerate() {
        let (row, column) = (index / grid.n_side, index % grid.n_side);
        let (x_mm, y_mm) = (grid.coordinate_mm(column), grid.coordinate_mm(row));
        // Writing to a string does not fail.
        let _ = writeln!(out, "{row},{column},{x_mm},{y_mm},{x},{y}");
    }
    out
}

/// Reads a grid: columns by name, rows in any order, y rising or falling with the row.
///
/// # Errors
/// The first thing that is wrong, with line, column and value: a node that is missing or there
/// twice, a grid that is not square, even and centred.
pub fn read(file: &str, bytes: &[u8]) -> Result<OffsetGrid, TableError> {
    let text = decode(file, bytes)?;
    let table = TextTable::new(file, &text);
    let n_rows = table.rows().count();
    let n_side = n_rows.isqrt();
    if !(2..=N_SIDE_MAX).contains(&n_side) || n_side * n_side != n_rows {
        return Err(TableError::NoRows {
            file: file.into(),
            found: format!("{n_rows} rows"),
            expected: format!("a square number of rows, 4 to {}", N_SIDE_MAX * N_SIDE_MAX),
        });
    }
    let columns = columns(&table)?;
    let mut nodes = vec![None; n_rows];
    for row in table.rows() {
        table.check_width(&row, NAMES.len())?;
        let at = |part: usize| index(&table, &row, columns[part], (NAMES[part], n_side));
        let (j, k) = (at(0)?, at(1)?);
        let mut values = [0.0; 4];
        for (part, value) in values.iter_mut().enumerate() {
            *value = table.need(&row, columns[part + 2], NAMES[part + 2])?;
        }
        let node = &mut nodes[j * n_side + k];
        if node.is_some() {
            let expected = format!("a node of its own; row {j}, column {k} was there before");
            return Err(table.bad_cell(&row, columns[0], NAMES[0], expected));
        }
        *node = Some((row.line, values));
    }
    // As many rows as nodes and none twice: all are there.
    let nodes: Vec<(usize, [f64; 4])> = nodes.into_iter().flatten().collect();
    even(file, n_side, nodes)
}

/// Positions of the named columns.
fn columns(table: &TextTable<'_>) -> Result<[usize; 6], TableError> {
    let expected = || table.bad_columns(NAMES.join(", "));
    let header = table.header().ok_or_else(expected)?;
    let mut columns = [0; 6];
    for (column, name) in columns.iter_mut().zip(NAMES) {
        let mut found =
            (0..header.cells.len()).filter(|&i| header.cells[i].eq_ignore_ascii_case(name));
        *column = match (found.next(), found.next()) {
            (Some(index), None) => index,
            _ => return Err(expected()),
        };
    }
    Ok(columns)
}

/// Row or column of a node.
fn index(
    table: &TextTable<'_>,
    row: &Row<'_>,
    index: usize,
    (name, n_side): (&str, usize),
) -> Result<usize, TableError> {
    let value = row.cells.get(index).and_then(|cell| cell.parse::<usize>().ok());
    value.filter(|value| *value < n_side).ok_or_else(|| {
        table.bad_cell(row, index, name, format!("a whole number, 0 to {}", n_side - 1))
    })
}

/// The grid, if it is even: nodes row by row, each with its line and x, y, offsets.
fn even(
    file: &str,
    n_side: usize,
    mut nodes: Vec<(usize, [f64; 4])>,
) -> Result<OffsetGrid, TableError> {
    let last = nodes.len() - 1;
    if nodes[last].1[1] < nodes[0].1[1] {
        // The first row is the topmost.
        let rows: Vec<_> = nodes.chunks(n_side).rev().map(<[_]>::to_vec).collect();
        nodes = rows.concat();
    }
    let half_width_mm = 0.5 * (nodes[last].1[0] - nodes[0].1[0]);
    let offsets_mm = nodes.iter().map(|(_, [_, _, x, y])| [*x, *y]).collect();
    let grid = OffsetGrid { n_side, half_width_mm, offsets_mm };
    let allowed_mm = UNEVEN_MAX * 2.0 * half_width_mm / (n_side - 1) as f64;
    for (index, (line, [x_mm, y_mm, ..])) in nodes.iter().enumerate() {
        let place = [(x_mm, index % n_side, "x_mm"), (y_mm, index / n_side, "y_mm")];
        for (&found_mm, index, column) in place {
            let expected_mm = grid.coordinate_mm(index);
            // The negated form refuses grids without width too.
            if !((found_mm - expected_mm).abs() <= allowed_mm && allowed_mm > 0.0) {
                return Err(TableError::Cell {
                    file: file.into(),
                    line: *line,
                    column: column.into(),
                    found: format!("{found_mm}"),
                    expected: format!(
                        "{expected_mm}, as in an even grid with the field's centre in its own"
                    ),
                });
            }
        }
    }
    Ok(grid)
}
