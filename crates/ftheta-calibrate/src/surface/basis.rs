//! The functions that surfaces are sums of, over the square ±1.

use nalgebra::DMatrix;

/// A set of functions; those of the y error may differ from those of the x error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Basis {
    /// 1, u, u·v² for x; 1, v, v·u² for y.
    Pincushion,
    /// Chebyshev polynomials up to a total degree.
    Total(usize),
    /// Chebyshev polynomials up to a degree in each coordinate.
    Tensor(usize),
    /// Cubic B-splines over so many zones a side.
    Zones(usize),
    /// Bilinear between 3 × 3 places.
    Hats,
}

/// How far functions go on beyond the square.
const BEYOND: f64 = 1.06;

impl Basis {
    /// Number of functions of each coordinate.
    pub fn n_terms(self) -> usize {
        match self {
            Self::Pincushion => 3,
            Self::Total(degree) => (degree + 1) * (degree + 2) / 2,
            Self::Tensor(degree) => (degree + 1) * (degree + 1),
            Self::Zones(n_zones) => (n_zones + 3) * (n_zones + 3),
            Self::Hats => 9,
        }
    }

    /// The functions at a place. They go on a little beyond the square, since a target in its
    /// corner may need commands beyond; farther out they stay as they are, or they would run away.
    ///
    /// * `index`: 0 for the error of x, 1 for that of y
    pub fn terms(self, [u, v]: [f64; 2], index: usize) -> Vec<f64> {
        let (cu, cv) = (u.clamp(-BEYOND, BEYOND), v.clamp(-BEYOND, BEYOND));
        match self {
            Self::Pincushion => {
                let (a, b) = if index == 0 { (u, v) } else { (v, u) };
                vec![1.0, a, a * b * b]
            }
            Self::Total(degree) => {
                let (by_u, by_v) = (chebyshev(cu, degree), chebyshev(cv, degree));
                let orders = (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j)));
                orders.map(|(i, j)| by_u[i] * by_v[j]).collect()
            }
            Self::Tensor(degree) => product(&chebyshev(cu, degree), &chebyshev(cv, degree)),
            Self::Zones(n_zones) => product(&splines(cu, n_zones), &splines(cv, n_zones)),
            Self::Hats => product(&hats(cu), &hats(cv)),
        }
    }

    /// One row a place.
    pub fn design(self, places: &[[f64; 2]], index: usize) -> DMatrix<f64> {
        let mut design = DMatrix::zeros(places.len(), self.n_terms());
        for (row, &place) in places.iter().enumerate() {
            let terms = self.terms(place, index);
            terms.into_iter().enumerate().for_each(|(column, term)| design[(row, column)] = term);
        }
        design
    }

    /// What stiffness weighs: third differences of neighbouring zones, so that parabolas are free.
    pub fn penalty(self) -> Option<DMatrix<f64>> {
        let Self::Zones(n_zones) = self else {
            return None;
        };
        let n = n_zones + 3;
        let difference = |at: usize| [(at, -1.0), (at + 1, 3.0), (at + 2, -3.0), (at + 3, 1.0)];
        let mut rows = Vec::new();
        for line in 0..n {
            for at in 0..n - 3 {
                rows.push(difference(at).map(|(k, weight)| (line * n + k, weight)));
                rows.push(difference(at).map(|(k, weight)| (k * n + line, weight)));
            }
        }
        let mut differences = DMatrix::zeros(rows.len(), n * n);
        for (row, cells) in rows.into_iter().enumerate() {
            cells.into_iter().for_each(|(column, weight)| differences[(row, column)] = weight);
        }
        Some(differences.tr_mul(&differences))
    }

    /// In words.
    pub fn description(self) -> String {
        match self {
            Self::Pincushion => "offset, scale and pincushion of each axis".into(),
            Self::Total(degree) => format!("polynomial of total degree {degree}"),
            Self::Tensor(degree) => format!("polynomial of degree {degree} in each coordinate"),
            Self::Zones(n_zones) => format!("cubic splines over {n_zones} × {n_zones} zones"),
            Self::Hats => "nine points, bilinear between them".into(),
        }
    }

    /// Names of the coefficients.
    pub fn names(self, n_terms: usize) -> Vec<String> {
        match self {
            Self::Pincushion => ["offset", "scale", "pincushion"].map(String::from).into(),
            Self::Total(_) => (0..n_terms).map(|k| format!("total_{k}")).collect(),
            Self::Tensor(degree) => {
                let n = degree + 1;
                (0..n_terms).map(|k| format!("tensor_{}_{}", k / n, k % n)).collect()
            }
            Self::Zones(_) => (0..n_terms).map(|k| format!("zone_{k}")).collect(),
            Self::Hats => (0..n_terms).map(|k| format!("point_{}_{}", k / 3, k % 3)).collect(),
        }
    }
}

fn product(by_u: &[f64], by_v: &[f64]) -> Vec<f64> {
    by_u.iter().flat_map(|a| by_v.iter().map(move |b| a * b)).collect()
}

fn chebyshev(u: f64, degree: usize) -> Vec<f64> {
    let mut t = vec![1.0, u];
    for k in 2..=degree {
        t.push(2.0 * u * t[k - 1] - t[k - 2]);
    }
    t.truncate(degree + 1);
    t
}

/// Uniform cubic B-splines: four of them are not zero in each zone. The zones span all that is not
/// held, so that their stiffness holds beyond the square as well.
fn splines(u: f64, n_zones: usize) -> Vec<f64> {
    let position = 0.5 * (u / BEYOND + 1.0) * n_zones as f64;
    let zone = (position.max(0.0) as usize).min(n_zones - 1);
    let s = position - zone as f64;
    let r = 1.0 - s;
    let mut values = vec![0.0; n_zones + 3];
    values[zone] = r * r * r / 6.0;
    values[zone + 1] = (3.0 * s * s * (s - 2.0) + 4.0) / 6.0;
    values[zone + 2] = (3.0 * r * r * (r - 2.0) + 4.0) / 6.0;
    values[zone + 3] = s * s * s / 6.0;
    values
}

fn hats(u: f64) -> [f64; 3] {
    [(-u).max(0.0), 1.0 - u.abs(), u.max(0.0)]
}

#[cfg(test)]
mod tests {
    use super::{Basis, hats, splines};

    /// Splines and hats sum to one, so a constant error is mapped as one.
    #[test]
    fn partitions_sum_to_one() {
        for k in 0..=20 {
            let u = f64::from(k) / 10.0 - 1.0;
            assert!((splines(u, 4).iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!((hats(u).iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn every_basis_has_as_many_terms_as_it_says() {
        for basis in
            [Basis::Pincushion, Basis::Total(5), Basis::Tensor(3), Basis::Zones(4), Basis::Hats]
        {
            assert_eq!(basis.terms([0.3, -0.7], 1).len(), basis.n_terms());
            assert_eq!(basis.names(basis.n_terms()).len(), basis.n_terms());
        }
    }
}
