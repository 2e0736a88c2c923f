//! Finds the columns of a table of measured points, by their names or, without, by what is in them.

use crate::text_table::TextTable;
use crate::text_table::error::TableError;
use std::borrow::Cow;

/// What the first pair of columns holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum First {
    /// Targets, mm.
    Target,
    /// Signed commands in bits.
    Bits,
    /// Commands as 16 hexadecimal bits, the centre at 0x8000.
    Galvo,
}

/// Which columns are read.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    /// What the first pair is.
    pub first: First,
    /// Whether the second pair is the error (measured less nominal) rather than the place.
    pub errors: bool,
    /// Positions of first and second pair: x, y, x, y.
    pub pairs: [usize; 4],
    /// Position of the round.
    pub round: Option<usize>,
    /// Names of the four columns for messages.
    pub names: [&'static str; 4],
}

const TARGET: [&str; 2] = ["target_x_mm", "target_y_mm"];
const BITS: [&str; 2] = ["rtc_x", "rtc_y"];
const GALVO: [&str; 2] = ["galvo_x", "galvo_y"];
const MEASURED: [&str; 2] = ["measured_x_mm", "measured_y_mm"];
const ERROR: [&str; 2] = ["error_x_mm", "error_y_mm"];

/// What the first pair may be, its names in messages, and the stems of its names in files.
const FIRSTS: [(First, [&str; 2], &[&str]); 3] = [
    (First::Target, TARGET, &["target", "nominal"]),
    (First::Bits, BITS, &["rtc"]),
    (First::Galvo, GALVO, &["galvo"]),
];
/// The same for the second pair, and whether it is the error.
const SECONDS: [(bool, [&str; 2], &[&str]); 2] =
    [(false, MEASURED, &["measured", "real"]), (true, ERROR, &["error"])];

/// Columns that name a mark and say nothing about where it is.
const LABELS: [&str; 9] = ["mark", "id", "label", "name", "row", "column", "col", "i", "j"];

const EXPECTED: &str =
    "target_x_mm, target_y_mm, measured_x_mm, measured_y_mm and perhaps round, each once";
const EXPECTED_SHAPE: &str = "4 (target x, y, measured x, y in mm; or commands in bits and \
     measured), 5 (a round as well) or 6 (row, column, nominal x, y, error x, y; or measured x, \
     y, i, j and hexadecimal galvo x, y)";

impl Columns {
    /// The columns of a table, and names of those that are not used.
    ///
    /// # Errors
    /// If one is missing or there twice, or a table without names has no known shape.
    pub fn of(table: &TextTable<'_>) -> Result<(Self, Vec<String>), TableError> {
        match table.header() {
            Some(header) => {
                let names: Vec<String> = header.cells.iter().map(|name| plain(name)).collect();
                Self::named(&names).ok_or_else(|| table.bad_columns(EXPECTED))
            }
            None => {
                let columns = Self::shaped(table);
                let columns = columns.ok_or_else(|| table.bad_columns(EXPECTED_SHAPE))?;
                Ok((columns, Vec::new()))
            }
        }
    }

    fn named(names: &[String]) -> Option<(Self, Vec<String>)> {
        let (first, first_names, [x, y]) = FIRSTS
            .iter()
            .find_map(|(first, shown, stems)| Some((*first, *shown, pair(names, stems)?)))?;
        let (errors, second_names, [u, v]) = SECONDS
            .iter()
            .find_map(|(errors, shown, stems)| Some((*errors, *shown, pair(names, stems)?)))?;
        let round = match names.iter().filter(|name| *name == "round").count() {
            0 => None,
            1 => names.iter().position(|name| name == "round"),
            _ => return None,
        };
        let pairs = [x, y, u, v];
        let is_unused = |index: &usize| {
            !pairs.contains(index)
                && Some(*index) != round
                && !names[*index].is_empty()
                && !LABELS.contains(&names[*index].as_str())
        };
        let unused = (0..names.len()).filter(is_unused).map(|i| names[i].clone()).collect();
        let columns = Self {
            first,
            errors,
            pairs,
            round,
            names: [first_names[0], first_names[1], second_names[0], second_names[1]],
        };
        Some((columns, unused))
    }

