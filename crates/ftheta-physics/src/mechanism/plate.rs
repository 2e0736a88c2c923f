//! A flat shell of four nodes: plane stress, and bending with shear that does not lock.
//!
//! Local axes: 1 along the shaft (z), 2 across it (x), normal y. Freedoms of a node: u1, u2, the
//! deflection w along y, and the rotations about axes 1 and 2.

use super::Material;
use nalgebra::{DMatrix, Matrix2, SMatrix};

/// Freedoms of a node.
pub(super) const NODE_FREEDOMS: usize = 5;

/// Freedoms of an element.
const N: usize = 4 * NODE_FREEDOMS;

/// Corners of the parent square.
const CORNERS: [(f64, f64); 4] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];

/// Share of the thickness that carries shear (Reissner).
const SHEAR_SHARE: f64 = 5.0 / 6.0;

type Strain = SMatrix<f64, 3, N>;
type Shear = SMatrix<f64, 2, N>;

/// Shape functions of an element at a point of the parent square.
pub(super) struct Shapes {
    /// Weights of the corners.
    pub(super) n: [f64; 4],
    /// Their slopes along axes 1 and 2, 1/m.
    pub(super) slope: [[f64; 2]; 4],
    /// Area per area of the parent square, m².
    pub(super) area: f64,
    /// Slopes along the parent's axes.
    parent: [[f64; 2]; 4],
    /// Position's slopes along the parent's axes: row per parent axis.
    jacobian: Matrix2<f64>,
}

impl Shapes {
    /// Shapes at `(s, t)`, corners in m along axes 1 and 2.
    pub(super) fn new(corners: &[[f64; 2]; 4], s: f64, t: f64) -> Self {
        let n = CORNERS.map(|(a, b)| 0.25 * (1.0 + a * s) * (1.0 + b * t));
        let parent = CORNERS.map(|(a, b)| [0.25 * a * (1.0 + b * t), 0.25 * b * (1.0 + a * s)]);
        let jacobian = Matrix2::from_fn(|row, column| {
            (0..4).map(|i| parent[i][row] * corners[i][column]).sum()
        });
        let inverse = jacobian.try_inverse().unwrap_or_else(Matrix2::zeros);
        let slope = parent.map(|d| {
            [
                inverse[(0, 0)] * d[0] + inverse[(0, 1)] * d[1],
                inverse[(1, 0)] * d[0] + inverse[(1, 1)] * d[1],
            ]
        });
        Self { n, slope, area: jacobian.determinant(), parent, jacobian }
    }
}

/// Places of the four Gauss points, each of weight one.
pub(super) fn gauss() -> [(f64, f64); 4] {
    let g = 1.0 / 3.0_f64.sqrt();
    CORNERS.map(|(a, b)| (a * g, b * g))
}

/// Stiffness and mass of an element.
///
/// Source: MITC4 (Bathe and Dvorkin 1985) for bending, isoparametric plane stress.
pub(super) fn element(
    corners: &[[f64; 2]; 4],
    thickness: f64,
    material: &Material,
) -> [DMatrix<f64>; 2] {
    let nu = material.poisson;
    let plane = material.young_pa / (1.0 - nu * nu);
    #[rustfmt::skip]
    let elastic = SMatrix::<f64, 3, 3>::from_row_slice(&[
        plane, plane * nu, 0.0,
        plane * nu, plane, 0.0,
        0.0, 0.0, material.shear_pa(),
    ]);
    let shear_rigidity = SHEAR_SHARE * material.shear_pa() * thickness;
    let line = thickness * material.density_kg_m3;
    let cube = thickness.powi(3) / 12.0;
    let mut stiffness = SMatrix::<f64, N, N>::zeros();
    let mut mass = SMatrix::<f64, N, N>::zeros();
    for (s, t) in gauss() {
        let shapes = Shapes::new(corners, s, t);
        let membrane = membrane(&shapes);
        let curvature = curvature(&shapes);
        let shear = shear(corners, &shapes, s, t);
        stiffness += membrane.transpose() * elastic * membrane * (thickness * shapes.area)
            + curvature.transpose() * elastic * curvature * (cube * shapes.area)
            + shear.transpose() * shear * (shear_rigidity * shapes.area);
        for i in 0..4 {
            for j in 0..4 {
                let both = shapes.n[i] * shapes.n[j] * shapes.area;
                let (row, column) = (NODE_FREEDOMS * i, NODE_FREEDOMS * j);
                for freedom in 0..3 {
                    mass[(row + freedom, column + freedom)] += both * line;
                }
                for freedom in 3..5 {
                    mass[(row + freedom, column + freedom)] += both * cube * material.density_kg_m3;
                }
            }
        }
    }
    [stiffness, mass].map(|matrix| DMatrix::from_column_slice(N, N, matrix.as_slice()))
}

fn membrane(shapes: &Shapes) -> Strain {
    let mut strain = Strain::zeros();
    for (i, slope) in shapes.slope.iter().enumerate() {
        let at = NODE_FREEDOMS * i;
        strain[(0, at)] = slope[0];
        strain[(1, at + 1)] = slope[1];
        strain[(2, at)] = slope[1];
        strain[(2, at + 1)] = slope[0];
    }
    strain
}

/// Curvatures: a fibre at height ζ moves by ζ·θ2 along axis 1 and by -ζ·θ1 along axis 2.
fn curvature(shapes: &Shapes) -> Strain {
    let mut strain = Strain::zeros();
    for (i, slope) in shapes.slope.iter().enumerate() {
        let at = NODE_FREEDOMS * i;
        strain[(0, at + 4)] = slope[0];
        strain[(1, at + 3)] = -slope[1];
        strain[(2, at + 4)] = slope[1];
        strain[(2, at + 3)] = -slope[0];
    }
    strain
}

/// Shear strains, interpolated from those along the edges at the edges' middles.
fn shear(corners: &[[f64; 2]; 4], shapes: &Shapes, s: f64, t: f64) -> Shear {
    let mut parent = Shear::zeros();
    let mut tie = |axis: usize, at_s: f64, at_t: f64, share: f64| {
        let middle = Shapes::new(corners, at_s, at_t);
        for i in 0..4 {
            let at = NODE_FREEDOMS * i;
            parent[(axis, at + 2)] += share * middle.parent[i][axis];
            parent[(axis, at + 4)] += share * middle.n[i] * middle.jacobian[(axis, 0)];
            parent[(axis, at + 3)] -= share * middle.n[i] * middle.jacobian[(axis, 1)];
        }
    };
    tie(0, 0.0, -1.0, 0.5 * (1.0 - t));
    tie(0, 0.0, 1.0, 0.5 * (1.0 + t));
    tie(1, -1.0, 0.0, 0.5 * (1.0 - s));
    tie(1, 1.0, 0.0, 0.5 * (1.0 + s));
    shapes.jacobian.try_inverse().unwrap_or_else(Matrix2::zeros) * parent
}
