//! Delays from where lines of several speeds begin and end.
//!
//! With s = ±1 the way a line runs, v its speed: its start lies `s (v τ_on - v²/2a - b)` beyond the
//! nominal one and its stop `s (v τ_off - v²/2a + b)`, both shifted by where the pattern lies.
//! Lines both ways separate the shift, several speeds the growth b. Source: optics.md D.2 and D.3.

use super::growth::Growth;
use nalgebra::{DMatrix, DVector};

/// An end that is off by so many deviations is left out; the least deviation, mm.
const GATE: f64 = 4.5;
const DEVIATION_MIN_MM: f64 = 2e-4;
const N_ROUNDS: usize = 12;
/// v²/2a counts if it is so many deviations.
const SIGNIFICANT: f64 = 4.0;
/// Fewest speeds with which v² can be told from v.
const N_SPEEDS_SQUARE: usize = 4;
/// The modelled growth is right to this part: what a picture shows is less by a nearly constant
/// length, which is fitted, and by a little more.
const GROWTH_PRIOR: f64 = 0.1;
/// Share of the ends that may be left out.
pub const WRONG_SHARE: f64 = 0.2;

/// An end of a line as it was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineEnd {
    /// Index of its row.
    pub row: usize,
    /// Index of its speed.
    pub speed: usize,
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// 1 where the line runs along, -1 where it runs back.
    pub sense: f64,
    /// Whether light is switched on here, or off.
    pub on: bool,
    /// Where it is beyond the nominal place, along the pattern, mm.
    pub off_mm: f64,
    /// Where the row lies across, mm.
    pub across_mm: f64,
}

/// What the regression found.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// Lateness of the start, s.
    pub tau_on_s: f64,
    /// Lateness of the stop, s.
    pub tau_off_s: f64,
    /// Standard deviations of both, and of their mean, s.
    pub sd_s: [f64; 3],
    /// Acceleration with which a line starts and ends, mm/s², if the ends show it.
    pub acceleration_mm_s2: Option<f64>,
    /// Growth of the ends beside what was modelled, mm.
    pub growth_mm: f64,
    /// What each end is off the model, mm, in the order given.
    pub left_mm: Vec<f64>,
    /// Whether each end was used.
    pub used: Vec<bool>,
    /// Deviation of the ends used, mm.
    pub rms_mm: f64,
}

/// Columns of the equations.
const N_BASE: usize = 5;

/// Fits the delays; `None` if speeds or ways do not separate them.
pub fn regress(ends: &[LineEnd], growth: &Growth) -> Option<Regression> {
    let n_speeds = 1 + ends.iter().map(|end| end.speed).max()?;
    let plain = fit(ends, growth, false)?;
    if n_speeds < N_SPEEDS_SQUARE {
        return Some(plain.0);
    }
    let Some((square, curvature, sd)) = fit(ends, growth, true) else {
        return Some(plain.0);
    };
    let clear = curvature > SIGNIFICANT * sd;
    Some(if clear { square } else { plain.0 })
}

/// A fit, with 1/2a and its deviation where v² is one of the columns.
fn fit(ends: &[LineEnd], growth: &Growth, square: bool) -> Option<(Regression, f64, f64)> {
    let modelled = matches!(growth, Growth::Modelled { .. });
    let n_columns = N_BASE + usize::from(square) + usize::from(modelled);
    let fastest = ends.iter().map(|end| end.speed_mm_s).fold(0.0, f64::max);
    let row = |end: &LineEnd| equation(end, growth, square, fastest);
    let mut used = vec![true; ends.len()];
    let mut deviation = f64::INFINITY;
    let mut solution = DVector::zeros(n_columns);
    let mut inverse = DMatrix::zeros(n_columns, n_columns);
    let mut left = vec![0.0; ends.len()];
    for round in 0..N_ROUNDS {
        let mut normal = DMatrix::zeros(n_columns, n_columns);
        let mut right = DVector::zeros(n_columns);
        for (end, _) in ends.iter().zip(&used).filter(|(_, used)| **used) {
            let row = row(end);
            let row = DVector::from_column_slice(&row);
            normal.ger(1.0, &row, &row, 1.0);
            right.axpy(end.sense * end.off_mm, &row, 1.0);
        }
        if modelled {
            let weight = if deviation.is_finite() { deviation } else { 0.003 } / GROWTH_PRIOR;
            normal[(n_columns - 1, n_columns - 1)] += weight * weight;
            right[n_columns - 1] += weight * weight;
        }
        // Columns are of the order of one, so this is how well they can be told apart.
        inverse = normal.clone().try_inverse()?;
        solution = &inverse * right;
        for (left, end) in left.iter_mut().zip(ends) {
            *left = end.sense * end.off_mm - DVector::from_column_slice(&row(end)).dot(&solution);
        }
        let mut sizes: Vec<f64> = left.iter().map(|left| left.abs()).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        deviation = (1.4826 * median).max(DEVIATION_MIN_MM);
        let now: Vec<bool> = left.iter().map(|left| left.abs() < GATE * deviation).collect();
        if now == used && round > 0 {
            break;
        }
        used = now;
    }
    let n_used = used.iter().filter(|used| **used).count();
    if n_used <= n_columns {
        return None;
    }
    let sum: f64 = left.iter().zip(&used).filter(|(_, used)| **used).map(|(l, _)| l * l).sum();
    let variance = sum / (n_used - n_columns) as f64;
    let sd = |index: usize| (variance * inverse[(index, index)]).sqrt();
    let both = inverse[(0, 0)] + inverse[(1, 1)] + 2.0 * inverse[(0, 1)];
    let (curvature, curvature_sd) =
        if square { (solution[N_BASE], sd(N_BASE)) } else { (0.0, 0.0) };
    let regression = Regression {
        tau_on_s: solution[0] / fastest,
        tau_off_s: solution[1] / fastest,
        sd_s: [sd(0), sd(1), 0.5 * (variance * both).sqrt()].map(|sd| sd / fastest),
        // The column is v² over the fastest's.
        acceleration_mm_s2: square.then(|| 0.5 * fastest * fastest / curvature),
        growth_mm: solution[2],
        left_mm: left,
        used,
        rms_mm: variance.sqrt(),
    };
    regression.tau_on_s.is_finite().then_some((regression, curvature, curvature_sd))
}

