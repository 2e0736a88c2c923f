//! Kept files: a header, the key of what decides the content, the content, and a checksum over all
//! of it; little-endian.

use crate::cache_key::{CacheKey, N_DIGEST};
use sha2::{Digest, Sha256};
use thiserror::Error;

/// Why a kept file cannot be used.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum KeptFileError {
    /// It is of another kind or version.
    #[error("it is not a file of this kind and version")]
    Header,
    /// Its checksum is wrong: cut short or damaged.
    #[error("its checksum is wrong: it was cut short or damaged")]
    Checksum,
    /// It is for another machine or other settings.
    #[error("it is for another machine or other settings")]
    Key,
}

/// A file that begins with header and key.
pub(crate) fn begin(header: &[u8], key: CacheKey) -> Vec<u8> {
    [header, &key.0].concat()
}

/// The finished file.
pub(crate) fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    let digest = Sha256::digest(&bytes);
    bytes.extend(digest);
    bytes
}

/// The content of a file.
///
/// # Errors
/// If it is damaged, of another kind or version, or not for this key.
pub(crate) fn open<'a>(
    bytes: &'a [u8],
    header: &[u8],
    key: CacheKey,
) -> Result<Rest<'a>, KeptFileError> {
    if !bytes.starts_with(header) {
        return Err(KeptFileError::Header);
    }
    let split = bytes.len().checked_sub(N_DIGEST).ok_or(KeptFileError::Checksum)?;
    let (content, digest) = bytes.split_at(split);
    if Sha256::digest(content).as_slice() != digest {
        return Err(KeptFileError::Checksum);
    }
    let mut rest = Rest(content.get(header.len()..).unwrap_or_default());
    if rest.take(N_DIGEST)? != key.0 {
        return Err(KeptFileError::Key);
    }
    Ok(rest)
}

/// The bytes not yet read; a content that does not fit its own counts counts as damaged.
pub(crate) struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    pub(crate) fn take(&mut self, n_bytes: usize) -> Result<&'a [u8], KeptFileError> {
        let (taken, rest) = self.0.split_at_checked(n_bytes).ok_or(KeptFileError::Checksum)?;
        self.0 = rest;
        Ok(taken)
    }

    pub(crate) fn count(&mut self) -> Result<u32, KeptFileError> {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(self.take(4)?);
        Ok(u32::from_le_bytes(bytes))
    }

    pub(crate) fn numbers(&mut self, n_numbers: usize) -> Result<Vec<f64>, KeptFileError> {
        let n_bytes = n_numbers.checked_mul(8).ok_or(KeptFileError::Checksum)?;
        let number = |chunk: &[u8]| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(chunk);
            f64::from_le_bytes(bytes)
        };
        Ok(self.take(n_bytes)?.chunks_exact(8).map(number).collect())
    }
}

/// Checks that a file cut anywhere, or with one bit flipped anywhere, is refused.
#[cfg(test)]
pub(crate) fn assert_damage_is_noticed(whole: &[u8], is_refused: impl Fn(&[u8]) -> bool) {
    for n_bytes in 0..whole.len() {
        assert!(is_refused(&whole[..n_bytes]), "cut to {n_bytes}");
        let mut flipped = whole.to_vec();
        flipped[n_bytes] ^= 0x10;
        assert!(is_refused(&flipped), "flipped {n_bytes}");
    }
}
