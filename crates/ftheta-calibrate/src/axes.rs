//! Which way the axes of a head run: swapped, mirrored, and which mirror comes first.

use crate::mark::Mark;
use ftheta_model::machine::{Axis, Optics};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::optics::field_from_angles;
use nalgebra::{DMatrix, Matrix2};

/// How the measured field lies against the head: its place (x, y), in machine coordinates, is found
/// at (±x, ±y), or at (±y, ±x) where the axes are swapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Measured x follows the machine's y.
    pub swapped: bool,
    /// Measured x runs the other way.
    pub x_reversed: bool,
    /// Measured y runs the other way.
    pub y_reversed: bool,
    /// Which coordinate the first mirror moves, as the marks have it.
    pub first_mirror: Axis,
    /// How much worse the second best way fits, as a ratio of distances.
    pub margin: f64,
}

/// A head with this much less distortion left than with the machine file's first mirror shows that
/// the file is wrong.
const FIRST_MIRROR_RATIO: f64 = 0.5;

impl Axes {
    /// The axes as the machine file has them.
    pub fn straight(first_mirror: Axis) -> Self {
        Self { swapped: false, x_reversed: false, y_reversed: false, first_mirror, margin: 1.0 }
    }

    /// Finds how the axes run: of the eight ways the one nearest to the affine map from nominal to
    /// measured places; then of the two orders of the mirrors the one that leaves less.
    pub fn find(optics: &Optics, marks: &[Mark]) -> Self {
        let nominal: Vec<_> =
            marks.iter().map(|mark| field_from_angles(optics, mark.command)).collect();
        let (linear, _) = affine(&nominal, marks.iter().map(|mark| mark.measured));
        let ways = (0..8).map(|index| Self {
            swapped: index & 1 != 0,
            x_reversed: index & 2 != 0,
            y_reversed: index & 4 != 0,
            ..Self::straight(optics.first_mirror)
        });
        let mut ways: Vec<_> = ways
            .map(|way| {
                ((linear / linear.norm().max(1e-9) * 2f64.sqrt() - way.matrix()).norm(), way)
            })
            .collect();
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (best, mut axes) = ways[0];
        axes.margin = ways[1].0 / best.max(1e-9);
        let other = match optics.first_mirror {
            Axis::X => Axis::Y,
            Axis::Y => Axis::X,
        };
        let left = [optics.first_mirror, other].map(|first_mirror| {
            let turned = Optics { first_mirror, ..optics.clone() };
            let nominal: Vec<_> =
                marks.iter().map(|mark| field_from_angles(&turned, mark.command)).collect();
            affine(&nominal, marks.iter().map(|mark| mark.measured)).1
        });
        if left[1] < FIRST_MIRROR_RATIO * left[0] && marks.len() >= 9 {
            axes.first_mirror = other;
        }
        axes
    }

    /// Measured by the head's coordinates.
    fn matrix(&self) -> Matrix2<f64> {
        let sign = |reversed: bool| if reversed { -1.0 } else { 1.0 };
        let (x, y) = (sign(self.x_reversed), sign(self.y_reversed));
        if self.swapped { Matrix2::new(0.0, x, y, 0.0) } else { Matrix2::new(x, 0.0, 0.0, y) }
    }

    /// Where a place of the head, mirror 1 moving its first coordinate, is measured.
    pub fn measured(&self, head: FieldPoint) -> FieldPoint {
        let place = in_order(self.first_mirror, head);
        let m = self.matrix();
        FieldPoint::new(
            m.m11 * place.x_mm + m.m12 * place.y_mm,
            m.m21 * place.x_mm + m.m22 * place.y_mm,
        )
    }

    /// The place of the head, mirror 1 moving its first coordinate, of a measured one.
    pub fn head(&self, measured: FieldPoint) -> FieldPoint {
        // The matrix is orthogonal.
        let m = self.matrix();
        let place = FieldPoint::new(
            m.m11 * measured.x_mm + m.m21 * measured.y_mm,
            m.m12 * measured.x_mm + m.m22 * measured.y_mm,
        );
        in_order(self.first_mirror, place)
    }

    /// Commands in the order of the mirrors.
    pub fn commands(&self, angles: MirrorAngles) -> MirrorAngles {
        match self.first_mirror {
            Axis::X => angles,
            Axis::Y => MirrorAngles::new(angles.y_rad, angles.x_rad),
        }
    }

    /// Whether anything is other than the machine file has it.
    pub fn turned(&self) -> bool {
        self.swapped || self.x_reversed || self.y_reversed
    }
}

fn in_order(first_mirror: Axis, place: FieldPoint) -> FieldPoint {
    match first_mirror {
        Axis::X => place,
        Axis::Y => FieldPoint::new(place.y_mm, place.x_mm),
    }
}

/// Linear part of the affine map of least squares, and what it leaves, mm rms.
pub(crate) fn affine(
    from: &[FieldPoint],
    to: impl Iterator<Item = FieldPoint>,
) -> (Matrix2<f64>, f64) {
    let n = from.len();
    let design = DMatrix::from_fn(n, 3, |row, column| match column {
        0 => 1.0,
        1 => from[row].x_mm,
        _ => from[row].y_mm,
    });
    let flat: Vec<f64> = to.flat_map(|place| [place.x_mm, place.y_mm]).collect();
    let values = DMatrix::from_row_slice(n, 2, &flat);
    let Ok(solved) = design.clone().svd(true, true).solve(&values, 1e-12) else {
        return (Matrix2::zeros(), f64::INFINITY);
    };
    let left = (&values - design * &solved).norm_squared() / n as f64;
    let linear = Matrix2::new(solved[(1, 0)], solved[(2, 0)], solved[(1, 1)], solved[(2, 1)]);
    (linear, left.sqrt())
}
