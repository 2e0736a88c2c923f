//! Atlas files: solved jumps, kept between runs; binary, with a checksum over everything.

use crate::cache_key::CacheKey;
use crate::kept_file::{KeptFileError, Rest, begin, open, seal};

const HEADER: &[u8] = b"ftheta-atlas 1\n";

/// One level: for every number of ticks from zero the step and as many voltages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AtlasLevel {
    /// Longest step of each number of ticks, rad.
    pub steps_rad: Vec<f64>,
    /// Voltages of that step, V.
    pub sequences_v: Vec<Vec<f64>>,
}

/// An atlas as bytes.
pub fn write(key: CacheKey, levels: &[AtlasLevel]) -> Vec<u8> {
    let mut out = begin(HEADER, key);
    out.extend((levels.len() as u32).to_le_bytes());
    for level in levels {
        out.extend((level.steps_rad.len() as u32).to_le_bytes());
        let numbers = level.steps_rad.iter().chain(level.sequences_v.iter().flatten());
        numbers.for_each(|number| out.extend(number.to_le_bytes()));
    }
    seal(out)
}

/// Reads an atlas file.
///
/// # Errors
/// If it is damaged, of another version, or not for this key.
pub fn read(bytes: &[u8], key: CacheKey) -> Result<Vec<AtlasLevel>, KeptFileError> {
    let mut rest = open(bytes, HEADER, key)?;
    let n_levels = rest.count()?;
    (0..n_levels).map(|_| level(&mut rest)).collect()
}

fn level(rest: &mut Rest<'_>) -> Result<AtlasLevel, KeptFileError> {
    let n_steps = rest.count()? as usize;
    let steps_rad = rest.numbers(n_steps)?;
    let sequences_v = (0..n_steps).map(|n| rest.numbers(n)).collect::<Result<_, _>>()?;
    Ok(AtlasLevel { steps_rad, sequences_v })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept_file::assert_damage_is_noticed;

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
        assert_damage_is_noticed(&whole, |bytes| read(bytes, key).is_err());
        assert_eq!(read(&whole, CacheKey::of("S14")), Err(KeptFileError::Key));
        assert_eq!(read(b"ftheta-atlas 0\n", key), Err(KeptFileError::Header));
    }

    #[test]
    fn counts_that_promise_more_than_is_there_are_refused() {
        let (key, _) = example();
        let mut bytes = begin(HEADER, key);
        bytes.extend(u32::MAX.to_le_bytes());
        bytes.extend(u32::MAX.to_le_bytes());
        assert_eq!(read(&seal(bytes), key), Err(KeptFileError::Checksum));
    }
}
