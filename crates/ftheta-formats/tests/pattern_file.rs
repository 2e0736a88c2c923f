//! Pattern files: what is written is read, and what is wrong is named with its place.

use expect_test::expect;
use ftheta_formats::pattern_file::{read, write};
use ftheta_model::pattern::{
    Feature, FeatureShape, GridMark, LaserDelays, LineProcess, MarkStyle, Pattern,
};
use ftheta_model::space::FieldPoint;
use proptest::prelude::*;

fn pattern() -> Pattern {
    let (a, b) = (FieldPoint::new(-0.1, 1.0 / 3.0), FieldPoint::new(2e-7, 55.0));
    let process = LineProcess { speed_mm_s: 1234.5, power_ratio: 0.5 };
    let mark = |style, row| {
        FeatureShape::Mark(GridMark { style, place_mm: a, size_mm: 4.0, row, column: 64 })
    };
    let (family, code) = ("ring".to_owned(), "17".to_owned());
    let shapes = [
        FeatureShape::Line { from_mm: a, to_mm: b, process },
        FeatureShape::Circle { centre_mm: b, radius_mm: 0.7, process },
        mark(MarkStyle::Cross, 0),
        mark(MarkStyle::Dot, 3),
        FeatureShape::Fiducial { family, code, place_mm: b, size_mm: 5.0, burned: false },
        FeatureShape::Reference { from_mm: b, to_mm: a, burned: true },
    ];
    let named = |(index, shape)| Feature { id: format!("f{index}"), shape };
    Pattern {
        kind: "grid".into(),
        field_mm: 110.3,
        features: shapes.into_iter().enumerate().map(named).collect(),
        machine: Some("S14-f420".into()),
        laser: Some(LaserDelays { on_us: -20.0, off_us: -15.5 }),
    }
}

#[test]
fn what_was_written_is_read() {
    let text = write(&pattern());
    assert_eq!(read(text.as_bytes()), Ok(pattern()));
    assert_eq!(read(format!("\u{feff}{text}").as_bytes()), Ok(pattern()));
    let bare = Pattern { machine: None, laser: None, features: Vec::new(), ..pattern() };
    assert_eq!(read(write(&bare).as_bytes()), Ok(bare));
}

#[test]
fn files_of_others_are_read() {
    let text = r#"{"kind": "grid", "field_mm": 110, "machine": null, "more": [1],
        "features": [{"id": 7, "kind": "cross", "x_mm": -50.0, "y_mm": 25, "size_mm": 6,
                      "row": 0, "column": 1, "note": "ours"}],
        "laser": {"on_us": 0, "off_us": 0}}"#;
    let read = read(text.as_bytes()).unwrap();
    let (id, mark) = read.marks().next().unwrap();
    assert_eq!((id, mark.place_mm, mark.column), ("7", FieldPoint::new(-50.0, 25.0), 1));
    assert_eq!((read.machine, read.laser), (None, Some(LaserDelays::default())));
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let text = write(&pattern());
    let changed = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        read(changed.as_bytes()).unwrap_err().to_string()
    };
    let found = [
        changed("}", ""),
        changed("\"kind\":\"line\"", "\"kind\":\"spline\""),
        changed("\"f1\"", "\"f0\""),
        changed("\"x1_mm\":-0.1", "\"x1_mm\":\"-0.1\""),
        changed("\"x1_mm\":-0.1", "\"x1_mm\":1e7"),
        changed("\"x1_mm\":-0.1,", ""),
        changed("\"row\":3", "\"row\":-1"),
        changed("\"row\":3", "\"row\":1.5"),
        changed("\"burned\":false", "\"burned\":null"),
        changed("\"on_us\":-20.0", "\"on_us\":[]"),
        changed("\"field_mm\":110.3", "\"field_mm\":0"),
        changed("\"machine\":\"S14-f420\"", "\"machine\":{}"),
        changed("\"features\":[", "\"features\":[7,"),
        read(b"[]").unwrap_err().to_string(),
        read(b"{\"features\":3}").unwrap_err().to_string(),
        read(b"").unwrap_err().to_string(),
    ];
    expect![[r#"
        line 1, column 143: key must be a string
        features[0].kind is "spline", expected line, circle, cross, dot, fiducial or reference
        features[1].id is "f0", expected a name of its own
        features[0].x1_mm is "-0.1", expected -1000000 to 1000000
        features[0].x1_mm is 10000000.0, expected -1000000 to 1000000
        features[0].x1_mm is missing, expected -1000000 to 1000000
        features[3].row is -1, expected 0 to 1000000
        features[3].row is 1.5, expected a whole number
        features[4].burned is missing, expected true or false
        laser.on_us is a list of 0, expected -1000000 to 1000000
        field_mm is 0, expected 0.001 to 1000000
        machine is an object, expected text
        features[0] is 7, expected an object
        the file is a list of 0, expected an object
        features is 3, expected a list of features
        line 1, column 0: EOF while parsing a value"#]]
    .assert_eq(&found.join("\n"));
    let deep = "[".repeat(100_000);
    assert!(read(deep.as_bytes()).is_err());
}

proptest! {
    #[test]
    fn no_bytes_cause_a_panic(at in 0usize..1200, with in any::<[u8; 3]>()) {
        let mut bytes = write(&pattern()).into_bytes();
        let at = at.min(bytes.len() - 3);
        bytes[at..at + 3].copy_from_slice(&with);
        let _ = read(&bytes);
    }
}
