//! What holds for every drawing.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use ftheta_model::job::{FillRule, Job, Layer, Paint, Shape};
use ftheta_model::recipe::{Hatch, Pen};
use ftheta_model::toolpath::{Mark, Toolpath};
use ftheta_toolpath::lay::{LayOptions, Order, lay};
use kurbo::{BezPath, Circle, ParamCurve, ParamCurveNearest, PathEl, Point, Rect, Shape as _};
use proptest::prelude::*;

const TOLERANCE_MM: f64 = 0.002;

fn point() -> impl Strategy<Value = Point> {
    (-50.0..50.0, -50.0..50.0).prop_map(Point::from)
}

/// A cubic, a disc, a rectangle or a polyline, open or closed.
fn path() -> impl Strategy<Value = BezPath> {
    prop_oneof![
        prop::collection::vec(point(), 4).prop_map(|p| {
            let mut path = BezPath::new();
            path.move_to(p[0]);
            path.curve_to(p[1], p[2], p[3]);
            path
        }),
        (point(), 0.01..9.0).prop_map(|(p, r)| Circle::new(p, r).to_path(1e-4)),
        (point(), point()).prop_map(|(a, b)| Rect::from_points(a, b).to_path(1e-4)),
        polygon(3..9),
        prop::collection::vec(point(), 2..6).prop_map(|p| {
            let mut path = BezPath::new();
            path.move_to(p[0]);
            p[1..].iter().for_each(|p| path.line_to(*p));
            path
        }),
    ]
}

fn polygon(n: std::ops::Range<usize>) -> impl Strategy<Value = BezPath> {
    prop::collection::vec(point(), n).prop_map(|p| {
        let mut path = BezPath::new();
        path.move_to(p[0]);
        p[1..].iter().for_each(|p| path.line_to(*p));
        path.close_path();
        path
    })
}

fn drawing() -> impl Strategy<Value = Job> {
    let pens = (1u32..4, 0.0..180.0, any::<bool>()).prop_map(|(n_passes, angle_deg, outline)| {
        let hatched = Pen {
            n_passes,
            hatch: Some(Hatch { spacing_mm: 1.5, angle_deg, outline }),
            ..Pen::default()
        };
        vec![Pen::default(), hatched]
    });
    let shapes = prop::collection::vec((path(), any::<bool>(), 0..2usize), 1..14);
    (pens, shapes).prop_map(|(pens, shapes)| {
        let shapes = shapes.into_iter().enumerate();
        let shapes = shapes.map(|(i, (path, fill, pen_index))| Shape {
            source: format!("#{i}"),
            path,
            paint: match fill {
                true => Paint::Fill(FillRule::EvenOdd),
                false => Paint::Stroke,
            },
            pen_index,
        });
        Job {
            layers: vec![Layer { name: String::new(), shapes: shapes.collect() }],
            pens,
            page_mm: [120.0, 120.0],
        }
    })
}

fn laid(job: &Job, order: Order, half_field_mm: f64) -> Toolpath {
    let options = LayOptions {
        order,
        half_field_mm,
        clip: true,
        flatten_tolerance_mm: TOLERANCE_MM,
        ..LayOptions::default()
    };
    lay(job, &options).unwrap().value
}

/// What stays of a mark when it is reversed or starts elsewhere.
fn signature(mark: &Mark) -> String {
    let ends = match mark.closed {
        true => Point::ZERO,
        false => mark.start().midpoint(mark.end()),
    };
    let (length, area) = (mark.length_mm(), mark.curve.bounding_box());
    let size = [area.x0, area.x1, area.y0, area.y1, ends.x, ends.y, length];
    let size = size.map(|v| (v * 1e4).round() as i64);
    format!("{} {} {size:?}", mark.pen_index, mark.source)
}

fn is_inside(p: Point, polygon: &[Point]) -> bool {
    let crossings = polygon.windows(2).filter(|e| {
        (e[0].y > p.y) != (e[1].y > p.y)
            && p.x < e[0].x + (p.y - e[0].y) / (e[1].y - e[0].y) * (e[1].x - e[0].x)
    });
    crossings.count() % 2 == 1
}

fn distance_to_polyline(p: Point, points: &[Point]) -> f64 {
    let lines = points.windows(2).map(|e| kurbo::Line::new(e[0], e[1]));
    lines.map(|line| line.nearest(p, 1e-9).distance_sq.sqrt()).fold(f64::INFINITY, f64::min)
}

fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn order_changes_no_mark(job in drawing()) {
        let list = |order| {
            let mut list: Vec<_> = laid(&job, order, 60.0).marks.iter().map(signature).collect();
            list.sort();
            list
        };
        prop_assert_eq!(list(Order::Keep), list(Order::Shortest));
    }

    #[test]
    fn shortest_is_not_longer(mut job in drawing()) {
        // Without closed contours nothing is nested, so nothing forbids the drawing's order.
        job.layers[0].shapes.retain(|shape| {
            shape.paint != Paint::Stroke && shape.pen_index == 1
                || !shape.path.elements().contains(&PathEl::ClosePath)
                    && shape.paint == Paint::Stroke
        });
        if let Some(hatch) = &mut job.pens[1].hatch {
            hatch.outline = false;
        }
        let keep = laid(&job, Order::Keep, 60.0).jump_length_mm();
        let short = laid(&job, Order::Shortest, 60.0).jump_length_mm();
        prop_assert!(short <= keep + 1e-9, "{short} {keep}");
    }

    #[test]
    fn pens_never_mix_and_runs_are_alike(job in drawing()) {
        let (one, two) = (laid(&job, Order::Shortest, 60.0), laid(&job, Order::Shortest, 60.0));
        prop_assert!(one.marks.windows(2).all(|m| m[0].pen_index <= m[1].pen_index));
        prop_assert_eq!(format!("{one:?}"), format!("{two:?}"));
    }

    #[test]
    fn points_follow_the_curve(job in drawing(), half_mm in 10.0..60.0, keep in any::<bool>()) {
        let order = if keep { Order::Keep } else { Order::Shortest };
        for mark in laid(&job, order, half_mm).marks {
            let ends = (mark.curve.segments().next(), mark.curve.segments().last());
            prop_assert_eq!(ends.0.unwrap().start(), mark.start());
            prop_assert_eq!(ends.1.unwrap().end(), mark.end());
            prop_assert!(!mark.closed || mark.start() == mark.end());
            prop_assert!(mark.points.windows(2).all(|p| p[0] != p[1]));
            for segment in mark.curve.segments() {
                for i in 0..=20 {
                    let p = segment.eval(f64::from(i) / 20.0);
                    prop_assert!(p.x.abs().max(p.y.abs()) < half_mm + 1e-6);
                    let off = distance_to_polyline(p, &mark.points);
                    prop_assert!(off < TOLERANCE_MM, "{off}");
                }
            }
        }
    }

    #[test]
    fn inner_contours_come_before_outer_ones(job in drawing()) {
        let closed: Vec<Mark> = laid(&job, Order::Shortest, 60.0)
            .marks
            .into_iter()
            .filter(|mark| mark.closed)
            .collect();
        for (i, outer) in closed.iter().enumerate() {
            for inner in closed[i + 1..].iter().filter(|m| m.pen_index == outer.pen_index) {
                let all_in = inner.points.iter().all(|&p| is_inside(p, &outer.points));
                let smaller = inner.curve.area().abs() < outer.curve.area().abs() - 1e-6;
                prop_assert!(!(all_in && smaller), "{} in {}", inner.source, outer.source);
            }
        }
    }

    #[test]
    fn hatch_covers_the_area(
        path in polygon(3..12),
        even_odd in any::<bool>(),
        angle_deg in -200.0..200.0,
    ) {
        let hatch = Hatch { spacing_mm: 0.05, angle_deg, outline: false };
        let rule = if even_odd { FillRule::EvenOdd } else { FillRule::NonZero };
        let shape = Shape {
            source: "#p".into(),
            path: path.clone(),
            paint: Paint::Fill(rule),
            pen_index: 0,
        };
        let job = Job {
            pens: vec![Pen { hatch: Some(hatch), ..Pen::default() }],
            layers: vec![Layer { name: String::new(), shapes: vec![shape] }],
            page_mm: [100.0, 100.0],
        };
        let marks = laid(&job, Order::Keep, 60.0).marks;
        let hatched_mm2: f64 = marks.iter().map(|m| m.length_mm() * hatch.spacing_mm).sum();
        let corners: Vec<Point> = path.elements().iter().filter_map(PathEl::end_point).collect();
        let area_mm2 = area_by_columns(&corners, rule);
        // A quarter of a spacing may be missing along the outline, and columns have a width.
        let perimeter_mm = path.perimeter(1e-6);
        let off_mm2 = hatched_mm2 - area_mm2;
        prop_assert!(off_mm2.abs() < 0.02 * perimeter_mm, "{off_mm2} of {area_mm2}");
    }
}

/// Area by vertical columns of 0.02 mm, each with all edges looked at.
fn area_by_columns(corners: &[Point], rule: FillRule) -> f64 {
    let mut area_mm2 = 0.0;
    for column in -2500..2500 {
        let x = (f64::from(column) + 0.5) * 0.02;
        let mut crossings = Vec::new();
        for i in 0..corners.len() {
            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
            if (a.x > x) != (b.x > x) {
                let y = a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y);
                crossings.push((y, if a.x > x { 1 } else { -1 }));
            }
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            let inside = match rule {
                FillRule::NonZero => winding != 0,
                FillRule::EvenOdd => winding % 2 != 0,
            };
            if inside {
                area_mm2 += (pair[1].0 - pair[0].0) * 0.02;
            }
        }
    }
    area_mm2
}
