//! Marks of grids in photographs that the twin takes, and pictures that give none.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

mod sheet_picture;

use ftheta::calibrate::picture::error::PictureError;
use ftheta::calibrate::picture::{FieldSeen, MarkSeen, PictureOptions, find_field, find_marks};
use ftheta::model::pattern::{FeatureShape, MarkStyle, Pattern};
use ftheta::model::picture::{Picture, PixelPoint};
use ftheta::photograph::{Photograph, PhotographOptions};
use sheet_picture::{Sheet, tally};
use std::path::Path;

/// All marks that were burned are found, none else, and where they are: in the picture to
/// hundredths of a pixel, in the field to what the print of signs leaves, rms along each axis.
fn whole(name: &str, seen: &FieldSeen, photograph: &Photograph, [px, um]: [f64; 2]) {
    let tally = tally(seen, photograph);
    assert_eq!((tally.n_lost, tally.n_false), (0, 0), "{name}: {tally:?}");
    assert!(tally.off_px < px && tally.off_um < um, "{name}: {tally:?}");
}

#[test]
fn every_cross_is_found_and_nothing_else() {
    let crosses = Sheet::new(MarkStyle::Cross, 17, 240.0);
    for (name, seed, turn_deg, limits) in
        [("upright", 201, 0.0, [0.04, 20.0]), ("upside down", 202, 180.0, [0.04, 20.0])]
    {
        let photograph = crosses.taken(seed, &|options| options.camera.turn_deg = turn_deg);
        let seen = crosses.seen(&photograph).unwrap();
        assert!(seen.signs.len() > 36, "{name}: {}", seen.signs.len());
        whole(name, &seen, &photograph, limits);
    }
    let small = Sheet::new(MarkStyle::Cross, 9, 120.0);
    let rough = small.taken(203, &|options| {
        options.sensor.noise = 0.05;
        options.sensor.blur_px = 1.6;
        options.bright = true;
        options.camera.turn_deg = 90.0;
    });
    whole("rough", &small.seen(&rough).unwrap(), &rough, [0.12, 30.0]);
    let dots = Sheet::new(MarkStyle::Dot, 9, 120.0);
    let photograph = dots.taken(204, &|_| {});
    whole("dots", &dots.seen(&photograph).unwrap(), &photograph, [0.1, 30.0]);
}

/// A sheet that lies askew moves and turns what is measured, and not what a field by its marks is.
#[test]
fn a_sheet_that_lies_askew_does_not_matter() {
    let sheet = Sheet::new(MarkStyle::Cross, 9, 120.0);
    let crosses = sheet.pattern();
    let photograph = sheet.taken(205, &|options| options.sheet_lies = [2.0, -1.0, 0.8]);
    let straight = sheet.taken(205, &|_| {});
    let by_marks = |photograph: &Photograph| {
        let options =
            PictureOptions { sheet_mm: photograph.caliper_mm, ..PictureOptions::default() };
        find_field(&photograph.picture, &crosses, &options).unwrap().marks
    };
    for (askew, straight) in by_marks(&photograph).iter().zip(by_marks(&straight)) {
        if let (Some(a), Some(b)) = (askew.measured_mm, straight.measured_mm) {
            let off_mm = (a.x_mm - b.x_mm).hypot(a.y_mm - b.y_mm);
            assert!(off_mm < 0.06, "{}: {off_mm}", askew.id);
        }
    }
}

/// Where the 25 crosses of the project's reference picture are, by OpenCV's camera model.
const REFERENCE_PX: [[f64; 2]; 25] = [
    [372.5670, 991.5034],
    [579.0761, 1006.9710],
    [791.4572, 1021.6802],
    [1008.0534, 1035.4288],
    [1226.9924, 1048.0436],
    [370.8220, 787.2060],
    [581.7254, 800.1338],
    [798.8198, 812.8127],
    [1020.3308, 825.0915],
    [1244.2453, 836.8287],
    [370.2270, 574.0999],
    [585.1273, 584.1344],
    [806.5000, 594.5000],
    [1032.4639, 605.1102],
    [1260.8783, 615.8667],
    [370.9319, 353.5676],
    [589.3371, 360.4106],
    [814.4442, 368.2222],
    [1044.2811, 376.9933],
    [1276.5991, 386.6771],
    [373.0499, 127.3644],
    [594.3839, 130.8025],
    [822.5837, 135.8846],
    [1055.6077, 142.6887],
    [1291.1274, 151.2240],
];

#[test]
fn the_reference_crosses_are_found() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    let read = ftheta::import::picture(&folder.join("ref_crosses.jpg")).unwrap();
    let pattern = ftheta::import::pattern(&folder.join("ref_crosses.json")).unwrap();
    let marks = find_marks(&read.picture, &pattern).unwrap();
    let off = |(mark, [x, y]): (&MarkSeen, &[f64; 2])| {
        mark.pixel.unwrap().distance(PixelPoint::new(*x, *y))
    };
    let squares: f64 = marks.iter().zip(&REFERENCE_PX).map(off).map(|px| px * px).sum();
    let rms_px = (squares / 25.0).sqrt();
    assert!(marks.len() == 25 && rms_px < 0.05, "{rms_px}");
}

