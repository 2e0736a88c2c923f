//! From bytes to text: gzip, byte order marks and encodings.

use super::Limits;
use super::error::SvgError;
use crate::encoding;
use std::borrow::Cow;
use std::io::Read;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The text of an SVG or SVGZ file.
///
/// UTF-8, UTF-16 with a byte order mark, and Latin-1 where the XML declaration says so.
///
/// # Errors
/// If the file is empty, too large, damaged, or in no known encoding.
pub fn text<'a>(bytes: &'a [u8], limits: &Limits) -> Result<Cow<'a, str>, SvgError> {
    if bytes.starts_with(&GZIP_MAGIC) {
        let unpacked = unpack(bytes, limits)?;
        return Ok(Cow::Owned(plain_text(&unpacked, limits)?.into_owned()));
    }
    plain_text(bytes, limits)
}

fn plain_text<'a>(bytes: &'a [u8], limits: &Limits) -> Result<Cow<'a, str>, SvgError> {
    if limits.n_bytes_max < bytes.len() {
        return Err(SvgError::TooLarge { n_bytes: bytes.len(), limit: limits.n_bytes_max });
    }
    let text = match encoding::text(bytes) {
        Ok(text) => text,
        // Each byte of Latin-1 is the code point of the same number.
        Err(_) if declares_latin1(bytes) => {
            Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect())
        }
        Err(offset) => return Err(SvgError::NotText { offset }),
    };
    if text.trim().is_empty() {
        return Err(SvgError::Empty);
    }
    Ok(text)
}

fn unpack(bytes: &[u8], limits: &Limits) -> Result<Vec<u8>, SvgError> {
    let mut unpacked = Vec::new();
    // One byte more than the limit tells a file that is just as long from one that is longer.
    flate2::read::MultiGzDecoder::new(bytes)
        .take(limits.n_bytes_max as u64 + 1)
        .read_to_end(&mut unpacked)
        .map_err(|error| SvgError::Compressed { message: error.to_string() })?;
    Ok(unpacked)
}

fn declares_latin1(bytes: &[u8]) -> bool {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_ascii_lowercase();
    head.starts_with("<?xml") && (head.contains("iso-8859-1") || head.contains("windows-1252"))
}
