//! A square with a cross through its centre: nine places to measure with a ruler.
//!
//! Source: the test of the thesis that calibration is compared with.

use super::error::PatternError;
use super::sheet::{self, Sheet, SheetProcess};
use ftheta_model::job::Job;
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{Feature, FeatureShape, LineProcess, Pattern};
use ftheta_model::space::FieldPoint;
use kurbo::{BezPath, Rect};

/// The axes' sign, by the square's side.
const SIGN: f64 = 0.1;
/// From the cross to it, by the square's side.
const SIGN_GAP: f64 = 0.02;

/// The square for a machine.
///
/// * `field_mm`: its side, mm
///
/// # Errors
/// If it does not fit the machine's field.
pub fn sheet(
    field_mm: f64,
    process: &SheetProcess,
    machine: &Machine,
) -> Result<Sheet, PatternError> {
    let limit_mm = machine.optics.field_mm;
    if field_mm > limit_mm || field_mm.is_nan() {
        return Err(PatternError::Field { field_mm, size_mm: 0.0, reach_mm: field_mm, limit_mm });
    }
    let half_mm = 0.5 * field_mm;
    let at = |x: i32, y: i32| FieldPoint::new(half_mm * f64::from(x), half_mm * f64::from(y));
    let strokes = [
        ("square", vec![at(-1, -1), at(1, -1), at(1, 1), at(-1, 1), at(-1, -1)]),
        ("cross-x", vec![at(-1, 0), at(1, 0)]),
        ("cross-y", vec![at(0, -1), at(0, 1)]),
    ];
    let (mut features, mut curves) = (Vec::new(), Vec::new());
    for (name, places) in strokes {
        let n_sides = places.len() - 1;
        let mut path = BezPath::new();
        for (index, &place) in places.iter().enumerate() {
            let Some(previous) = index.checked_sub(1) else {
                path.move_to(place);
                continue;
            };
            path.line_to(place);
            let process = LineProcess { speed_mm_s: process.speed_mm_s, power_ratio: 1.0 };
            let id = if n_sides > 1 { format!("{name}-{index}") } else { name.into() };
            let from_mm = places[previous];
            let shape = FeatureShape::Line { from_mm, to_mm: place, process };
            features.push(Feature { id, shape });
        }
        curves.push((name.to_owned(), path));
    }
    let gap_mm = SIGN_GAP * field_mm;
    let bounds = Rect::from_origin_size((gap_mm, gap_mm), (SIGN * field_mm, SIGN * field_mm));
    let layers =
        vec![sheet::layer("square", curves), sheet::layer("sign", sheet::axes_sign(bounds))];
    let pattern = Pattern {
        kind: "square".into(),
        field_mm,
        features,
        machine: Some(machine.name.clone()),
        laser: Some(sheet::delays(&machine.laser)),
    };
    let names = [
        ["lower left", "lower", "lower right"],
        ["left", "centre", "right"],
        ["upper left", "upper", "upper right"],
    ];
    let places = (-1..=1).zip(names).flat_map(|(y, names)| {
        (-1..=1).zip(names).map(move |(x, name)| (name.to_owned(), at(x, y)))
    });
    let places = places.collect();
    let job = Job { layers, ..Sheet::new_job(process, field_mm) };
    Ok(Sheet { pattern, job, hatch_spacing_mm: None, keep_order: false, places, printed: None })
}
