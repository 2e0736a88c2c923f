//! Text becomes letters at the places that SVG gives them.

use expect_test::{Expect, expect};
use ftheta_formats::svg::{SvgOptions, read};
use ftheta_model::job::{Job, Paint};
use ftheta_model::recipe::{Recipe, TextStyle};
use ftheta_model::warning::Imported;
use kurbo::{Rect, Shape};
use std::fmt::Write;

fn imported(content: &str, style: TextStyle) -> Imported<Job> {
    let drawing = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='20mm' \
         viewBox='-10 -10 20 20'>{content}</svg>"
    );
    let recipe = Recipe { text: style, ..Recipe::default() };
    read(drawing.as_bytes(), &recipe, &SvgOptions::default()).unwrap()
}

fn bounds(content: &str) -> Rect {
    let job = imported(content, TextStyle::Outline).value;
    let boxes = job.shapes().map(|shape| shape.path.bounding_box());
    boxes.reduce(|all, next| all.union(next)).unwrap()
}

/// Bounds of each subpath to 0.001 mm.
fn check(content: &str, style: TextStyle, expected: Expect) {
    let imported = imported(content, style);
    let mut out = String::new();
    for shape in imported.value.shapes() {
        let paint = if shape.paint == Paint::Stroke { "stroke" } else { "fill" };
        let pen = &imported.value.pens[shape.pen_index].name;
        writeln!(out, "{paint} {pen} {}", shape.source).unwrap();
        for subpath in shape.path.subpaths() {
            let Rect { x0, y0, x1, y1 } = subpath.bounding_box();
            writeln!(out, "  {x0:.3} {y0:.3} to {x1:.3} {y1:.3}").unwrap();
        }
    }
    for warning in &imported.warnings {
        writeln!(out, "warning: {warning}").unwrap();
    }
    expected.assert_eq(&out);
}

