//! Atlas files: solved jumps, kept between runs; binary, with a checksum over everything.

use crate::cache_key::{CacheKey, N_DIGEST};
use sha2::{Digest, Sha256};
use thiserror::Error;

const HEADER: &[u8] = b"ftheta-atlas 1\n";

/// One level: for every number of ticks from zero the step and as many voltages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AtlasLevel {
    /// Longest step of each number of ticks, rad.
    pub steps_rad: Vec<f64>,
    /// Voltages of that step, V.
    pub sequences_v: Vec<Vec<f64>>,
}

/// Why an atlas file cannot be used.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum AtlasFileError {
    /// It is not an atlas file, or of another version.
    #[error("it is not an atlas file of this version")]
    Header,
    /// Its checksum is wrong: cut short or damaged.
    #[error("its checksum is wrong: it was cut short or damaged")]
    Checksum,
    /// It is for another machine or other settings.
    #[error("it is for another machine or other settings")]
    Key,
}

/// An atlas as bytes.
pub fn write(key: CacheKey, levels: &[AtlasLevel]) -> Vec<u8> {
    let mut out = HEADER.to_vec();
    out.extend(key.0);
    out.extend((levels.len() as u32).to_le_bytes());
    for level in levels {
        out.extend((level.steps_rad.len() as u32).to_le_bytes());
        let numbers = level.steps_rad.iter().chain(level.sequences_v.iter().flatten());
        numbers.for_each(|number| out.extend(number.to_le_bytes()));
    }
    let digest = Sha256::digest(&out);
    out.extend(digest);
    out
}

/// Reads an atlas file.
///
/// # Errors
/// If it is damaged, of another version, or not for this key.
pub fn read(bytes: &[u8], key: CacheKey) -> Result<Vec<AtlasLevel>, AtlasFileError> {
    if !bytes.starts_with(HEADER) {
        return Err(AtlasFileError::Header);
    }
    let split = bytes.len().checked_sub(N_DIGEST).ok_or(AtlasFileError::Checksum)?;
    let (content, digest) = bytes.split_at(split);
    if Sha256::digest(content).as_slice() != digest {
        return Err(AtlasFileError::Checksum);
    }
    let mut rest = Rest(content.get(HEADER.len()..).unwrap_or_default());
    if rest.take(N_DIGEST)? != key.0 {
        return Err(AtlasFileError::Key);
    }
    let n_levels = rest.count()?;
    (0..n_levels).map(|_| level(&mut rest)).collect()
}

fn level(rest: &mut Rest<'_>) -> Result<AtlasLevel, AtlasFileError> {
    let n_steps = rest.count()?;
    let steps_rad = rest.numbers(n_steps)?;
    let sequences_v = (0..n_steps).map(|n| rest.numbers(n)).collect::<Result<_, _>>()?;
    Ok(AtlasLevel { steps_rad, sequences_v })
}

/// The bytes not yet read; a content that does not fit its own counts counts as damaged.
struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    fn take(&mut self, n_bytes: usize) -> Result<&'a [u8], AtlasFileError> {
        let (taken, rest) = self.0.split_at_checked(n_bytes).ok_or(AtlasFileError::Checksum)?;
        self.0 = rest;
        Ok(taken)
    }

    fn count(&mut self) -> Result<usize, AtlasFileError> {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(self.take(4)?);
        Ok(u32::from_le_bytes(bytes) as usize)
    }

    fn numbers(&mut self, n_numbers: usize) -> Result<Vec<f64>, AtlasFileError> {
        let n_bytes = n_numbers.checked_mul(8).ok_or(AtlasFileError::Checksum)?;
        let number = |chunk: &[u8]| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(chunk);
            f64::from_le_bytes(bytes)
        };
        Ok(self.take(n_bytes)?.chunks_exact(8).map(number).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (CacheKey, Vec<AtlasLevel>) {
        let level = |step: f64| AtlasLevel {
            steps_rad: vec![0.0, 0.0, step],
            sequences_v: vec![vec![], vec![0.0], vec![step, -1.0 / 3.0]],
        };
        (CacheKey::of("S10"), vec![level(1e-7), AtlasLevel::default(), level(0.25)])
    }

    #[test]
    fn what_was_written_is_read_bit_for_bit() {
        let (key, levels) = example();
        assert_eq!(read(&write(key, &levels), key), Ok(levels));
    }

    #[test]
    fn every_damage_is_noticed() {
        let (key, levels) = example();
        let whole = write(key, &levels);
        for n_bytes in 0..whole.len() {
            assert!(read(&whole[..n_bytes], key).is_err(), "cut to {n_bytes}");
            let mut flipped = whole.clone();
            flipped[n_bytes] ^= 0x10;
            assert!(read(&flipped, key).is_err(), "flipped {n_bytes}");
        }
        assert_eq!(read(&whole, CacheKey::of("S14")), Err(AtlasFileError::Key));
        assert_eq!(read(b"ftheta-atlas 0\n", key), Err(AtlasFileError::Header));
    }

    #[test]
    fn counts_that_promise_more_than_is_there_are_refused() {
        let (key, _) = example();
        let mut bytes = HEADER.to_vec();
        bytes.extend(key.0);
        bytes.extend(u32::MAX.to_le_bytes());
        bytes.extend(u32::MAX.to_le_bytes());
        let digest = Sha256::digest(&bytes);
        bytes.extend(digest);
        assert_eq!(read(&bytes, key), Err(AtlasFileError::Checksum));
    }
}
