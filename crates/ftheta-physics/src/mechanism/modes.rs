//! The lowest elastic modes: frequencies, shapes, and how far each turns rotor and mirror.

use super::MechanismError;
use super::assembly::{Direction, Model};
use super::rotation::Rotation;
use super::solve::BandFactor;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use std::f64::consts::TAU;

/// What most of a mode's kinetic energy is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeKind {
    /// Rotation about the shaft, and twist of the mirror.
    Torsion,
    /// Bending along x, in the mirror's plane.
    BendingX,
    /// Bending along y, across the mirror's plane.
    BendingY,
    /// Stretching along the shaft.
    Axial,
}

impl ModeKind {
    /// A word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Torsion => "torsion",
            Self::BendingX => "bending x",
            Self::BendingY => "bending y",
            Self::Axial => "axial",
        }
    }
}

/// One elastic mode: what moves how far per unit of its coordinate, whose scale is such that the
/// mode's inertia is 1 kg·m².
#[derive(Clone, Debug, PartialEq)]
pub struct ModeShape {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// What moves most.
    pub kind: ModeKind,
    /// Angle of the rotor about the shaft, rad per unit.
    pub rotor: f64,
    /// Angle of the mirror about the shaft, rad per unit.
    pub mirror: f64,
    /// Angle of the mirror about x, rad per unit.
    pub tilt: f64,
    /// Displacements in m and rotations in rad of all freedoms, per unit.
    pub shape: DVector<f64>,
}

/// The lowest elastic modes of a mechanism that is free to turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// Inertia of the whole, kg·m²: the rotation as a mode.
    pub inertia_kg_m2: f64,
    /// Damping ratio of every mode.
    pub damping_ratio: f64,
    /// The modes, slowest first.
    pub shapes: Vec<ModeShape>,
    /// What rotation does to them.
    pub rotation: Rotation,
}

/// Shift of the stiffness by so much mass, that the free rotation does not make it singular.
const SHIFT_HZ: f64 = 500.0;

/// An elastic motion slower than this is one that the bearings do not hold.
const HELD_HZ: f64 = 20.0;

const ITERATIONS_MAX: usize = 300;

/// Relative change of squared frequencies at which the iteration ends.
const CHANGE_MAX: f64 = 1e-11;

