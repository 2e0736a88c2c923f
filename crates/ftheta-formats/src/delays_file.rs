//! Delays files: tuned settings of the classic planner, kept between runs; text with a checksum.

use crate::cache_key::{CacheKey, hex};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use thiserror::Error;

const HEADER: &str = "ftheta-delays 1";

/// Why a delays file cannot be used.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum DelaysFileError {
    /// It is not a delays file, or of another version.
    #[error("it is not a delays file of this version")]
    Header,
    /// Its checksum is wrong: cut short or damaged.
    #[error("its checksum is wrong: it was cut short or damaged")]
    Checksum,
    /// It is for another job, machine or other settings.
    #[error("it is for another job, machine or other settings")]
    Key,
    /// A row is not what it should be.
    #[error("row {row} is not a name and whole numbers, or not the one expected")]
    Row {
        /// Which, from 0.
        row: usize,
    },
}

/// A file of rows: a name, and settings in whole steps, or none where there are no good ones.
pub fn write<const N: usize>(key: CacheKey, rows: &[(&str, Option<[i32; N]>)]) -> String {
    let mut out = format!("{HEADER}\n{}\n", hex(&key.0));
    for (name, steps) in rows {
        out.push_str(name);
        for step in steps.iter().flatten() {
            // Writing to a string does not fail.
            let _ = write!(out, " {step}");
        }
        out.push('\n');
    }
    let digest = hex(&Sha256::digest(&out));
    out + &digest + "\n"
}

/// Reads the rows of these names, which have to be all there are, in their order.
///
/// # Errors
/// If the file is damaged, of another version, or not for this key.
pub fn read<const N: usize>(
    bytes: &[u8],
    key: CacheKey,
    names: &[&str],
) -> Result<Vec<Option<[i32; N]>>, DelaysFileError> {
    let text = std::str::from_utf8(bytes).map_err(|_| DelaysFileError::Header)?;
    let Some(rest) = text.strip_prefix(HEADER).and_then(|rest| rest.strip_prefix('\n')) else {
        return Err(DelaysFileError::Header);
    };
    let body = text.strip_suffix('\n').and_then(|text| text.rsplit_once('\n'));
    let (content, digest) = body.ok_or(DelaysFileError::Checksum)?;
    // What is hashed has its last line's end.
    let content = &text[..content.len() + 1];
    if hex(&Sha256::digest(content)) != digest {
        return Err(DelaysFileError::Checksum);
    }
    let mut lines = rest.lines();
    if lines.next() != Some(&hex(&key.0)) {
        return Err(DelaysFileError::Key);
    }
    let rows = names.iter().enumerate().map(|(row, &name)| {
        let line = lines.next().and_then(|line| line.strip_prefix(name));
        line.and_then(steps).ok_or(DelaysFileError::Row { row })
    });
    let rows = rows.collect::<Result<_, _>>()?;
    match (lines.next(), lines.next()) {
        (Some(_), None) => Ok(rows),
        _ => Err(DelaysFileError::Row { row: names.len() }),
    }
}

/// Nothing, or as many numbers as there have to be.
fn steps<const N: usize>(text: &str) -> Option<Option<[i32; N]>> {
    let numbers: Result<Vec<i32>, _> = text.split_whitespace().map(str::parse).collect();
    let numbers = numbers.ok()?;
    if numbers.is_empty() { Some(None) } else { numbers.try_into().ok().map(Some) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["a", "b", "sky_a"];

    fn example() -> (CacheKey, String) {
        let rows = [Some([3, -18, 8]), None, Some([i32::MIN, 0, i32::MAX])];
        let key = CacheKey::of("text");
        let named: Vec<_> = NAMES.into_iter().zip(rows).collect();
        let text = write(key, &named);
        assert_eq!(read(text.as_bytes(), key, &NAMES), Ok(rows.to_vec()));
        (key, text)
    }

    #[test]
    fn every_damage_is_noticed() {
        let (key, whole) = example();
        for n_bytes in 0..whole.len() {
            let cut = &whole.as_bytes()[..n_bytes];
            assert!(read::<3>(cut, key, &NAMES).is_err(), "cut to {n_bytes}");
            let mut flipped = whole.clone().into_bytes();
            flipped[n_bytes] ^= 0x10;
            assert!(read::<3>(&flipped, key, &NAMES).is_err(), "flipped {n_bytes}");
        }
    }

    #[test]
    fn other_keys_rows_and_versions_are_refused() {
        let (key, whole) = example();
        let error = |text: &str, key, names: &[&str]| read::<3>(text.as_bytes(), key, names);
        assert_eq!(error(&whole, CacheKey::of("panel"), &NAMES), Err(DelaysFileError::Key));
        assert_eq!(error("ftheta-delays 0\n", key, &NAMES), Err(DelaysFileError::Header));
        for names in [&["a", "b"][..], &["a", "b", "c"], &["a", "b", "sky_a", "d"]] {
            assert!(matches!(error(&whole, key, names), Err(DelaysFileError::Row { .. })));
        }
        let row = Err(DelaysFileError::Row { row: 0 });
        assert_eq!(read::<2>(whole.as_bytes(), key, &NAMES), row);
    }
}
