//! Tables of text as people, spreadsheets and other programs write them.
//!
//! Cells are separated by comma, semicolon, tab or blanks; which of them, and whether decimals
//! follow a point or a comma, is told from the rows. Comments begin with `#`, `//` or `;`.

pub mod dialect;
pub mod error;

use crate::encoding;
use dialect::{Dialect, Separator, number, split, without_comment};
use error::TableError;
use std::borrow::Cow;

/// Lines from which the dialect is told.
const N_LINES_SEEN: usize = 200;

/// A table: perhaps a header, and rows.
pub struct TextTable<'a> {
    file: &'a str,
    text: &'a str,
    dialect: Dialect,
    header: Option<Row<'a>>,
    /// Line and text of `KEY = value` lines, which some programs put above the rows.
    pub settings: Vec<(usize, &'a str)>,
}

/// The cells of one line.
#[derive(Clone, Debug)]
pub struct Row<'a> {
    /// Line from 1.
    pub line: usize,
    /// Cells without quotes and the blanks around them.
    pub cells: Vec<Cow<'a, str>>,
}

/// The text of a file: UTF-8, UTF-16 with a byte order mark, or else Latin-1.
///
/// # Errors
/// If there are bytes that no text has.
pub fn decode<'a>(file: &str, bytes: &'a [u8]) -> Result<Cow<'a, str>, TableError> {
    let not_text = |offset| TableError::NotText { file: file.into(), offset };
    let text = match encoding::text(bytes) {
        Ok(text) => text,
        // The first byte that is not UTF-8 may be a letter of an old code page.
        Err(_) if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) => {
            return Err(not_text(2));
        }
        Err(_) => Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect()),
    };
    if let Some(offset) = text.find('\0') {
        return Err(not_text(offset));
    }
    if !text.contains('\r') {
        return Ok(text);
    }
    Ok(Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n")))
}

impl<'a> TextTable<'a> {
    /// A table in a text.
    ///
    /// * `file`: its name, for messages
    pub fn new(file: &'a str, text: &'a str) -> Self {
        let lines = || text.lines().enumerate().map(|(index, line)| (index + 1, line));
        let is_content = |line: &&str| {
            let line = line.trim_start();
            !line.is_empty() && !line.starts_with(['#', ';']) && !line.starts_with("//")
        };
        let is_row = |line: &&str| is_content(line) && !is_setting(line);
        let seen: Vec<&str> =
            lines().map(|(_, line)| line).filter(is_row).take(N_LINES_SEEN).collect();
        let dialect = Dialect::of(&seen);
        let settings = lines().filter(|(_, line)| is_content(line) && is_setting(line));
        let settings = settings.map(|(line, text)| (line, text.trim())).collect();
        let mut table = Self { file, text, dialect, header: None, settings };
        table.header = table.rows().next().filter(|row| {
            let is_number = |cell: &Cow<'_, str>| number(cell, dialect.decimal).is_some();
            !row.cells.iter().any(is_number)
        });
        table
    }

    /// The first row, if none of its cells is a number.
    pub fn header(&self) -> Option<&Row<'a>> {
        self.header.as_ref()
    }

    /// Cells of the header, or else of most rows.
    pub fn n_columns(&self) -> usize {
        self.header.as_ref().map_or(self.dialect.n_columns, |header| header.cells.len())
    }

    /// The rows below the header.
    pub fn rows(&self) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let (dialect, first) = (self.dialect, self.header.as_ref().map_or(0, |row| row.line));
        let n_columns = self.n_columns();
        self.text.lines().enumerate().skip(first).filter_map(move |(index, line)| {
            let cells = cells(line, dialect, n_columns)?;
            (!is_setting(line)).then_some(Row { line: index + 1, cells })
        })
    }

    /// The finite number in a cell; `None` if it is empty.
    ///
    /// # Errors
    /// If it is something else.
    pub fn number(
        &self,
        row: &Row<'_>,
        index: usize,
        column: &str,
    ) -> Result<Option<f64>, TableError> {
        let Some(cell) = row.cells.get(index).filter(|cell| !cell.is_empty()) else {
            return Ok(None);
        };
        match number(cell, self.dialect.decimal) {
            Some(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.bad_cell(row, index, column, self.finite())),
        }
    }

    /// The finite number in a cell.
    ///
    /// # Errors
    /// If it is empty or something else.
    pub fn need(&self, row: &Row<'_>, index: usize, column: &str) -> Result<f64, TableError> {
        self.number(row, index, column)?
            .ok_or_else(|| self.bad_cell(row, index, column, self.finite()))
    }

    /// Checks that a row has a cell for each column; empty ones may be missing at its end, and
    /// others may not be more.
    ///
    /// # Errors
    /// If it has more, or fewer than `n_cells_min`.
    pub fn check_width(&self, row: &Row<'_>, n_cells_min: usize) -> Result<(), TableError> {
        let (n_cells, n_columns) = (row.cells.len(), self.n_columns());
        let more = row.cells.iter().skip(n_columns).any(|cell| !cell.is_empty());
        if !more && n_cells >= n_cells_min {
            return Ok(());
        }
        let commas = more && self.dialect.separator == Separator::Sign(',');
        let hint = match commas {
            true => "; numbers with a decimal comma need quotes or semicolons between them",
            false => "",
        };
        let (file, line) = (self.file.into(), row.line);
        Err(TableError::Width { file, line, n_cells, n_columns, hint })
    }

    /// What a number of this table looks like.
    fn finite(&self) -> &'static str {
        match self.dialect.decimal {
            ',' => "a finite number with a decimal comma, as in the rest of the file",
            _ => "a finite number",
        }
    }

    /// The error of a cell.
    pub fn bad_cell(
        &self,
        row: &Row<'_>,
        index: usize,
        column: &str,
        expected: impl Into<String>,
    ) -> TableError {
        let found = match row.cells.get(index) {
            Some(cell) if !cell.is_empty() => shown(cell),
            _ => "empty".into(),
        };
        TableError::Cell {
            file: self.file.into(),
            line: row.line,
            column: column.into(),
            found,
            expected: expected.into(),
        }
    }

    /// The error of a header, or of rows without one.
    pub fn bad_columns(&self, expected: impl Into<String>) -> TableError {
        let (line, found) = match &self.header {
            Some(row) => (row.line, shown(&row.cells.join(", "))),
            None => {
                let line = self.rows().next().map_or(1, |row| row.line);
                (line, format!("without names, {} of them", self.n_columns()))
            }
        };
        TableError::Columns { file: self.file.into(), line, found, expected: expected.into() }
    }
}

/// Text from a file in quotes; a cell of a wrong file may be long.
fn shown(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { format!("\"{short}...\"") } else { format!("\"{short}\"") }
}

/// Whether a line gives a value to a key rather than cells to columns.
fn is_setting(line: &str) -> bool {
    line.split_once('=').is_some_and(|(key, _)| {
        let mut letters = key.trim().chars();
        letters.next().is_some_and(char::is_alphabetic)
            && letters.all(|letter| letter.is_alphanumeric() || "_ ".contains(letter))
    })
}

/// The cells of a line, unless it is blank or a comment.
fn cells(line: &str, dialect: Dialect, n_columns: usize) -> Option<Vec<Cow<'_, str>>> {
    let cells = split(without_comment(line, dialect.separator), dialect.separator);
    if cells.iter().all(|cell| cell.is_empty()) {
        return None;
    }
    // Between semicolons a row's first cell may be empty, and a comment looks the same.
    if line.trim_start().starts_with(';') && cells.len() != n_columns {
        return None;
    }
    Some(cells)
}
