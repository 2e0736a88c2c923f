//! Laying out large jobs: 100 000 segments in order, and a fine hatch.

use divan::Bencher;
use ftheta_model::job::{FillRule, Job, Layer, Paint, Shape};
use ftheta_model::recipe::{Hatch, Pen};
use ftheta_toolpath::lay::{LayOptions, Order, lay};
use kurbo::{BezPath, Circle, Point, Shape as _};

fn main() {
    divan::main();
}

/// Short segments at places that look random but are the same every time.
fn segments(n: u32) -> Job {
    let unit = |i: u32, salt: u32| {
        let mixed = (i ^ salt.rotate_left(16)).wrapping_mul(0x9E37_79B9);
        let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85EB_CA6B);
        f64::from(mixed ^ (mixed >> 13)) / f64::from(u32::MAX)
    };
    let shapes = (0..n).map(|i| {
        let from = Point::new(110.0 * unit(i, 1) - 55.0, 110.0 * unit(i, 2) - 55.0);
        let way = kurbo::Vec2::from_angle(6.3 * unit(i, 3)) * (0.05 + 0.2 * unit(i, 4));
        let mut path = BezPath::new();
        path.move_to(from);
        path.line_to(from + way);
        shape(path, Paint::Stroke)
    });
    job(shapes.collect(), None)
}

fn shape(path: BezPath, paint: Paint) -> Shape {
    Shape { source: "#s".into(), path, paint, pen_index: 0 }
}

fn job(shapes: Vec<Shape>, hatch: Option<Hatch>) -> Job {
    Job {
        pens: vec![Pen { hatch, ..Pen::default() }],
        layers: vec![Layer { name: String::new(), shapes }],
        page_mm: [120.0, 120.0],
    }
}

#[divan::bench(args = [10_000, 100_000], sample_count = 3)]
fn order_segments(bencher: Bencher<'_, '_>, n: u32) {
    let job = segments(n);
    bencher.bench(|| lay(&job, &LayOptions::default()).map(|laid| laid.value.marks.len()));
}

#[divan::bench(sample_count = 3)]
fn keep_100_000_segments(bencher: Bencher<'_, '_>) {
    let job = segments(100_000);
    let options = LayOptions { order: Order::Keep, ..LayOptions::default() };
    bencher.bench(|| lay(&job, &options).map(|laid| laid.value.marks.len()));
}

/// 2 000 discs, about 200 000 hatch lines and their outlines.
#[divan::bench(sample_count = 3)]
fn hatch_2000_discs(bencher: Bencher<'_, '_>) {
    let shapes = (0..2000).map(|i| {
        let centre = Point::new(f64::from(i % 50) * 2.2 - 54.0, f64::from(i / 50) * 2.2 - 43.0);
        let disc = Circle::new(centre, 1.0).to_path(1e-3);
        shape(disc, Paint::Fill(FillRule::NonZero))
    });
    let hatch = Hatch { spacing_mm: 0.02, angle_deg: 30.0, outline: true };
    let job = job(shapes.collect(), Some(hatch));
    bencher.bench(|| lay(&job, &LayOptions::default()).map(|laid| laid.value.marks.len()));
}
