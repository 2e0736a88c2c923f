//! No picture makes anything panic, however small or strange, and none of noise gives a number.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::calibrate::picture::{PictureOptions, find_field, find_marks};
use ftheta::delay_calibration::calibrate_delay;
use ftheta::formats::picture_file::PictureRead;
use ftheta::machines;
use ftheta::model::pattern::{MarkStyle, Pattern};
use ftheta::model::picture::Picture;
use ftheta::pattern::delay::{self, DelayOptions, Method};
use ftheta::pattern::fiducials;
use ftheta::pattern::grid::{self, GridOptions};
use ftheta::pattern::sheet::SheetProcess;
use proptest::prelude::*;
use std::sync::LazyLock;

static PATTERNS: LazyLock<Vec<Pattern>> = LazyLock::new(|| {
    let machine = machines::find("S14-f420").unwrap();
    let process = SheetProcess::of(&machine);
    let grid = |style| {
        let options = GridOptions { n_side: 3, field_mm: 100.0, style, size_mm: None, process };
        fiducials::around(grid::sheet(&options, &machine).unwrap()).unwrap().pattern
    };
    let delay =
        |method| delay::sheet(&DelayOptions::usual(method, &machine), &machine).unwrap().pattern;
    vec![
        grid(MarkStyle::Cross),
        grid(MarkStyle::Dot),
        delay(Method::Comb),
        delay(Method::Rectangle),
    ]
});

/// Noise, stripes, squares, or all of them, of any size.
fn picture() -> impl Strategy<Value = Picture> {
    let size = (1_usize..90, 1_usize..90);
    (size, any::<u64>(), 1_usize..20, 1_usize..20, 0.0_f32..1.0).prop_map(
        |((width, height), seed, column, row, noise)| {
            let mut state = seed | 1;
            let values = (0..width * height).map(|index| {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                let random = (state >> 40) as f32 / (1 << 24) as f32;
                let (x, y) = (index % width, index / width);
                let stripes = ((x / column) % 2) as f32 * 0.5 + ((y / row) % 2) as f32 * 0.5;
                noise * random + (1.0 - noise) * stripes
            });
            Picture::new(width, height, values.collect()).unwrap()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
    #[test]
    fn strange_pictures_give_no_number(picture in picture()) {
        let machine = machines::find("S14-f420").unwrap();
        for pattern in PATTERNS.iter() {
            let sheet_mm = [Some(120.0), Some(120.0)];
            for mm_per_px in [None, Some(0.1)] {
                let options = PictureOptions { sheet_mm, mm_per_px, ..PictureOptions::default() };
                let found = find_field(&picture, pattern, &options);
                prop_assert!(mm_per_px.is_some() || found.is_err());
            }
            let _ = find_marks(&picture, pattern);
            let read = PictureRead {
                picture: picture.clone(),
                saturated_ratio: 0.0,
                bits: 8,
                notes: Vec::new(),
            };
            prop_assert!(calibrate_delay(&read, pattern, &machine, None).is_err());
        }
    }
}
