//! Drawings to be printed at true size: PDF and SVG of rectangles and lines in mm.

use kurbo::{BezPath, PathEl, Point, Rect};
use std::fmt::Write as _;

/// Points of PDF in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// A drawing on paper; mm, origin in the page's centre, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Print {
    /// Width and height of the page, mm.
    pub page_mm: [f64; 2],
    /// What is on it, the lowest first.
    pub items: Vec<Item>,
}

/// Something black or white.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A filled rectangle.
    Rectangle {
        /// Where.
        rect: Rect,
        /// Black, or white.
        black: bool,
    },
    /// A line along a curve of straight pieces.
    Line {
        /// Where.
        path: BezPath,
        /// How wide, mm.
        width_mm: f64,
        /// Whether it is broken.
        dashed: bool,
    },
}

/// The drawing as a PDF of one page.
pub fn to_pdf(print: &Print) -> Vec<u8> {
    let [width, height] = print.page_mm.map(|mm| mm * POINTS_PER_MM);
    let content = content(print);
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".into(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".into(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4} {height:.4}] \
             /Resources << >> /Contents 4 0 R >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
    ];
    let mut out = String::from("%PDF-1.4\n");
    let mut offsets = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        offsets.push(out.len());
        // Writing to a String cannot fail, here and below.
        let _ = write!(out, "{} 0 obj\n{object}\nendobj\n", index + 1);
    }
    let table = out.len();
    let _ = write!(out, "xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
    for offset in offsets {
        let _ = writeln!(out, "{offset:010} 00000 n ");
    }
    let n = objects.len() + 1;
    let _ = write!(out, "trailer\n<< /Size {n} /Root 1 0 R >>\nstartxref\n{table}\n%%EOF\n");
    out.into_bytes()
}

fn content(print: &Print) -> String {
    let [width, height] = print.page_mm;
    let at = |point: Point| {
        [(point.x + 0.5 * width) * POINTS_PER_MM, (point.y + 0.5 * height) * POINTS_PER_MM]
    };
    let mut out = String::from("1 J 1 j\n");
    for item in &print.items {
        match item {
            Item::Rectangle { rect, black } => {
                let [x, y] = at(Point::new(rect.x0, rect.y0));
                let [w, h] = [rect.width(), rect.height()].map(|mm| mm * POINTS_PER_MM);
                let shade = u8::from(!black);
                let _ = writeln!(out, "{shade} g {x:.4} {y:.4} {w:.4} {h:.4} re f");
            }
            Item::Line { path, width_mm, dashed } => {
                let dashes = if *dashed { "[6 6]" } else { "[]" };
                let width = width_mm * POINTS_PER_MM;
                let _ = writeln!(out, "0 G {width:.4} w {dashes} 0 d");
                for element in path.elements() {
                    let _ = match element {
                        PathEl::MoveTo(p) => write!(out, "{:.4} {:.4} m ", at(*p)[0], at(*p)[1]),
                        PathEl::ClosePath => write!(out, "h "),
                        other => other
                            .end_point()
                            .map_or(Ok(()), |p| write!(out, "{:.4} {:.4} l ", at(p)[0], at(p)[1])),
                    };
                }
                out.push_str("S\n");
            }
        }
    }
    out
}

/// The drawing as an SVG in mm.
pub fn to_svg(print: &Print) -> String {
    let [width, height] = print.page_mm;
    let [left, top] = [-0.5 * width, -0.5 * height];
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"{left} {top} {width} {height}\">\n<g transform=\"scale(1,-1)\">\n"
    );
    for item in &print.items {
        let _ = match item {
            Item::Rectangle { rect, black } => {
                let shade = if *black { "#000" } else { "#fff" };
                writeln!(
                    out,
                    "<rect x=\"{:.4}\" y=\"{:.4}\" width=\"{:.4}\" height=\"{:.4}\" \
                     fill=\"{shade}\"/>",
                    rect.x0,
                    rect.y0,
                    rect.width(),
                    rect.height()
                )
            }
            Item::Line { path, width_mm, dashed } => {
                let dashes = if *dashed { " stroke-dasharray=\"2 2\"" } else { "" };
                writeln!(
                    out,
                    "<path d=\"{}\" fill=\"none\" stroke=\"#000\" stroke-linecap=\"round\" \
                     stroke-width=\"{width_mm}\"{dashes}/>",
                    path.to_svg()
                )
            }
        };
    }
    out.push_str("</g>\n</svg>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pdf_has_its_table_where_it_says_and_true_lengths() {
        let rect = Rect::new(-10.0, -5.0, 15.4, 5.0);
        let mut path = BezPath::new();
        path.move_to((0.0, 0.0));
        path.line_to((25.4, 0.0));
        let items = vec![
            Item::Rectangle { rect, black: true },
            Item::Line { path, width_mm: 0.2, dashed: true },
        ];
        let print = Print { page_mm: [210.0, 297.0], items };
        let text = String::from_utf8(to_pdf(&print)).unwrap();
        let at: usize = text.lines().rev().nth(1).unwrap().parse().unwrap();
        assert!(text[at..].starts_with("xref\n0 5\n"));
        for (index, line) in text[at..].lines().skip(3).take(4).enumerate() {
            let offset: usize = line[..10].parse().unwrap();
            assert!(text[offset..].starts_with(&format!("{} 0 obj", index + 1)), "{line}");
        }
        // An inch is 72 points.
        assert!(text.contains("72.0000 28.3465 re f"), "{text}");
        let svg = to_svg(&print);
        assert!(roxmltree::Document::parse(&svg).is_ok());
        assert!(svg.contains("width=\"210mm\" height=\"297mm\""));
    }
}
