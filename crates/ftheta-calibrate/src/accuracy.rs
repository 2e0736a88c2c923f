//! Root mean squares and maxima of distances.

use ftheta_model::space::FieldPoint;

/// Size of a set of errors, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Root mean square.
    pub rms_mm: f64,
    /// Greatest.
    pub max_mm: f64,
}

impl Spread {
    /// Of distances, mm; zero of none.
    pub fn of(distances_mm: impl Iterator<Item = f64>) -> Self {
        let (mut n, mut square, mut max_mm) = (0, 0.0, 0.0f64);
        for distance in distances_mm {
            n += 1;
            square += distance * distance;
            max_mm = max_mm.max(distance);
        }
        Self { rms_mm: (square / f64::from(n.max(1))).sqrt(), max_mm }
    }
}

/// Distance of two places, mm.
pub fn distance_mm(a: FieldPoint, b: FieldPoint) -> f64 {
    (a.x_mm - b.x_mm).hypot(a.y_mm - b.y_mm)
}
