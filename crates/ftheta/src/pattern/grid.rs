//! A grid of crosses or dots, each with its label, to measure a field by.
//!
//! Columns are A, B, ... from the smallest x, rows 1, 2, ... from the smallest y. A label stands
//! below and left of its mark, along the left and lower border inside the grid, so that nothing
//! goes beyond the marks and no label comes near an arm.

use super::error::PatternError;
use super::sheet::{self, Sheet, SheetProcess};
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{Feature, FeatureShape, GridMark, MarkStyle, Pattern};
use ftheta_model::space::FieldPoint;
use kurbo::{Affine, BezPath, Circle, Rect, Shape as _};

/// Most marks along a side.
pub const N_SIDE_MAX: u32 = 65;
/// Part of the pitch that a mark may take.
const SIZE_MAX: f64 = 0.6;
/// What a mark takes if not told: part of the pitch, and at most this many mm.
const CROSS: (f64, f64) = (0.3, 8.0);
const DOT: (f64, f64) = (0.15, 2.0);
/// Smallest mark and smallest letter, in spot diameters.
const SIZE_MIN_SPOTS: f64 = 4.0;
const LETTER_MIN_SPOTS: f64 = 6.0;
/// Distance of lines that fill a dot, in spot diameters.
const HATCH_SPOTS: f64 = 0.7;
/// Height of a capital letter, em.
const CAPITAL_EM: f64 = 0.75;

/// What a grid looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridOptions {
    /// Marks along each side: odd, 3 to 65.
    pub n_side: u32,
    /// Distance of the outermost marks' centres, mm.
    pub field_mm: f64,
    /// Crosses or dots.
    pub style: MarkStyle,
    /// From tip to tip of a cross, or diameter of a dot, mm; derived from the pitch if `None`.
    pub size_mm: Option<f64>,
    /// How it is marked.
    pub process: SheetProcess,
}

/// Sizes of a grid, all mm.
#[derive(Clone, Copy, Debug)]
struct Sizes {
    pitch_mm: f64,
    size_mm: f64,
    /// From a mark's axes to what stands beside them.
    gap_mm: f64,
    letter_mm: f64,
}

/// The grid for a machine.
///
/// # Errors
/// If it does not fit the machine's field, or marks and labels do not fit each other.
pub fn sheet(options: &GridOptions, machine: &Machine) -> Result<Sheet, PatternError> {
    let sizes = sizes(options, machine)?;
    let features: Vec<Feature> = marks(options, &sizes)
        .map(|mark| Feature { id: label(mark.column, mark.row), shape: FeatureShape::Mark(mark) })
        .collect();
    let pattern = Pattern {
        kind: "grid".into(),
        field_mm: options.field_mm,
        features,
        machine: Some(machine.name.clone()),
        laser: Some(sheet::delays(&machine.laser)),
    };
    let places = pattern.marks().map(|(id, mark)| (id.to_owned(), mark.place_mm)).collect();
    let side_mm = options.field_mm + sizes.size_mm;
    let job = Job {
        layers: vec![mark_layer(&pattern), label_layer(&pattern, options, &sizes)],
        ..Sheet::new_job(&options.process, side_mm)
    };
    let hatch_spacing_mm = Some(HATCH_SPOTS * machine.laser.spot_diameter_mm);
    Ok(Sheet { pattern, job, hatch_spacing_mm, keep_order: false, places, printed: None })
}

/// The name of a mark: letters of its column, number of its row from 1.
pub fn label(column: u32, row: u32) -> String {
    // 26 columns of one letter, 26 · 26 of two.
    let letter = |index: u32| char::from(b'A' + (index % 26) as u8);
    match column {
        0..26 => format!("{}{}", letter(column), row + 1),
        _ => format!("{}{}{}", letter(column / 26 - 1), letter(column), row + 1),
    }
}

fn sizes(options: &GridOptions, machine: &Machine) -> Result<Sizes, PatternError> {
    let GridOptions { n_side, field_mm, .. } = *options;
    if !(3..=N_SIDE_MAX).contains(&n_side) || n_side % 2 == 0 {
        return Err(PatternError::Side { n_side });
    }
    let spot_mm = machine.laser.spot_diameter_mm;
    let pitch_mm = field_mm / f64::from(n_side - 1);
    let (part, most_mm) = if options.style == MarkStyle::Cross { CROSS } else { DOT };
    let size_mm = options.size_mm.unwrap_or((part * pitch_mm).min(most_mm));
    if size_mm > SIZE_MAX * pitch_mm {
        return Err(PatternError::Size { size_mm, pitch_mm, limit_mm: SIZE_MAX * pitch_mm });
    }
    let limit_mm = SIZE_MIN_SPOTS * spot_mm;
    if size_mm < limit_mm {
        return Err(PatternError::TooSmall { size_mm, spot_mm, limit_mm });
    }
    let (reach_mm, limit_mm) = (field_mm + size_mm, machine.optics.field_mm);
    if reach_mm > limit_mm || reach_mm.is_nan() {
        return Err(PatternError::Field { field_mm, size_mm, reach_mm, limit_mm });
    }
    let gap_mm = match options.style {
        // Beyond the tips where there is room, else clear of the arms.
        MarkStyle::Cross => (0.5 * size_mm + 3.0 * spot_mm)
            .min(0.1 * pitch_mm)
            .max(0.25 * size_mm)
            .max(3.0 * spot_mm),
        MarkStyle::Dot => 0.5 * size_mm + 3.0 * spot_mm,
    };
    let letter_mm = letter_mm(n_side, pitch_mm, gap_mm).min(0.25 * pitch_mm).min(4.0);
    let limit_mm = LETTER_MIN_SPOTS * spot_mm;
    if letter_mm < limit_mm {
        return Err(PatternError::Points { n_side, field_mm, letter_mm, limit_mm });
    }
    Ok(Sizes { pitch_mm, size_mm, gap_mm, letter_mm })
}

