//! What a kept file is for, as a hash of everything that decides its content.

use sha2::{Digest, Sha256};

/// Bytes of a hash.
pub(crate) const N_DIGEST: usize = 32;

/// A hash of everything that decides a kept file's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheKey(pub(crate) [u8; N_DIGEST]);

impl CacheKey {
    /// The key of what decides the content, as text.
    pub fn of(text: &str) -> Self {
        Self(Sha256::digest(text).into())
    }

    /// The name of the file: the beginning of the key, and its kind.
    pub fn file_name(&self, kind: &str) -> String {
        format!("{}.{kind}", hex(&self.0[..8]))
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
