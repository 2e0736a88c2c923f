//! Least squares with what each equation would leave if it had not been used.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A solution.
pub struct Solved {
    pub coefficients: DVector<f64>,
    /// Value less prediction without it; NaN where it alone decides a coefficient.
    pub left_out: DVector<f64>,
}

/// Singular values below this part of the greatest are left out: they hold rounding alone.
const RANK: f64 = 1e-9;

/// Solves `design · c = values`; `None` where the rank does not do.
///
/// * `penalty`: what `stiffness` weighs, relative to the design's own weight
pub fn solve(
    design: &DMatrix<f64>,
    values: &DVector<f64>,
    penalty: Option<DMatrix<f64>>,
    stiffness: f64,
) -> Option<Solved> {
    let (coefficients, hat) = match penalty {
        Some(penalty) => penalised(design, values, &penalty, stiffness)?,
        None => exact(design, values)?,
    };
    let residual = values - design * &coefficients;
    let left_out = residual.zip_map(&hat, |left, taken| {
        // An equation that alone decides a coefficient says nothing of itself.
        if taken < 1.0 - 1e-9 { left / (1.0 - taken) } else { f64::NAN }
    });
    Some(Solved { coefficients, left_out })
}

fn exact(design: &DMatrix<f64>, values: &DVector<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
    let svd = design.clone().svd(true, true);
    let (greatest, least) = (svd.singular_values.max(), svd.singular_values.min());
    if design.nrows() < design.ncols() || least <= RANK * greatest {
        return None;
    }
    let coefficients = svd.solve(values, RANK * greatest).ok()?;
    let u = svd.u.as_ref()?;
    let hat = DVector::from_iterator(u.nrows(), u.row_iter().map(|row| row.norm_squared()));
    Some((coefficients, hat))
}

fn penalised(
    design: &DMatrix<f64>,
    values: &DVector<f64>,
    penalty: &DMatrix<f64>,
    stiffness: f64,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let normal = design.tr_mul(design);
    // A trace of rounding keeps what neither marks nor stiffness hold from running away.
    let weight = normal.trace() / normal.nrows() as f64;
    let ridge = DMatrix::identity(normal.nrows(), normal.nrows()) * (1e-12 * weight);
    let factor = Cholesky::new(&normal + penalty * (stiffness * weight) + ridge)?;
    let coefficients = factor.solve(&design.tr_mul(values));
    let solved = factor.solve(&design.transpose());
    let hat = DVector::from_fn(design.nrows(), |row, _| {
        design.row(row).transpose().dot(&solved.column(row))
    });
    Some((coefficients, hat))
}
