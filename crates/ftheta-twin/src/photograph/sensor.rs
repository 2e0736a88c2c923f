//! From light to a picture: uneven light, dirt, blur, noise and shades.

use super::camera::Camera;
use super::print::uniform;
use super::render::{FINE, Scene};
use ftheta_model::picture::Picture;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::f64::consts::TAU;

/// How much darker a corner is, and how much light changes from side to side.
const VIGNETTE: f64 = 0.25;
const SLOPE: f64 = 0.15;
/// Part of the noise's variance that there is in the dark.
const DARK: f64 = 0.15;
/// Size of a reflection, of the picture's half diagonal.
const GLARE: f64 = 0.12;
/// Brightness of dirt.
const DIRT: f32 = 0.3;

/// What happens between the lens and the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Standard deviation of the lens' blur, px.
    pub blur_px: f64,
    /// Noise of a white pixel, of full scale.
    pub noise: f64,
    /// Factor on all light; from 1.2 on white is over-exposed.
    pub exposure: f64,
    /// Unevenness of the light over that of a lamp beside the plate; 0 is even.
    pub unevenness: f64,
    /// Light that is reflected from somewhere on the plate, at its brightest; 0 is none.
    pub glare: f64,
    /// Specks and fibres on the plate.
    pub n_dirt: usize,
    /// Shades are the light to the power of 1/gamma.
    pub gamma: f64,
    /// Seed of noise, dirt and light.
    pub seed: u64,
}

/// The picture that the camera takes, in 256 shades; the same on any number of threads.
pub fn expose(scene: &Scene, camera: &Camera, sensor: &Sensor) -> Picture {
    let (width, height) = (camera.width, camera.height);
    let mut fine = scene.radiance(camera);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(sensor.seed ^ 0x7365_6e73_6f72);
    let from_rad = TAU * uniform(&mut random);
    // Where a reflection is, of the half diagonal from the middle.
    let glare = [uniform(&mut random) - 0.5, uniform(&mut random) - 0.5];
    for _ in 0..sensor.n_dirt {
        drop_dirt(&mut fine, [width, height], &mut random);
    }
    let mut light = gathered(&fine, width, sensor.blur_px);
    drop(fine);
    let radius_px = 0.5 * (width as f64).hypot(height as f64);
    let (sin, cos) = from_rad.sin_cos();
    for (y, row) in light.chunks_mut(width).enumerate() {
        // A stream for every row.
        let stream = sensor.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ y as u64;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(stream);
        let v = (y as f64 - 0.5 * height as f64) / radius_px;
        for (x, value) in row.iter_mut().enumerate() {
            let u = (x as f64 - 0.5 * width as f64) / radius_px;
            let uneven = SLOPE * (u * cos + v * sin) - VIGNETTE * (u * u + v * v);
            let reflected = ((u - glare[0]).powi(2) + (v - glare[1]).powi(2)) / (GLARE * GLARE);
            let lit = f64::from(*value) * (1.0 + sensor.unevenness * uneven)
                + sensor.glare * (-reflected).exp();
            let lit = sensor.exposure * lit;
            let normal: f64 = StandardNormal.sample(&mut random);
            let noisy = lit + sensor.noise * (DARK + (1.0 - DARK) * lit.max(0.0)).sqrt() * normal;
            let mut shade = noisy.clamp(0.0, 1.0);
            if sensor.gamma != 1.0 {
                shade = shade.powf(1.0 / sensor.gamma);
            }
            *value = ((255.0 * shade).round() / 255.0) as f32;
        }
    }
    Picture::new(width, height, light).expect("a camera has pixels, and each has its light")
}