#[test]
fn outlines() {
    check(
        "<text id='t' x='1' y='2' font-size='4'>IL</text>",
        TextStyle::Outline,
        expect![[r#"
            fill #000000 #t
              1.320 -2.000 to 1.800 1.040
              2.520 -2.000 to 4.280 1.040
        "#]],
    );
    check(
        "<text id='t' font-size='4' fill='none' stroke='red' font-weight='bold'>o</text>",
        TextStyle::Outline,
        expect![[r#"
            stroke #ff0000 #t
              0.128 -0.034 to 2.290 2.234
              0.780 0.406 to 1.638 1.794
        "#]],
    );
}

#[test]
fn single_strokes() {
    check(
        "<text id='t' x='1' y='2' font-size='4'>IL</text>",
        TextStyle::SingleStroke,
        expect![[r#"
            stroke #000000 #t
              1.571 -2.000 to 1.571 1.000
              2.714 -2.000 to 2.714 1.000
              2.714 -2.000 to 4.429 -2.000
        "#]],
    );
    check(
        "<text id='t' font-family='Hershey Sans 1' font-size='2' fill='blue'>é±ж</text>",
        TextStyle::Outline,
        expect![[r#"
            stroke #0000ff #t
              0.214 0.000 to 1.071 1.000
              2.214 0.000 to 2.214 1.286
              1.571 0.643 to 2.857 0.643
              3.429 0.643 to 4.714 0.643
            warning: #t: no letter in Hershey Simplex for "ж", left out
            warning: #t: no letter in Hershey Simplex for "±é", spelt with others
        "#]],
    );
}

#[test]
fn places_of_letters() {
    check(
        "<text id='t' x='0 5' y='0' dy='0 0 -1' font-size='4'>I<tspan id='s' dx='1'>I</tspan>\
         <tspan x='-5' y='5' fill='red'>I</tspan></text>",
        TextStyle::Outline,
        expect![[r#"
            fill #000000 #t
              0.320 0.000 to 0.800 3.040
            fill #000000 #s
              6.320 0.000 to 6.800 3.040
            fill #ff0000 <tspan> on line 1
              -4.680 -4.000 to -4.200 -0.960
        "#]],
    );
}

#[test]
fn raised_letters() {
    check(
        "<text id='t' font-size='4'>I<tspan id='s' style='baseline-shift:super;font-size:50%'>I\
         </tspan><tspan id='u' baseline-shift='-25%'>I</tspan></text>\
         <text id='v' font-size='4' dominant-baseline='hanging'>I</text>",
        TextStyle::Outline,
        expect![[r#"
            fill #000000 #t
              0.320 0.000 to 0.800 3.040
            fill #000000 #s
              1.360 1.360 to 1.600 2.880
            fill #000000 #u
              2.120 -1.000 to 2.600 2.040
            fill #000000 #v
              0.320 -3.000 to 0.800 0.040
        "#]],
    );
}

#[test]
fn anchors() {
    let start = bounds("<text font-size='4'>ftheta</text>");
    let middle = bounds("<text font-size='4' text-anchor='middle'>ftheta</text>");
    let end = bounds("<text font-size='4' style='text-anchor:end'>ftheta</text>");
    let shift_mm = start.x0 - middle.x0;
    assert!(4.0 < shift_mm && shift_mm < 7.0, "{shift_mm}");
    assert!((start.x0 - end.x0 - 2.0 * shift_mm).abs() < 1e-9);
}

#[test]
fn white_space() {
    let plain = bounds("<text font-size='4'>a b</text>");
    assert_eq!(bounds("<text font-size='4'>\n  a \t\n b  </text>"), plain);
    assert_eq!(bounds("<text font-size='4'> a <tspan> b </tspan> </text>"), plain);
    assert!(plain.x1 < bounds("<text font-size='4' xml:space='preserve'>a  b</text>").x1);
    assert!(plain.x1 < bounds("<text font-size='4' letter-spacing='1'>a b</text>").x1);
}

#[test]
fn sizes() {
    let plain = bounds("<text font-size='4'>H</text>");
    let same = |content: &str| {
        let other = bounds(content);
        assert!((other.y1 - plain.y1).abs() < 1e-9, "{content}: {other:?}");
    };
    same("<text font-size='3pt'>H</text>");
    same("<g font-size='8'><text font-size='50%'>H</text></g>");
    same("<g font-size='2'><text font-size='2em'>H</text></g>");
    same("<text style='font: italic 4px/1 Arial, sans-serif'>H</text>");
    same("<text transform='scale(2)' font-size='2'>H</text>");
}

#[test]
fn what_is_replaced_is_said() {
    check(
        "<text id='t' font-family=\"'Helvetica Neue', Arial\" font-size='2'>.\
         <tspan font-family='Courier'>ж☃</tspan><textPath id='p' href='#x'>no</textPath></text>\
         <text id='u' font-family='Courier' rotate='3' y='5' font-size='2'>.</text>",
        TextStyle::Outline,
        expect![[r#"
            fill #000000 #t
              0.086 -0.017 to 0.415 0.315
            fill #000000 <tspan> on line 1
              1.400 0.698 to 1.502 0.800
              1.400 0.298 to 1.502 0.400
              1.200 1.200 to 1.300 1.300
              1.500 1.221 to 1.600 1.300
              0.883 -0.017 to 2.037 1.517
              1.400 0.498 to 1.502 0.600
              1.370 1.078 to 1.594 1.234
            fill #000000 #u
              0.086 -5.017 to 0.415 -4.685
            warning: #p: text on a path, left out
            warning: <text>: font "Helvetica Neue" is replaced by the bundled B612
            warning: <text>: font "Courier" is replaced by the bundled B612
            warning: #t: no letter in B612 for "ж", left out
            warning: #u: rotate is ignored
        "#]],
    );
}

#[test]
fn fonts_of_the_computer() {
    let drawing = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 9 9'>\
                   <text y='9' font-family='No Such Font 9'>x</text></svg>";
    let options = SvgOptions { system_fonts: true, ..SvgOptions::default() };
    let imported = read(drawing.as_bytes(), &Recipe::default(), &options).unwrap();
    let warning = imported.warnings[0].message.as_str();
    expect![[r#"font "No Such Font 9" is replaced by the bundled B612"#]].assert_eq(warning);
}
