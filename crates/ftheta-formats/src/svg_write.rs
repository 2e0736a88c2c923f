//! Writes a job as a plain SVG: millimetres, resolved curves, layers as groups, a colour per pen.

use ftheta_model::job::{FillRule, Job, Layer, Paint, Shape};
use kurbo::Affine;
use std::fmt::{self, Write};

/// Colours of pens that are not named by one: far apart, readable on white.
const COLORS: [&str; 8] =
    ["#000000", "#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf"];

/// The job as an SVG document in mm that [`crate::svg::read`] reads as the same curves.
///
/// Strokes are hairlines of no width, since a mark has none. Text has become curves.
pub fn to_svg(job: &Job) -> String {
    let [width_mm, height_mm] = job.page_mm;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\"\n  \
         width=\"{width_mm}mm\" height=\"{height_mm}mm\" viewBox=\"0 0 {width_mm} {height_mm}\">\n"
    );
    // Field millimetres have their origin in the page's centre and y up.
    let page_from_field = Affine::new([1.0, 0.0, 0.0, -1.0, 0.5 * width_mm, 0.5 * height_mm]);
    for layer in &job.layers {
        // Writing to a String cannot fail.
        let _ = write_layer(job, layer, page_from_field, &mut out);
    }
    out.push_str("</svg>\n");
    out
}

fn write_layer(job: &Job, layer: &Layer, page_from_field: Affine, out: &mut String) -> fmt::Result {
    let name = escaped(&layer.name);
    writeln!(out, "<g inkscape:groupmode=\"layer\" inkscape:label=\"{name}\">")?;
    for shape in &layer.shapes {
        let path = page_from_field * shape.path.clone();
        let paint = paint(job, shape);
        writeln!(out, "<path {paint} d=\"{}\"/>", path.to_svg())?;
    }
    writeln!(out, "</g>")
}

fn paint(job: &Job, shape: &Shape) -> String {
    let named = job.pens.get(shape.pen_index).map(|pen| pen.name.as_str());
    let color = named
        .filter(|name| name.starts_with('#') && name.is_ascii())
        .unwrap_or(COLORS[shape.pen_index % COLORS.len()]);
    let color = escaped(color);
    match shape.paint {
        Paint::Stroke => format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"0\""),
        Paint::Fill(FillRule::NonZero) => format!("fill=\"{color}\""),
        Paint::Fill(FillRule::EvenOdd) => format!("fill=\"{color}\" fill-rule=\"evenodd\""),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
