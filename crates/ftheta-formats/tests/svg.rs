//! SVG drawings become the jobs that are written beside them.

use expect_test::{Expect, expect};
use ftheta_formats::svg::{SvgOptions, read};
use ftheta_model::job::{FillRule, Job, Paint};
use ftheta_model::recipe::{Pen, PenRule, Recipe, TextStyle};
use ftheta_model::warning::Imported;
use kurbo::{BezPath, ParamCurve, PathEl, Point, Shape};
use std::fmt::Write;

fn check(drawing: &str, expected: Expect) {
    check_with(
        drawing,
        &Recipe::default(),
        &SvgOptions::default(),
        expected,
    );
}

fn check_with(drawing: &str, recipe: &Recipe, options: &SvgOptions, expected: Expect) {
    let dump = match read(drawing.as_bytes(), recipe, options) {
        Ok(imported) => dump(&imported),
        Err(error) => format!("error: {error}\n"),
    };
    expected.assert_eq(&dump);
}

/// A drawing in `tests/golden` and the job beside it.
fn check_file(name: &str) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/");
    let drawing = std::fs::read(format!("{folder}{name}.svg")).unwrap();
    let imported = read(&drawing, &Recipe::default(), &SvgOptions::default()).unwrap();
    expect_test::expect_file![format!("{folder}{name}.txt")].assert_eq(&dump(&imported));
}

/// `content` on a page of 20 x 20 mm whose units are mm.
fn check_content(content: &str, expected: Expect) {
    check(&on_page(content), expected);
}

fn on_page(content: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' \
         width='20mm' height='20mm' viewBox='-10 -10 20 20'>\n{content}</svg>"
    )
}

fn dump(imported: &Imported<Job>) -> String {
    let job = &imported.value;
    let mut out = format!("page {} x {} mm\n", mm(job.page_mm[0]), mm(job.page_mm[1]));
    for layer in &job.layers {
        writeln!(out, "layer {:?}", layer.name).unwrap();
        for shape in &layer.shapes {
            let paint = match shape.paint {
                Paint::Stroke => "stroke",
                Paint::Fill(FillRule::NonZero) => "fill",
                Paint::Fill(FillRule::EvenOdd) => "fill-evenodd",
            };
            let pen = &job.pens[shape.pen_index].name;
            let path = path_text(&shape.path);
            writeln!(out, "  {paint} {pen} {}: {path}", shape.source).unwrap();
        }
    }
    for warning in &imported.warnings {
        writeln!(out, "warning: {warning}").unwrap();
    }
    out
}

fn path_text(path: &BezPath) -> String {
    let at = |point: &Point| format!("{},{}", mm(point.x), mm(point.y));
    path.iter()
        .map(|element| match element {
            PathEl::MoveTo(p) => format!("M{}", at(&p)),
            PathEl::LineTo(p) => format!("L{}", at(&p)),
            PathEl::QuadTo(p1, p2) => format!("Q{} {}", at(&p1), at(&p2)),
            PathEl::CurveTo(p1, p2, p3) => format!("C{} {} {}", at(&p1), at(&p2), at(&p3)),
            PathEl::ClosePath => "Z".into(),
        })
        .collect::<Vec<_>>()
        .join(" ")
}

