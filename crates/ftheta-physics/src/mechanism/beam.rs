//! A straight round beam of two nodes: axial, torsion, and bending with shear.

use super::Segment;
use super::solve::Row;
use nalgebra::{DMatrix, SVector};
use std::f64::consts::PI;

/// Freedoms of a node: ux, uy, uz, θx, θy, θz.
pub(super) const NODE_FREEDOMS: usize = 6;

/// Section of a tube, SI.
pub(super) struct Section {
    area: f64,
    /// Second moment of area for bending; twice that for torsion.
    second_moment: f64,
    /// Share of the area that carries shear.
    shear_share: f64,
}

impl Section {
    /// Section of a segment.
    ///
    /// Source: shear coefficient of Cowper 1966, hollow circle.
    pub(super) fn new(segment: &Segment) -> Self {
        let (d, b, nu) = (segment.diameter_m, segment.bore_m, segment.material.poisson);
        let ratio = (b / d) * (b / d);
        let square = (1.0 + ratio) * (1.0 + ratio);
        Self {
            area: PI / 4.0 * (d * d - b * b),
            second_moment: PI / 64.0 * (d.powi(4) - b.powi(4)),
            shear_share: 6.0 * (1.0 + nu) * square
                / ((7.0 + 6.0 * nu) * square + (20.0 + 12.0 * nu) * ratio),
        }
    }
}

/// Four displacement and four rotation weights of bending at `s` in 0 to 1, for the freedoms
/// deflection, slope, deflection, slope.
///
/// Source: Timoshenko beam with constant shear along the element (Friedman and Kosmatka 1993).
fn bending_shapes(s: f64, length: f64, phi: f64) -> [SVector<f64, 4>; 2] {
    let k = 1.0 / (1.0 + phi);
    let (s2, s3) = (s * s, s * s * s);
    let deflection = SVector::<f64, 4>::new(
        k * (1.0 - 3.0 * s2 + 2.0 * s3 + phi * (1.0 - s)),
        k * length * (s - 2.0 * s2 + s3 + 0.5 * phi * (s - s2)),
        k * (3.0 * s2 - 2.0 * s3 + phi * s),
        k * length * (s3 - s2 - 0.5 * phi * (s - s2)),
    );
    let rotation = SVector::<f64, 4>::new(
        k * 6.0 * (s2 - s) / length,
        k * (1.0 - 4.0 * s + 3.0 * s2 + phi * (1.0 - s)),
        k * 6.0 * (s - s2) / length,
        k * (3.0 * s2 - 2.0 * s + phi * s),
    );
    [deflection, rotation]
}

/// Gauss points and weights on 0 to 1, exact to degree seven.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Places of the freedoms of bending in the element, and the sign of the slope: uy falls with θx.
const BENDING: [([usize; 4], f64); 2] = [([0, 4, 6, 10], 1.0), ([1, 3, 7, 9], -1.0)];

/// Stiffness and mass of an element of a length, freedoms of the one node after those of the other.
pub(super) fn element(segment: &Segment, length: f64) -> [DMatrix<f64>; 2] {
    let material = &segment.material;
    let section = Section::new(segment);
    let (e, g, rho) = (material.young_pa, material.shear_pa(), material.density_kg_m3);
    let (area, second) = (section.area, section.second_moment);
    let mut stiffness = DMatrix::zeros(12, 12);
    let mut mass = DMatrix::zeros(12, 12);
    for (freedom, rigidity, inertia) in
        [(2, e * area, rho * area), (5, g * 2.0 * second, rho * 2.0 * second)]
    {
        for (i, j, sign, share) in
            [(0, 0, 1.0, 2.0), (0, 6, -1.0, 1.0), (6, 0, -1.0, 1.0), (6, 6, 1.0, 2.0)]
        {
            stiffness[(freedom + i, freedom + j)] = sign * rigidity / length;
            mass[(freedom + i, freedom + j)] = share * inertia * length / 6.0;
        }
    }
    let phi = shear_parameter(segment, length);
    let (l, l2) = (length, length * length);
    let scale = e * second / (length.powi(3) * (1.0 + phi));
    #[rustfmt::skip]
    let bend = [
        [12.0, 6.0 * l, -12.0, 6.0 * l],
        [6.0 * l, (4.0 + phi) * l2, -6.0 * l, (2.0 - phi) * l2],
        [-12.0, -6.0 * l, 12.0, -6.0 * l],
        [6.0 * l, (2.0 - phi) * l2, -6.0 * l, (4.0 + phi) * l2],
    ];
    for (places, slope_sign) in BENDING {
        let sign = [1.0, slope_sign, 1.0, slope_sign];
        for i in 0..4 {
            for j in 0..4 {
                let both = sign[i] * sign[j];
                stiffness[(places[i], places[j])] = both * scale * bend[i][j];
                mass[(places[i], places[j])] = GAUSS
                    .iter()
                    .map(|&(s, weight)| {
                        let [deflection, rotation] = bending_shapes(s, length, phi);
                        both * weight
                            * length
                            * rho
                            * (area * deflection[i] * deflection[j]
                                + second * rotation[i] * rotation[j])
                    })
                    .sum();
            }
        }
    }
    [stiffness, mass]
}

/// Shear flexibility against bending flexibility of an element.
fn shear_parameter(segment: &Segment, length: f64) -> f64 {
    let section = Section::new(segment);
    let material = &segment.material;
    12.0 * material.young_pa * section.second_moment
        / (section.shear_share * material.shear_pa() * section.area * length * length)
}

/// Mass and displacements ux, uy at the Gauss points of an element whose first node's freedoms
/// begin at `first`; the other node's follow.
pub(super) fn mass_points(segment: &Segment, length: f64, first: usize) -> Vec<(f64, [Row; 2])> {
    let phi = shear_parameter(segment, length);
    let line_mass = segment.material.density_kg_m3 * Section::new(segment).area * length;
    GAUSS
        .iter()
        .map(|&(s, weight)| {
            let [deflection, _] = bending_shapes(s, length, phi);
            let rows = BENDING.map(|(places, slope_sign)| {
                let sign = [1.0, slope_sign, 1.0, slope_sign];
                (0..4).map(|i| (first + places[i], sign[i] * deflection[i])).collect()
            });
            (line_mass * weight, rows)
        })
        .collect()
}
