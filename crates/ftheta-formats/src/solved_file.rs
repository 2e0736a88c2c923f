//! Files of solved programs, kept between runs; binary, with a checksum over everything.

use crate::cache_key::CacheKey;
use crate::kept_file::{KeptFileError, begin, open, seal};
use std::collections::BTreeMap;

const HEADER: &[u8] = b"ftheta-solved 1\n";
/// Stands for the count of numbers where there are none since there is no solution.
const NO_SOLUTION: u32 = u32::MAX;

/// Numbers by key, `None` where a program has no solution.
pub type Solved = BTreeMap<[i32; 4], Option<Vec<f64>>>;

/// Solved programs as bytes.
pub fn write(key: CacheKey, solved: &Solved) -> Vec<u8> {
    let mut out = begin(HEADER, key);
    out.extend((solved.len() as u32).to_le_bytes());
    for (which, numbers) in solved {
        which.iter().for_each(|part| out.extend(part.to_le_bytes()));
        let n_numbers = numbers.as_ref().map_or(NO_SOLUTION, |numbers| numbers.len() as u32);
        out.extend(n_numbers.to_le_bytes());
        numbers.iter().flatten().for_each(|number| out.extend(number.to_le_bytes()));
    }
    seal(out)
}

/// Reads a file of solved programs.
///
/// # Errors
/// If it is damaged, of another version, or not for this key.
pub fn read(bytes: &[u8], key: CacheKey) -> Result<Solved, KeptFileError> {
    let mut rest = open(bytes, HEADER, key)?;
    let mut solved = Solved::new();
    for _ in 0..rest.count()? {
        let mut which = [0; 4];
        for part in &mut which {
            *part = rest.count()?.cast_signed();
        }
        let numbers = match rest.count()? {
            NO_SOLUTION => None,
            n_numbers => Some(rest.numbers(n_numbers as usize)?),
        };
        solved.insert(which, numbers);
    }
    Ok(solved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept_file::assert_damage_is_noticed;

    fn example() -> (CacheKey, Solved) {
        let numbers = |n: usize| Some((0..n).map(|i| 1.0 / (i as f64 - 0.5)).collect());
        let solved = [
            ([1, 35, 3, 0], numbers(36)),
            ([1, 36, 3, 0], None),
            ([2, -1, i32::MIN, -400], numbers(0)),
        ];
        (CacheKey::of("S10"), solved.into())
    }

    #[test]
    fn what_was_written_is_read_bit_for_bit() {
        let (key, solved) = example();
        assert_eq!(read(&write(key, &solved), key), Ok(solved));
    }

    #[test]
    fn every_damage_is_noticed() {
        let (key, solved) = example();
        let whole = write(key, &solved);
        assert_damage_is_noticed(&whole, |bytes| read(bytes, key).is_err());
        assert_eq!(read(&whole, CacheKey::of("S14")), Err(KeptFileError::Key));
    }

    #[test]
    fn counts_that_promise_more_than_is_there_are_refused() {
        let (key, _) = example();
        for n_numbers in [1, u32::MAX - 1] {
            let mut bytes = begin(HEADER, key);
            [1, 0, 0, 0, 0, n_numbers].iter().for_each(|n: &u32| bytes.extend(n.to_le_bytes()));
            assert_eq!(read(&seal(bytes), key), Err(KeptFileError::Checksum));
        }
    }
}