/// A row of the equations: on, off, growth, shift, its change across, v², modelled growth.
fn equation(end: &LineEnd, growth: &Growth, square: bool, fastest: f64) -> Vec<f64> {
    let speed = end.speed_mm_s / fastest;
    let outward = if end.on { -1.0 } else { 1.0 };
    let (on, off) = if end.on { (speed, 0.0) } else { (0.0, speed) };
    let across = end.sense * end.across_mm / 10.0;
    let mut row = vec![on, off, outward, end.sense, across];
    if square {
        row.push(-speed * speed);
    }
    if let Growth::Modelled { growth_mm, .. } = growth {
        row.push(outward * growth_mm[end.speed]);
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends of four lines each way at some speeds.
    fn ends(acceleration_mm_s2: f64, growth: impl Fn(usize) -> f64) -> Vec<LineEnd> {
        let mut ends = Vec::new();
        for (speed, v) in [1e3, 2e3, 4e3, 6e3, 8e3, 10e3].into_iter().enumerate() {
            for line in 0..8 {
                let sense = if line % 2 == 0 { 1.0 } else { -1.0 };
                let row = ends.len() / 2;
                let across_mm = -0.4 * row as f64;
                for on in [true, false] {
                    let tau = if on { 85e-6 } else { -60e-6 };
                    let out = if on { -1.0 } else { 1.0 } * growth(speed);
                    let moved = v * tau - v * v / (2.0 * acceleration_mm_s2) + out;
                    // A micrometre of jitter that is not random, and the pattern's place.
                    let jitter = 1e-3 * ((row * 7 + usize::from(on) * 3) as f64).sin();
                    let off_mm = sense * (moved + jitter) + 0.3 + 0.001 * across_mm;
                    let speed_mm_s = v;
                    ends.push(LineEnd { row, speed, speed_mm_s, sense, on, off_mm, across_mm });
                }
            }
        }
        ends
    }

    #[test]
    fn delays_come_back_beside_shift_and_growth() {
        let found = regress(&ends(f64::INFINITY, |_| 0.005), &Growth::Alike).unwrap();
        assert!((found.tau_on_s - 85e-6).abs() < 0.1e-6, "{found:?}");
        assert!((found.tau_off_s + 60e-6).abs() < 0.1e-6, "{found:?}");
        assert!((found.growth_mm - 0.005).abs() < 1e-3);
        assert_eq!(found.acceleration_mm_s2, None);
        assert!(found.sd_s.iter().all(|&sd| sd > 1e-9 && sd < 0.2e-6));
    }

    #[test]
    fn an_acceleration_limited_start_shows_in_the_square_of_the_speed() {
        let found = regress(&ends(1e8, |_| 0.005), &Growth::Alike).unwrap();
        assert!((found.tau_on_s - 85e-6).abs() < 0.4e-6, "{found:?}");
        let acceleration = found.acceleration_mm_s2.unwrap();
        assert!((acceleration - 1e8).abs() < 2e6, "{acceleration}");
    }

    #[test]
    fn wrong_ends_are_left_out() {
        let mut ends = ends(f64::INFINITY, |_| 0.005);
        for wrong in [3, 20, 41] {
            ends[wrong].off_mm += 0.05;
        }
        let found = regress(&ends, &Growth::Alike).unwrap();
        let left_out: Vec<_> = (0..ends.len()).filter(|&index| !found.used[index]).collect();
        assert_eq!(left_out, [3, 20, 41]);
        assert!((found.tau_on_s - 85e-6).abs() < 0.1e-6);
    }

    #[test]
    fn one_speed_does_not_separate_growth() {
        let ends: Vec<_> =
            ends(f64::INFINITY, |_| 0.0).into_iter().filter(|e| e.speed == 0).collect();
        let found = regress(&ends, &Growth::Alike);
        assert!(found.is_none_or(|found| found.sd_s[0] > 1e-3));
    }
}
