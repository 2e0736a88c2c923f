//! Patterns to measure: marks at their places, labels clear of them, errors where it cannot be.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta::pattern::grid::{GridOptions, label, sheet};
use ftheta::pattern::sheet::{Sheet, SheetProcess};
use ftheta::pattern::square;
use ftheta_formats::machine::preset;
use ftheta_formats::points::{self, Points};
use ftheta_formats::{pattern_file, svg, svg_write};
use ftheta_model::job::Job;
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{FeatureShape, MarkStyle};
use ftheta_model::recipe::Recipe;
use ftheta_physics::optics::{angles_from_field, field_from_angles};
use kurbo::{Rect, Shape as _};

fn machine() -> Machine {
    preset("S14-f420").unwrap().unwrap()
}

fn options(n_side: u32) -> GridOptions {
    GridOptions {
        n_side,
        field_mm: 280.0,
        style: MarkStyle::Cross,
        size_mm: None,
        process: SheetProcess::of(&machine()),
    }
}

fn grid(n_side: u32, style: MarkStyle) -> Sheet {
    sheet(&GridOptions { style, ..options(n_side) }, &machine()).unwrap()
}

/// Bounds of the shapes of a layer with their sources.
fn bounds(job: &Job, layer: usize) -> Vec<(String, Rect)> {
    let shapes = job.layers[layer].shapes.iter();
    shapes.map(|shape| (shape.source.clone(), shape.path.bounding_box())).collect()
}

/// Every label is clear of every arm, disc, label and sign, by three spots, and inside the marks.
#[test]
fn labels_touch_nothing() {
    for (n_side, style) in [
        (3, MarkStyle::Cross),
        (9, MarkStyle::Cross),
        (17, MarkStyle::Dot),
        (65, MarkStyle::Cross),
        (65, MarkStyle::Dot),
    ] {
        let made = grid(n_side, style);
        let clear_mm = 2.9 * machine().laser.spot_diameter_mm;
        let half_mm = 140.0 + 0.5 * made.pattern.marks().next().unwrap().1.size_mm;
        let field = Rect::new(-half_mm, -half_mm, half_mm, half_mm);
        // Arms and discs, each a rectangle.
        let arms: Vec<Rect> = made
            .pattern
            .marks()
            .flat_map(|(_, mark)| {
                let (x, y, half) = (mark.place_mm.x_mm, mark.place_mm.y_mm, 0.5 * mark.size_mm);
                match mark.style {
                    MarkStyle::Cross => vec![
                        Rect::new(x - half, y, x + half, y),
                        Rect::new(x, y - half, x, y + half),
                    ],
                    MarkStyle::Dot => vec![Rect::new(x - half, y - half, x + half, y + half)],
                }
            })
            .collect();
        let labels = bounds(&made.job, 1);
        assert_eq!(labels.len(), (n_side * n_side) as usize + 4);
        let pitch_mm = 280.0 / f64::from(n_side - 1);
        for (index, (source, label)) in labels.iter().enumerate() {
            let grown = label.inflate(clear_mm, clear_mm);
            assert_eq!(grown.union(field), field, "{source} of {n_side}");
            let near = |other: &&Rect| (other.center() - label.center()).hypot() < 3.0 * pitch_mm;
            for arm in arms.iter().filter(near) {
                let apart = arm.x0 >= grown.x1
                    || arm.x1 <= grown.x0
                    || arm.y0 >= grown.y1
                    || arm.y1 <= grown.y0;
                assert!(apart, "{source} of {n_side} at {label:?} touches {arm:?}");
            }
            let is_sign = |source: &str| !source.starts_with("label");
            for (other, bounds) in &labels[index + 1..] {
                let signs = is_sign(source) && is_sign(other);
                assert!(
                    signs || grown.intersect(*bounds).area() == 0.0,
                    "{source} and {other} of {n_side}"
                );
            }
        }
    }
}

#[test]
fn a_grid_is_written_with_its_places_and_marked_there() {
    let made = grid(5, MarkStyle::Cross);
    assert_eq!(
        pattern_file::read(pattern_file::write(&made.pattern).as_bytes()),
        Ok(made.pattern.clone())
    );
    // The drawing reads back with its crosses at the nominal places, to the last bits.
    let read = svg::read(
        svg_write::to_svg(&made.job).as_bytes(),
        &Recipe::default(),
        &svg::SvgOptions::default(),
    );
    let read = read.unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    let machine = machine();
    let mut n_crosses = 0;
    for ((_, mark), (_, found)) in made.pattern.marks().zip(bounds(&read.value, 0)) {
        let centre = found.center();
        let (dx, dy) = (centre.x - mark.place_mm.x_mm, centre.y - mark.place_mm.y_mm);
        assert!(dx.hypot(dy) < 1e-9 && (found.width() - mark.size_mm).abs() < 1e-9, "{found:?}");
        // And the nominal inverse puts the beam there.
        let angles = angles_from_field(&machine.optics, mark.place_mm).unwrap();
        let lands = field_from_angles(&machine.optics, angles);
        assert!((lands.x_mm - mark.place_mm.x_mm).hypot(lands.y_mm - mark.place_mm.y_mm) < 1e-9);
        n_crosses += 1;
    }
    assert_eq!(n_crosses, 25);
    let ids: Vec<&str> = made.pattern.marks().map(|(id, _)| id).collect();
    assert_eq!((ids[0], ids[7], ids[24]), ("A1", "C2", "E5"));
    assert_eq!([label(25, 0), label(26, 0), label(64, 64)], ["Z1", "AA1", "BM65"]);
}

