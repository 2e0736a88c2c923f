//! From a picture to delays, and to the marks of a field.
#![allow(clippy::unwrap_used, reason = "a bench may stop at once")]

#[path = "../tests/comb/mod.rs"]
mod comb;
#[path = "../tests/sheet_picture/mod.rs"]
mod sheet_picture;

use comb::Setup;
use divan::Bencher;
use ftheta::delay_calibration::calibrate_delay;
use ftheta::formats::picture_file::{read, write_jpeg};
use ftheta::model::pattern::MarkStyle;
use sheet_picture::Sheet;

fn main() {
    divan::main();
}

/// 12 megapixels, 289 crosses, forty signs.
#[divan::bench(sample_count = 10)]
fn field(bencher: Bencher) {
    let sheet = Sheet::new(MarkStyle::Cross, 17, 240.0);
    let taken = sheet.taken(1, &|_| {});
    bencher.bench(|| sheet.seen(&taken).unwrap());
}

/// The same picture's JPEG, only read.
#[divan::bench(sample_count = 10)]
fn read_jpeg(bencher: Bencher) {
    let taken = Sheet::new(MarkStyle::Cross, 17, 240.0).taken(1, &|_| {});
    let bytes = write_jpeg(&taken.picture, 92).unwrap();
    bencher.bench(|| read(&bytes).unwrap());
}

/// A comb of 120 lines in pictures of about 3 and 10 megapixels.
#[divan::bench(args = [20, 10], sample_count = 10)]
fn delays(bencher: Bencher, um_per_px: u32) {
    let setup = Setup { um_per_px: f64::from(um_per_px), ..Setup::comb() };
    let machine = setup.machine();
    let pattern = setup.pattern(&machine);
    let picture = setup.picture(&machine, &pattern, 1);
    bencher.bench(|| calibrate_delay(&picture, &pattern, &machine, None).unwrap());
}