#[test]
fn pictures_that_show_no_grid_give_no_field() {
    let sheet = Sheet::new(MarkStyle::Cross, 9, 120.0);
    let coarse = |options: &mut PhotographOptions| {
        options.camera.megapixels = Some(3.0);
        options.burn.missing = 0.0;
    };
    let good = sheet.taken(211, &coarse);
    assert!(sheet.seen(&good).is_ok());
    let refused = |photograph: &Photograph| sheet.seen(photograph).unwrap_err();
    let mirrored = sheet.taken(211, &|options| {
        coarse(options);
        options.camera.mirrored = true;
    });
    assert_eq!(refused(&mirrored), PictureError::Mirrored);
    let with = |picture: Picture| Photograph { picture, ..good.clone() };
    let (width, height) = (good.picture.width(), good.picture.height());
    let cropped = {
        let rows = (0..height).flat_map(|y| good.picture.row(y)[..width / 2].to_vec());
        with(Picture::new(width / 2, height, rows.collect()).unwrap())
    };
    assert!(matches!(
        refused(&cropped),
        PictureError::FewSigns { .. } | PictureError::OtherGrid { .. }
    ));
    let twice = {
        let rows = (0..height).flat_map(|y| [good.picture.row(y), good.picture.row(y)].concat());
        with(Picture::new(2 * width, height, rows.collect()).unwrap())
    };
    assert!(matches!(refused(&twice), PictureError::SignTwice { .. }), "{}", refused(&twice));
    let white = sheet.taken(211, &|options| {
        coarse(options);
        options.sensor.exposure = 1.8;
    });
    let error = refused(&white);
    let expected = matches!(
        error,
        PictureError::Saturated { .. }
            | PictureError::FewMarks { .. }
            | PictureError::FewSigns { .. }
    );
    assert!(expected, "{error}");
    let blurred = sheet.taken(211, &|options| {
        coarse(options);
        options.sensor.blur_px = 6.0;
    });
    refused(&blurred);
    let wall = with(Picture::new(400, 300, vec![0.5; 120_000]).unwrap());
    assert!(matches!(refused(&wall), PictureError::NoContrast { .. }));
    let gravel = (0..400 * 300).map(|i| (i * 7919 % 101) as f32 / 101.0);
    let gravel = with(Picture::new(400, 300, gravel.collect()).unwrap());
    refused(&gravel);
}

#[test]
fn patterns_and_lengths_that_do_not_fit_are_named() {
    let sheet = Sheet::new(MarkStyle::Cross, 9, 120.0);
    let crosses = sheet.pattern();
    let good = sheet.taken(212, &|options| options.camera.megapixels = Some(3.0));
    let error = |pattern: &Pattern, options: &PictureOptions| {
        find_field(&good.picture, pattern, options).unwrap_err()
    };
    let plain = PictureOptions::default();
    assert!(matches!(error(&crosses, &plain), PictureError::SheetSize { axis: 'x', .. }));
    let wrong = PictureOptions { sheet_mm: [Some(120.0), Some(140.0)], ..plain };
    assert!(matches!(error(&crosses, &wrong), PictureError::WrongSheetSize { axis: 'x', .. }));
    let known = PictureOptions { sheet_mm: good.caliper_mm, ..plain };
    // Another grid with the same sheet, a sheet of other signs, no sheet, no marks.
    let mut other = crosses.clone();
    other.features.retain(|feature| match &feature.shape {
        FeatureShape::Mark(mark) => mark.column < 8,
        _ => true,
    });
    let found = error(&other, &known);
    assert!(matches!(found, PictureError::OtherGrid { found: [9, 9], known: [8, 9] }), "{found}");
    let mut strange = crosses.clone();
    for feature in &mut strange.features {
        if let FeatureShape::Fiducial { code, .. } = &mut feature.shape {
            *code = format!("{}", code.parse::<u32>().unwrap() + 20);
        }
    }
    assert!(matches!(error(&strange, &known), PictureError::StrangeSign { .. }));
    let mut bare = crosses.clone();
    bare.features.retain(|feature| matches!(feature.shape, FeatureShape::Mark(_)));
    assert_eq!(error(&bare, &plain), PictureError::NoScale);
    // Without signs marks are found all the same, as a scanner's picture has them.
    let marks = find_marks(&good.picture, &bare).unwrap();
    for mark in &marks {
        let known = good.truth.centres.iter().find(|(id, _)| *id == mark.id);
        assert_eq!(known.is_some(), mark.pixel.is_some(), "{}", mark.id);
        if let (Some((_, known)), Some(pixel)) = (known, mark.pixel) {
            assert!(known.pixel.distance(pixel) < 0.3, "{}", mark.id);
        }
    }
    bare.features.clear();
    assert!(matches!(error(&bare, &plain), PictureError::NoMarks { .. }));
}
