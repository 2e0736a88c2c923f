//! A printed sheet with signs around a grid, by which a photograph of it can be measured.
//!
//! Forty signs stand around the plate, a line along x below them and one along y beside them are
//! measured with a caliper, since printers are off by some tenths of a percent.

use super::error::PatternError;
use super::sheet::{self, Sheet};
use ftheta_formats::print_file::{Item, Print};
use ftheta_model::pattern::{Feature, FeatureShape, Pattern};
use ftheta_model::space::FieldPoint;
use ftheta_model::tag;
use kurbo::{Affine, BezPath, Point, Rect};

/// Signs along each side, both corners among them.
const N_SIDE: usize = 11;
/// Side of a sign by that of the field, and its limits, mm.
const SIGN: f64 = 0.0325;
const SIGN_MM: [f64; 2] = [5.0, 12.0];
/// From the outermost marks to the plate's edge: what heads are off, by the field and at least, mm.
const PLATE: f64 = 0.02;
const PLATE_MM: f64 = 3.0;
/// From there to the signs' white, mm.
const GAP_MM: f64 = 0.5;
/// From the signs to the lines, from the lines to the paper's edge, mm.
const LINE_GAP_MM: f64 = 2.0;
const MARGIN_MM: f64 = 4.0;
/// Lines are whole multiples of this long, mm, this wide, and have bars of this length.
const LINE_STEP_MM: f64 = 10.0;
const LINE_WIDTH_MM: f64 = 0.25;
const BAR_MM: f64 = 3.0;
/// Size of letters, mm.
const LETTER_MM: f64 = 2.5;
/// Paper that printers have: name, shorter and longer side, mm.
const PAPERS: [(&str, f64, f64); 5] = [
    ("A4", 210.0, 297.0),
    ("A3", 297.0, 420.0),
    ("A2", 420.0, 594.0),
    ("A1", 594.0, 841.0),
    ("A0", 841.0, 1189.0),
];

/// A sheet to be printed.
#[derive(Clone, Debug)]
pub struct Printed {
    /// What is on it.
    pub print: Print,
    /// The paper that it needs.
    pub paper: &'static str,
    /// Length of the lines along x and y, mm.
    pub line_mm: f64,
}

/// A grid with a printed sheet around it.
///
/// # Errors
/// If the sheet is larger than any paper.
pub fn around(mut grid: Sheet) -> Result<Sheet, PatternError> {
    let side_mm = grid.job.page_mm[0];
    let sign_mm = (SIGN * side_mm).clamp(SIGN_MM[0], SIGN_MM[1]);
    let cell_mm = sign_mm / tag::N_CELLS as f64;
    let plate_mm = 0.5 * side_mm + (PLATE * side_mm).max(PLATE_MM);
    let ring_mm = plate_mm + GAP_MM + cell_mm + 0.5 * sign_mm;
    let edge_mm = ring_mm + 0.5 * sign_mm + cell_mm;
    grid.pattern.features.extend(signs(ring_mm, sign_mm));
    let line_mm = (2.0 * ring_mm / LINE_STEP_MM).floor() * LINE_STEP_MM;
    let line_at_mm = edge_mm + LINE_GAP_MM;
    grid.pattern.features.extend(lines(line_mm, line_at_mm));
    let reach_mm = 2.0 * (line_at_mm + 0.5 * BAR_MM + MARGIN_MM);
    // Words stand above and below the square.
    let paper = PAPERS
        .iter()
        .find(|(_, short, long)| reach_mm <= *short && reach_mm + 8.0 * LETTER_MM <= *long);
    let &(paper, width, height) =
        paper.ok_or(PatternError::Paper { reach_mm, limit_mm: PAPERS[PAPERS.len() - 1].1 })?;
    let mut print = Print { page_mm: [width, height], items: Vec::new() };
    draw(&grid.pattern, &mut print);
    let outline = Rect::new(-plate_mm, -plate_mm, plate_mm, plate_mm);
    print.items.push(line(
        &[
            corner(outline, 0),
            corner(outline, 1),
            corner(outline, 2),
            corner(outline, 3),
            corner(outline, 0),
        ],
        true,
    ));
    words(&mut print, line_mm, line_at_mm, paper);
    grid.printed = Some(Printed { print, paper, line_mm });
    Ok(grid)
}

fn corner(rect: Rect, index: usize) -> Point {
    let (x, y) =
        [(rect.x0, rect.y0), (rect.x1, rect.y0), (rect.x1, rect.y1), (rect.x0, rect.y1)][index];
    Point::new(x, y)
}

