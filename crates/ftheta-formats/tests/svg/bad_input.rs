//! Damaged and senseless files give clear errors.

use expect_test::{Expect, expect};
use flate2::Compression;
use flate2::write::GzEncoder;
use ftheta_formats::svg::{SvgOptions, read};
use ftheta_model::recipe::Recipe;
use std::io::Write;

/// Start of a drawing of 9 x 9 mm.
pub const HEAD: &str = "<svg xmlns='http://www.w3.org/2000/svg' \
                    xmlns:xlink='http://www.w3.org/1999/xlink' width='9mm' height='9mm' \
                    viewBox='0 0 9 9'>";
/// A line that is marked.
pub const LINE: &str = "<path id='ok' d='M0 0L9 9' stroke='red'/>";

/// The error or the warnings, and the three parts of the error's fault.
pub fn outcome(bytes: &[u8]) -> String {
    match read(bytes, &Recipe::default(), &SvgOptions::default()) {
        Ok(imported) => {
            let shapes: Vec<_> = imported.value.shapes().map(|shape| &shape.source).collect();
            let mut out = format!("{shapes:?}\n");
            for warning in &imported.warnings {
                out += &format!("{warning}\n");
            }
            out
        }
        Err(error) => format!("{error}\n{:?}\n", error.fault()),
    }
}

/// Checks the outcome of a file.
pub fn check(bytes: impl AsRef<[u8]>, expected: Expect) {
    expected.assert_eq(&outcome(bytes.as_ref()));
}

/// An otherwise good drawing with `content` in it.
pub fn check_content(content: &str, expected: Expect) {
    check(format!("{HEAD}{LINE}{content}</svg>"), expected);
}

