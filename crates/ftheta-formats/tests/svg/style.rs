//! Paint, layers and pens, and what is said of the rest.

use crate::checks::{check_content, check_file, check_with, on_page};
use expect_test::expect;
use ftheta_formats::svg::{SvgOptions, read};
use ftheta_model::recipe::{Pen, PenRule, Recipe};

#[test]
fn programs_files() {
    check_file("inkscape");
    check_file("illustrator");
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
         <path id='h' d='M0 0h1' style='font: 4px/1 x; stroke: teal'/>
         <path id='i' d='M0 0h1' style='stroke:lime;stroke:octarine'/>
         <g color='#123456'><path id='g' d='M0 0h1' style='stroke:currentColor'/></g></g>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #222222 #first: M0,0 L1,0
              stroke #ff0000 #a: M0,0 L1,0
              stroke #0000ff #b: M0,0 L1,0
              stroke #00ff00 #c: M0,0 L1,0
              stroke #111111 #d: M0,0 L1,0
              stroke #444444 #e: M0,0 L1,0
              stroke #333333 #f: M0,0 L1,0
              stroke #008080 #h: M0,0 L1,0
              stroke #00ff00 #i: M0,0 L1,0
              stroke #123456 #g: M0,0 L1,0
            warning: #e: stroke="rgb(0, 10%, 255)" is no paint, ignored
            warning: #i: stroke="octarine" is no paint, ignored
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
fn pens_by_colour_and_layer() {
    let pen = |name: &str| Pen { name: name.into(), ..Pen::default() };
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
    let job = read(drawing.as_bytes(), &recipe, &SvgOptions::default()).unwrap().value;
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
         <path id='anim' d='M0 0h1' stroke='red' stroke-width='2'><animate/></path>
         <rect id='paper' width='1' height='1' fill='#fff'/>
         <text id='up' font-family='Hershey' style='writing-mode:tb;
         text-decoration:none' font-size='4'>|</text>
         <metadata/><title/><desc/><foreign xmlns='urn:x'/>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #p: M0,0 L1,0
              stroke #ff0000 #bad: M0,0 L1,0
              stroke #ff0000 #anim: M0,0 L1,0
              fill #ffffff #paper: M0,0 L1,0 L1,-1 L0,-1 Z
              stroke #000000 #up: M0.571428571,3.571428571 L0.571428571,-1
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
            warning: #anim: <animate> in it is ignored
            warning: #up: writing-mode is ignored
            warning: <svg>: strokes up to 2.000 mm wide are marked along their centre line only (1)
            warning: <svg>: white areas are marked too; give them no fill to leave them bare (1)
        "#]],
    );
}
