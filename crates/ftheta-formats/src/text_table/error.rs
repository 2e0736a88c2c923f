//! What is wrong with a table of text.

use thiserror::Error;

/// What is wrong with a table of text.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// Not text.
    #[error("{file}: byte {offset} is not text")]
    NotText {
        /// The file.
        file: String,
        /// The first byte that is none.
        offset: usize,
    },
    /// Nothing in it that could be used.
    #[error("{file}: {found}, expected {expected}")]
    NoRows {
        /// The file.
        file: String,
        /// What there is instead.
        found: String,
        /// What should be.
        expected: String,
    },
    /// More rows than are read.
    #[error("{file}:{line}: more than {limit} rows")]
    TooManyRows {
        /// The file.
        file: String,
        /// Line of the first row too many, from 1.
        line: usize,
        /// The limit.
        limit: usize,
    },
    /// Columns that say nothing, are missing, or are there twice.
    #[error("{file}:{line}: columns {found}, expected {expected}")]
    Columns {
        /// The file.
        file: String,
        /// Line from 1.
        line: usize,
        /// The columns as written, or their number.
        found: String,
        /// What should be.
        expected: String,
    },
    /// A row with more or fewer cells than columns.
    #[error("{file}:{line}: {n_cells} cells, expected {n_columns}{hint}")]
    Width {
        /// The file.
        file: String,
        /// Line from 1.
        line: usize,
        /// Cells of the row.
        n_cells: usize,
        /// Columns of the table.
        n_columns: usize,
        /// What may be the reason, or nothing.
        hint: &'static str,
    },
    /// A cell that cannot be.
    #[error("{file}:{line}: {column} is {found}, expected {expected}")]
    Cell {
        /// The file.
        file: String,
        /// Line from 1.
        line: usize,
        /// The column's name.
        column: String,
        /// The cell as written, in quotes, or that it is empty.
        found: String,
        /// What is allowed.
        expected: String,
    },
}

impl TableError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let at = |file: &str, line: &usize| format!("{file}:{line}");
        match self {
            Self::NotText { file, offset } => {
                (file.clone(), format!("byte {offset}"), "text".into())
            }
            Self::NoRows { file, found, expected } => {
                (file.clone(), found.clone(), expected.clone())
            }
            Self::TooManyRows { file, line, limit } => {
                (at(file, line), format!("more than {limit} rows"), format!("{limit} rows"))
            }
            Self::Columns { file, line, found, expected } => {
                (at(file, line), found.clone(), expected.clone())
            }
            Self::Width { file, line, n_cells, n_columns, .. } => {
                (at(file, line), format!("{n_cells} cells"), format!("{n_columns} cells"))
            }
            Self::Cell { file, line, column, found, expected } => {
                (format!("{file}:{line}: {column}"), found.clone(), expected.clone())
            }
        }
    }
}
