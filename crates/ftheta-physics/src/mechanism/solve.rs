//! Sparse symmetric matrices as lists of entries, and their factor within a band.

use nalgebra::{DMatrix, DVector};

/// A square matrix as a list of entries; entries in one place add up.
#[derive(Clone, Debug, Default)]
pub(super) struct Entries {
    list: Vec<(usize, usize, f64)>,
}

/// Linear combination of the degrees of freedom: index and weight.
pub(super) type Row = Vec<(usize, f64)>;

impl Entries {
    /// Adds an element's matrix whose local freedoms are combinations of the global ones.
    pub(super) fn add(&mut self, element: &DMatrix<f64>, freedoms: &[Row]) {
        for (i, row) in freedoms.iter().enumerate() {
            for (j, column) in freedoms.iter().enumerate() {
                let value = element[(i, j)];
                if value == 0.0 {
                    continue;
                }
                for &(a, weight_a) in row {
                    self.list.extend(column.iter().map(|&(b, w)| (a, b, value * weight_a * w)));
                }
            }
        }
    }

    /// Adds one entry.
    pub(super) fn push(&mut self, row: usize, column: usize, value: f64) {
        self.list.push((row, column, value));
    }

    /// Puts entries of one place together, in the order of rows.
    pub(super) fn compress(&mut self) {
        self.list.sort_by_key(|&(row, column, _)| (row, column));
        self.list.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            if same {
                kept.2 += next.2;
            }
            same
        });
    }

    /// The product with every column of `x`.
    pub(super) fn times(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(x.nrows(), x.ncols());
        for column in 0..x.ncols() {
            for &(i, j, value) in &self.list {
                product[(i, column)] += value * x[(j, column)];
            }
        }
        product
    }

    /// The product with a vector.
    pub(super) fn times_vector(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(x.len());
        for &(i, j, value) in &self.list {
            product[i] += value * x[j];
        }
        product
    }

    /// The entries on the diagonal.
    pub(super) fn diagonal(&self, n: usize) -> DVector<f64> {
        let mut diagonal = DVector::zeros(n);
        for &(i, _, value) in self.list.iter().filter(|entry| entry.0 == entry.1) {
            diagonal[i] += value;
        }
        diagonal
    }

    /// As a full matrix of `n` rows.
    pub(super) fn to_dense(&self, n: usize) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(n, n);
        for &(i, j, value) in &self.list {
            dense[(i, j)] += value;
        }
        dense
    }
}

/// Cholesky factor of a symmetric positive definite matrix that is zero outside a band.
pub(super) struct BandFactor {
    n: usize,
    band: usize,
    /// Row i holds columns i-band to i of the factor.
    lower: Vec<f64>,
}

impl BandFactor {
    /// The factor of `a + shift · b`, or `None` where that is not positive definite.
    pub(super) fn new(n: usize, a: &Entries, b: &Entries, shift: f64) -> Option<Self> {
        let all = || a.list.iter().chain(&b.list);
        let band = all().map(|&(i, j, _)| i.abs_diff(j)).max().unwrap_or(0);
        let mut factor = Self { n, band, lower: vec![0.0; n * (band + 1)] };
        for (entries, scale) in [(a, 1.0), (b, shift)] {
            for &(i, j, value) in entries.list.iter().filter(|entry| entry.1 <= entry.0) {
                let place = factor.place(i, j);
                factor.lower[place] += scale * value;
            }
        }
        for i in 0..n {
            for j in i.saturating_sub(band)..=i {
                let first = i.saturating_sub(band).max(j.saturating_sub(band));
                let (row_i, row_j) = (factor.place(i, first), factor.place(j, first));
                let length = j - first;
                let dot: f64 = factor.lower[row_i..row_i + length]
                    .iter()
                    .zip(&factor.lower[row_j..row_j + length])
                    .map(|(left, right)| left * right)
                    .sum();
                let place = factor.place(i, j);
                let rest = factor.lower[place] - dot;
                factor.lower[place] = if i == j {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return None;
                    }
                    rest.sqrt()
                } else {
                    rest / factor.lower[factor.place(j, j)]
                };
            }
        }
        Some(factor)
    }

    fn place(&self, row: usize, column: usize) -> usize {
        row * (self.band + 1) + self.band + column - row
    }

    /// Solves for every column of `x`, in place.
    pub(super) fn solve(&self, x: &mut DMatrix<f64>) {
        for column in 0..x.ncols() {
            for i in 0..self.n {
                let mut value = x[(i, column)];
                for j in i.saturating_sub(self.band)..i {
                    value -= self.lower[self.place(i, j)] * x[(j, column)];
                }
                x[(i, column)] = value / self.lower[self.place(i, i)];
            }
            for i in (0..self.n).rev() {
                let value = x[(i, column)] / self.lower[self.place(i, i)];
                x[(i, column)] = value;
                for j in i.saturating_sub(self.band)..i {
                    x[(j, column)] -= self.lower[self.place(i, j)] * value;
                }
            }
        }
    }
}
