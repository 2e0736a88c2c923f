//! What calibration reaches on heads with hidden errors, beside the figures asked for.
//!
//! `cargo run --release -p ftheta --example 04_calibration_figures [HEADS]`
#![allow(clippy::unwrap_used, reason = "a campaign may stop at once")]

#[path = "../tests/hidden/mod.rs"]
mod hidden;

use ftheta::calibrate::calibrate::Model;
use hidden::Setup;

/// Marks a side, noise, whether the lens' polynomial is known, what is asked.
const PHYSICAL: [(usize, f64, bool, &str); 11] = [
    (3, 10.0, true, "18 / 34"),
    (5, 10.0, false, "9 / 21"),
    (9, 10.0, false, "6 / 17"),
    (17, 10.0, false, "4 / 13"),
    (3, 2.0, true, "14 / 26"),
    (5, 2.0, false, "4 / 9"),
    (9, 2.0, false, "2.2 / 7"),
    (17, 2.0, false, "1.4 / 5"),
    (3, 50.0, true, "44 / 95"),
    (3, 10.0, false, "34 / 54"),
    (5, 50.0, false, "36 / 80"),
];

/// Surfaces, as in the tables of `optics.md` B.2, whose marks reach 5 % beyond the field.
const OVER_THE_EDGE: [(Model, usize, &str); 4] = [
    (Model::Polynomial, 9, "6.9 / 17, within 15 %"),
    (Model::Polynomial, 17, "4.4 / 12, within 15 %"),
    (Model::Zones, 9, "10.5 / 26, within 15 %"),
    (Model::Zones, 17, "5.4 / 15, within 15 %"),
];

fn main() {
    let n_heads: u64 = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(20);
    let row = |name: &str, setup: Setup, asked: &str| {
        let results: Vec<_> = (1000..1000 + n_heads).map(|seed| setup.errors_um(seed)).collect();
        let mean =
            |value: &dyn Fn(&(ftheta::calibrate::calibrate::Calibration, f64, f64)) -> f64| {
                results.iter().map(value).sum::<f64>() / n_heads as f64
            };
        let outliers: usize = results.iter().map(|r| r.0.outliers.len()).sum();
        println!(
            "{name:44} {:7.1} / {:7.1}   expected {:6.1} / {:6.1}   noise {:5.1}   left out {:6.1}   wrong {outliers}   asked {asked}",
            mean(&|r| r.1),
            mean(&|r| r.2),
            mean(&|r| r.0.expected.rms_mm * 1e3),
            mean(&|r| r.0.expected.max_mm * 1e3),
            mean(&|r| r.0.noise_mm * 1e3),
            mean(&|r| r.0.left_out.map_or(f64::NAN, |l| l.rms_mm) * 1e3),
        );
    };
    println!("mean over {n_heads} heads, 280 mm, rms / mean of maxima, µm");
    for (n, noise, polynomial, asked) in PHYSICAL {
        let setup = Setup::new(n, noise, polynomial);
        let lens = if polynomial { "polynomial" } else { "focal length" };
        row(&format!("{} marks, {noise} µm, {lens}", n * n), setup, asked);
    }
    row(
        "25 marks, 10 µm, 120 mm",
        Setup { field_mm: 120.0, ..Setup::new(5, 10.0, false) },
        "8 / 19",
    );
    row("289 marks, 10 µm, stress", Setup { stress: 5.0, ..Setup::new(17, 10.0, false) }, "7 / 20");
    for field_mm in [120.0, 150.0, 200.0, 250.0, 280.0] {
        for model in [Model::Scale, Model::NinePoint, Model::Physical] {
            let setup = Setup { field_mm, model: Some(model), ..Setup::new(3, 50.0, false) };
            let asked = if field_mm <= 200.0 { "thesis 500, 100" } else { "thesis 1000, 300" };
            row(&format!("{field_mm} mm, 9 marks, 50 µm, {}", model.name()), setup, asked);
        }
    }
    for (model, n, asked) in OVER_THE_EDGE {
        let setup = Setup { model: Some(model), reach: 1.05, ..Setup::new(n, 10.0, false) };
        let name = format!("{}, {} marks over 105 % of the field", model.name(), n * n);
        row(&name, setup, asked);
    }
    for model in Model::ALL {
        for n in [3, 5, 9, 17] {
            if n * n < model.n_marks_min() {
                continue;
            }
            let setup = Setup { model: Some(model), ..Setup::new(n, 10.0, false) };
            row(&format!("{}, {} marks, focal length", model.name(), n * n), setup, "");
        }
    }
}
