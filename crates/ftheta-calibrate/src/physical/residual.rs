//! A smooth residual over the commands: Chebyshev polynomials of total degree seven, and higher
//! ones of each command alone, for what a mirror's sensor does.

use ftheta_model::space::MirrorAngles;

/// Highest total degree of terms of both commands.
const DEGREE: usize = 7;
/// Highest degree of terms of one command.
const DEGREE_ALONE: usize = 11;
/// Terms of each coordinate.
pub const N_TERMS: usize = (DEGREE + 1) * (DEGREE + 2) / 2 + 2 * (DEGREE_ALONE - DEGREE);
/// The polynomials span this much more than the marks.
const MARGIN: f64 = 1.08;

/// The square of commands over which the residual is smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    half_rad: f64,
}

impl Residual {
    /// Spans the commands of the marks.
    pub fn over(commands: impl Iterator<Item = MirrorAngles>) -> Self {
        let reach = commands.map(|c| c.x_rad.abs().max(c.y_rad.abs())).fold(1e-6, f64::max);
        Self { half_rad: MARGIN * reach }
    }

    /// The terms at a command, each already divided by its degree: higher orders are smaller in
    /// every optic. Outside the square those of its border.
    pub fn terms(&self, command: MirrorAngles) -> [f64; N_TERMS] {
        let [by_x, by_y] = [command.x_rad, command.y_rad].map(|rad| {
            let u = (rad / self.half_rad).clamp(-1.0, 1.0);
            let mut t = [1.0; DEGREE_ALONE + 1];
            t[1] = u;
            for k in 2..=DEGREE_ALONE {
                t[k] = 2.0 * u * t[k - 1] - t[k - 2];
            }
            t
        });
        let both = (0..=DEGREE).flat_map(|i| (0..=DEGREE - i).map(move |j| (i, j)));
        let alone = (DEGREE + 1..=DEGREE_ALONE).flat_map(|k| [(k, 0), (0, k)]);
        let mut terms = [0.0; N_TERMS];
        for (term, (i, j)) in terms.iter_mut().zip(both.chain(alone)) {
            *term = by_x[i] * by_y[j] / (i + j).max(1) as f64;
        }
        terms
    }
}
