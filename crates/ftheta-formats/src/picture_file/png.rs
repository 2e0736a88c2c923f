//! PNG, of any depth and colour.

use super::{PictureFileError, PictureRead, Samples, checked_size};
use ::png::{BitDepth, ColorType, Decoder, DecodingError, Transformations};
use std::io::{Cursor, ErrorKind};

const KIND: &str = "PNG";

/// Reads a PNG, to its very end.
pub(super) fn read(bytes: &[u8]) -> Result<PictureRead, PictureFileError> {
    let failed = |error: DecodingError| match &error {
        DecodingError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof => {
            PictureFileError::Truncated { kind: KIND, n_bytes: bytes.len() }
        }
        _ => PictureFileError::Damaged { kind: KIND, message: error.to_string() },
    };
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(failed)?;
    let info = reader.info();
    let (width, height) = checked_size(info.width, info.height)?;
    let mut notes = Vec::new();
    if info.animation_control.is_some() {
        notes.push("the PNG is animated; its first picture is taken".into());
    }
    let damaged = |message: &str| PictureFileError::Damaged { kind: KIND, message: message.into() };
    let n_bytes = reader.output_buffer_size().ok_or_else(|| damaged("its size"))?;
    let mut data = vec![0; n_bytes];
    let frame = reader.next_frame(&mut data).map_err(failed)?;
    reader.finish().map_err(failed)?;
    let n_channels = match frame.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err(damaged("it has no palette")),
    };
    let n_bytes_sample = if frame.bit_depth == BitDepth::Sixteen { 2 } else { 1 };
    if [frame.width as usize, frame.height as usize] != [width, height]
        || data.len() < width * height * n_channels * n_bytes_sample
    {
        return Err(damaged("its first picture is not whole"));
    }
    let read = if n_bytes_sample == 2 {
        let at = |index| f32::from(u16::from_be_bytes([data[2 * index], data[2 * index + 1]]));
        Samples { width, height, n_channels, bits: 16, at }.read(notes)
    } else {
        let at = |index: usize| f32::from(data[index]);
        Samples { width, height, n_channels, bits: 8, at }.read(notes)
    };
    read.ok_or_else(|| damaged("it has no pixels"))
}
