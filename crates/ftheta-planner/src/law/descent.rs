//! Gradient search for the parameters of a law: least time within limits.

/// Weights of the broken limits, in order.
const WEIGHTS: [f64; 4] = [1.0, 30.0, 1e3, 1e5];
/// Most steps of one weight.
const N_STEPS: usize = 60;
/// Change of a parameter for the gradient.
const NUDGE: f64 = 1e-6;
/// Longest step of any parameter.
const STEP_MAX: f64 = 0.5;
/// Least relative gain of a step that is worth another.
const GAIN_MIN: f64 = 1e-7;

/// Parameters near the start at which `cost` is least while `excess` is nowhere above zero.
///
/// Quasi-Newton steps (BFGS) on the cost plus the weighted squares of what is in excess, the
/// weight growing. Both in units of order one. Deterministic.
pub(super) fn descend<const N: usize>(
    start: [f64; N],
    evaluate: impl Fn(&[f64; N]) -> (f64, [f64; 3]),
) -> [f64; N] {
    let mut at = start;
    for weight in WEIGHTS {
        let value = |parameters: &[f64; N]| {
            let (cost, excess) = evaluate(parameters);
            cost + weight * excess.iter().map(|part| part.max(0.0).powi(2)).sum::<f64>()
        };
        at = quasi_newton(at, value);
    }
    at
}

fn quasi_newton<const N: usize>(start: [f64; N], value: impl Fn(&[f64; N]) -> f64) -> [f64; N] {
    let mut at = start;
    let mut here = value(&at);
    let mut slope = gradient(&at, &value);
    let mut inverse = identity();
    for _ in 0..N_STEPS {
        let mut direction = product(&inverse, &slope).map(|part| -part);
        if dot(&direction, &slope) >= 0.0 {
            inverse = identity();
            direction = slope.map(|part| -part);
        }
        let longest = direction.iter().fold(0.0_f64, |longest, part| longest.max(part.abs()));
        let Some((next, there)) = search(&at, here, &direction, STEP_MAX / longest, &value) else {
            break;
        };
        let next_slope = gradient(&next, &value);
        let step = std::array::from_fn(|i| next[i] - at[i]);
        let change = std::array::from_fn(|i| next_slope[i] - slope[i]);
        update(&mut inverse, &step, &change);
        let gain = here - there;
        (at, here, slope) = (next, there, next_slope);
        if gain < GAIN_MIN * here.abs() {
            break;
        }
    }
    at
}

/// The first of halved steps that gains; `None` where none does.
fn search<const N: usize>(
    at: &[f64; N],
    here: f64,
    direction: &[f64; N],
    longest: f64,
    value: impl Fn(&[f64; N]) -> f64,
) -> Option<([f64; N], f64)> {
    let mut length = longest.min(1.0);
    for _ in 0..30 {
        let next = std::array::from_fn(|i| at[i] + length * direction[i]);
        let there = value(&next);
        if there < here {
            return Some((next, there));
        }
        length *= 0.5;
    }
    None
}

fn gradient<const N: usize>(at: &[f64; N], value: impl Fn(&[f64; N]) -> f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let nudged = |by: f64| {
            let mut near = *at;
            near[i] += by;
            value(&near)
        };
        (nudged(NUDGE) - nudged(-NUDGE)) / (2.0 * NUDGE)
    })
}

/// The update of Broyden, Fletcher, Goldfarb and Shanno of the inverse second derivative.
fn update<const N: usize>(inverse: &mut [[f64; N]; N], step: &[f64; N], change: &[f64; N]) {
    let curvature = dot(step, change);
    if curvature <= 1e-12 * dot(step, step).sqrt() * dot(change, change).sqrt() {
        return;
    }
    let bent = product(inverse, change);
    let factor = (1.0 + dot(change, &bent) / curvature) / curvature;
    for (i, row) in inverse.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry +=
                factor * step[i] * step[j] - (bent[i] * step[j] + step[i] * bent[j]) / curvature;
        }
    }
}

fn identity<const N: usize>() -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

fn product<const N: usize>(matrix: &[[f64; N]; N], vector: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| dot(&matrix[i], vector))
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
