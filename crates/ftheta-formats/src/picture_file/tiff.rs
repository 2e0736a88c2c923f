//! TIFF of 8 or 16 bits, grey or RGB.

use super::{PictureFileError, PictureRead, Samples, checked_size};
use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};
use std::io::{Cursor, ErrorKind};

const KIND: &str = "TIFF";
const EXPECTED: &str = "grey or RGB of 8 or 16 bits, without compression or with LZW, Deflate or \
                        PackBits";
/// Largest decoded picture, bytes: four channels of 16 bits.
const N_BYTES_MAX: usize = super::MEGAPIXELS_MAX * 1_000_000 * 8;

/// Reads the first picture of a TIFF.
pub(super) fn read(bytes: &[u8]) -> Result<PictureRead, PictureFileError> {
    let failed = |error: TiffError| match &error {
        TiffError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof => {
            PictureFileError::Truncated { kind: KIND, n_bytes: bytes.len() }
        }
        TiffError::UnsupportedError(what) => PictureFileError::Unsupported {
            kind: KIND,
            found: format!("not read here ({what})"),
            expected: EXPECTED,
        },
        _ => PictureFileError::Damaged { kind: KIND, message: error.to_string() },
    };
    let unsupported =
        |found: String| PictureFileError::Unsupported { kind: KIND, found, expected: EXPECTED };
    let damaged = |message: &str| PictureFileError::Damaged { kind: KIND, message: message.into() };
    let mut limits = Limits::default();
    limits.decoding_buffer_size = N_BYTES_MAX;
    limits.intermediate_buffer_size = N_BYTES_MAX;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(failed)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(failed)?;
    let (width, height) = checked_size(width, height)?;
    let (n_channels, bits) = match decoder.colortype().map_err(failed)? {
        ColorType::Gray(bits) => (1, bits),
        ColorType::GrayA(bits) => (2, bits),
        ColorType::RGB(bits) => (3, bits),
        ColorType::RGBA(bits) => (4, bits),
        ColorType::CMYK(_) | ColorType::CMYKA(_) => {
            return Err(unsupported("CMYK, inks for print".into()));
        }
        other => return Err(unsupported(format!("of another kind ({other:?})"))),
    };
    if !matches!(bits, 8 | 16) {
        return Err(unsupported(format!("of {bits} bits")));
    }
    let planes = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(failed)?;
    if planes == Some(2) && n_channels > 1 {
        return Err(unsupported("kept channel by channel".into()));
    }
    let orientation = decoder.find_tag_unsigned::<u16>(Tag::Orientation).map_err(failed)?;
    let mut notes = Vec::new();
    if let Some(orientation @ 2..=8) = orientation {
        notes.push(format!(
            "the file asks for the picture to be turned (orientation {orientation}); it is taken \
             as stored"
        ));
    }
    let n_samples = width * height * n_channels;
    let read = match decoder.read_image().map_err(failed)? {
        DecodingResult::U8(data) if data.len() == n_samples => {
            let at = |index: usize| f32::from(data[index]);
            Samples { width, height, n_channels, bits: 8, at }.read(notes)
        }
        DecodingResult::U16(data) if data.len() == n_samples => {
            let at = |index: usize| f32::from(data[index]);
            Samples { width, height, n_channels, bits: 16, at }.read(notes)
        }
        DecodingResult::U8(_) | DecodingResult::U16(_) => return Err(damaged("its size")),
        _ => return Err(unsupported("of numbers that are no brightness".into())),
    };
    read.ok_or_else(|| damaged("it has no pixels"))
}
