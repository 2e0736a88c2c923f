//! The model's equations around an estimate: what each unknown moves at each mark.

use super::parameters::Parameters;
use super::residual::{N_TERMS, Residual};
use crate::axes::Axes;
use crate::mark::Mark;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::head::Tracer;
use nalgebra::{DMatrix, DVector};

/// Step of the differences, in sigmas: the model is all but linear over it.
const STEP: f64 = 1e-3;

/// What is known before any mark: the head's parameters, the axes, where the residual is smooth.
pub struct Model {
    pub parameters: Parameters,
    pub axes: Axes,
    pub residual: Residual,
}

/// Two rows a mark (x, y of the head's place) by all unknowns: parameters in sigmas, then residual
/// terms of x and of y in mm.
pub struct Linearised {
    pub jacobian: DMatrix<f64>,
    /// Measured less predicted by the parameters alone, plus the Jacobian times the estimate, mm:
    /// what the unknowns have to explain.
    pub data_mm: DVector<f64>,
}

impl Model {
    /// Parameters of the head.
    pub fn n_parameters(&self) -> usize {
        self.parameters.all().len()
    }

    /// All unknowns.
    pub fn n_unknowns(&self) -> usize {
        self.n_parameters() + 2 * N_TERMS
    }

    /// Equations of the marks around an estimate.
    pub fn linearised(&self, marks: &[Mark], estimate: &DVector<f64>) -> Linearised {
        let commands: Vec<_> = marks.iter().map(|mark| self.axes.commands(mark.command)).collect();
        let n_parameters = self.n_parameters();
        let mut jacobian = self.jacobian(&commands, estimate);
        let tracer = Tracer::new(&self.parameters.head(estimate.rows(0, n_parameters).as_slice()));
        let mut data_mm = DVector::zeros(2 * marks.len());
        for (index, (mark, &command)) in marks.iter().zip(&commands).enumerate() {
            let (measured, place) = (self.axes.head(mark.measured), tracer.place(command));
            data_mm[2 * index] = measured.x_mm - place.x_mm;
            data_mm[2 * index + 1] = measured.y_mm - place.y_mm;
        }
        let parameters = estimate.rows(0, n_parameters);
        data_mm += jacobian.columns(0, n_parameters) * parameters;
        // A place without a beam would spoil every sum.
        let broken = |value: &f64| !value.is_finite();
        if jacobian.iter().any(broken) || data_mm.iter().any(broken) {
            jacobian.fill(0.0);
            data_mm.fill(f64::INFINITY);
        }
        Linearised { jacobian, data_mm }
    }

    /// What each unknown moves at each command, mm.
    pub fn jacobian(&self, commands: &[MirrorAngles], estimate: &DVector<f64>) -> DMatrix<f64> {
        let n_parameters = self.n_parameters();
        let mut jacobian = DMatrix::zeros(2 * commands.len(), self.n_unknowns());
        let mut values = estimate.rows(0, n_parameters).into_owned();
        for column in 0..n_parameters {
            let middle = values[column];
            let [low, high] = [-STEP, STEP].map(|step| {
                values[column] = middle + step;
                Tracer::new(&self.parameters.head(values.as_slice()))
            });
            values[column] = middle;
            let slopes = commands.iter().flat_map(|&command| {
                let (a, b) = (low.place(command), high.place(command));
                [b.x_mm - a.x_mm, b.y_mm - a.y_mm].map(|change| change / (2.0 * STEP))
            });
            jacobian.column_mut(column).iter_mut().zip(slopes).for_each(|(cell, v)| *cell = v);
        }
        for (index, &command) in commands.iter().enumerate() {
            let terms = self.residual.terms(command);
            for (k, term) in terms.into_iter().enumerate() {
                jacobian[(2 * index, n_parameters + k)] = term;
                jacobian[(2 * index + 1, n_parameters + N_TERMS + k)] = term;
            }
        }
        jacobian
    }

    /// The head and residual of an estimate.
    pub fn place(
        &self,
        tracer: &Tracer,
        estimate: &DVector<f64>,
        angles: MirrorAngles,
    ) -> FieldPoint {
        let command = self.axes.commands(angles);
        let place = tracer.place(command);
        let terms = self.residual.terms(command);
        let n_parameters = self.n_parameters();
        let sum = |first: usize| -> f64 {
            let values = &estimate.as_slice()[first..first + N_TERMS];
            terms.iter().zip(values).map(|(term, value)| term * value).sum()
        };
        self.axes.measured(FieldPoint::new(
            place.x_mm + sum(n_parameters),
            place.y_mm + sum(n_parameters + N_TERMS),
        ))
    }
}
