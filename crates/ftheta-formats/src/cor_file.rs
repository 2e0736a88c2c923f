//! EZCAD correction files (`.cor`): offsets of 65 × 65 galvo positions, binary, little-endian.
//!
//! Version 2 (label `JCZ_COR_2_1`): label of 22 bytes, 6 reserved, scale, pairs of 32-bit integers,
//! image index. Version 1 (`LMC1COR_1.0`): label, 2 reserved, 63 doubles of which number 43 is the
//! scale, pairs of doubles, image index.
//!
//! Source: layout found by comparing public files and readers; version 1 without a file to compare.

use thiserror::Error;

/// Nodes along each side of the table.
pub const N_SIDE: usize = 65;
/// Galvo units between neighbouring nodes.
pub const PITCH_UNITS: f64 = 1024.0;
/// Greatest offset that a board takes, either sign.
pub const OFFSET_MAX: i32 = 32_767;

const LABEL_2: &str = "JCZ_COR_2_1";
const LABEL_1: &str = "LMC1COR_1.0";
const N_LABEL: usize = 22;
const SCALE_AT_2: usize = 28;
const OFFSETS_AT_2: usize = 36;
const N_BYTES_2: usize = OFFSETS_AT_2 + 8 * N_SIDE * N_SIDE + 4;
const SCALE_AT_1: usize = N_LABEL + 2 + 8 * 43;
const OFFSETS_AT_1: usize = N_LABEL + 2 + 8 * 63;
const N_BYTES_1: usize = OFFSETS_AT_1 + 16 * N_SIDE * N_SIDE + 4;

/// A correction table of EZCAD.
#[derive(Clone, Debug, PartialEq)]
pub struct CorTable {
    /// Galvo units per mm; 65 536 units are the field's side.
    pub units_per_mm: f64,
    /// Offsets of the nodes, galvo units: 65 rows (index j) of 65 (index k), the first number along
    /// the axis that k runs along. Added to the nominal position.
    pub offsets: Vec<[i32; 2]>,
    /// 0 or 1 in known files.
    pub image_index: i32,
}

/// Which layout is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CorVersion {
    /// Doubles; older boards.
    One,
    /// Integers.
    #[default]
    Two,
}

/// What is wrong with a `.cor` file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CorFileError {
    /// No known label.
    #[error("begins with {found}, not with the label {LABEL_2} or {LABEL_1}")]
    Label {
        /// The first bytes.
        found: String,
    },
    /// Cut short, or longer than its version is.
    #[error("{n_bytes} bytes, a file with the label {label} has {expected}")]
    Size {
        /// The label.
        label: &'static str,
        /// Bytes of the file.
        n_bytes: usize,
        /// Bytes of its version.
        expected: usize,
    },
    /// No useful scale.
    #[error("byte {offset}: {found} galvo units per mm are outside {limit}")]
    Scale {
        /// Where it stands.
        offset: usize,
        /// The scale.
        found: f64,
        /// What is allowed.
        limit: &'static str,
    },
    /// A node that no board can use.
    #[error("row {row}, column {column}: an offset of {found} is outside ±{OFFSET_MAX}")]
    Offset {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The offset.
        found: f64,
    },
    /// A table to write that has not 65 × 65 nodes.
    #[error("{n_nodes} nodes, a .cor file has {expected}", expected = N_SIDE * N_SIDE)]
    Nodes {
        /// Nodes there are.
        n_nodes: usize,
    },
}

impl CorFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Label { found } => {
                ("label".into(), found.clone(), format!("{LABEL_2} or {LABEL_1}"))
            }
            Self::Size { n_bytes, expected, .. } => {
                ("size".into(), format!("{n_bytes} bytes"), format!("{expected} bytes"))
            }
            Self::Scale { offset, found, limit } => {
                (format!("byte {offset}"), found.to_string(), (*limit).into())
            }
            Self::Offset { row, column, found } => (
                format!("row {row}, column {column}"),
                found.to_string(),
                format!("-{OFFSET_MAX} to {OFFSET_MAX}"),
            ),
            Self::Nodes { n_nodes } => {
                ("nodes".into(), n_nodes.to_string(), (N_SIDE * N_SIDE).to_string())
            }
        }
    }
}

