//! Mechanism files: what is read, and what is said of a faulty one.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::{Expect, expect};
use ftheta_formats::mechanism;
use ftheta_physics::mechanism::{Model, Part};

const GALLERY: &str = include_str!("../../../gallery/s10-mechanism.toml");

#[test]
fn gallery_file_is_read() {
    let found = mechanism::read("s10.toml", GALLERY).unwrap();
    let parts: Vec<Part> = found.segments.iter().map(|segment| segment.part).collect();
    assert_eq!(parts, [Part::Shaft, Part::Rotor, Part::Shaft, Part::Mount]);
    assert_eq!(found.segments[1].material.density_kg_m3, 7500.0);
    assert!((found.shaft_m() - 43e-3).abs() < 1e-12);
    assert_eq!(found.bearings[0].radial_n_m, 2e7);
    assert_eq!((found.mirror.stations.len(), found.mirror.width_m()), (4, 16.5e-3));
    found.check().unwrap();
}

/// Every outline is meshed, and its inertia is that of its area.
#[test]
fn outlines_have_the_inertia_of_their_area() {
    let line = "outline = \"octagon\"\nwidth_mm = 16.5\nheight_mm = 20.5\ncorner_mm = 4";
    assert!(GALLERY.contains(line));
    // Per thickness and density: w³h/12 of a rectangle, less 0.3 % for an ellipse's straight parts.
    let ellipse = std::f64::consts::PI / 64.0 * 16.5_f64.powi(3) * 20.5;
    let rectangle = 16.5_f64.powi(3) * 20.5 / 12.0;
    for (outline, expected, tolerance) in [
        ("outline = \"rectangle\"\nwidth_mm = 16.5\nheight_mm = 20.5", rectangle, 1e-9),
        (
            "outline = \"stations\"\nalong_mm = [0, 9, 20.5]\nwidths_mm = [16.5, 16.5, 16.5]",
            rectangle,
            1e-9,
        ),
        ("outline = \"ellipse\"\nwidth_mm = 16.5\nheight_mm = 20.5\nfoot_mm = 0.5", ellipse, 0.01),
    ] {
        let mechanism = mechanism::read("m.toml", &GALLERY.replace(line, outline)).unwrap();
        let found = Model::new(&mechanism).unwrap().inertias_kg_m2()[3];
        let mirror = &mechanism.mirror;
        // The plate's own thickness adds the area times h³/12.
        let area_mm2: f64 = mirror
            .stations
            .windows(2)
            .map(|pair| {
                0.5e6 * (pair[1].along_m - pair[0].along_m) * (pair[0].width_m + pair[1].width_m)
            })
            .sum();
        let expected = 2200.0 * (2e-3 * expected * 1e-12 + 8e-9 / 12.0 * area_mm2 * 1e-6);
        assert!((found / expected - 1.0).abs() < tolerance, "{outline}: {found} {expected}");
    }
}

fn check(from: &str, to: &str, expected: Expect) {
    assert!(GALLERY.contains(from), "{from}");
    let error = mechanism::read("m.toml", &GALLERY.replacen(from, to, 1)).unwrap_err();
    expected.assert_eq(&error.to_string());
}

#[test]
fn faults_name_line_value_and_limit() {
    check(
        "length_mm = 4",
        "length_mm = -4",
        expect!["m.toml:32: segment.length_mm = -4 is outside 0.01 to 1000"],
    );
    check(
        "diameter_mm = 3",
        "diameter_mm = 0",
        expect!["m.toml:33: segment.diameter_mm = 0 is outside 0.01 to 500"],
    );
    check(
        "diameter_mm = 3",
        "diameter_mm = 3\nbore_mm = 3",
        expect!["m.toml:34: segment.bore_mm = 3 is outside 0 to the diameter 3"],
    );
    check(
        "material = \"steel\"",
        "material = \"stel\"",
        expect![[
            r#"m.toml:34: segment.material = "stel" is outside the materials of the file: steel, magnet, aluminium, silica"#
        ]],
    );
    check(
        "part = \"rotor\"",
        "part = \"mount\"",
        expect![[
            r#"m.toml:30: segment = [[segment]] is outside segments with one of part = "rotor""#
        ]],
    );
}

#[test]
fn outlines_that_cannot_be_are_refused() {
    check(
        "corner_mm = 4",
        "corner_mm = 9",
        expect![
            "m.toml:67: mirror.corner_mm = 9 is outside less than half of width and height, 8.25"
        ],
    );
    check(
        "bond_mm = 3",
        "bond_mm = 30",
        expect!["m.toml:69: mirror.bond_mm = 30 is outside less than the height 20.5"],
    );
    check(
        "element_mm = 0.8",
        "element_mm = 0.1",
        expect![
            "m.toml:3: element_mm = 0.1 is outside what makes at most 4000 elements, it would be 34460 of them"
        ],
    );
    check(
        "position_mm = 36",
        "position_mm = 44",
        expect!["m.toml:60: bearing.position_mm = 44 is outside the shaft, 0 to 43.000"],
    );
    check(
        "thickness_mm = 2",
        "thickness = 2",
        expect![
            "m.toml:68: unknown key mirror.thickness, the unit is missing: did you mean thickness_mm?"
        ],
    );
    check(
        "poisson = 0.29",
        "poisson = 0.5",
        expect!["m.toml:9: material.poisson = 0.5 is outside 0 to 0.499"],
    );
    check(
        "outline = \"octagon\"",
        "outline = \"circle\"",
        expect![[
            r#"m.toml:64: mirror.outline = "circle" is outside "rectangle", "octagon", "ellipse", "stations""#
        ]],
    );
    check(
        "outline = \"octagon\"\nwidth_mm = 16.5\nheight_mm = 20.5\ncorner_mm = 4",
        "outline = \"stations\"\nalong_mm = [0, 0]\nwidths_mm = [5, 5]",
        expect![
            "m.toml:65: mirror.along_mm = [0, 0] is outside two and more distances, rising from 0"
        ],
    );
}
