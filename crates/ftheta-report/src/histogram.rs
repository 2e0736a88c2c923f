//! Percentiles of any number of values in fixed memory.

/// Weights of values in bins of nearly equal ratio: the leading bits of the floating-point number.
///
/// # Accuracy
/// A percentile is within half a bin of the exact one and never outside the extremes, which are
/// exact. Values below the lowest bin count as the smallest value.
#[derive(Clone, Debug)]
pub struct Histogram {
    weights: Vec<f64>,
    /// Bits of a value that are not looked at.
    n_bits_dropped: u32,
    lowest: f64,
    below: f64,
    total: f64,
    min: f64,
    max: f64,
}

impl Histogram {
    /// Bins from `lowest` to `highest`, `2^n_bits` from each power of two to the next.
    pub fn new(lowest: f64, highest: f64, n_bits: u32) -> Self {
        let n_bits_dropped = f64::MANTISSA_DIGITS - 1 - n_bits;
        let n_bins = (highest.to_bits() >> n_bits_dropped) - (lowest.to_bits() >> n_bits_dropped);
        Self {
            weights: vec![0.0; n_bins as usize + 1],
            n_bits_dropped,
            lowest,
            below: 0.0,
            total: 0.0,
            min: f64::INFINITY,
            max: 0.0,
        }
    }

    /// Bins for errors in µm: from 0.1 nm to 1 m in steps of 0.4 to 0.8 %.
    pub fn of_errors_um() -> Self {
        Self::new(1e-4, 1e6, 7)
    }

    /// Adds a value that is not negative.
    pub fn add(&mut self, value: f64, weight: f64) {
        self.total += weight;
        self.see(value);
        if value < self.lowest {
            self.below += weight;
            return;
        }
        let bin = (value.to_bits() >> self.n_bits_dropped) - self.first_bits();
        let last = self.weights.len() - 1;
        self.weights[(bin as usize).min(last)] += weight;
    }

    fn first_bits(&self) -> u64 {
        self.lowest.to_bits() >> self.n_bits_dropped
    }

    /// Widens the extremes to a value without weight.
    pub fn see(&mut self, value: f64) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Smallest value; infinite if there is none.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// Largest value; 0 if there is none.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// The value that `share` of the weight does not exceed; 0 if there is none.
    pub fn percentile(&self, share: f64) -> f64 {
        let mut left = share * self.total - self.below;
        if self.total <= 0.0 {
            return 0.0;
        }
        if left <= 0.0 {
            return self.min;
        }
        for (bin, weight) in self.weights.iter().enumerate() {
            left -= weight;
            if left <= 0.0 {
                let twice = 2 * (bin as u64 + self.first_bits()) + 1;
                let middle = f64::from_bits(twice << (self.n_bits_dropped - 1));
                return middle.clamp(self.min, self.max);
            }
        }
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_within_half_a_bin() {
        let mut histogram = Histogram::of_errors_um();
        for i in 1..=10_000 {
            histogram.add(f64::from(i) * 0.01, 1.0);
        }
        for share in [0.01, 0.5, 0.99] {
            let exact = 100.0 * share;
            let off = histogram.percentile(share) / exact - 1.0;
            assert!(off.abs() < 0.006, "{share}: {off}");
        }
        assert_eq!(histogram.max(), 100.0);
        assert_eq!(histogram.percentile(1.0), 100.0);
        assert_eq!(Histogram::of_errors_um().percentile(0.99), 0.0);
    }
}
