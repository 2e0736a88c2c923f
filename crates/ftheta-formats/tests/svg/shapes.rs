//! Shapes, curves, transforms and repeated content.

use crate::checks::{check, check_content, job_of, on_page};
use expect_test::expect;
use kurbo::{ParamCurve, Point, Shape};

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
fn basic_shapes() {
    check_content(
        "<g fill='none' stroke='red'><rect id='r' x='1' y='2' width='3' height='4'/>
         <polyline points='0,0 1 2,3-1.5'/><polygon id='poly' points='0,0 1,2 3-1 9'/>
         <line x1='1' x2='-1'/><path d='M1 1H2V2h-1z l-1 0'/></g>",
        expect![[r#"
            page 20 x 20 mm
            layer ""
              stroke #ff0000 #r: M1,-2 L4,-2 L4,-6 L1,-6 Z
              stroke #ff0000 <polyline> on line 3: M0,0 L1,-2 L3,1.5
              stroke #ff0000 #poly: M0,0 L1,-2 L3,1 Z
              stroke #ff0000 <line> on line 4: M1,0 L-1,0
              stroke #ff0000 <path> on line 4: M1,-1 L2,-1 L2,-2 L1,-2 Z M1,-1 L0,-1
            warning: #poly: bad points, kept up to the error
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
    let job = job_of(&drawing);
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
    for (flags, large, below) in
        [("0 0", false, true), ("0 1", false, false), ("1 0", true, true), ("1 1", true, false)]
    {
        let drawing =
            on_page(&format!("<path d='M-1 0A2 2 0 {flags} 1 0' fill='none' stroke='red'/>"));
        let job = job_of(&drawing);
        let bounds = job.layers[0].shapes[0].path.bounding_box();
        let sagitta_mm = if large { 2.0 + 3f64.sqrt() } else { 2.0 - 3f64.sqrt() };
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
