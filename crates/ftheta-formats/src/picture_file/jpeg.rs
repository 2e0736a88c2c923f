//! JPEG, baseline and progressive, grey or colour.
//!
//! The markers are walked here first: a decoder may fill up a file that was cut off, and phones
//! append things behind the picture.

use super::{PictureFileError, PictureRead, Samples, checked_size};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

const KIND: &str = "JPEG";
/// Longest side that the format knows.
const SIDE_MAX: usize = 65_535;

/// What the markers say.
struct Outline {
    width: u32,
    height: u32,
    bits: u8,
    n_channels: usize,
    /// Of EXIF, 1 to 8; 1 is as stored.
    orientation: u16,
    /// Where the picture ends.
    end: usize,
}

/// Reads a JPEG.
pub(super) fn read(bytes: &[u8]) -> Result<PictureRead, PictureFileError> {
    let outline = outline(bytes)?;
    let (width, height) = checked_size(outline.width, outline.height)?;
    let unsupported = |found: String, expected| {
        Err(PictureFileError::Unsupported { kind: KIND, found, expected })
    };
    if outline.bits != 8 {
        return unsupported(format!("of {} bits", outline.bits), "a JPEG of 8 bits, PNG or TIFF");
    }
    let n_channels = match outline.n_channels {
        1 => 1,
        3 => 3,
        4 => return unsupported("CMYK, inks for print".into(), "RGB or grey"),
        n => return unsupported(format!("of {n} channels"), "RGB or grey"),
    };
    let space = if n_channels == 1 { ColorSpace::Luma } else { ColorSpace::RGB };
    let options = DecoderOptions::default()
        .set_max_width(SIDE_MAX)
        .set_max_height(SIDE_MAX)
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(space);
    let damaged = |message: String| PictureFileError::Damaged { kind: KIND, message };
    let whole = ZCursor::new(&bytes[..outline.end]);
    let mut decoder = JpegDecoder::new_with_options(whole, options);
    let data = decoder.decode().map_err(|error| damaged(error.to_string()))?;
    if data.len() != width * height * n_channels {
        return Err(damaged("its size".into()));
    }
    let mut notes = Vec::new();
    if outline.orientation > 1 {
        notes.push(format!(
            "the camera asks for the picture to be turned (EXIF orientation {}); it is taken as \
             stored, pixels in messages count from the stored upper left",
            outline.orientation
        ));
    }
    let at = |index: usize| f32::from(data[index]);
    let samples = Samples { width, height, n_channels, bits: 8, at };
    samples.read(notes).ok_or_else(|| damaged("it has no pixels".into()))
}

/// Walks the markers from the first to the end of the picture.
fn outline(bytes: &[u8]) -> Result<Outline, PictureFileError> {
    let truncated = || PictureFileError::Truncated { kind: KIND, n_bytes: bytes.len() };
    let damaged = |message: &str| PictureFileError::Damaged { kind: KIND, message: message.into() };
    let mut found: Option<Outline> = None;
    let mut orientation = 1;
    let mut at = 2;
    loop {
        let marker = loop {
            match (bytes.get(at), bytes.get(at + 1)) {
                (Some(0xff), Some(0xff)) => at += 1,
                (Some(0xff), Some(&marker)) => break marker,
                (Some(_), Some(_)) => return Err(damaged("bytes where a marker should be")),
                _ => return Err(truncated()),
            }
        };
        at += 2;
        match marker {
            0xd9 => {
                let outline = found.ok_or_else(|| damaged("no picture in it"))?;
                return Ok(Outline { orientation, end: at, ..outline });
            }
            0x01 | 0xd0..=0xd7 => continue,
            _ => {}
        }
        let length =
            bytes.get(at..at + 2).map(|two| usize::from(two[0]) << 8 | usize::from(two[1]));
        let length = length.ok_or_else(truncated)?;
        let segment = bytes.get(at + 2..(at + length).max(at + 2)).ok_or_else(truncated)?;
        at += length.max(2);
        match (marker, segment) {
            // Starts of frames; c4, c8 and cc are something else.
            (
                0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf,
                &[bits, h1, h0, w1, w0, n, ..],
            ) => {
                let word = |high: u8, low: u8| u32::from(high) << 8 | u32::from(low);
                let (width, height) = (word(w1, w0), word(h1, h0));
                let n_channels = usize::from(n);
                found = Some(Outline { width, height, bits, n_channels, orientation, end: 0 });
            }
            (0xe1, [b'E', b'x', b'i', b'f', 0, 0, exif @ ..]) => {
                orientation = exif_orientation(exif).unwrap_or(1);
            }
            // Compressed data up to the next marker.
            (0xda, _) => {
                let data = bytes.get(at..).unwrap_or_default();
                let next = data
                    .windows(2)
                    .position(|two| two[0] == 0xff && !matches!(two[1], 0 | 0xd0..=0xd7));
                at += next.ok_or_else(truncated)?;
            }
            _ => {}
        }
    }
}

/// Tag 0x112 of the first directory.
fn exif_orientation(exif: &[u8]) -> Option<u16> {
    let big = exif.starts_with(b"MM");
    let word = |at: usize| {
        let two = [*exif.get(at)?, *exif.get(at.checked_add(1)?)?];
        Some(if big { u16::from_be_bytes(two) } else { u16::from_le_bytes(two) })
    };
    let (high, low) = if big { (4, 6) } else { (6, 4) };
    let start = usize::from(word(high)?) << 16 | usize::from(word(low)?);
    let entries = (0..usize::from(word(start)?)).map(|index| start + 2 + 12 * index);
    let mut entries = entries.take_while(|&at| at < exif.len());
    let entry = entries.find(|&at| word(at) == Some(0x112))?;
    word(entry + 8)
}
