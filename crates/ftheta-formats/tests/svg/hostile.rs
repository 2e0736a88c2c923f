//! Files that are made to take memory or time stop at a limit.

use crate::bad_input::{HEAD, LINE, check, check_content};
use expect_test::expect;
use flate2::Compression;
use flate2::write::GzEncoder;
use ftheta_formats::svg::{Limits, SvgOptions, read};
use ftheta_model::recipe::Recipe;
use std::io::Write;

#[test]
fn large_files_stop_at_the_limit() {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(&vec![b' '; 1 << 20]).unwrap();
    let bomb = gzip.finish().unwrap();
    let options = SvgOptions {
        limits: Limits { n_bytes_max: 1 << 16, ..Limits::default() },
        ..SvgOptions::default()
    };
    let error = read(&bomb, &Recipe::default(), &options).unwrap_err();
    expect!["the file has more than 65536 bytes"].assert_eq(&error.to_string());
    let options = SvgOptions {
        limits: Limits { n_path_elements_max: 1000, ..Limits::default() },
        ..SvgOptions::default()
    };
    let long = format!("{HEAD}<path id='p' stroke='red' d='M0 0{}'/></svg>", "h1v1".repeat(1000));
    let error = read(long.as_bytes(), &Recipe::default(), &options).unwrap_err();
    expect!["#p: more than 1000 path elements"].assert_eq(&error.to_string());
    let long =
        format!("{HEAD}<polygon id='q' stroke='red' points='{}'/></svg>", "1 2 ".repeat(2000));
    let error = read(long.as_bytes(), &Recipe::default(), &options).unwrap_err();
    expect!["#q: more than 1000 path elements"].assert_eq(&error.to_string());
    let long = format!("{HEAD}<text id='t'>{}</text></svg>", "x".repeat(200_000));
    let error = read(long.as_bytes(), &Recipe::default(), &options).unwrap_err();
    expect!["#t: more than 100000 characters in one text"].assert_eq(&error.to_string());
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
    let spans = format!("<text>{}x{}</text>", "<tspan>".repeat(250), "</tspan>".repeat(250));
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
        entities += &format!("<!ENTITY e{level} '{}'>", format!("&e{};", level - 1).repeat(10));
    }
    check(
        format!("<!DOCTYPE svg [{entities}]>{HEAD}<text>&e11;</text></svg>"),
        expect![[r#"
            line 1, column 106: a possible entity reference loop is detected
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
            line 1, column 68: unknown entity reference 'e'
            ("line 1, column 68", "", "")
        "#]],
    );
    let illustrator = "<!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN' 'svg11.dtd' [\
                       <!ENTITY ns 'http://www.w3.org/2000/svg'>]>";
    check(
        format!("{illustrator}{}{LINE}</svg>", HEAD.replace("http://www.w3.org/2000/svg", "&ns;")),
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
    let css = format!("<style>{}{{{}}}</style>", "a,".repeat(9000), "b:c;".repeat(9000));
    check_content(
        &css,
        expect![[r##"
            ["#ok"]
            <style>: too many rules to look at, some were ignored
        "##]],
    );
    let slow = format!("<style>x {}path{{fill:red}}</style>", "g ".repeat(40));
    let groups = format!("{}{}{}", "<g>".repeat(200), LINE, "</g>".repeat(200));
    check_content(
        &format!("{slow}{groups}"),
        expect![[r##"
            ["#ok", "#ok"]
            <style>: too many rules to look at, some were ignored
        "##]],
    );
}

#[test]
fn warnings_are_capped() {
    let images: String = (0..1000).map(|n| format!("<image id='i{n}'/>")).collect();
    let drawing = format!("{HEAD}{LINE}{images}</svg>");
    let imported = read(drawing.as_bytes(), &Recipe::default(), &SvgOptions::default()).unwrap();
    assert_eq!(imported.warnings.len(), 201);
    expect!["<svg>: and 800 more warnings"].assert_eq(&imported.warnings[200].to_string());
}