/// A speck or a fibre somewhere in a picture of this size, as parts of pixels.
fn drop_dirt(fine: &mut [f32], [width, height]: [usize; 2], random: &mut Xoshiro256PlusPlus) {
    let mut unit = || uniform(random);
    let centre = [unit() * width as f64, unit() * height as f64];
    let is_fibre = unit() < 0.5;
    let radius_px = if is_fibre { 0.8 + 0.8 * unit() } else { 1.0 + 4.0 * unit() };
    let length_px = if is_fibre { 8.0 + 40.0 * unit() } else { 2.0 * unit() };
    let (sin, cos) = (TAU * unit()).sin_cos();
    let reach = FINE as i64 * (radius_px + 0.5 * length_px + 1.0).ceil() as i64;
    let at = centre.map(|px| FINE as i64 * px as i64);
    let [width, height] = [width, height].map(|side| FINE * side);
    let px = |index: i64| (index as f64 + 0.5) / FINE as f64 - 0.5;
    for y in (at[1] - reach).max(0)..(at[1] + reach).min(height as i64) {
        for x in (at[0] - reach).max(0)..(at[0] + reach).min(width as i64) {
            let (dx, dy) = (px(x) - centre[0], px(y) - centre[1]);
            let along = dx * cos + dy * sin;
            let beyond = along - along.clamp(-0.5 * length_px, 0.5 * length_px);
            let distance_px = beyond.hypot(dy * cos - dx * sin);
            let share = (radius_px + 0.5 - distance_px).clamp(0.0, 1.0) as f32;
            let value = &mut fine[y as usize * width + x as usize];
            *value += share * (DIRT - *value);
        }
    }
}

/// Light of every pixel from that of its parts: blurred by the lens, then gathered. The border goes
/// on beyond the picture.
fn gathered(fine: &[f32], width: usize, sigma_px: f64) -> Vec<f32> {
    let weights = gathering(sigma_px);
    let n_fine = FINE * width;
    let n_rows = fine.len() / n_fine;
    // From so many parts before a pixel's first on.
    let before = (weights.len() - FINE) / 2;
    let mut along = Vec::with_capacity(n_rows * width);
    for row in fine.chunks(n_fine) {
        along.extend((0..width).map(|x| {
            let at = |i: usize| row[(FINE * x + i).saturating_sub(before).min(n_fine - 1)];
            weights.iter().enumerate().map(|(i, weight)| weight * at(i)).sum::<f32>()
        }));
    }
    let mut light = vec![0.0; n_rows / FINE * width];
    for (y, to) in light.chunks_mut(width).enumerate() {
        for (i, weight) in weights.iter().enumerate() {
            let row = (FINE * y + i).saturating_sub(before).min(n_rows - 1);
            let from = &along[row * width..(row + 1) * width];
            to.iter_mut().zip(from).for_each(|(value, from)| *value += weight * from);
        }
    }
    light
}

/// Weights with which a pixel gathers light from its own parts and those beside: a Gaussian, summed
/// over the pixel's parts.
fn gathering(sigma_px: f64) -> Vec<f32> {
    let sigma = FINE as f64 * sigma_px;
    let reach = (4.0 * sigma).ceil() as usize;
    let bell = |i: f64| if sigma > 0.0 { (-0.5 * (i / sigma).powi(2)).exp() } else { 1.0 };
    let mut weights = vec![0.0; 2 * reach + FINE];
    for part in 0..FINE {
        for (i, weight) in weights[part..].iter_mut().take(2 * reach + 1).enumerate() {
            *weight += bell(i as f64 - reach as f64);
        }
    }
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| (weight / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of half a pixel keeps its place, wherever it lies in the pixels.
    #[test]
    fn thin_lines_do_not_snap_to_pixels() {
        let width = 24;
        for parts in 0..4 {
            let mut fine = vec![0.0; FINE * width * FINE];
            for row in fine.chunks_mut(FINE * width) {
                row[22 + parts] = 1.0;
            }
            let light = gathered(&fine, width, 0.8);
            let sum: f32 = light[..width].iter().sum();
            let moment: f32 = (0..width).map(|x| x as f32 * light[x]).sum();
            let expected = (22 + parts) as f32 * 0.5 - 0.25;
            assert!((moment / sum - expected).abs() < 1e-3, "{} {expected}", moment / sum);
            assert!((sum - 0.5).abs() < 1e-5, "{sum}");
        }
        let plain = gathered(&[0.0, 1.0, 0.0, 1.0], 1, 0.0);
        assert_eq!(plain, [0.5]);
    }
}
