//! A picture as under even light, its noise and its contrast.

use ftheta_model::picture::Picture;

/// Side of the surroundings that a pixel is held against, by the picture's shorter side; least, px.
const SURROUNDINGS: f64 = 1.0 / 12.0;
const SURROUNDINGS_MIN_PX: usize = 24;
/// Shade that is made up for, by the picture's mean.
const SHADE_MIN: f32 = 0.25;
/// Share of the pixels that have to be beyond the contrast.
const CONTRAST_SHARE: f64 = 0.003;
/// Noise by the contrast from which a picture is smoothed, and what one to three rounds of that
/// leave of the noise.
const NOISY: f64 = 0.05;
const SMOOTHED: [f64; 3] = [0.375, 0.273, 0.226];

/// A picture less its ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Flat {
    /// Every pixel less the mean around it, as under even light; smoothed where it is noisy.
    pub off: Vec<f32>,
    /// What all but a small share of these lie between.
    pub extremes: [f64; 2],
    /// Standard deviation of the picture's noise, of full scale.
    pub noise: f64,
    /// What smoothing has left of it.
    pub noise_left: f64,
}

impl Flat {
    /// A picture made even.
    pub fn new(picture: &Picture) -> Self {
        let noise = noise(picture);
        let mut off = difference(picture);
        let mut found = extremes(&off);
        let mut noise_left = noise;
        for share in SMOOTHED {
            if noise_left < NOISY * found[1].max(-found[0]) {
                break;
            }
            // Lines would fall to pieces; a little of their depth is the smaller loss.
            smooth(&mut off, picture.width());
            found = extremes(&off);
            noise_left = share * noise;
        }
        Self { off, extremes: found, noise, noise_left }
    }
}

/// Noise from differences of neighbours, which strokes and uneven light hardly touch.
fn noise(picture: &Picture) -> f64 {
    let row_step = (picture.height() / 256).max(1);
    let mut differences: Vec<f32> = (0..picture.height())
        .step_by(row_step)
        .flat_map(|y| picture.row(y).windows(2).map(|pair| (pair[1] - pair[0]).abs()))
        .collect();
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    let (_, &mut median, _) = differences.select_nth_unstable_by(middle, f32::total_cmp);
    f64::from(median) / (0.674_49 * std::f64::consts::SQRT_2)
}

/// Every pixel less the mean around it, as under even light.
fn difference(picture: &Picture) -> Vec<f32> {
    let (width, height) = (picture.width(), picture.height());
    let side = (SURROUNDINGS * width.min(height) as f64) as usize;
    let reach = side.max(SURROUNDINGS_MIN_PX) / 2;
    let along = running_means(picture.values(), width, reach);
    // Columns as rows, so that memory is read in order.
    let turned = transposed(&along, width);
    let means = transposed(&running_means(&turned, height, reach), height);
    let sum: f64 = means.iter().map(|&mean| f64::from(mean)).sum();
    let overall = (sum / means.len() as f64) as f32;
    let least = SHADE_MIN * overall;
    let of_pixel = |(value, mean): (&f32, f32)| (value - mean) * (overall / mean.max(least));
    if overall <= 0.0 {
        return vec![0.0; means.len()];
    }
    picture.values().iter().zip(means).map(of_pixel).collect()
}

/// Every value becomes a mean of its neighbours, 1 2 1 along rows and columns.
fn smooth(values: &mut [f32], width: usize) {
    let height = values.len() / width;
    for row in values.chunks_exact_mut(width) {
        let mut left = row[0];
        for x in 0..width {
            let right = row[(x + 1).min(width - 1)];
            let here = row[x];
            row[x] = 0.25 * (left + right) + 0.5 * here;
            left = here;
        }
    }
    let mut above: Vec<f32> = values[..width].to_vec();
    for y in 0..height {
        for x in 0..width {
            let below = values[(y + 1).min(height - 1) * width + x];
            let here = values[y * width + x];
            values[y * width + x] = 0.25 * (above[x] + below) + 0.5 * here;
            above[x] = here;
        }
    }
}

/// Means of each row over `2 · reach + 1` values, or as many as there are at its ends.
fn running_means(values: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let mut means = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width) {
        let mut sum: f64 = row.iter().take(reach).map(|&value| f64::from(value)).sum();
        let mut n = reach.min(width);
        for x in 0..width {
            if let Some(&value) = row.get(x + reach) {
                (sum, n) = (sum + f64::from(value), n + 1);
            }
            if let Some(left) = x.checked_sub(reach + 1) {
                (sum, n) = (sum - f64::from(row[left]), n - 1);
            }
            means.push((sum / n as f64) as f32);
        }
    }
    means
}

fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width;
    let mut turned = vec![0.0; values.len()];
    // Blocks that fit the cache.
    const BLOCK: usize = 32;
    for top in (0..height).step_by(BLOCK) {
        for left in (0..width).step_by(BLOCK) {
            for y in top..(top + BLOCK).min(height) {
                for x in left..(left + BLOCK).min(width) {
                    turned[x * height + y] = values[y * width + x];
                }
            }
        }
    }
    turned
}

/// What all but a small share of the values lie between.
fn extremes(values: &[f32]) -> [f64; 2] {
    let mut sample: Vec<f32> =
        values.iter().step_by((values.len() / 2_000_000).max(1)).copied().collect();
    let share = ((CONTRAST_SHARE * sample.len() as f64) as usize).min(sample.len() - 1);
    let (_, &mut low, _) = sample.select_nth_unstable_by(share, f32::total_cmp);
    let high_index = sample.len() - 1 - share;
    let (_, &mut high, _) = sample.select_nth_unstable_by(high_index, f32::total_cmp);
    [f64::from(low), f64::from(high)]
}
