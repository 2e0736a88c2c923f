//! Least squares of a function of few parameters, by Levenberg and Marquardt's method.

use nalgebra::{DMatrix, DVector};

/// Steps at most, and the relative gain at which the search ends.
const N_STEPS: usize = 60;
const SETTLED: f64 = 1e-10;
/// Damping at the start, and where it is given up.
const DAMPING: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e9;

/// Where a search ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Sum of the residuals' squares.
    pub cost: f64,
    /// Inverse of JᵀJ there: covariance of the parameters for residuals of variance one.
    pub covariance: Option<DMatrix<f64>>,
}

/// The parameters that make the residuals smallest, from a first guess.
///
/// * `steps`: how far each parameter is moved for its derivative; also its scale
/// * `residuals`: writes one number for each datum, always as many; not finite where the
///   parameters make no sense
///
/// `None` if the residuals of the first guess are not finite.
pub fn minimise(
    first: &[f64],
    steps: &[f64],
    mut residuals: impl FnMut(&[f64], &mut Vec<f64>),
) -> Option<Minimum> {
    let n = first.len();
    let mut parameters = first.to_vec();
    let (mut here, mut there) = (Vec::new(), Vec::new());
    residuals(&parameters, &mut here);
    let sum = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let mut cost = sum(&here);
    if !cost.is_finite() {
        return None;
    }
    let mut damping = DAMPING;
    let mut normal = DMatrix::zeros(n, n);
    for _ in 0..N_STEPS {
        let mut jacobian = DMatrix::zeros(here.len(), n);
        for (index, step) in steps.iter().enumerate() {
            let kept = parameters[index];
            parameters[index] = kept + step;
            residuals(&parameters, &mut there);
            parameters[index] = kept;
            // In units of the steps, so that the damping treats all alike.
            let difference = there.iter().zip(&here).map(|(there, here)| there - here);
            jacobian.column_mut(index).copy_from_slice(&difference.collect::<Vec<_>>());
        }
        normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&DVector::from_column_slice(&here));
        let before = cost;
        while damping < DAMPING_MAX {
            let mut damped = normal.clone();
            for index in 0..n {
                damped[(index, index)] *= 1.0 + damping;
                damped[(index, index)] += f64::MIN_POSITIVE;
            }
            let Some(factors) = damped.cholesky() else {
                damping *= 10.0;
                continue;
            };
            let move_by = factors.solve(&gradient);
            let tried: Vec<f64> =
                (0..n).map(|index| parameters[index] - steps[index] * move_by[index]).collect();
            residuals(&tried, &mut there);
            let found = sum(&there);
            if found < cost {
                (parameters, cost) = (tried, found);
                std::mem::swap(&mut here, &mut there);
                damping = (0.2 * damping).max(1e-12);
                break;
            }
            damping *= 5.0;
        }
        if damping >= DAMPING_MAX || before - cost <= SETTLED * before {
            break;
        }
    }
    let covariance = normal.try_inverse().map(|mut inverse| {
        for row in 0..n {
            for column in 0..n {
                inverse[(row, column)] *= steps[row] * steps[column];
            }
        }
        inverse
    });
    Some(Minimum { parameters, cost, covariance })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_is_found_with_its_covariance() {
        let times: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.1).collect();
        let found = minimise(&[1.0, 0.1], &[1e-6, 1e-6], |p, out| {
            out.clear();
            out.extend(times.iter().map(|t| p[0] * (-p[1] * t).exp() - 3.0 * (-0.7 * t).exp()));
        })
        .unwrap();
        assert!((found.parameters[0] - 3.0).abs() < 1e-6, "{found:?}");
        assert!((found.parameters[1] - 0.7).abs() < 1e-6, "{found:?}");
        let covariance = found.covariance.unwrap();
        // Sum of exp(-1.4 t) bounds how well the height is known.
        let information: f64 = times.iter().map(|t| (-1.4 * t).exp()).sum();
        assert!(covariance[(0, 0)] >= 1.0 / information);
    }

    #[test]
    fn a_guess_without_sense_is_refused() {
        assert!(minimise(&[0.0], &[1e-6], |_, out| *out = vec![f64::NAN]).is_none());
    }
}
