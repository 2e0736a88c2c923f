//! What rotation does to the modes: coupling, stiffening and pull per squared speed.

use super::assembly::MassPoint;
use super::modes::ModeShape;
use nalgebra::{DMatrix, DVector};

/// Terms of the kinetic energy that rotation adds, see [`spin`](super::spin).
#[derive(Clone, Debug, PartialEq)]
pub struct Rotation {
    /// `G`: how much mode i moves across mode j.
    pub coupling: DMatrix<f64>,
    /// `S`: stiffness per squared speed, by tension less displacement.
    pub stiffening: DMatrix<f64>,
    /// `r`: generalised force per squared speed.
    pub pull: DVector<f64>,
}

impl Rotation {
    /// Sums over the particles of a mechanism.
    pub(super) fn new(points: &[MassPoint], shapes: &[ModeShape]) -> Self {
        let n = shapes.len();
        let mut rotation = Self {
            coupling: DMatrix::zeros(n, n),
            stiffening: DMatrix::zeros(n, n),
            pull: DVector::zeros(n),
        };
        let sum = |row: &[(usize, f64)], mode: usize| -> f64 {
            row.iter().map(|&(index, weight)| weight * shapes[mode].shape[index]).sum()
        };
        for point in points {
            let x: Vec<f64> = (0..n).map(|i| sum(&point.displacement[0], i)).collect();
            let y: Vec<f64> = (0..n).map(|i| sum(&point.displacement[1], i)).collect();
            let slope: Vec<f64> = (0..n).map(|i| sum(&point.slope, i)).collect();
            for i in 0..n {
                let across = point.place_m[0] * x[i] + point.place_m[1] * y[i];
                rotation.pull[i] += point.mass_kg * across;
                for j in 0..n {
                    rotation.coupling[(i, j)] += point.mass_kg * (x[i] * y[j] - y[i] * x[j]);
                    rotation.stiffening[(i, j)] += point.tension_kg_m2 * slope[i] * slope[j]
                        - point.mass_kg * (x[i] * x[j] + y[i] * y[j]);
                }
            }
        }
        rotation
    }
}
