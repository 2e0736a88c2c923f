//! Picture files: PNG, JPEG and TIFF as cameras and scanners write them, read as brightness.

pub mod error;
mod jpeg;
mod jpeg_code;
mod png;
mod tiff;
mod write;

pub use error::PictureFileError;
use ftheta_model::picture::Picture;
pub use write::{write_jpeg, write_png};

/// Most megapixels of a picture.
pub const MEGAPIXELS_MAX: usize = 100;
/// What each channel gives to brightness. Source: Rec. 601, as in JPEG.
const WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// A picture, and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureRead {
    /// Its brightness, as encoded: neither gamma nor colour profile is undone.
    pub picture: Picture,
    /// Share of pixels in which some channel is at full scale. Pixels at 0 are not counted: deep
    /// marks are black.
    pub saturated_ratio: f64,
    /// Bits of a channel.
    pub bits: u8,
    /// What a user may want to know, as that the file asks for it to be turned.
    pub notes: Vec<String>,
}

/// Reads a PNG, JPEG or TIFF; which one it is, its first bytes say.
///
/// Colours become brightness, what is transparent shows white, of several pictures in a file the
/// first is taken. Pixels stay where they are stored, even if the file asks for another
/// orientation. Memory is taken only after the size in the header was found to be within
/// [`MEGAPIXELS_MAX`].
///
/// # Errors
/// If it is no such picture, too large, damaged or cut off, or of a kind that has no brightness
/// (CMYK). No picture is returned in part.
pub fn read(bytes: &[u8]) -> Result<PictureRead, PictureFileError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => png::read(bytes),
        [0xff, 0xd8, 0xff, ..] => jpeg::read(bytes),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => tiff::read(bytes),
        _ => Err(PictureFileError::NotPicture { found: looks_like(bytes) }),
    }
}

/// What a file looks like, and for other pictures what to do.
fn looks_like(bytes: &[u8]) -> String {
    let start = &bytes[..bytes.len().min(64)];
    let known = match bytes {
        [] => "an empty file",
        [b'G', b'I', b'F', b'8', ..] => "a GIF, which has too few shades; save it as PNG",
        [b'B', b'M', ..] => "a BMP; save it as PNG",
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => {
            "a WebP; save it as PNG"
        }
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => {
            "a HEIC or AVIF picture or a film; set the camera to JPEG (\"most compatible\")"
        }
        [b'%', b'P', b'D', b'F', ..] => "a PDF",
        [b'P', b'K', 3, 4, ..] => "a ZIP archive",
        _ if start.trim_ascii_start().starts_with(b"<") => "an SVG, XML or HTML text",
        _ if start.trim_ascii_start().starts_with(b"{") => "a JSON text",
        _ if start.iter().all(|byte| matches!(byte, b'\t' | b'\n' | b'\r' | 32..127)) => "a text",
        _ => {
            let hex: Vec<String> = start.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            return format!("no picture (it begins with {})", hex.join(" "));
        }
    };
    known.into()
}

/// Width and height as sizes, if there are not too many pixels.
fn checked_size(width: u32, height: u32) -> Result<(usize, usize), PictureFileError> {
    let (width, height) = (width as usize, height as usize);
    let n_pixels = width.saturating_mul(height);
    if n_pixels > MEGAPIXELS_MAX * 1_000_000 {
        let megapixels = n_pixels.div_ceil(1_000_000);
        return Err(PictureFileError::TooLarge {
            width,
            height,
            megapixels,
            limit: MEGAPIXELS_MAX,
        });
    }
    Ok((width, height))
}

/// Decoded samples, pixel by pixel.
struct Samples<F: Fn(usize) -> f32> {
    width: usize,
    height: usize,
    /// 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha.
    n_channels: usize,
    bits: u8,
    /// The sample at an index, in steps of the file.
    at: F,
}

impl<F: Fn(usize) -> f32> Samples<F> {
    /// Brightness; `None` if there is no pixel.
    fn read(self, notes: Vec<String>) -> Option<PictureRead> {
        let full = (1u32 << self.bits) as f32 - 1.0;
        let n_pixels = self.width * self.height;
        let mut n_saturated = 0usize;
        let mut values = Vec::with_capacity(n_pixels);
        for pixel in 0..n_pixels {
            let at = |channel: usize| (self.at)(pixel * self.n_channels + channel);
            let (grey, top) = if self.n_channels < 3 {
                (at(0), at(0))
            } else {
                let [r, g, b] = [at(0), at(1), at(2)];
                let grey = WEIGHTS[0] * r + WEIGHTS[1] * g + WEIGHTS[2] * b;
                (grey, r.max(g).max(b))
            };
            n_saturated += usize::from(top >= full);
            let cover = if self.n_channels.is_multiple_of(2) {
                at(self.n_channels - 1) / full
            } else {
                1.0
            };
            values.push(1.0 - cover * (1.0 - grey / full));
        }
        let saturated_ratio = n_saturated as f64 / n_pixels.max(1) as f64;
        let picture = Picture::new(self.width, self.height, values).ok()?;
        Some(PictureRead { picture, saturated_ratio, bits: self.bits, notes })
    }
}

#[cfg(test)]
mod tests;
