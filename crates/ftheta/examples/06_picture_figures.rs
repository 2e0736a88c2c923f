//! Delays and fields found in photographs of the twin, beside the figures asked for.
//!
//! `cargo run --release -p ftheta --example 06_picture_figures [PICTURES [ROWS]]`
//!
//! `ROWS` is a part of the names of the rows to print.
#![allow(clippy::unwrap_used, reason = "a campaign may stop at once")]

#[path = "../tests/comb/mod.rs"]
mod comb;
#[path = "../tests/sheet_picture/mod.rs"]
mod sheet_picture;

use comb::Setup;
use ftheta::model::pattern::MarkStyle;
use ftheta::pattern::delay::LineAxis;
use ftheta::photograph::PowerRule;
use sheet_picture::Sheet;

/// Seed of the first picture of a row.
const FIRST_SEED: u64 = 2000;

fn main() {
    let n: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(50);
    let rows = std::env::args().nth(2).unwrap_or_default();
    delays(n, &rows);
    fields(n, &rows);
}

/// Marks of grids in 12 megapixels: what is asked for is 289 of 289, none false, 12 µm.
fn fields(n: u64, rows: &str) {
    println!("marks over {n} pictures of 12 megapixels, seeds from {FIRST_SEED}");
    for (name, sheet) in [
        ("17 x 17 crosses, 240 mm", Sheet::new(MarkStyle::Cross, 17, 240.0)),
        (
            "17 x 17 crosses, print without errors",
            Sheet { print_errors: false, ..Sheet::new(MarkStyle::Cross, 17, 240.0) },
        ),
        ("17 x 17 dots, 240 mm", Sheet::new(MarkStyle::Dot, 17, 240.0)),
        ("9 x 9 crosses, 120 mm", Sheet::new(MarkStyle::Cross, 9, 120.0)),
        ("65 x 65 crosses, 240 mm", Sheet::new(MarkStyle::Cross, 65, 240.0)),
    ] {
        if !name.contains(rows) {
            continue;
        }
        let n = if sheet.n_side > 17 { n.div_ceil(10) } else { n };
        let all: Vec<_> = (0..n).map(|seed| sheet.tally(FIRST_SEED + seed)).collect();
        let found: Vec<_> = all.iter().flatten().collect();
        let total = |of: fn(&sheet_picture::Tally) -> usize| {
            found.iter().map(|tally| of(tally)).sum::<usize>()
        };
        let mean = |of: fn(&sheet_picture::Tally) -> f64| {
            found.iter().map(|tally| of(tally)).sum::<f64>() / found.len() as f64
        };
        let most = found.iter().map(|tally| tally.left_um).fold(0.0, f64::max);
        println!(
            "{name:42} lost {} of {}, false {}  {:.3} px  against the truth {:5.1} µm, less place, \
             turn and scale {:4.1} µm (most {most:.1}), rms along an axis  refused {}",
            total(|t| t.n_lost),
            total(|t| t.n_burned),
            total(|t| t.n_false),
            mean(|t| t.off_px),
            mean(|t| t.off_um),
            mean(|t| t.left_um),
            all.len() - found.len(),
        );
        if let Some(Err(error)) = all.iter().find(|tally| tally.is_err()) {
            println!("    refused: {error}");
        }
    }
}

fn delays(n: u64, rows: &str) {
    println!("errors over {n} pictures, seeds from {FIRST_SEED}, mean ± deviation, µs");
    let comb = Setup::comb();
    let constant = Some(PowerRule::Constant);
    for (name, setup, asked) in [
        ("comb, 20 µm/px", comb, "0.3, mean 0.1"),
        ("comb along y", Setup { axis: LineAxis::Y, ..comb }, "0.3, mean 0.1"),
        ("comb, 40 µm/px", Setup { um_per_px: 40.0, ..comb }, "0.5"),
        ("comb, dose ±10 %", Setup { dose_slope: 0.1, ..comb }, "0.6"),
        ("comb, constant power", Setup { power: constant, ..comb }, "1.5"),
        (
            "comb, jitter 10 µm, noise 5 %, blur 2 px",
            Setup { jitter_um: 10.0, noise: 0.05, blur_px: 2.0, ..comb },
            "",
        ),
        (
            "comb, bright on dark, turned by 180°",
            Setup { bright: true, turn_deg: 180.0, ..comb },
            "",
        ),
        ("comb, negative delays", Setup { late_us: [-70.0, -95.0], ..comb }, "0.3, mean 0.1"),
        ("comb, nulling pass", Setup { late_us: [0.7, -0.4], ..comb }, "0.3, mean 0.1"),
        ("comb, spot of 30 µm", Setup { spot_um: 30.0, ..comb }, ""),
        ("comb, shades of gamma 2.2", Setup { gamma: 2.2, ..comb }, ""),
        ("rectangle, 5 m/s", Setup::rectangle(), "5.5 is the patent's"),
        ("rectangle, spot of 30 µm", Setup { spot_um: 30.0, ..Setup::rectangle() }, ""),
    ] {
        if !name.contains(rows) {
            continue;
        }
        let results: Vec<_> = (0..n).map(|seed| setup.errors(FIRST_SEED + seed)).collect();
        let found: Vec<_> = results.iter().flatten().collect();
        let row = |value: fn(&comb::Errors) -> f64| {
            let n = found.len() as f64;
            let mean = found.iter().map(|e| value(e)).sum::<f64>() / n;
            let sum = found.iter().map(|e| (value(e) - mean).powi(2)).sum::<f64>();
            let most = found.iter().map(|e| value(e).abs()).fold(0.0, f64::max);
            format!("{mean:6.3} ± {:.3} (most {most:.2})", (sum / (n - 1.0).max(1.0)).sqrt())
        };
        println!(
            "{name:42} on {}  off {}  mean {}  stated {:.2}  refused {}  asked {asked}",
            row(|e| e.on_us),
            row(|e| e.off_us),
            row(|e| e.mean_us),
            found.iter().map(|e| e.sd_us).sum::<f64>() / found.len() as f64,
            results.len() - found.len(),
        );
        if let Some(Err(error)) = results.iter().find(|result| result.is_err()) {
            println!("    refused: {error}");
        }
    }
}