/// Signs around a square, from its lower left corner row by row.
fn signs(ring_mm: f64, size_mm: f64) -> impl Iterator<Item = Feature> {
    let at = move |index: usize| 2.0 * ring_mm * index as f64 / (N_SIDE - 1) as f64 - ring_mm;
    let border = (0..N_SIDE * N_SIDE).filter(|index| {
        let (row, column) = (index / N_SIDE, index % N_SIDE);
        row == 0 || column == 0 || row == N_SIDE - 1 || column == N_SIDE - 1
    });
    border.enumerate().map(move |(number, index)| Feature {
        id: format!("sign-{number}"),
        shape: FeatureShape::Fiducial {
            family: tag::FAMILY.into(),
            code: number.to_string(),
            place_mm: FieldPoint::new(at(index % N_SIDE), at(index / N_SIDE)),
            size_mm,
            burned: false,
        },
    })
}

fn lines(length_mm: f64, at_mm: f64) -> [Feature; 2] {
    let half_mm = 0.5 * length_mm;
    let feature = |id: &str, from_mm: FieldPoint, to_mm: FieldPoint| Feature {
        id: id.into(),
        shape: FeatureShape::Reference { from_mm, to_mm, burned: false },
    };
    [
        feature("line-x", FieldPoint::new(-half_mm, -at_mm), FieldPoint::new(half_mm, -at_mm)),
        feature("line-y", FieldPoint::new(at_mm, -half_mm), FieldPoint::new(at_mm, half_mm)),
    ]
}

/// Draws what of a pattern is printed.
fn draw(pattern: &Pattern, print: &mut Print) {
    for feature in &pattern.features {
        match &feature.shape {
            FeatureShape::Fiducial { code, place_mm, size_mm, burned: false, .. } => {
                let cells = code.parse().ok().and_then(tag::cells).unwrap_or_default();
                let cell_mm = size_mm / tag::N_CELLS as f64;
                let (left, top) = (place_mm.x_mm - 0.5 * size_mm, place_mm.y_mm + 0.5 * size_mm);
                let square = Rect::new(left, top - size_mm, left + size_mm, top);
                print.items.push(Item::Rectangle { rect: square, black: true });
                for (row, cells) in cells.iter().enumerate() {
                    for (column, _) in cells.iter().enumerate().filter(|(_, white)| **white) {
                        let (x, y) = (left + cell_mm * column as f64, top - cell_mm * row as f64);
                        let rect = Rect::new(x, y - cell_mm, x + cell_mm, y);
                        print.items.push(Item::Rectangle { rect, black: false });
                    }
                }
            }
            FeatureShape::Reference { from_mm, to_mm, burned: false } => {
                let (from, to) = (Point::from(*from_mm), Point::from(*to_mm));
                let across = (to - from).normalize();
                let across = kurbo::Vec2::new(-across.y, across.x) * 0.5 * BAR_MM;
                print.items.push(line(&[from, to], false));
                for end in [from, to] {
                    print.items.push(line(&[end - across, end + across], false));
                }
            }
            _ => {}
        }
    }
}

fn line(points: &[Point], dashed: bool) -> Item {
    let mut path = BezPath::new();
    for (index, point) in points.iter().enumerate() {
        match index {
            0 => path.move_to(*point),
            _ => path.line_to(*point),
        }
    }
    Item::Line { path, width_mm: LINE_WIDTH_MM, dashed }
}

/// What to do with the sheet, above and below it.
fn words(print: &mut Print, line_mm: f64, line_at_mm: f64, paper: &str) {
    let below = -line_at_mm - 0.5 * BAR_MM - 1.5 * LETTER_MM;
    let above = line_at_mm + LETTER_MM;
    for (text, y) in [
        (
            format!("Print on {paper} at 100 %. The plate lies within the broken line."),
            above + 2.0 * LETTER_MM,
        ),
        ("Lay it so that the machine's x runs along these words.".to_owned(), above),
        (format!("Measure both long lines from bar to bar ({line_mm:.0} mm):"), below),
        (
            "--sheet-x-mm this one, --sheet-y-mm the one on the right".to_owned(),
            below - 2.0 * LETTER_MM,
        ),
    ] {
        let path = Affine::scale(LETTER_MM) * sheet::lettering(&text);
        let width = LETTER_MM * sheet::width_em(&text);
        let path = Affine::translate((-0.5 * width, y)) * path;
        print.items.push(Item::Line { path, width_mm: LINE_WIDTH_MM, dashed: false });
    }
}
