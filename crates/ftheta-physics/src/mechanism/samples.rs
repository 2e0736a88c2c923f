//! Samples of a torque or an angle: whether they are any, and the spline through them.

use super::MechanismError;

/// Refuses samples that are not finite or not in order.
pub(super) fn check_samples(times_s: &[f64], values: &[f64]) -> Result<(), MechanismError> {
    let fault = |index, what| Err(MechanismError::Samples { index, what });
    if times_s.len() != values.len() || times_s.len() < 2 {
        return fault(values.len(), "there must be a time for each, and two of them");
    }
    for (index, (time_s, value)) in times_s.iter().zip(values).enumerate() {
        if !(time_s.is_finite() && value.is_finite()) {
            return fault(index, "not a finite number");
        }
        if index > 0 && *time_s <= times_s[index - 1] {
            return fault(index, "not later than the one before");
        }
    }
    Ok(())
}

/// Second derivatives at the knots of the cubic spline that starts and ends without slope.
pub(super) fn spline_accelerations(times_s: &[f64], angles_rad: &[f64]) -> Vec<f64> {
    let n = times_s.len();
    let slope = |i: usize| (angles_rad[i + 1] - angles_rad[i]) / (times_s[i + 1] - times_s[i]);
    // Row i: left·a[i-1] + 2(left + right)·a[i] + right·a[i+1] = 6·(change of slope).
    let width = |i: usize| times_s[i + 1] - times_s[i];
    let row = |i: usize| {
        let left = if i > 0 { width(i - 1) } else { 0.0 };
        let right = if i + 1 < n { width(i) } else { 0.0 };
        let slope_before = if i > 0 { slope(i - 1) } else { 0.0 };
        let slope_after = if i + 1 < n { slope(i) } else { 0.0 };
        (left, 2.0 * (left + right), right, 6.0 * (slope_after - slope_before))
    };
    // Elimination downwards, then back up.
    let mut reduced: Vec<(f64, f64)> = Vec::with_capacity(n);
    for i in 0..n {
        let (left, middle, right, known) = row(i);
        let (ratio, value) = reduced.last().copied().unwrap_or((0.0, 0.0));
        let pivot = middle - left * ratio;
        reduced.push((right / pivot, (known - left * value) / pivot));
    }
    let mut accelerations = vec![0.0; n];
    let mut after = 0.0;
    for i in (0..n).rev() {
        after = reduced[i].1 - reduced[i].0 * after;
        accelerations[i] = after;
    }
    accelerations
}
