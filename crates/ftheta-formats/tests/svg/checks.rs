//! A drawing in, the text of its job out.

use expect_test::Expect;
use ftheta_formats::svg::{SvgOptions, read};
use ftheta_model::job::{FillRule, Job, Paint};
use ftheta_model::recipe::Recipe;
use ftheta_model::warning::Imported;
use kurbo::{BezPath, PathEl, Point};
use std::fmt::Write;

/// Checks the job of a drawing, read as it is.
pub fn check(drawing: &str, expected: Expect) {
    check_with(drawing, &Recipe::default(), &SvgOptions::default(), expected);
}

/// Checks the job of a drawing, or the error.
pub fn check_with(drawing: &str, recipe: &Recipe, options: &SvgOptions, expected: Expect) {
    let dump = match read(drawing.as_bytes(), recipe, options) {
        Ok(imported) => dump(&imported),
        Err(error) => format!("error: {error}\n"),
    };
    expected.assert_eq(&dump);
}

/// A drawing in `tests/golden` and the job beside it.
pub fn check_file(name: &str) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/");
    let drawing = std::fs::read(format!("{folder}{name}.svg")).unwrap();
    let imported = read(&drawing, &Recipe::default(), &SvgOptions::default()).unwrap();
    expect_test::expect_file![format!("{folder}{name}.txt")].assert_eq(&dump(&imported));
}

/// `content` on a page of 20 x 20 mm whose units are mm.
pub fn check_content(content: &str, expected: Expect) {
    check(&on_page(content), expected);
}

/// A drawing of 20 x 20 mm with its origin in the middle, in mm.
pub fn on_page(content: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' \
         width='20mm' height='20mm' viewBox='-10 -10 20 20'>\n{content}</svg>"
    )
}

/// All of a job but the pens, as text.
pub fn dump(imported: &Imported<Job>) -> String {
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

/// A path as SVG writes it.
pub fn path_text(path: &BezPath) -> String {
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
pub fn mm(value: f64) -> String {
    let text = format!("{value:.9}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// The job of a drawing that is good.
pub fn job_of(drawing: &str) -> Job {
    let imported = read(drawing.as_bytes(), &Recipe::default(), &SvgOptions::default());
    imported.unwrap().value
}
