//! Marks that cannot be meant: too few, on a line, in inches, in the wrong columns.

use crate::axes::affine;
use crate::error::CalibrateError;
use crate::mark::Mark;
use ftheta_model::machine::Optics;
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::Warning;
use ftheta_physics::optics::scale_mm_per_rad;
use nalgebra::Matrix2;
use std::collections::BTreeSet;

/// Fewest marks of any model.
pub const N_MARKS_MIN: usize = 4;
/// Spread across a line by spread along it, at least.
const FLATNESS: f64 = 0.02;
/// Sizes that are the same unit, measured by target.
const SIZE: [f64; 2] = [0.5, 2.0];
/// A size this far from one is worth a warning.
const SIZE_WARNING: f64 = 0.05;
/// What an affine map may leave, by the width of the field: distortion leaves a twentieth.
const UNRELATED: f64 = 0.1;
/// Part of the machine's field that marks should cover.
const COVER: f64 = 0.6;

/// Ratios of sizes that other units give, with what to say.
const UNITS: [(f64, &str); 6] = [
    (25.4, "are the targets in inch?"),
    (1.0 / 25.4, "are the measured places in inch?"),
    (1000.0, "are the measured places in µm, or the targets in m?"),
    (1e-3, "are the measured places in m, or the targets in µm?"),
    (10.0, "are the targets in cm?"),
    (0.1, "are the measured places in cm?"),
];

/// Refuses marks that no model can use, and warns of what weakens the result.
///
/// # Errors
/// [`CalibrateError`] with what is suspected.
pub fn check(optics: &Optics, marks: &[Mark]) -> Result<Vec<Warning>, CalibrateError> {
    let n_marks = marks.len();
    if n_marks < N_MARKS_MIN {
        return Err(CalibrateError::TooFew { n_marks, model: "scale", limit: N_MARKS_MIN });
    }
    let targets: Vec<FieldPoint> = marks.iter().map(|mark| mark.target).collect();
    let spread = spread(&targets);
    let (along_mm, across_mm) = (spread.max(), spread.min());
    if across_mm < FLATNESS * along_mm || along_mm == 0.0 {
        return Err(CalibrateError::Collinear { across_mm, along_mm });
    }
    exchanged(marks)?;
    let (linear, rms_mm) = affine(&targets, marks.iter().map(|mark| mark.measured));
    let ratio = linear.determinant().abs().sqrt();
    let of_unit = |unit: f64| (ratio / unit).ln().abs() < 0.15;
    if let Some((_, suspicion)) = UNITS.into_iter().find(|&(unit, _)| of_unit(unit)) {
        return Err(CalibrateError::Unit { ratio, suspicion });
    }
    let field_mm = 2.0 * reach_mm(&targets);
    if rms_mm > UNRELATED * field_mm {
        return Err(CalibrateError::Unrelated { rms_mm, field_mm });
    }
    if !(SIZE[0]..=SIZE[1]).contains(&ratio) {
        return Err(CalibrateError::Size { ratio, focal_mm: 0.5 * scale_mm_per_rad(optics) });
    }
    Ok(warnings(optics, marks, ratio))
}

fn warnings(optics: &Optics, marks: &[Mark], ratio: f64) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |message: String| warnings.push(Warning::new("points", message));
    if (ratio - 1.0).abs() > SIZE_WARNING {
        warn(format!(
            "the measured field is {ratio:.4} times as large as the targets: check the focal \
             length in the machine file ({} mm)",
            0.5 * scale_mm_per_rad(optics)
        ));
    }
    let covers = |sign_x: f64, sign_y: f64| {
        marks.iter().any(|m| m.target.x_mm * sign_x >= 0.0 && m.target.y_mm * sign_y >= 0.0)
    };
    let n_quadrants = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .into_iter()
        .filter(|&(x, y)| covers(x, y))
        .count();
    let targets: Vec<_> = marks.iter().map(|mark| mark.target).collect();
    let (reach_mm, half_mm) = (reach_mm(&targets), 0.5 * optics.field_mm);
    if n_quadrants < 4 {
        warn(format!(
            "the marks lie in {n_quadrants} of 4 quadrants; what the table does elsewhere is guessed"
        ));
    } else if reach_mm < COVER * half_mm {
        warn(format!(
            "the marks reach ±{reach_mm:.1} mm of the field's ±{half_mm:.1} mm; what the table does \
             beyond is guessed"
        ));
    }
    let key = |m: &Mark| (m.target.x_mm.to_bits(), m.target.y_mm.to_bits(), m.round);
    let different: BTreeSet<_> = marks.iter().map(key).collect();
    let n_repeated = marks.len() - different.len();
    if n_repeated > 0 {
        warn(format!("{n_repeated} target(s) are measured more than once in a round; all count"));
    }
    warnings
}

/// Greatest coordinate, either sign.
pub fn reach_mm(places: &[FieldPoint]) -> f64 {
    places.iter().map(|place| place.x_mm.abs().max(place.y_mm.abs())).fold(0.0, f64::max)
}

/// Root mean square of the places along their principal axes, mm.
fn spread(places: &[FieldPoint]) -> nalgebra::Vector2<f64> {
    let n = places.len() as f64;
    let sum = places.iter().fold((0.0, 0.0), |s, p| (s.0 + p.x_mm, s.1 + p.y_mm));
    let mut moments = Matrix2::zeros();
    for place in places {
        let off = nalgebra::Vector2::new(place.x_mm - sum.0 / n, place.y_mm - sum.1 / n);
        moments += off * off.transpose() / n;
    }
    moments.symmetric_eigenvalues().map(|value| value.max(0.0).sqrt())
}

/// Targets are round numbers on a grid, measured places are not.
fn exchanged(marks: &[Mark]) -> Result<(), CalibrateError> {
    let different = |place: fn(&Mark) -> FieldPoint| {
        marks.iter().map(|mark| place(mark).x_mm.to_bits()).collect::<BTreeSet<_>>().len()
    };
    let (n_targets, n_measured) = (different(|m| m.target), different(|m| m.measured));
    let n_marks = marks.len();
    if n_marks >= 9 && 2 * n_measured <= n_marks && 10 * n_targets >= 9 * n_marks {
        return Err(CalibrateError::Exchanged { n_marks, n_targets, n_measured });
    }
    Ok(())
}