/// To 1e-9 mm, without trailing zeros.
fn mm(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

#[test]
fn millimetres_come_out_exactly() {
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="64mm" viewBox="0 0 100 64">
            <path id="p" d="M0 0L100 64M10 10h20v-5l-3-4" fill="none" stroke="#f00"/>
        </svg>"##,
        expect![[r#"
            page 100 x 64 mm
            layer ""
              stroke #ff0000 #p: M-50,32 L50,-32 M-40,22 L-20,22 L-20,27 L-23,31
        "#]],
    );
}

#[test]
fn hairlines_and_default_fill() {
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="10mm" height="10mm" viewBox="0 0 10 10">
            <rect id="r" x="1" y="1" width="2" height="3" stroke="blue" stroke-width="0"/>
            <line x1="0" y1="0" x2="5" y2="5" stroke="red"/>
            <path d="M0 0 5 5" stroke="red"/>
            <path d="M5 5q1 1 2 0t2 0c1 0 1 1 0 1s0-1 1 0" fill="none" stroke="lime"
                style="stroke-width:0.1;-inkscape-stroke:hairline"/>
        </svg>"##,
        expect![[r#"
            page 10 x 10 mm
            layer ""
              fill #000000 #r: M-4,4 L-2,4 L-2,1 L-4,1 Z
              stroke #0000ff #r: M-4,4 L-2,4 L-2,1 L-4,1 Z
              stroke #ff0000 <line> on line 3: M-5,5 L0,0
              stroke #ff0000 <path> on line 4: M-5,5 L0,0
              stroke #00ff00 <path> on line 5: M0,0 Q1,-1 2,0 Q3,1 4,0 C5,0 5,-1 4,-1 C3,-1 4,0 5,-1
        "#]],
    );
}

#[test]
fn units() {
    for (size, side_mm) in [
        ("50mm", 50.0),
        ("5cm", 50.0),
        ("2in", 50.8),
        ("144pt", 50.8),
        ("12pc", 50.8),
        ("192px", 50.8),
        ("192", 50.8),
        ("2IN", 50.8),
    ] {
        let drawing = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='{size}' height='{size}'>\
             <line x1='0' y1='0' x2='100%' y2='{size}' stroke='red'/></svg>"
        );
        let job = read(
            drawing.as_bytes(),
            &Recipe::default(),
            &SvgOptions::default(),
        )
        .unwrap()
        .value;
        let bounds = job.layers[0].shapes[0].path.bounding_box();
        for value in [
            job.page_mm[0],
            job.page_mm[1],
            bounds.width(),
            bounds.height(),
        ] {
            assert!((value - side_mm).abs() < 1e-12, "{size}: {value}");
        }
        assert!(bounds.center().distance(Point::ORIGIN) < 1e-12);
    }
}

#[test]
fn page_from_view_box_or_content() {
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-48 -48 96 192">
            <path id="p" d="M-48-48L48 144" stroke="#000"/></svg>"##,
        expect![[r#"
            page 25.4 x 50.8 mm
            layer ""
              stroke #000000 #p: M-12.7,25.4 L12.7,-25.4
        "#]],
    );
    check(
        r##"<svg xmlns="http://www.w3.org/2000/svg">
            <path id="p" d="M96 96h96v192" fill="none" stroke="#000"/></svg>"##,
        expect![[r#"
            page 25.4 x 50.8 mm
            layer ""
              stroke #000000 #p: M-12.7,25.4 L12.7,25.4 L12.7,-25.4
            warning: <svg>: states no size, so its content in px is taken as the page
        "#]],
    );
    let options = SvgOptions {
        fit_mm: Some(30.0),
        ..SvgOptions::default()
    };
    check_with(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="100%" height="100%" viewBox="0 0 7 14">
            <path id="p" d="M0 0L7 14" stroke="#000"/></svg>"##,
        &Recipe::default(),
        &options,
        expect![[r#"
            page 15 x 30 mm
            layer ""
              stroke #000000 #p: M-7.5,15 L7.5,-15
        "#]],
    );
}

#[test]
fn aspect_ratio() {
    for aspect in ["xMidYMid meet", "xMinYMax meet", "xMaxYMin slice", "none"] {
        let drawing = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='10mm' \
             viewBox='0 0 5 5' preserveAspectRatio='{aspect}'>\
             <path id='p' d='M0 0L5 5' stroke='red'/></svg>"
        );
        let expected = match aspect {
            "xMidYMid meet" => "M-5,5 L5,-5",
            "xMinYMax meet" => "M-10,5 L0,-5",
            "xMaxYMin slice" => "M-10,5 L10,-15",
            _ => "M-10,5 L10,-5",
        };
        let job = read(
            drawing.as_bytes(),
            &Recipe::default(),
            &SvgOptions::default(),
        )
        .unwrap()
        .value;
        assert_eq!(
            path_text(&job.layers[0].shapes[0].path),
            expected,
            "{aspect}"
        );
    }
}

#[test]
fn programs_files() {
    check_file("inkscape");
    check_file("illustrator");
}

#[test]
fn basic_shapes() {
    check_content(
        "<g fill='none' stroke='red'><rect id='r' x='1' y='2' width='3' height='4'/>
         <polyline points='0,0 1 2,3-1.5'/><polygon id='poly' points='0,0 1,2 3-1 9'/>
         <line x1='1' x2='-1'/><path d='M1 1H2V2h-1z l-1 0'/></g>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #r: M1,-2 L4,-2 L4,-6 L1,-6 Z
              stroke #ff0000 <line> on line 4: M1,0 L-1,0
              stroke #ff0000 <path> on line 4: M1,-1 L2,-1 L2,-2 L1,-2 Z M1,-1 L0,-1
        "#]],
    );
}

#[test]
fn round_shapes_are_round() {
    let drawing = on_page(
        "<g fill='none' stroke='red'><circle r='7'/><ellipse cx='1' rx='7' ry='7'/>
         <rect x='-7' y='-7' width='14' height='14' rx='7'/>
         <path d='M-7 0A7 7 0 0 1 7 0 7 7 90 0 1-7 0z'/>
         <path transform='scale(0.001)' d='M-7000 0a7000 7000 0 1 0 14000 0'/></g>",
    );
    let job = read(
        drawing.as_bytes(),
        &Recipe::default(),
        &SvgOptions::default(),
    )
    .unwrap()
    .value;
    for (index, shape) in job.shapes().enumerate() {
        let center = Point::new(if index == 1 { 1.0 } else { 0.0 }, 0.0);
        for segment in shape.path.segments() {
            for step in 0..=16 {
                let point = segment.eval(f64::from(step) / 16.0);
                let error_mm = (point.distance(center) - 7.0).abs();
                assert!(error_mm < 1e-6, "shape {index}: {error_mm} mm");
            }
        }
    }
}

#[test]
fn arcs_take_the_asked_way() {
    for (flags, large, below) in [
        ("0 0", false, true),
        ("0 1", false, false),
        ("1 0", true, true),
        ("1 1", true, false),
    ] {
        let drawing = on_page(&format!(
            "<path d='M-1 0A2 2 0 {flags} 1 0' fill='none' stroke='red'/>"
        ));
        let job = read(
            drawing.as_bytes(),
            &Recipe::default(),
            &SvgOptions::default(),
        )
        .unwrap()
        .value;
        let bounds = job.layers[0].shapes[0].path.bounding_box();
        let sagitta_mm = if large {
            2.0 + 3f64.sqrt()
        } else {
            2.0 - 3f64.sqrt()
        };
        let found_mm = if below { -bounds.y0 } else { bounds.y1 };
        assert!((found_mm - sagitta_mm).abs() < 1e-6, "{flags}: {bounds:?}");
    }
}

#[test]
fn transforms_use_and_symbols() {
    check_content(
        "<defs><path id='tick' d='M0 0h1'/>
         <symbol id='box' viewBox='0 0 10 10'><path id='diagonal' d='M0 0L10 10'/></symbol></defs>
         <g stroke='red' transform='translate(1 2) scale(2)'>
           <use xlink:href='#tick' x='1' transform='rotate(90)'/>
           <use href='#tick' stroke='blue' transform='skewX(45) translate(0,1)'/></g>
         <use href='#box' x='2' y='3' width='5' height='5' stroke='lime'/>
         <svg x='-5' y='-5' width='10' height='5' viewBox='0 0 1 1'>
           <path id='inner' d='M0 0L1 1' stroke='red'/></svg>
         <use id='lost' href='#nowhere'/>",
        expect![[r##"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #tick: M1,-4 L1,-6
              stroke #0000ff #tick: M3,-4 L5,-4
              stroke #00ff00 #diagonal: M2,-3 L7,-8
              stroke #ff0000 #inner: M-2.5,5 L2.5,0
            warning: #lost: refers to "#nowhere", which is not in this file, left out
        "##]],
    );
}

#[test]
fn the_cascade() {
    check_content(
        "<style>path { stroke: red } #b { stroke: blue } .c { stroke: lime }
           g path.d { stroke: #111 !important } path:first-child { stroke: #222 }
           [data-x] { stroke: #333 }</style>
         <g fill='none'><path id='first' d='M0 0h1'/><path id='a' d='M0 0h1' stroke='#999'/>
         <path id='b' class='c' d='M0 0h1'/><path id='c' class='x c' d='M0 0h1'/>
         <path id='d' class='d' d='M0 0h1' style='stroke:#444'/>
         <path id='e' d='M0 0h1' style='stroke:#444; stroke: rgb(0, 10%, 255)'/>
         <path id='f' d='M0 0h1' data-x='1'/>
         <g color='#123456'><path id='g' d='M0 0h1' style='stroke:currentColor'/></g></g>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #222222 #first: M0,0 L1,0
              stroke #ff0000 #a: M0,0 L1,0
              stroke #0000ff #b: M0,0 L1,0
              stroke #00ff00 #c: M0,0 L1,0
              stroke #111111 #d: M0,0 L1,0
              stroke #333333 #f: M0,0 L1,0
              stroke #123456 #g: M0,0 L1,0
        "#]],
    );
}

#[test]
fn what_is_not_seen_is_not_marked() {
    check_content(
        "<path id='seen' d='M0 0h1v1' fill-rule='evenodd'/>
         <path d='M0 0h1v1' fill='none'/><path d='M0 0h1v1' display='none'/>
         <path d='M0 0h1v1' visibility='hidden'/><path d='M0 0h1v1' opacity='0'/>
         <g opacity='0%'><path d='M0 0h1v1'/></g><g display='none'><path d='M0 0h1v1'/></g>
         <g visibility='hidden'><path id='shown' visibility='visible' d='M0 0h1v1'/></g>
         <path id='line' d='M0 0h1v1' fill-opacity='0' stroke='red' stroke-opacity='.1'/>
         <path d='M0 0h1v1' fill='transparent' stroke='red' stroke-opacity='0'/>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              fill-evenodd #000000 #seen: M0,0 L1,0 L1,-1
              fill #000000 #shown: M0,0 L1,0 L1,-1
              stroke #ff0000 #line: M0,0 L1,0 L1,-1
        "#]],
    );
}

#[test]
fn paint_servers() {
    check_content(
        "<linearGradient id='a' href='#b'/><radialGradient id='b'><stop stop-color='#abc'/>
         <stop stop-color='red'/></radialGradient>
         <path id='p' d='M0 0h1v1' fill='url(#a)'/>
         <path id='q' d='M0 0h1v1' fill='url(#missing)'/>
         <path id='r' d='M0 0h1v1' fill='url(#missing) red'/>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              fill #aabbcc #p: M0,0 L1,0 L1,-1
              fill #ff0000 #r: M0,0 L1,0 L1,-1
            warning: #p: paint "a" is taken as the plain colour #aabbcc
            warning: #q: paint "missing" is not in this file, taken as none
        "#]],
    );
}

#[test]
fn dashes() {
    check_content(
        "<g fill='none' stroke='red'>
         <path id='open' d='M0 0h5' stroke-dasharray='2 1'/>
         <path id='odd' d='M0 0h5' stroke-dasharray='1' stroke-dashoffset='0.5'/>
         <rect id='closed' width='2' height='2' stroke-dasharray='3 1' transform='scale(2 1)'/>
         <path id='none' d='M0 0h5' stroke-dasharray='0 0'/></g>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #open: M3,0 L5,0 M0,0 L2,0
              stroke #ff0000 #odd: M1.5,0 L2.5,0 M3.5,0 L4.5,0 M0,0 L0.5,0
              stroke #ff0000 #closed: M4,-2 L0,-2 L0,-1 M0,0 L4,0 L4,-1
              stroke #ff0000 #none: M0,0 L5,0
        "#]],
    );
}

#[test]
fn pens_by_colour_and_layer() {
    let pen = |name: &str| Pen {
        name: name.into(),
        ..Pen::default()
    };
    let rule = |name: &str, color_rgb: Option<[u8; 3]>, layer: Option<&str>| PenRule {
        pen: pen(name),
        color_rgb,
        layer: layer.map(str::to_owned),
    };
    let recipe = Recipe {
        pens: vec![
            rule("red on deep", Some([255, 0, 0]), Some("DEEP")),
            rule("deep", None, Some("deep")),
            rule("unused", Some([9, 9, 9]), None),
            rule("red", Some([255, 0, 0]), None),
        ],
        ..Recipe::default()
    };
    let drawing = on_page(
        "<g id='Deep'><path id='a' d='M0 0h1' stroke='red'/><g id='sub'>
         <path id='b' d='M0 0h1' stroke='blue'/></g></g>
         <g id='flat_x20_top'><path id='c' d='M0 0h1' stroke='#ff0000'/>
         <path id='d' d='M0 0h1' stroke='blue'/></g>
         <path id='e' d='M0 0h1' stroke='lime'/><path id='f' d='M0 0h1' stroke='#00f'/>",
    );
    check_with(
        &drawing,
        &recipe,
        &SvgOptions::default(),
        expect![[r#"
        page 20 x 20 mm
        layer "Deep"
          stroke red on deep #a: M0,0 L1,0
          stroke deep #b: M0,0 L1,0
        layer "flat top"
          stroke red #c: M0,0 L1,0
          stroke #0000ff #d: M0,0 L1,0
        layer ""
          stroke #00ff00 #e: M0,0 L1,0
          stroke #0000ff #f: M0,0 L1,0
    "#]],
    );
    let job = read(drawing.as_bytes(), &recipe, &SvgOptions::default())
        .unwrap()
        .value;
    let names: Vec<_> = job.pens.iter().map(|pen| pen.name.as_str()).collect();
    let expected = ["red on deep", "deep", "unused", "red", "#0000ff", "#00ff00"];
    assert_eq!(names, expected);
}

#[test]
fn what_is_ignored_is_said() {
    check_content(
        "<path id='p' d='M0 0h1' stroke='red' clip-path='url(#c)' marker-end='url(#m)'/>
         <g id='g' mask='url(#m)' filter='url(#f)'><path id='q' d='M0 0h1' stroke='red'/></g>
         <image id='i' href='a.png'/><foreignObject/><script/><flowRoot id='flow'/>
         <path id='bad' d='M0 0h1x3' stroke='red'/><blink id='b'/>
         <rect id='flat' width='3' height='0'/><path id='dot' d='M1 1h0' stroke='red'/>
         <path id='anim' d='M0 0h1' stroke='red'><animate/></path>
         <metadata/><title/><desc/><foreign xmlns='urn:x'/>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #p: M0,0 L1,0
              stroke #ff0000 #bad: M0,0 L1,0
              stroke #ff0000 #anim: M0,0 L1,0
            layer "g"
              stroke #ff0000 #q: M0,0 L1,0
            warning: #p: clip-path is ignored, marked unclipped
            warning: #g: mask is ignored, marked unmasked
            warning: #i: raster image, left out
            warning: <foreignObject> on line 4: foreign content, left out
            warning: <script> on line 4: script, not run
            warning: #flow: flowed text, left out; convert it to text in Inkscape
            warning: #bad: bad path data, kept up to the error: unexpected data at position 7
            warning: #b: unknown element, left out
            warning: #flat: its size is not above 0, left out
            warning: #dot: a single point without length, left out
        "#]],
    );
}