/// Reads a `.cor` file of either version.
///
/// # Errors
/// If the label is not known, the size is another, the scale is not 1 to 1e5 units per mm, or an
/// offset is beyond what a board takes.
pub fn read(bytes: &[u8]) -> Result<CorTable, CorFileError> {
    let version = version(bytes)?;
    let (label, expected, scale_at, offsets_at) = match version {
        CorVersion::Two => (LABEL_2, N_BYTES_2, SCALE_AT_2, OFFSETS_AT_2),
        CorVersion::One => (LABEL_1, N_BYTES_1, SCALE_AT_1, OFFSETS_AT_1),
    };
    let sized = CorFileError::Size { label, n_bytes: bytes.len(), expected };
    if bytes.len() != expected {
        return Err(sized);
    }
    let (body, trailer) = bytes.split_at(expected - 4);
    let scales = body.get(scale_at..).and_then(|rest| doubles(rest).next());
    let units_per_mm = scales.ok_or(sized)?;
    check_scale(units_per_mm, scale_at)?;
    let numbers: Vec<f64> = match version {
        CorVersion::Two => integers(&body[offsets_at..]).map(f64::from).collect(),
        CorVersion::One => doubles(&body[offsets_at..]).map(f64::round).collect(),
    };
    let node = |(index, pair): (usize, &[f64])| {
        check_offset(index, pair[0])?;
        check_offset(index, pair[1])?;
        // Whole and within 16 bits.
        Ok([pair[0] as i32, pair[1] as i32])
    };
    let offsets = numbers.chunks_exact(2).enumerate().map(node).collect::<Result<_, _>>()?;
    let image_index = integers(trailer).next().unwrap_or_default();
    Ok(CorTable { units_per_mm, offsets, image_index })
}

/// Writes a `.cor` file.
///
/// # Errors
/// As [`read`], for a table that could not be read again.
pub fn write(table: &CorTable, version: CorVersion) -> Result<Vec<u8>, CorFileError> {
    let n_nodes = table.offsets.len();
    if n_nodes != N_SIDE * N_SIDE {
        return Err(CorFileError::Nodes { n_nodes });
    }
    for (index, pair) in table.offsets.iter().enumerate() {
        pair.iter().try_for_each(|&offset| check_offset(index, f64::from(offset)))?;
    }
    let scale = table.units_per_mm.to_le_bytes();
    let mut out = Vec::with_capacity(N_BYTES_1);
    match version {
        CorVersion::Two => {
            check_scale(table.units_per_mm, SCALE_AT_2)?;
            out.extend(LABEL_2.bytes());
            out.resize(SCALE_AT_2, 0);
            out.extend(scale);
            out.extend(table.offsets.iter().flatten().flat_map(|offset| offset.to_le_bytes()));
        }
        CorVersion::One => {
            check_scale(table.units_per_mm, SCALE_AT_1)?;
            // Eleven letters of two bytes fill the label's 22 bytes.
            out.extend(LABEL_1.encode_utf16().flat_map(u16::to_le_bytes));
            out.resize(SCALE_AT_1, 0);
            out.extend(scale);
            out.resize(OFFSETS_AT_1, 0);
            let offsets = table.offsets.iter().flatten().map(|&offset| f64::from(offset));
            out.extend(offsets.flat_map(f64::to_le_bytes));
        }
    }
    out.extend(table.image_index.to_le_bytes());
    Ok(out)
}

fn version(bytes: &[u8]) -> Result<CorVersion, CorFileError> {
    let label = &bytes[..bytes.len().min(N_LABEL)];
    let wide: Vec<u8> = LABEL_1.encode_utf16().flat_map(u16::to_le_bytes).collect();
    // What follows the label's end may be anything.
    let ends = |name: &str| {
        label.starts_with(name.as_bytes()) && label.get(name.len()).is_none_or(|&next| next == 0)
    };
    if ends(LABEL_2) {
        Ok(CorVersion::Two)
    } else if ends(LABEL_1) || label == wide {
        Ok(CorVersion::One)
    } else {
        Err(CorFileError::Label { found: format!("{:?}", String::from_utf8_lossy(label)) })
    }
}

fn check_scale(units_per_mm: f64, offset: usize) -> Result<(), CorFileError> {
    if (1.0..=1e5).contains(&units_per_mm) {
        return Ok(());
    }
    Err(CorFileError::Scale { offset, found: units_per_mm, limit: "1 to 100000" })
}

fn check_offset(index: usize, offset: f64) -> Result<(), CorFileError> {
    if offset.abs() <= f64::from(OFFSET_MAX) {
        return Ok(());
    }
    let (row, column) = (index / N_SIDE, index % N_SIDE);
    Err(CorFileError::Offset { row, column, found: offset })
}

fn integers(bytes: &[u8]) -> impl Iterator<Item = i32> {
    bytes.as_chunks().0.iter().map(|&chunk| i32::from_le_bytes(chunk))
}

fn doubles(bytes: &[u8]) -> impl Iterator<Item = f64> {
    bytes.as_chunks().0.iter().map(|&chunk| f64::from_le_bytes(chunk))
}