#[test]
fn no_svg_at_all() {
    check(
        "",
        expect![[r#"
        the file is empty
        ("", "0 bytes", "")
    "#]],
    );
    check(
        " \n ",
        expect![[r#"
        the file is empty
        ("", "0 bytes", "")
    "#]],
    );
    check(
        "hello",
        expect![[r#"
            line 1, column 1: unknown token
            ("line 1, column 1", "", "")
        "#]],
    );
    check(
        [0u8, 159, 146, 150],
        expect![[r#"
        byte 1 is not text: neither UTF-8 nor UTF-16 with a byte order mark
        ("byte 1", "", "UTF-8 or UTF-16")
    "#]],
    );
    check(
        "<html><body/></html>",
        expect![[r#"
        the outermost element is <html>, not <svg>
        ("", "<html>", "<svg>")
    "#]],
    );
    check(
        "\u{0}\u{0}\u{0}\u{1}",
        expect![[r#"
            line 1, column 1: unknown token
            ("line 1, column 1", "", "")
        "#]],
    );
    check(
        format!("{HEAD}{LINE}"),
        expect![[r#"
            line 1: the file ends before <svg> is closed
            ("line 1", "", "</svg>")
        "#]],
    );
    check(
        &format!("{HEAD}{LINE}")[..150],
        expect![[r#"
            line 1: the file ends before <svg> is closed
            ("line 1", "", "</svg>")
        "#]],
    );
}

#[test]
fn encodings() {
    let drawing = format!("{HEAD}{LINE}</svg>");
    let with_mark = |little_endian: bool| -> Vec<u8> {
        let units = std::iter::once(0xfeff).chain(drawing.encode_utf16());
        units
            .flat_map(|unit| if little_endian { unit.to_le_bytes() } else { unit.to_be_bytes() })
            .collect()
    };
    let good = outcome(drawing.as_bytes());
    assert_eq!(outcome(&with_mark(true)), good);
    assert_eq!(outcome(&with_mark(false)), good);
    assert_eq!(outcome(format!("\u{feff}{drawing}").as_bytes()), good);
    let latin1 = [b"<?xml version='1.0' encoding='ISO-8859-1'?><!-- \xe9 -->", drawing.as_bytes()];
    assert_eq!(outcome(&latin1.concat()), good);
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(drawing.as_bytes()).unwrap();
    let packed = gzip.finish().unwrap();
    assert_eq!(outcome(&packed), good);
    check(
        &packed[..packed.len() / 2],
        expect![[r#"
        the compressed file is damaged: incomplete deflate stream
        ("", "incomplete deflate stream", "")
    "#]],
    );
    check(
        [0xff, 0xfe, b'<'],
        expect![[r#"
        byte 2 is not text: neither UTF-8 nor UTF-16 with a byte order mark
        ("byte 2", "", "UTF-8 or UTF-16")
    "#]],
    );
}

#[test]
fn numbers_that_are_none() {
    check_content(
        "<path id='p' d='M0 0L1e400 1' stroke='red'/>",
        expect![[r##"
            ["#ok"]
            #p: bad path data, kept up to the error: invalid number at position 6
        "##]],
    );
    check_content(
        "<path id='p' d='M0 0L5 5LNaN 1' stroke='red'/>",
        expect![[r##"
            ["#ok", "#p"]
            #p: bad path data, kept up to the error: invalid number at position 10
        "##]],
    );
    check_content(
        "<path id='p' d='M0 0L1e300 1' stroke='red'/>",
        expect![[r##"
            ["#ok"]
            #p: coordinates beyond 1 km or not finite, left out
        "##]],
    );
    check_content(
        "<polyline id='p' points='0,0 1,1 2,2 3 x 4' fill='none' stroke='red'/>",
        expect![[r##"
            ["#ok", "#p"]
            #p: bad points, kept up to the error
        "##]],
    );
    check_content(
        "<circle id='c' r='1e300'/>",
        expect![[r##"
            ["#ok"]
            #c: coordinates beyond 1 km or not finite, left out
        "##]],
    );
    check_content(
        "<circle id='c' r='inf'/>",
        expect![[r##"
            ["#ok"]
            #c: r="inf" is no length, taken as 0
        "##]],
    );
    check_content(
        "<circle id='c' r='-2'/>",
        expect![[r##"
            ["#ok"]
            #c: r is negative, so it is left out
        "##]],
    );
}

#[test]
fn values_without_meaning() {
    check_content(
        "<rect id='r' width='2furlongs' height='2'/>",
        expect![[r##"
            ["#ok", "#r"]
            #r: unknown unit in width="2furlongs", taken as px
        "##]],
    );
    check_content(
        "<path id='p' d='M0 0A1e308 1e-308 7 1 1 9 9' stroke='red'/>",
        expect![[r##"
            ["#ok", "#p"]
        "##]],
    );
    check_content(
        "<path id='p' transform='scale(0)' d='M0 0L5 5'/>",
        expect![[r##"
            ["#ok"]
            #p: transform="scale(0)" cannot be used, left out
        "##]],
    );
    check_content(
        "<g id='g' transform='rotate(foo)'><path d='M0 0L5 5'/></g>",
        expect![[r##"
            ["#ok"]
            #g: transform="rotate(foo)" cannot be used, left out
        "##]],
    );
    check_content(
        "<path id='p' stroke='red' stroke-dasharray='1e-12' d='M0 0L5 5'/>\
         <path id='q' stroke='red' stroke-dasharray='1 1e300' d='M0 0Q1e200 1e300 5 5'/>",
        expect![[r##"
            ["#ok", "#p"]
            #p: more than a million dashes, marked as a full line
            #q: coordinates beyond 1 km or not finite, left out
        "##]],
    );
    check_content(
        "<text id='t' x='1e400' font-size='1e30'>x</text>",
        expect![[r##"
            ["#ok"]
            #t: x="1e400" cannot be read to its end
            #t: coordinates beyond 1 km or not finite, left out
        "##]],
    );
}

#[test]
fn pages_without_size() {
    for size in [
        "width='0' height='1'",
        "width='1' height='-1mm'",
        "width='x' height='1'",
        "viewBox='0 0 0 1'",
        "viewBox='0 0 1'",
        "width='1e400' height='1'",
    ] {
        let drawing = format!("<svg {size}>{LINE}</svg>");
        let error = read(drawing.as_bytes(), &Recipe::default(), &SvgOptions::default());
        let message = error.unwrap_err().to_string();
        assert!(message.contains("gives no page"), "{size}: {message}");
    }
    for fit_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = SvgOptions { fit_mm: Some(fit_mm), ..SvgOptions::default() };
        let drawing = format!("{HEAD}{LINE}</svg>");
        let error = read(drawing.as_bytes(), &Recipe::default(), &options).unwrap_err();
        assert!(error.to_string().contains("cannot fit"), "{error}");
    }
}

#[test]
fn nothing_to_mark() {
    check(
        format!("{HEAD}</svg>"),
        expect![[r#"
        nothing to mark: the drawing holds no shapes
        ("", "", "")
    "#]],
    );
    check(
        format!("{HEAD}<image href='a.png'/></svg>"),
        expect![[r#"
            nothing to mark: the drawing holds only raster images (1)
            ("", "", "")
        "#]],
    );
    check(
        format!("{HEAD}<path fill='none' d='M0 0h1v1'/></svg>"),
        expect![[r#"
            nothing to mark: the drawing holds only hidden or unpainted elements (1)
            ("", "", "")
        "#]],
    );
    check(
        "<svg/>",
        expect![[r#"
        nothing to mark: the drawing holds no shapes
        ("", "", "")
    "#]],
    );
}