    /// Without names: by number of columns, and by what the first rows hold.
    fn shaped(table: &TextTable<'_>) -> Option<Self> {
        let shape = |first, errors, pairs, first_names: [_; 2], second_names: [_; 2]| Self {
            first,
            errors,
            pairs,
            round: None,
            names: [first_names[0], first_names[1], second_names[0], second_names[1]],
        };
        let absolute = shape(First::Target, false, [0, 1, 2, 3], TARGET, MEASURED);
        match table.n_columns() {
            4 if has_bits(table) => Some(shape(First::Bits, false, [0, 1, 2, 3], BITS, MEASURED)),
            4 => Some(absolute),
            5 => Some(Self { round: Some(4), ..absolute }),
            6 if has_galvo(table) => {
                Some(shape(First::Galvo, false, [4, 5, 0, 1], GALVO, MEASURED))
            }
            6 if has_indices(table) => {
                Some(shape(First::Target, true, [2, 3, 4, 5], TARGET, ERROR))
            }
            _ => None,
        }
    }
}

/// Positions of the x and y columns of one of these stems, if each is there once.
fn pair(names: &[String], stems: &[&str]) -> Option<[usize; 2]> {
    let only = |axis: &str| {
        let is_it = |name: &String| stems.iter().any(|stem| *name == format!("{stem}_{axis}"));
        let mut found = names.iter().enumerate().filter(|(_, name)| is_it(name));
        let (index, _) = found.next()?;
        found.next().is_none().then_some(index)
    };
    Some([only("x")?, only("y")?])
}

/// A column's name in lower case, without its unit, blanks and hyphens as underscores.
pub fn plain(name: &str) -> String {
    let name = name.to_lowercase().replace([' ', '-', '(', ')', '[', ']'], "_");
    let words: Vec<&str> = name.split('_').filter(|word| !word.is_empty()).collect();
    match words.split_last() {
        Some((&("mm" | "bit" | "bits" | "hex"), rest)) => rest.join("_"),
        _ => words.join("_"),
    }
}

/// Rows from which a shape is told.
const N_ROWS_SEEN: usize = 200;

/// Whether the first pair is whole numbers far larger than any millimetre beside them.
fn has_bits(table: &TextTable<'_>) -> bool {
    let mut greatest = [0.0f64; 2];
    for row in table.rows().take(N_ROWS_SEEN) {
        for index in 0..4 {
            let Ok(Some(value)) = table.number(&row, index, "") else { continue };
            if index < 2 && value.fract() != 0.0 {
                return false;
            }
            greatest[index / 2] = greatest[index / 2].max(value.abs());
        }
    }
    let [commands, measured_mm] = greatest;
    measured_mm > 0.0 && commands > 20.0 * measured_mm
}

/// Whether the columns are measured x, y, indices i, j and hexadecimal numbers: places are not
/// written as the whole numbers that rows and columns of a grid are.
fn has_galvo(table: &TextTable<'_>) -> bool {
    let mut any_place = false;
    for row in table.rows().take(N_ROWS_SEEN) {
        let cell = |index: usize| row.cells.get(index).map_or("", |cell| cell.as_ref());
        if ![4, 5].iter().all(|&index| hex16(cell(index)).is_some())
            || ![2, 3].iter().all(|&index| cell(index).parse::<i32>().is_ok())
        {
            return false;
        }
        any_place |= [0, 1].iter().any(|&index| cell(index).parse::<u32>().is_err());
    }
    any_place
}

/// Whether the first pair is rows and columns of a grid.
fn has_indices(table: &TextTable<'_>) -> bool {
    let is_index = |cell: Option<&Cow<'_, str>>| cell.is_some_and(|c| c.parse::<u32>().is_ok());
    table.rows().take(N_ROWS_SEEN).all(|row| (0..2).all(|index| is_index(row.cells.get(index))))
}

/// A number of 16 hexadecimal bits, with or without `0x`.
pub fn hex16(cell: &str) -> Option<u16> {
    let digits = cell.strip_prefix("0x").or_else(|| cell.strip_prefix("0X")).unwrap_or(cell);
    // `from_str_radix` would take a sign.
    let all_hex = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    all_hex.then(|| u16::from_str_radix(digits, 16).ok()).flatten()
}
