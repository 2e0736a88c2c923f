//! Damaged, hostile and senseless files give clear errors, in bounded time and memory.

use expect_test::{Expect, expect};
use flate2::Compression;
use flate2::write::GzEncoder;
use ftheta_formats::svg::{Limits, SvgOptions, read};
use ftheta_model::recipe::Recipe;
use proptest::prelude::*;
use std::io::Write;

const HEAD: &str = "<svg xmlns='http://www.w3.org/2000/svg' \
                    xmlns:xlink='http://www.w3.org/1999/xlink' width='9mm' height='9mm' \
                    viewBox='0 0 9 9'>";
const LINE: &str = "<path id='ok' d='M0 0L9 9' stroke='red'/>";

/// The error or the warnings, and the three parts of the error's fault.
fn outcome(bytes: &[u8]) -> String {
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

fn check(bytes: impl AsRef<[u8]>, expected: Expect) {
    expected.assert_eq(&outcome(bytes.as_ref()));
}

/// An otherwise good drawing with `content` in it.
fn check_content(content: &str, expected: Expect) {
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
        line 1, column 1: unknown token at 1:1
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
        line 1, column 1: unknown token at 1:1
        ("line 1, column 1", "", "")
    "#]],
    );
    check(
        format!("{HEAD}{LINE}"),
        expect![[r#"
        line 1, column 1: the root node was opened but never closed
        ("line 1, column 1", "", "")
    "#]],
    );
    check(
        &format!("{HEAD}{LINE}")[..150],
        expect![[r#"
        line 1, column 1: unexpected end of stream
        ("line 1, column 1", "", "")
    "#]],
    );
}

#[test]
fn encodings() {
    let drawing = format!("{HEAD}{LINE}</svg>");
    let with_mark = |little_endian: bool| -> Vec<u8> {
        let units = std::iter::once(0xfeff).chain(drawing.encode_utf16());
        units
            .flat_map(|unit| {
                if little_endian {
                    unit.to_le_bytes()
                } else {
                    unit.to_be_bytes()
                }
            })
            .collect()
    };
    let good = outcome(drawing.as_bytes());
    assert_eq!(outcome(&with_mark(true)), good);
    assert_eq!(outcome(&with_mark(false)), good);
    assert_eq!(outcome(format!("\u{feff}{drawing}").as_bytes()), good);
    let latin1 = [
        b"<?xml version='1.0' encoding='ISO-8859-1'?><!-- \xe9 -->",
        drawing.as_bytes(),
    ];
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
fn large_files_stop_at_the_limit() {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(&vec![b' '; 1 << 20]).unwrap();
    let bomb = gzip.finish().unwrap();
    let options = SvgOptions {
        limits: Limits {
            n_bytes_max: 1 << 16,
            ..Limits::default()
        },
        ..SvgOptions::default()
    };
    let error = read(&bomb, &Recipe::default(), &options).unwrap_err();
    expect!["the file has more than 65536 bytes"].assert_eq(&error.to_string());
    let options = SvgOptions {
        limits: Limits {
            n_path_elements_max: 1000,
            ..Limits::default()
        },
        ..SvgOptions::default()
    };
    let long = format!(
        "{HEAD}<path id='p' stroke='red' d='M0 0{}'/></svg>",
        "h1v1".repeat(1000)
    );
    let error = read(long.as_bytes(), &Recipe::default(), &options).unwrap_err();
    expect!["#p: more than 1000 path elements"].assert_eq(&error.to_string());
}

#[test]
fn deep_nesting() {
    let nested = |n: usize| format!("{HEAD}{}{LINE}{}</svg>", "<g>".repeat(n), "</g>".repeat(n));
    check(
        nested(200),
        expect![[r##"
        ["#ok"]
    "##]],
    );
    check(
        nested(100_000),
        expect![[r#"
        line 1: elements are nested deeper than 256
        ("line 1", "", "256 levels")
    "#]],
    );
    check(
        format!("{HEAD}{}", "<g>".repeat(100_000)),
        expect![[r#"
        line 1: elements are nested deeper than 256
        ("line 1", "", "256 levels")
    "#]],
    );
    let spans = format!(
        "<text>{}x{}</text>",
        "<tspan>".repeat(250),
        "</tspan>".repeat(250)
    );
    check_content(
        &spans,
        expect![[r##"
        ["#ok", "<tspan> on line 1"]
    "##]],
    );
}

#[test]
fn repeated_content() {
    check_content(
        "<use id='u' href='#u'/>",
        expect![[r##"
        ["#ok"]
        #u: refers to "#u", which contains it, left out
    "##]],
    );
    check_content(
        "<g id='g'><use xlink:href='#g'/></g>",
        expect![[r##"
        ["#ok"]
        <use> on line 1: refers to "#g", which contains it, left out
    "##]],
    );
    check_content(
        "<g id='a'><use id='u' href='#b'/></g><g id='b'><use id='v' href='#a'/></g>",
        expect![[r##"
            ["#ok"]
            #u: refers to "#b", which contains it, left out
            #v: refers to "#a", which contains it, left out
        "##]],
    );
    let mut laughs = String::from("<g id='l0'><rect width='1' height='1'/></g>");
    for level in 1..12 {
        let uses = format!("<use href='#l{}'/>", level - 1).repeat(10);
        laughs += &format!("<g id='l{level}'>{uses}</g>");
    }
    check_content(
        &format!("<defs>{laughs}</defs><use id='u' href='#l11'/>"),
        expect![[r#"
        <rect> on line 1: more than 5000000 elements, those repeated by <use> included
        ("<rect> on line 1", "", "5000000 elements, those repeated by <use> included")
    "#]],
    );
}

#[test]
fn entities() {
    let mut entities = String::from("<!ENTITY e0 'lol'>");
    for level in 1..12 {
        entities += &format!(
            "<!ENTITY e{level} '{}'>",
            format!("&e{};", level - 1).repeat(10)
        );
    }
    check(
        format!("<!DOCTYPE svg [{entities}]>{HEAD}<text>&e11;</text></svg>"),
        expect![[r#"
            line 1, column 106: a possible entity reference loop is detected at 1:106
            ("line 1, column 106", "", "")
        "#]],
    );
    let long = "x".repeat(100_000);
    let uses = "&e;".repeat(10_000);
    check(
        format!("<!DOCTYPE svg [<!ENTITY e '{long}'>]>{HEAD}<text>{uses}</text></svg>"),
        expect![[r#"
            <!ENTITY>: more than 268435456 bytes of expanded entities
            ("<!ENTITY>", "", "268435456 bytes of expanded entities")
        "#]],
    );
    check(
        "<!DOCTYPE svg [<!ENTITY e SYSTEM 'file:///etc/passwd'>]><svg><text>&e;</text></svg>",
        expect![[r#"
            line 1, column 68: unknown entity reference 'e' at 1:68
            ("line 1, column 68", "", "")
        "#]],
    );
    let illustrator = "<!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN' 'svg11.dtd' [\
                       <!ENTITY ns 'http://www.w3.org/2000/svg'>]>";
    check(
        format!(
            "{illustrator}{}{LINE}</svg>",
            HEAD.replace("http://www.w3.org/2000/svg", "&ns;")
        ),
        expect![[r##"
            ["#ok"]
        "##]],
    );
}

#[test]
fn too_much_markup_on_one_element() {
    let attributes: String = (0..1000).map(|n| format!(" a{n}='1'")).collect();
    check_content(
        &format!("<g{attributes}/>"),
        expect![[r#"
        line 1: more than 256 attributes on one element
        ("line 1", "", "256 attributes on one element")
    "#]],
    );
    let css = format!(
        "<style>{}{{{}}}</style>",
        "a,".repeat(9000),
        "b:c;".repeat(9000)
    );
    check_content(
        &css,
        expect![[r##"
        ["#ok"]
        <style>: too many rules to look at, some were ignored
    "##]],
    );
    let slow = format!("<style>{}path{{fill:red}}</style>", "g ".repeat(40));
    let groups = format!("{}{}{}", "<g>".repeat(200), LINE, "</g>".repeat(200));
    check_content(
        &format!("{slow}{groups}"),
        expect![[r##"
        ["#ok", "#ok"]
    "##]],
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
        #c: its size is not above 0, left out
    "##]],
    );
    check_content(
        "<circle id='c' r='-2'/>",
        expect![[r##"
        ["#ok"]
        #c: r is negative, so it is left out
        #c: its size is not above 0, left out
    "##]],
    );
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
        #p: transform="scale(0)" cannot be read, left out
    "##]],
    );
    check_content(
        "<g id='g' transform='rotate(foo)'><path d='M0 0L5 5'/></g>",
        expect![[r##"
        ["#ok"]
        #g: transform="rotate(foo)" cannot be read, left out
    "##]],
    );
    check_content(
        "<path id='p' stroke='red' stroke-dasharray='1e-12' d='M0 0L5 5'/>",
        expect![[r##"
            ["#ok", "#p"]
            #p: more than a million dashes, marked as a full line
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
        let error = read(
            drawing.as_bytes(),
            &Recipe::default(),
            &SvgOptions::default(),
        );
        let message = error.unwrap_err().to_string();
        assert!(message.contains("gives no page"), "{size}: {message}");
    }
    for fit_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = SvgOptions {
            fit_mm: Some(fit_mm),
            ..SvgOptions::default()
        };
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
        nothing to mark: the drawing holds only 1 raster images
        ("", "", "")
    "#]],
    );
    check(
        format!("{HEAD}<path fill='none' d='M0 0h1v1'/></svg>"),
        expect![[r#"
        nothing to mark: the drawing holds only 1 hidden or unpainted elements
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

#[test]
fn warnings_are_capped() {
    let images: String = (0..1000).map(|n| format!("<image id='i{n}'/>")).collect();
    let drawing = format!("{HEAD}{LINE}{images}</svg>");
    let imported = read(
        drawing.as_bytes(),
        &Recipe::default(),
        &SvgOptions::default(),
    )
    .unwrap();
    assert_eq!(imported.warnings.len(), 201);
    expect!["<svg>: and 800 more warnings"].assert_eq(&imported.warnings[200].to_string());
}

/// A drawing with something of everything, to be damaged.
const VALID: &str = include_str!("golden/inkscape.svg");

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_bytes_do_not_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        outcome(&bytes);
    }

    #[test]
    fn random_markup_does_not_panic(
        parts in proptest::collection::vec(
            prop::sample::select(vec![
                "<", ">", "/>", "</", "g", "path", " d='", "M0 0", "A1 2 3 4 5 6 7", "'", "=",
                "<style>", "</style>", "{", "}", ".a", "fill:url(#x)", "@media", ";", ",", "/*",
                "<text x='1 2'>", "</text>", "<tspan>", "&lt;", "&#0;", "<![CDATA[", "]]>", "1e9",
                "<use href='#a' id='a'/>", "<svg>", "</svg>", "stroke-dasharray='0 1'", "%", "-",
            ]),
            0..60,
        )
    ) {
        outcome(format!("{HEAD}{LINE}{}</svg>", parts.concat()).as_bytes());
    }

    #[test]
    fn cut_files_do_not_panic(length in 0..VALID.len()) {
        outcome(&VALID.as_bytes()[..length]);
    }

    #[test]
    fn changed_files_do_not_panic(
        changes in proptest::collection::vec((0..VALID.len(), any::<u8>()), 1..20)
    ) {
        let mut bytes = VALID.as_bytes().to_vec();
        for (index, byte) in changes {
            bytes[index] = byte;
        }
        outcome(&bytes);
    }

    #[test]
    fn shuffled_files_do_not_panic(
        from in 0..VALID.len(), to in 0..VALID.len(), length in 0..200usize
    ) {
        let mut bytes = VALID.as_bytes().to_vec();
        let end = (from + length).min(bytes.len());
        let piece: Vec<u8> = bytes.drain(from..end).collect();
        let to = to.min(bytes.len());
        bytes.splice(to..to, piece);
        outcome(&bytes);
    }
}
