//! The plate picture: sizes, determinism, and that marks are seen.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use ftheta_model::dose::DoseMap;
use ftheta_report::plate::{PlateOptions, plate_png};

/// Rings and a hatched square, as a beam of 30 µm leaves them.
fn map(pixel_mm: f64) -> DoseMap {
    let mut dose = DoseMap::new(pixel_mm);
    let n = (16.0 / pixel_mm) as i32;
    for j in -n..=n {
        for i in -n..=n {
            let (x, y) = (f64::from(i) * pixel_mm, f64::from(j) * pixel_mm);
            let radius = x.hypot(y);
            let mut energy = 0.0;
            for ring in 1..8 {
                let off = (radius - 2.0 * f64::from(ring)) / 0.015;
                energy += (-2.0 * off * off).exp();
            }
            if x.abs() < 1.0 && y.abs() < 1.0 {
                let off = ((y / 0.05 + 100.0).fract() - 0.5) * 0.05 / 0.015;
                energy += (-2.0 * off * off).exp();
            }
            if energy > 1e-4 {
                dose.add(i, j, (energy * 1e-6) as f32);
            }
        }
    }
    dose
}

fn size_px(png: &[u8]) -> (u32, u32) {
    let reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    (reader.info().width, reader.info().height)
}

#[test]
fn the_longest_side_is_as_asked() {
    let dose = map(0.02);
    for longest_side_px in [300, 1000] {
        let options = PlateOptions { page_mm: Some([30.0, 40.0]), longest_side_px };
        let png = plate_png(&dose, &options);
        let (width, height) = size_px(&png);
        assert!(width.max(height).abs_diff(longest_side_px) <= 2, "{width} {height}");
        assert!(height > width);
        assert_eq!(png, plate_png(&dose, &options));
        if let Ok(folder) = std::env::var("PLATE_OUT") {
            std::fs::write(format!("{folder}/plate{longest_side_px}.png"), &png).unwrap();
        }
    }
}

#[test]
fn an_empty_map_is_a_bare_plate() {
    let png = plate_png(&DoseMap::new(0.01), &PlateOptions::default());
    assert_eq!(size_px(&png).0, 2000 - 2000 * 35 / 1000);
}
