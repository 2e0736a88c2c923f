//! How well coarse places along the lines agree with a way to lay the pattern on the picture.

use nalgebra::{DMatrix, DVector};

/// How much scale along and across differ, and a view's perspective and bend, by the extent.
const VIEW: f64 = 0.06;
/// Rounds in which coarse ends that are farther off than the first of these, px, are trusted less,
/// and what one counts at most.
const N_COARSE_ROUNDS: usize = 5;
const NEAR_PX: f64 = 2.0;
const FAR_PX: f64 = 30.0;

/// Equations for coarse places along the lines.
pub struct Coarse {
    mm_per_px: f64,
    rows: Vec<[f64; N_COARSE]>,
    values: Vec<f64>,
    weights: Vec<f64>,
    unseen: f64,
}

/// Shift, its change across, that of the scale along, perspective, bend; on, off, growth.
const N_COARSE: usize = 8;

impl Coarse {
    /// No places yet.
    pub fn new(mm_per_px: f64) -> Self {
        Self { mm_per_px, rows: Vec::new(), values: Vec::new(), weights: Vec::new(), unseen: 0.0 }
    }

    /// A place: where it should be along and across, how delays and growth move it, where it is.
    pub fn add(&mut self, weight: f64, [along, across]: [f64; 2], moved: [f64; 3], found: f64) {
        let [on, off, growth] = moved;
        let row = [1.0, across, along, along * across, across * across, on, off, growth];
        self.rows.push(row);
        self.values.push(found - along);
        self.weights.push(weight);
    }

    /// How many places there are.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// A row that was not found: both its ends are far off.
    pub fn add_unseen(&mut self, weight: f64) {
        self.unseen += 2.0 * weight * weight;
    }

    /// What is left, px rms, where what is far off counts as [`FAR_PX`].
    pub fn left_px(mut self) -> Option<f64> {
        let reach = |of: &dyn Fn(&[f64; N_COARSE]) -> f64| {
            self.rows.iter().map(|row| of(row).abs()).fold(1e-9, f64::max)
        };
        let (along, across) = (reach(&|row| row[2]), reach(&|row| row[1]));
        let weight = self.weights.iter().sum::<f64>() / self.rows.len() as f64;
        // The scale along is held near that across, and perspective and bend to what cameras do.
        for (column, reach) in [(2, along), (3, along * across), (4, across * across)] {
            let mut row = [0.0; N_COARSE];
            row[column] = reach / (VIEW * along);
            self.rows.push(row);
            self.values.push(0.0);
            self.weights.push(weight * self.mm_per_px);
        }
        let n = self.rows.len();
        let mut trust = self.weights.clone();
        let mut left = DVector::zeros(n);
        for _ in 0..N_COARSE_ROUNDS {
            let matrix =
                DMatrix::from_fn(n, N_COARSE, |row, column| trust[row] * self.rows[row][column]);
            let values = DVector::from_fn(n, |row, _| trust[row] * self.values[row]);
            let found = matrix.svd(true, true).solve(&values, 1e-9).ok()?;
            for index in 0..n {
                let row = self.rows[index].iter().zip(found.iter());
                left[index] = self.values[index] - row.map(|(a, b)| a * b).sum::<f64>();
                let off = (left[index] / (NEAR_PX * self.mm_per_px)).abs();
                trust[index] = self.weights[index] / off.max(1.0).sqrt();
            }
        }
        let squared = |mm: f64| (mm / self.mm_per_px).abs().min(FAR_PX).powi(2);
        let sum: f64 = left.iter().zip(&self.weights).map(|(l, w)| w * w * squared(*l)).sum();
        let total: f64 = self.weights.iter().map(|weight| weight * weight).sum();
        let far = self.unseen * FAR_PX * FAR_PX;
        Some(((sum + far) / (total + self.unseen)).sqrt())
    }
}
