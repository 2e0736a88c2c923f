//! A small drawing and its toolpath, as text.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use expect_test::{Expect, expect};
use ftheta_model::job::{FillRule, Job, Layer, Paint, Shape};
use ftheta_model::recipe::{Hatch, Pen};
use ftheta_toolpath::lay::{LayOptions, Order, lay};
use kurbo::BezPath;
use std::fmt::Write;

/// Shapes as `pen paint svg-path`, paint being `stroke` or `fill`.
fn check(shapes: &[&str], hatch: Option<Hatch>, options: &LayOptions, expected: &Expect) {
    let shapes = shapes.iter().enumerate().map(|(i, text)| {
        let mut words = text.splitn(3, ' ');
        let pen_index = words.next().unwrap().parse().unwrap();
        let paint = match words.next().unwrap() {
            "fill" => Paint::Fill(FillRule::EvenOdd),
            _ => Paint::Stroke,
        };
        Shape {
            source: format!("#{i}"),
            path: BezPath::from_svg(words.next().unwrap()).unwrap(),
            paint,
            pen_index,
        }
    });
    let second = Pen { name: "second".into(), n_passes: 2, ..Pen::default() };
    let job = Job {
        layers: vec![Layer { name: String::new(), shapes: shapes.collect() }],
        pens: vec![Pen { hatch, ..Pen::default() }, second],
        page_mm: [20.0, 20.0],
    };
    let text = match lay(&job, options) {
        Ok(laid) => {
            let mut text = String::new();
            for warning in &laid.warnings {
                writeln!(text, "warning: {warning}").unwrap();
            }
            for mark in &laid.value.marks {
                let closed = if mark.closed { "closed" } else { "open" };
                let curve = mark.curve.to_svg();
                writeln!(text, "{} {} {closed} {curve}", mark.pen_index, mark.source).unwrap();
            }
            text
        }
        Err(error) => format!("{error}\n{:?}\n", error.fault()),
    };
    expected.assert_eq(&text);
}

const HATCH: Hatch = Hatch { spacing_mm: 1.0, angle_deg: 0.0, outline: false };

#[test]
fn shortest_turns_marks_and_contours() {
    check(
        &[
            "0 stroke M9 0 L5 0",
            "0 stroke M-1 0 L-4 0 M0 0 H1",
            "0 stroke M-9 -1 H-5 V1 H-9 Z",
            "1 stroke M9 9 L8 9",
        ],
        None,
        &LayOptions::default(),
        &expect![[r#"
            0 #2 closed M-5,-1 L-5,1 L-9,1 L-9,-1 L-5,-1
            0 #1 open M-4,0 L-1,0
            0 #1 open M0,0 L1,0
            0 #0 open M5,0 L9,0
            1 #3 open M9,9 L8,9
            1 #3 open M8,9 L9,9
        "#]],
    );
}

#[test]
fn keep_leaves_the_drawing_alone() {
    let options = LayOptions { order: Order::Keep, ..LayOptions::default() };
    check(
        &["1 stroke M9 0 L5 0", "0 stroke M-1 0 L-4 0 M0 0 H1"],
        None,
        &options,
        &expect![[r#"
            0 #1 open M-1,0 L-4,0
            0 #1 open M0,0 L1,0
            1 #0 open M9,0 L5,0
            1 #0 open M9,0 L5,0
        "#]],
    );
}

#[test]
fn hatch_goes_to_and_fro_around_a_hole() {
    check(
        &["0 fill M0 0 H4 V4 H0 Z M1 1 H3 V3 H1 Z"],
        Some(HATCH),
        &LayOptions::default(),
        &expect![[r#"
            0 #0 open M0,0.5 L4,0.5
            0 #0 open M4,1.5 L3,1.5
            0 #0 open M3,2.5 L4,2.5
            0 #0 open M4,3.5 L0,3.5
            0 #0 open M0,2.5 L1,2.5
            0 #0 open M1,1.5 L0,1.5
        "#]],
    );
}

#[test]
fn inner_contours_come_first() {
    check(
        &[
            "0 stroke M0 0 H8 V8 H0 Z",
            "0 stroke M1 1 H2 V2 H1 Z",
            "0 stroke M4 4 H7 V7 H4 Z M5 5 H6 V6 H5 Z",
        ],
        None,
        &LayOptions::default(),
        &expect![[r#"
            0 #1 closed M1,1 L2,1 L2,2 L1,2 L1,1
            0 #2 closed M5,5 L6,5 L6,6 L5,6 L5,5
            0 #2 closed M4,4 L7,4 L7,7 L4,7 L4,4
            0 #0 closed M0,0 L8,0 L8,8 L0,8 L0,0
        "#]],
    );
}

#[test]
fn clip_cuts_curves_and_lines() {
    let options =
        LayOptions { half_field_mm: 2.0, clip: true, order: Order::Keep, ..LayOptions::default() };
    check(
        &[
            "0 stroke M0 0 Q2 0 4 2 L9 9",
            "0 stroke M-1 -1 H3 V0 H-1 Z",
            "0 fill M1 1 H3 V3 H1 Z",
            "0 stroke M5 5 H6",
        ],
        Some(HATCH),
        &options,
        &expect![[r#"
            warning: #0: outside the field: 1 curve(s) cut at its edge, 0 left out
            warning: #1: outside the field: 1 curve(s) cut at its edge, 0 left out
            warning: #2: outside the field: 1 hatch line(s) cut at its edge, 1 left out
            warning: #3: outside the field: 0 curve(s) cut at its edge, 1 left out
            0 #0 open M0,0 Q1,0 2,0.5
            0 #1 open M2,0 L-1,0 L-1,-1 L2,-1
            0 #2 open M2,1.5 L1,1.5
        "#]],
    );
}

#[test]
fn faults_and_warnings_name_the_place() {
    check(
        &["0 stroke M0 0 L0 0", "0 fill M0 0 H1 V1 Z", "0 fill M2 0 H3 V1 Z"],
        None,
        &LayOptions::default(),
        &expect![[r#"
            warning: #0: 1 part(s) without length left out
            warning: pen default: no hatch is set, so filled areas are marked along their outline
            0 #1 closed M0,0 L1,0 L1,1 L0,0
            0 #2 closed M2,0 L3,0 L3,1 L2,0
        "#]],
    );
    let outside = &["0 stroke M0 0 L70 0"];
    check(
        outside,
        None,
        &LayOptions::default(),
        &expect![[r##"
        #0: reaches (70.000, 0.000) mm, outside the field of ±60 mm
        ("#0", "(70.000, 0.000) mm", "±60 mm")
    "##]],
    );
    let thin = Hatch { spacing_mm: 0.0, ..HATCH };
    check(
        &["0 fill M0 0 H1 V1 Z"],
        Some(thin),
        &LayOptions::default(),
        &expect![[r#"
            hatch spacing of pen default: 0 mm is below 0.001 mm
            ("hatch spacing of pen default", "0 mm", "0.001 mm")
        "#]],
    );
}