impl Model {
    /// The `n_modes` lowest elastic modes; fewer if the model has fewer freedoms.
    ///
    /// # Errors
    /// If the bearings leave more than the rotation free, or the modes do not converge.
    ///
    /// # Accuracy
    /// Frequencies of the mesh to 1e-9 relative; what the mesh is worth shows on a finer one.
    ///
    /// Source: subspace iteration (Bathe 1971) on the shifted stiffness, without the rotation.
    pub fn modes(&self, n_modes: usize) -> Result<Modes, MechanismError> {
        let n_modes = n_modes.min(self.n_freedoms / 4).max(1);
        let n_vectors = (2 * n_modes + 8).min(self.n_freedoms - 1);
        let shift = (TAU * SHIFT_HZ).powi(2);
        let factor = BandFactor::new(self.n_freedoms, &self.stiffness, &self.mass, shift)
            .ok_or_else(|| self.too_stiff())?;
        let turned = self.mass.times_vector(&self.rotation) / self.inertia_kg_m2();
        // Vectors that hold a part of every mode; a small generator, so that runs are alike.
        let mut seed = 1_u64;
        let mut x = DMatrix::from_fn(self.n_freedoms, n_vectors, |_, _| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / f64::from(1 << 23) - 1.0
        });
        let mut squares = DVector::<f64>::zeros(n_vectors);
        let mut change = f64::INFINITY;
        for _ in 0..ITERATIONS_MAX {
            let pushed = self.mass.times(&x);
            let mut y = pushed.clone();
            factor.solve(&mut y);
            // What is left of the rotation would come out as a mode of zero frequency.
            let rotated = y.tr_mul(&turned);
            y -= &self.rotation * rotated.transpose();
            let (values, vectors) = self.ritz(&y, &pushed, shift)?;
            x = &y * vectors;
            change = (0..n_modes)
                .map(|i| ((values[i] - squares[i]) / (values[i].abs() + shift)).abs())
                .fold(0.0, f64::max);
            squares = values;
            if change < CHANGE_MAX {
                return self.described(&squares, &x, n_modes);
            }
        }
        Err(MechanismError::NotConverged { change, n_iterations: ITERATIONS_MAX })
    }

    fn too_stiff(&self) -> MechanismError {
        let diagonal = self.stiffness.diagonal(self.n_freedoms);
        let least = diagonal.iter().copied().filter(|&k| k > 0.0).fold(f64::INFINITY, f64::min);
        MechanismError::Stiffness { ratio: diagonal.max() / least, limit: 1e16 }
    }

    /// Squared frequencies within a subspace, in order, and the combinations that have them.
    fn ritz(
        &self,
        y: &DMatrix<f64>,
        pushed: &DMatrix<f64>,
        shift: f64,
    ) -> Result<(DVector<f64>, DMatrix<f64>), MechanismError> {
        let symmetric = |m: DMatrix<f64>| (&m + m.transpose()) * 0.5;
        let mut stiffness = symmetric(y.tr_mul(pushed));
        let mut mass = symmetric(y.tr_mul(&self.mass.times(y)));
        // Columns of like length, or the factor loses digits.
        let scale: Vec<f64> = (0..y.ncols()).map(|i| mass[(i, i)].sqrt().recip()).collect();
        for i in 0..y.ncols() {
            for j in 0..y.ncols() {
                stiffness[(i, j)] *= scale[i] * scale[j];
                mass[(i, j)] *= scale[i] * scale[j];
            }
        }
        let failed = MechanismError::NotConverged { change: f64::INFINITY, n_iterations: 0 };
        let lower = Cholesky::new(mass).ok_or(failed.clone())?.unpack();
        let half = lower.solve_lower_triangular(&stiffness).ok_or(failed.clone())?;
        let whole = lower.solve_lower_triangular(&half.transpose()).ok_or(failed.clone())?;
        let eigen =
            SymmetricEigen::try_new(symmetric(whole), 1e-15, 10_000).ok_or(failed.clone())?;
        let mut order: Vec<usize> = (0..y.ncols()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let vectors =
            lower.transpose().solve_upper_triangular(&eigen.eigenvectors).ok_or(failed)?;
        let values = DVector::from_fn(y.ncols(), |i, _| eigen.eigenvalues[order[i]] - shift);
        let vectors =
            DMatrix::from_fn(y.ncols(), y.ncols(), |i, j| scale[i] * vectors[(i, order[j])]);
        Ok((values, vectors))
    }

    fn described(
        &self,
        squares: &DVector<f64>,
        x: &DMatrix<f64>,
        n_modes: usize,
    ) -> Result<Modes, MechanismError> {
        let mut shapes = Vec::with_capacity(n_modes);
        for index in 0..n_modes {
            let frequency_hz = squares[index].max(0.0).sqrt() / TAU;
            if frequency_hz < HELD_HZ {
                return Err(MechanismError::NotHeld { frequency_hz, limit_hz: HELD_HZ });
            }
            let mut shape: DVector<f64> = x.column(index).into();
            // A mode and its opposite are the same: let the largest displacement be positive.
            if shape[shape.iamax()] < 0.0 {
                shape.neg_mut();
            }
            shapes.push(ModeShape {
                frequency_hz,
                kind: self.kind(&shape),
                rotor: self.rotor_row.dot(&shape),
                mirror: self.mirror_row.dot(&shape),
                tilt: self.tilt_row.dot(&shape),
                shape,
            });
        }
        Ok(Modes {
            inertia_kg_m2: self.inertia_kg_m2(),
            damping_ratio: self.damping_ratio,
            rotation: Rotation::new(&self.points, &shapes),
            shapes,
        })
    }

    /// Which motion has the greatest share of the kinetic energy.
    fn kind(&self, shape: &DVector<f64>) -> ModeKind {
        let twist = DVector::from_fn(shape.len(), |i, _| {
            let (image, sign, _) = self.images[i];
            0.5 * (shape[i] + sign * shape[image])
        });
        let rest = shape - &twist;
        let energy = |part: &DVector<f64>| part.dot(&self.mass.times_vector(part));
        let along = |direction: Direction| {
            let part = DVector::from_fn(shape.len(), |i, _| {
                if self.images[i].2 == direction { rest[i] } else { 0.0 }
            });
            energy(&part)
        };
        let mut kinds = [
            (energy(&twist), ModeKind::Torsion),
            (along(Direction::X), ModeKind::BendingX),
            (along(Direction::Y), ModeKind::BendingY),
            (along(Direction::Z), ModeKind::Axial),
        ];
        kinds.sort_by(|a, b| b.0.total_cmp(&a.0));
        kinds[0].1
    }
}