/// Size of the letters with which every label has its room, mm.
fn letter_mm(n_side: u32, pitch_mm: f64, gap_mm: f64) -> f64 {
    let widest_em = |columns: std::ops::Range<u32>| {
        let labels = columns.map(|column| label(column, n_side - 1));
        labels.map(|label| sheet::width_em(&label)).fold(0.0, f64::max)
    };
    // In the cell beside the centre the axes' sign, two capitals long, stands beside a label.
    let one = (pitch_mm - 2.0 * gap_mm) / (widest_em(0..n_side) + 2.0 * CAPITAL_EM);
    // In the left border's cells two labels are side by side, in the lower border's one above the
    // other, and a letter would fit between them.
    let two_wide = (pitch_mm - 2.0 * gap_mm) / (2.0 * widest_em(0..2) + 1.0);
    let two_high = (pitch_mm - 2.0 * gap_mm) / (2.0 * CAPITAL_EM + 1.0);
    one.min(two_wide).min(two_high)
}

fn marks(options: &GridOptions, sizes: &Sizes) -> impl Iterator<Item = GridMark> {
    let (GridOptions { n_side, style, .. }, Sizes { pitch_mm, size_mm, .. }) = (*options, *sizes);
    // From the centre, so that its mark is exactly there.
    let middle = f64::from(n_side / 2);
    let at = move |index: u32| pitch_mm * (f64::from(index) - middle);
    (0..n_side * n_side).map(move |index| {
        let (row, column) = (index / n_side, index % n_side);
        let place_mm = FieldPoint::new(at(column), at(row));
        GridMark { style, place_mm, size_mm, row, column }
    })
}

fn mark_layer(pattern: &Pattern) -> Layer {
    let shape = |(id, mark): (&str, &GridMark)| {
        let GridMark { place_mm: FieldPoint { x_mm, y_mm }, size_mm, .. } = *mark;
        let half_mm = 0.5 * size_mm;
        let (path, paint) = match mark.style {
            MarkStyle::Cross => {
                let mut path = BezPath::new();
                path.move_to((x_mm - half_mm, y_mm));
                path.line_to((x_mm + half_mm, y_mm));
                path.move_to((x_mm, y_mm - half_mm));
                path.line_to((x_mm, y_mm + half_mm));
                (path, Paint::Stroke)
            }
            MarkStyle::Dot => {
                let disc = Circle::new((x_mm, y_mm), half_mm);
                (disc.to_path(1e-6), Paint::Fill(ftheta_model::job::FillRule::NonZero))
            }
        };
        Shape { source: format!("mark {id}"), path, paint, pen_index: 0 }
    };
    Layer { name: "marks".into(), shapes: pattern.marks().map(shape).collect() }
}

/// Labels, and the axes' sign beside the mark in the centre.
fn label_layer(pattern: &Pattern, options: &GridOptions, sizes: &Sizes) -> Layer {
    let Sizes { pitch_mm, size_mm, gap_mm, letter_mm } = *sizes;
    let labels = pattern.marks().map(|(id, mark)| {
        let path = Affine::scale(letter_mm) * sheet::lettering(id);
        let bounds = path.bounding_box();
        let FieldPoint { x_mm, y_mm } = mark.place_mm;
        let x_mm = if mark.column == 0 { x_mm + gap_mm } else { x_mm - gap_mm - bounds.width() };
        let y_mm = if mark.row == 0 { y_mm + gap_mm } else { y_mm - gap_mm - bounds.height() };
        (format!("label {id}"), Affine::translate((x_mm, y_mm)) * path)
    });
    let widest_mm = letter_mm * sheet::width_em(&label(options.n_side - 1, options.n_side - 1));
    // Beside the label of the mark above and right of the centre.
    let length_mm =
        (pitch_mm - 2.0 * gap_mm - widest_mm).min(0.5 * pitch_mm).min(2.0 * size_mm.max(letter_mm));
    let bounds = Rect::new(gap_mm, gap_mm, gap_mm + length_mm, gap_mm + length_mm);
    sheet::layer("labels", labels.chain(sheet::axes_sign(bounds)))
}