#[test]
fn files_go_together() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("grid.svg");
    let files = grid(3, MarkStyle::Dot).write(&out).unwrap();
    let read = |kind: &str| {
        let path = &files.iter().find(|file| file.0 == kind).unwrap().1;
        std::fs::read_to_string(path).unwrap()
    };
    expect![[r##"
        # How the pattern is marked.

        [[pen]]
        name = "pattern"
        color = "#000000"
        mark_speed_mm_s = 1000
        power_w = 10
        hatch_spacing_mm = 0.0560 # dots are filled with lines this far apart
        target_x_mm,target_y_mm,measured_x_mm,measured_y_mm,round,mark
        -140,-140,,,1,A1
        0,-140,,,1,B1
        140,-140,,,1,C1
        -140,0,,,1,A2
        0,0,,,1,B2
        140,0,,,1,C2
        -140,140,,,1,A3
        0,140,,,1,B3
        140,140,,,1,C3
    "##]]
    .assert_eq(&(read("recipe") + &read("points")));
    let (recipe, beside) = ftheta::import::recipe_for(&out, None).unwrap();
    assert_eq!(beside, Some(folder.path().join("grid.recipe.toml")));
    let drawing = ftheta::import::drawing(&out, &recipe, &svg::SvgOptions::default()).unwrap();
    let job = drawing.value;
    assert!(job.shapes().all(|shape| job.pens[shape.pen_index].hatch.is_some()));
    // Filled in, the table is what a calibration reads.
    let filled = read("points").replace(",,,", ",1.5,2,");
    let points = points::read("grid.csv", filled.as_bytes()).unwrap();
    assert!(points.warnings.is_empty(), "{:?}", points.warnings);
    let Points::Measured(points) = points.value else { unreachable!("targets are in mm") };
    // Made again it is the same, but not over what a user has measured.
    grid(3, MarkStyle::Dot).write(&out).unwrap();
    std::fs::write(out.with_extension("csv"), &filled).unwrap();
    let error = grid(3, MarkStyle::Dot).write(&out).unwrap_err();
    assert!(error.to_string().contains("grid.csv: has measured places"), "{error}");
    assert_eq!(
        ftheta::import::measured_points(&out.with_extension("csv"), None).unwrap().value.len(),
        9
    );
    let made = grid(3, MarkStyle::Dot).pattern;
    assert_eq!(ftheta::import::pattern(&out.with_extension("json")).unwrap(), made);
    let bits = folder.path().join("bits.csv");
    std::fs::write(&bits, "-2000 0 -5 0\n2000 0 5 0\n").unwrap();
    assert!(
        ftheta::import::measured_points(&bits, None)
            .unwrap_err()
            .to_string()
            .contains("--units-per-mm")
    );
    assert_eq!(
        ftheta::import::measured_points(&bits, Some(400.0)).unwrap().value[0].target_mm.x_mm,
        -5.0
    );
    assert_eq!((points.len(), points[8].target_mm.x_mm, points[8].line), (9, 140.0, 10));
    assert!(grid(3, MarkStyle::Dot).write(&folder.path().join("grid.txt")).is_err());
}

#[test]
fn grids_that_do_not_fit_are_refused() {
    let error = |change: &dyn Fn(&mut GridOptions)| {
        let mut options = options(9);
        change(&mut options);
        sheet(&options, &machine()).unwrap_err().to_string()
    };
    let found = [
        error(&|o| o.field_mm = 330.0),
        error(&|o| o.field_mm = f64::NAN),
        error(&|o| o.size_mm = Some(22.0)),
        error(&|o| o.size_mm = Some(0.2)),
        error(&|o| o.n_side = 8),
        error(&|o| o.n_side = 67),
        error(&|o| (o.n_side, o.field_mm) = (65, 100.0)),
        square::sheet(400.0, &SheetProcess::of(&machine()), &machine()).unwrap_err().to_string(),
    ];
    expect![[r#"
        a field of 330 mm with marks of 8 mm reaches over 338 mm, the machine's field is 336 mm
        a field of NaN mm with marks of 8 mm reaches over NaN mm, the machine's field is 336 mm
        marks of 22 mm are too large, 21 mm is the limit with 35 mm between centres
        marks of 0.2 mm are too small for a spot of 0.08 mm, 0.32 mm is the limit
        8 marks along a side, expected an odd number from 3 to 65
        67 marks along a side, expected an odd number from 3 to 65
        65 x 65 marks on 100 mm leave room for labels of 0.223 mm, 0.480 mm is the limit
        a field of 400 mm with marks of 0 mm reaches over 400 mm, the machine's field is 336 mm"#]]
    .assert_eq(&found.join("\n"));
}

#[test]
fn the_square_has_nine_places() {
    let made = square::sheet(200.0, &SheetProcess::of(&machine()), &machine()).unwrap();
    assert_eq!(
        (made.pattern.kind.as_str(), made.pattern.features.len(), made.places.len()),
        ("square", 6, 9)
    );
    assert!(made.pattern.features.iter().all(|f| matches!(f.shape, FeatureShape::Line { .. })));
    let (name, place) = &made.places[8];
    assert_eq!((name.as_str(), place.x_mm, place.y_mm), ("upper right", 100.0, 100.0));
}
