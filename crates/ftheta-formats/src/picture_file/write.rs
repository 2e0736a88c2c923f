//! Pictures as PNG or JPEG, grey with 8 bits.

use super::jpeg_code::{AC, Code, DC, QUANTITIES, ZIGZAG, codes};
use ftheta_model::picture::Picture;
use std::f32::consts::PI;

/// Longest side that JPEG knows.
const SIDE_MAX: usize = 65_535;

/// A picture as PNG.
pub fn write_png(picture: &Picture) -> Vec<u8> {
    let mut bytes = Vec::new();
    let size = [picture.width(), picture.height()].map(|side| side as u32);
    let mut encoder = ::png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(::png::Compression::Fast);
    let shades = shades(picture.values());
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&shades));
    written.expect("writing to memory does not fail, and a picture has the size it says");
    bytes
}

fn shades(values: &[f32]) -> Vec<u8> {
    values.iter().map(|value| (255.0 * value).round().clamp(0.0, 255.0) as u8).collect()
}

/// A picture as baseline JPEG; `None` if a side is longer than 65 535 pixels.
///
/// * `quality`: 1 to 100, as libjpeg scales its tables
///
/// Source: ITU-T T.81, with the tables of its annex K.
pub fn write_jpeg(picture: &Picture, quality: u8) -> Option<Vec<u8>> {
    let (width, height) = (picture.width(), picture.height());
    if width.max(height) > SIDE_MAX {
        return None;
    }
    let quality = i32::from(quality.clamp(1, 100));
    let percent = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
    let steps = QUANTITIES.map(|step| ((i32::from(step) * percent + 50) / 100).clamp(1, 255) as u8);
    let mut bytes = vec![0xff, 0xd8];
    segment(&mut bytes, 0xe0, b"JFIF\0\x01\x01\0\0\x01\0\x01\0\0");
    segment(&mut bytes, 0xdb, &[&[0][..], &ZIGZAG.map(|at| steps[at])].concat());
    let [w, h] = [width, height].map(|side| (side as u16).to_be_bytes());
    segment(&mut bytes, 0xc0, &[8, h[0], h[1], w[0], w[1], 1, 1, 0x11, 0]);
    for (class, (counts, symbols)) in [(0x00, DC), (0x10, AC)] {
        segment(&mut bytes, 0xc4, &[&[class][..], &counts, symbols].concat());
    }
    segment(&mut bytes, 0xda, &[1, 1, 0, 0, 63, 0]);
    let shades = shades(picture.values());
    let mut coder = Coder { bytes, held: 0, n_held: 0, before: 0, dc: codes(DC), ac: codes(AC) };
    let cosines = cosines();
    for y in (0..height).step_by(8) {
        for x in (0..width).step_by(8) {
            let shade = |i: usize, j: usize| {
                let (row, column) = ((y + j).min(height - 1), (x + i).min(width - 1));
                f32::from(shades[row * width + column]) - 128.0
            };
            let block = transform(&cosines, shade);
            coder.block(&ZIGZAG.map(|at| (block[at] / f32::from(steps[at])).round() as i32));
        }
    }
    Some(coder.finish())
}

fn segment(bytes: &mut Vec<u8>, marker: u8, content: &[u8]) {
    bytes.extend([0xff, marker]);
    bytes.extend((content.len() as u16 + 2).to_be_bytes());
    bytes.extend(content);
}

/// Rows of the cosine transform of eight values.
fn cosines() -> [[f32; 8]; 8] {
    let mut rows = [[0.0; 8]; 8];
    for (order, row) in rows.iter_mut().enumerate() {
        let scale = if order == 0 { 0.125f32.sqrt() } else { 0.5 };
        for (at, value) in row.iter_mut().enumerate() {
            *value = scale * ((2 * at + 1) as f32 * order as f32 * PI / 16.0).cos();
        }
    }
    rows
}

fn transform(cosines: &[[f32; 8]; 8], value: impl Fn(usize, usize) -> f32) -> [f32; 64] {
    let mut along = [0.0; 64];
    for j in 0..8 {
        let row: [f32; 8] = std::array::from_fn(|i| value(i, j));
        for (u, weights) in cosines.iter().enumerate() {
            along[8 * j + u] = row.iter().zip(weights).map(|(a, b)| a * b).sum();
        }
    }
    let mut both = [0.0; 64];
    for (v, weights) in cosines.iter().enumerate() {
        for (j, weight) in weights.iter().enumerate() {
            for u in 0..8 {
                both[8 * v + u] += weight * along[8 * j + u];
            }
        }
    }
    both
}

/// Writes blocks as bits.
struct Coder {
    bytes: Vec<u8>,
    held: u32,
    n_held: u32,
    /// Mean of the block before.
    before: i32,
    dc: [Code; 256],
    ac: [Code; 256],
}

impl Coder {
    fn block(&mut self, values: &[i32; 64]) {
        let difference = values[0] - std::mem::replace(&mut self.before, values[0]);
        let size = magnitude(difference);
        self.put(self.dc[size as usize]);
        self.value(difference, size);
        let mut n_zeros = 0;
        for &value in &values[1..] {
            if value == 0 {
                n_zeros += 1;
                continue;
            }
            while n_zeros > 15 {
                self.put(self.ac[0xf0]);
                n_zeros -= 16;
            }
            let size = magnitude(value);
            self.put(self.ac[n_zeros << 4 | size as usize]);
            self.value(value, size);
            n_zeros = 0;
        }
        if n_zeros > 0 {
            self.put(self.ac[0]);
        }
    }

    /// A number by its lowest bits; negative ones less one.
    fn value(&mut self, value: i32, size: u32) {
        let bits = if value < 0 { value - 1 } else { value } as u32;
        self.put(Code { bits: bits & ((1 << size) - 1), n_bits: size });
    }

    fn put(&mut self, code: Code) {
        self.held = self.held << code.n_bits | code.bits;
        self.n_held += code.n_bits;
        while self.n_held >= 8 {
            self.n_held -= 8;
            let byte = (self.held >> self.n_held) as u8;
            self.bytes.push(byte);
            if byte == 0xff {
                self.bytes.push(0);
            }
        }
        self.held &= (1 << self.n_held) - 1;
    }

    fn finish(mut self) -> Vec<u8> {
        self.put(Code { bits: 0x7f, n_bits: 7 });
        self.bytes.extend([0xff, 0xd9]);
        self.bytes
    }
}

/// Bits that a number needs without its sign.
fn magnitude(value: i32) -> u32 {
    32 - value.unsigned_abs().leading_zeros()
}
