//! Profiles of lines in a picture: how wide they are, where they end.

use super::growth::ROW_WEIGHTS;
use crate::levenberg::minimise;
use crate::raster::strip::STEP_PX;
use ftheta_model::picture::{Picture, PixelPoint};

/// First guess of an edge's softness, px.
const SOFT_PX: f64 = 1.2;
/// Softest and hardest edge that is one, px.
const SOFT_MIN_PX: f64 = 0.15;
/// Darkest ground that brightness is divided by.
const GROUND_MIN: f64 = 0.02;

/// An end of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Where it is along the window, px from its middle.
    pub at_px: f64,
    /// Standard deviation of its blur, px.
    pub soft_px: f64,
    /// Brightness beyond the line.
    pub ground: f64,
    /// Brightness on the line.
    pub line: f64,
    /// Uncertainty of the place, px.
    pub sd_px: f64,
}

/// Where a line ends within a window along it.
///
/// * `outward`: direction of the line towards its end, of length one
/// * `reach_px`: half of the window's length
/// * `half_width_px`: how far from the middle of the line brightness is taken
///
/// `None` if there is no such edge in the window.
pub fn edge(
    picture: &Picture,
    middle: PixelPoint,
    outward: [f64; 2],
    [reach_px, half_width_px]: [f64; 2],
) -> Option<Edge> {
    let n = (reach_px / STEP_PX).floor() as i32;
    let [x, y] = outward;
    // Across, a bell: the tip is round, so the same rows have to be taken of all lines.
    let across = ROW_WEIGHTS.map(|(share, weight)| (share * half_width_px, weight));
    let total: f64 = across.iter().map(|(_, weight)| weight).sum();
    let samples: Vec<(f64, f64)> = (-n..=n)
        .map(|index| {
            let t = f64::from(index) * STEP_PX;
            let value = across.iter().map(|(off, weight)| {
                let at =
                    PixelPoint::new(middle.x_px + x * t - y * off, middle.y_px + y * t + x * off);
                weight * f64::from(picture.at(at))
            });
            (t, value.sum::<f64>() / total)
        })
        .collect();
    let quarter = samples.len() / 4;
    let mean = |part: &[(f64, f64)]| part.iter().map(|s| s.1).sum::<f64>() / part.len() as f64;
    let (line, ground) = (mean(&samples[..quarter]), mean(&samples[samples.len() - quarter..]));
    // Where the brightness is between both, from the area: a good first guess.
    let area = samples.iter().map(|s| (s.1 - ground) / (line - ground)).sum::<f64>() * STEP_PX;
    let first = area - 0.5 * (2 * n + 1) as f64 * STEP_PX;
    if !first.is_finite() || first.abs() > reach_px {
        return None;
    }
    let found = minimise(&[ground, line, first, SOFT_PX], &[1e-4, 1e-4, 1e-4, 1e-4], |p, out| {
        out.clear();
        let soft = p[3].abs().max(SOFT_MIN_PX) * std::f64::consts::SQRT_2;
        out.extend(samples.iter().map(|(t, value)| {
            let beyond = 0.5 * (1.0 + libm::erf((t - p[2]) / soft));
            p[1] + (p[0] - p[1]) * beyond - value
        }));
    })?;
    let [ground, line, at_px, soft] = found.parameters[..] else { return None };
    let soft_px = soft.abs().max(SOFT_MIN_PX);
    let inside = at_px.abs() + soft_px < reach_px;
    let variance = found.cost / (samples.len() - 4) as f64;
    let sd_px = (variance * found.covariance?[(2, 2)]).sqrt();
    inside.then_some(Edge { at_px, soft_px, ground, line, sd_px })
}

/// Widths of lines of one picture from their mean profiles across, mm, and the blur, px.
///
/// Depth, by the ground's brightness, and blur are those of the picture, the same for all: a line
/// that is narrower than the blur shows less deep.
///
/// * `profiles`: brightness across, every half pixel, the line in the middle
///
/// `None` if they are no lines.
pub fn widths_px(profiles: &[Vec<f64>], bright: bool) -> Option<(Vec<f64>, f64)> {
    let sign = if bright { 1.0 } else { -1.0 };
    let profiles: Vec<Vec<f64>> = profiles.iter().map(|profile| by_ground(profile)).collect();
    let depths = profiles.iter().map(|profile| {
        let ground = 0.5 * (profile.first()? + profile.last()?);
        profile.iter().map(|value| sign * (value - ground)).reduce(f64::max)
    });
    let depths: Vec<f64> = depths.collect::<Option<_>>()?;
    let depth = depths.iter().copied().fold(0.0, f64::max);
    let areas = profiles.iter().map(|profile| {
        let ground = 0.5 * (profile[0] + profile[profile.len() - 1]);
        let area = profile.iter().map(|value| sign * (value - ground)).sum::<f64>() * STEP_PX;
        (area / depth).max(0.5)
    });
    let grounds = profiles.iter().map(|profile| 0.5 * (profile[0] + profile[profile.len() - 1]));
    let first: Vec<f64> = [1.05 * depth, 1.0].into_iter().chain(areas).chain(grounds).collect();
    let n = profiles.len();
    let found = minimise(&first, &vec![1e-4; first.len()], |p, out| {
        out.clear();
        let soft = p[1].abs().max(SOFT_MIN_PX) * std::f64::consts::SQRT_2;
        for (index, profile) in profiles.iter().enumerate() {
            let (half, ground) = (0.5 * p[2 + index], p[2 + n + index]);
            let middle = 0.5 * (profile.len() - 1) as f64;
            out.extend(profile.iter().enumerate().map(|(at, value)| {
                let off = (at as f64 - middle) * STEP_PX;
                let covered =
                    0.5 * (libm::erf((off + half) / soft) - libm::erf((off - half) / soft));
                ground + sign * p[0] * covered - value
            }));
        }
        // A depth beyond the deepest line is possible, but not by much.
        out.push(0.1 * (p[0] / depth - 1.0));
    })?;
    Some((found.parameters[2..2 + n].to_vec(), found.parameters[1].abs()))
}

/// A profile by its ground's brightness, so that uneven light does not count.
fn by_ground(profile: &[f64]) -> Vec<f64> {
    let ground = match *profile {
        [first, .., last] => 0.5 * (first + last),
        _ => 1.0,
    };
    profile.iter().map(|value| value / ground.max(GROUND_MIN)).collect()
}
