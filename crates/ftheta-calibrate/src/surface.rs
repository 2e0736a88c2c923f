//! Maps of the error over the field that know nothing of the head: polynomials, zones, nine points,
//! scale with pincushion. All are linear in their coefficients.

mod basis;
mod least_squares;

use crate::axes::Axes;
use crate::error::CalibrateError;
use crate::mark::Mark;
pub use basis::Basis;
use ftheta_model::machine::Optics;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::optics::field_from_angles;
use least_squares::{Solved, solve};
use nalgebra::{DVector, Vector2};

/// Nominal optics with a map of what is added to their places.
pub struct Surface {
    optics: Optics,
    axes: Axes,
    parts: Vec<Part>,
    /// Of every mark used: measured less predicted without it, mm, in measured coordinates.
    pub left_out_mm: Vec<Vector2<f64>>,
}

/// One map, of coordinates divided by the half width of the marks.
#[derive(Clone)]
struct Part {
    basis: Basis,
    half_mm: f64,
    coefficients: [DVector<f64>; 2],
}

/// Which bases are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Offset, scale, pincushion and barrel of each axis.
    Scale,
    /// The same, and then the error of nine places, bilinear between them.
    NinePoint,
    /// Tensor and total degree, whichever cross-validation prefers.
    Polynomial,
    /// Cubic splines over 4 × 4 zones, smooth at their borders, as stiff as cross-validation asks.
    Zones,
}

/// Highest degree of a polynomial.
const DEGREE_MAX: usize = 9;
/// Marks by coefficients, at least: fewer, and noise is bent into the field.
const MARKS_PER_COEFFICIENT: f64 = 1.5;
/// Zones along a side.
const N_ZONES: usize = 4;
/// Stiffness of zones that is tried.
const STIFFNESS: [f64; 9] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// The errors to be mapped, one pair of coordinates a mark, head coordinates, mm.
struct Errors {
    places: Vec<[f64; 2]>,
    errors: [DVector<f64>; 2],
    half_mm: f64,
}

impl Surface {
    /// Fits the best member of a family.
    ///
    /// # Errors
    /// If the equations have no solution.
    pub fn fit(
        family: Family,
        optics: &Optics,
        axes: Axes,
        marks: &[Mark],
    ) -> Result<Self, CalibrateError> {
        let optics = Optics { first_mirror: ftheta_model::machine::Axis::X, ..optics.clone() };
        let mut surface = Self { optics, axes, parts: Vec::new(), left_out_mm: Vec::new() };
        let errors = surface.errors(marks);
        let singular = CalibrateError::Singular { model: family.name(), n_marks: marks.len() };
        let candidates: Vec<(Basis, f64)> = match family {
            Family::Scale | Family::NinePoint => vec![(Basis::Pincushion, 0.0)],
            Family::Polynomial => polynomials(marks.len()),
            Family::Zones => STIFFNESS.map(|stiffness| (Basis::Zones(N_ZONES), stiffness)).into(),
        };
        let mut left = surface.add(&errors, &candidates).ok_or(singular.clone())?;
        if family == Family::NinePoint {
            let errors = surface.errors(marks);
            left = surface.add(&errors, &[(Basis::Hats, 0.0)]).ok_or(singular)?;
        }
        surface.left_out_mm = (0..marks.len())
            .map(|k| {
                let turned = axes.measured(FieldPoint::new(left[0][k], left[1][k]));
                Vector2::new(turned.x_mm, turned.y_mm)
            })
            .collect();
        Ok(surface)
    }

