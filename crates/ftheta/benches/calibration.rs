//! Time of a fit by the number of marks, on a head with hidden errors.
#![allow(clippy::unwrap_used, reason = "a bench may stop at once")]

#[path = "../tests/hidden/mod.rs"]
mod hidden;

use divan::Bencher;
use ftheta::calibrate::calibrate::calibrate;
use ftheta::calibrate::table::Grid;
use hidden::Setup;

fn main() {
    divan::main();
}

/// Marks along a side: 9, 81, 289 and 4 225 of them.
#[divan::bench(args = [3, 9, 17, 65], sample_count = 3)]
fn physical_fit(bencher: Bencher<'_, '_>, n_side: usize) {
    let setup = Setup::new(n_side, 10.0, false);
    let marks = setup.marks(&setup.head(1), 1);
    bencher.bench_local(|| calibrate(&setup.optics(), &marks, &setup.options()).unwrap());
}

/// The table of a fit.
#[divan::bench(sample_count = 3)]
fn table(bencher: Bencher<'_, '_>) {
    let setup = Setup::new(5, 10.0, true);
    let marks = setup.marks(&setup.head(1), 1);
    let machine = ftheta::machines::find("S14-f420").unwrap();
    let calibration = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
    bencher.bench_local(|| calibration.table(&machine, Grid::default()).unwrap());
}
