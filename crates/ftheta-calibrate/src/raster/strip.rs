//! Profiles across a line: where its middle is.

use ftheta_model::picture::{Picture, PixelPoint};

/// Distance of samples, px.
pub const STEP_PX: f64 = 0.5;
/// A middle counts if it stands out from beside it by this much, of full scale.
const STANDS_OUT: f64 = 0.02;

/// A short piece of a line and what is beside it.
#[derive(Clone, Copy, Debug)]
pub struct Strip {
    /// Its middle.
    pub middle: PixelPoint,
    /// Direction of the line, of length one.
    pub direction: [f64; 2],
    /// Half of its length, px.
    pub half_length_px: f64,
    /// How far it reaches to each side, px.
    pub reach_px: f64,
}

impl Strip {
    /// Mean brightness across the line, from one side to the other.
    pub fn across(&self, picture: &Picture) -> Vec<f64> {
        let n = (self.reach_px / STEP_PX).floor() as i32;
        let n_long = (self.half_length_px / 1.0).floor() as i32;
        let [x, y] = self.direction;
        let value = |side: i32| {
            let off = f64::from(side) * STEP_PX;
            let mean = (-n_long..=n_long).map(|long| {
                let long = f64::from(long);
                let at = PixelPoint::new(
                    self.middle.x_px + x * long - y * off,
                    self.middle.y_px + y * long + x * off,
                );
                f64::from(picture.at(at))
            });
            mean.sum::<f64>() / f64::from(2 * n_long + 1)
        };
        (-n..=n).map(value).collect()
    }
}

/// Where a line's middle is beside the middle of a strip; `None` if there is no line.
pub fn centre_px(picture: &Picture, bright: bool, strip: &Strip) -> Option<PixelPoint> {
    if !picture.contains(strip.middle) {
        return None;
    }
    let values = strip.across(picture);
    let sign = if bright { 1.0 } else { -1.0 };
    let n = values.len();
    let side = (n / 6).max(1);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (left, right) = (mean(&values[..side]), mean(&values[n - side..]));
    let ground = |index: usize| left + (right - left) * index as f64 / (n - 1) as f64;
    let off: Vec<f64> = (0..n).map(|index| sign * (values[index] - ground(index))).collect();
    let top = off.iter().copied().fold(0.0, f64::max);
    if top < STANDS_OUT {
        return None;
    }
    // Half of the height and above: noise beside the line does not pull.
    let weights = off.iter().map(|value| (value - 0.3 * top).max(0.0));
    let (mut sum, mut moment) = (0.0, 0.0);
    for (index, weight) in weights.enumerate() {
        sum += weight;
        moment += weight * index as f64;
    }
    let off_px = (moment / sum - 0.5 * (n - 1) as f64) * STEP_PX;
    let [x, y] = strip.direction;
    Some(PixelPoint::new(strip.middle.x_px - y * off_px, strip.middle.y_px + x * off_px))
}

/// The straight line through points, those far off left out: height at 0 and slope.
pub fn straight(points: &[(f64, f64)]) -> (f64, f64) {
    let mut used: Vec<(f64, f64)> = points.to_vec();
    let mut line = (0.0, 0.0);
    for _ in 0..3 {
        let n = used.len() as f64;
        let (mean_t, mean_n) =
            (used.iter().map(|p| p.0).sum::<f64>() / n, used.iter().map(|p| p.1).sum::<f64>() / n);
        let (tt, tn) = used.iter().fold((0.0, 0.0), |(tt, tn), p| {
            let t = p.0 - mean_t;
            (tt + t * t, tn + t * (p.1 - mean_n))
        });
        let slope = if tt > 0.0 { tn / tt } else { 0.0 };
        line = (mean_n - slope * mean_t, slope);
        let off = |p: &(f64, f64)| (p.1 - line.0 - line.1 * p.0).abs();
        let mut sizes: Vec<f64> = points.iter().map(off).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        used = points.iter().filter(|p| off(p) < 4.0 * (1.5 * median).max(0.05)).copied().collect();
    }
    line
}

/// Where two lines cross, each a place and a direction of length one; `None` if they hardly do.
pub fn crossing(
    (p, [ax, ay]): ([f64; 2], [f64; 2]),
    (q, [bx, by]): ([f64; 2], [f64; 2]),
) -> Option<PixelPoint> {
    let cross = ax * by - ay * bx;
    if cross.abs() < 0.2 {
        return None;
    }
    let t = ((q[0] - p[0]) * by - (q[1] - p[1]) * bx) / cross;
    Some(PixelPoint::new(p[0] + t * ax, p[1] + t * ay))
}