    /// Adds the part that cross-validation prefers; what is left of them then.
    fn add(&mut self, errors: &Errors, candidates: &[(Basis, f64)]) -> Option<[DVector<f64>; 2]> {
        let solved = candidates.iter().filter_map(|&(basis, stiffness)| {
            let axis = |index: usize| -> Option<Solved> {
                let design = basis.design(&errors.places, index);
                solve(&design, &errors.errors[index], basis.penalty(), stiffness)
            };
            let (x, y) = (axis(0)?, axis(1)?);
            let sum = x.validation + y.validation;
            // One that cannot spare a mark comes last.
            let sum = if sum.is_nan() { f64::INFINITY } else { sum };
            Some((sum, basis, [x, y]))
        });
        let (_, basis, axes) = solved.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let left_out = axes.each_ref().map(|axis| axis.left_out.clone());
        let coefficients = axes.map(|axis| axis.coefficients);
        self.parts.push(Part { basis, half_mm: errors.half_mm, coefficients });
        Some(left_out)
    }

    /// Measured less predicted so far, over the nominal places.
    fn errors(&self, marks: &[Mark]) -> Errors {
        let nominal: Vec<FieldPoint> =
            marks.iter().map(|mark| self.nominal(mark.command)).collect();
        let reach = nominal.iter().map(|p| p.x_mm.abs().max(p.y_mm.abs())).fold(1e-3, f64::max);
        let left = |index: usize, mark: &Mark| {
            let (measured, place) = (self.axes.head(mark.measured), self.head_place(mark.command));
            [measured.x_mm - place.x_mm, measured.y_mm - place.y_mm][index]
        };
        let errors = [0, 1].map(|index| {
            DVector::from_iterator(marks.len(), marks.iter().map(|mark| left(index, mark)))
        });
        let places = nominal.iter().map(|p| [p.x_mm / reach, p.y_mm / reach]).collect();
        Errors { places, errors, half_mm: reach }
    }

    fn nominal(&self, angles: MirrorAngles) -> FieldPoint {
        field_from_angles(&self.optics, self.axes.commands(angles))
    }

    fn head_place(&self, angles: MirrorAngles) -> FieldPoint {
        let nominal = self.nominal(angles);
        let mut sum = [nominal.x_mm, nominal.y_mm];
        for part in &self.parts {
            let place = [nominal.x_mm / part.half_mm, nominal.y_mm / part.half_mm];
            for (index, sum) in sum.iter_mut().enumerate() {
                let terms = part.basis.terms(place, index);
                *sum +=
                    terms.iter().zip(&part.coefficients[index]).map(|(t, c)| t * c).sum::<f64>();
            }
        }
        FieldPoint::new(sum[0], sum[1])
    }

    /// Where commands put the beam, in measured coordinates.
    pub fn place(&self, angles: MirrorAngles) -> FieldPoint {
        self.axes.measured(self.head_place(angles))
    }

    /// What was chosen, in words.
    pub fn description(&self) -> String {
        let parts: Vec<_> = self.parts.iter().map(|part| part.basis.description()).collect();
        parts.join(", then ")
    }

    /// Coefficients with their names, mm: those of scale in terms of the field.
    pub fn coefficients(&self) -> Vec<(String, f64)> {
        let mut all = Vec::new();
        for part in &self.parts {
            for (axis, values) in ["x", "y"].iter().zip(&part.coefficients) {
                let names = part.basis.names(values.len());
                all.extend(names.into_iter().zip(values).map(|(n, &v)| (format!("{n}_{axis}"), v)));
            }
        }
        all
    }
}

impl Family {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scale => "scale",
            Self::NinePoint => "nine-point",
            Self::Polynomial => "polynomial",
            Self::Zones => "zones",
        }
    }
}

/// Polynomials that so many marks support.
fn polynomials(n_marks: usize) -> Vec<(Basis, f64)> {
    let degrees = 1..=DEGREE_MAX;
    let all = degrees.flat_map(|degree| [Basis::Total(degree), Basis::Tensor(degree)]);
    let fits = |basis: &Basis| basis.n_terms() as f64 * MARKS_PER_COEFFICIENT <= n_marks as f64;
    all.filter(fits).map(|basis| (basis, 0.0)).collect()
}
