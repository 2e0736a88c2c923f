//! From light to a picture: uneven light, dirt, blur, noise and shades.

use super::camera::Camera;
use super::print::uniform;
use super::render::Scene;
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
    let mut light = scene.radiance(camera);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(sensor.seed ^ 0x7365_6e73_6f72);
    let from_rad = TAU * uniform(&mut random);
    // Where a reflection is, of the half diagonal from the middle.
    let glare = [uniform(&mut random) - 0.5, uniform(&mut random) - 0.5];
    for _ in 0..sensor.n_dirt {
        drop_dirt(&mut light, [width, height], &mut random);
    }
    blur(&mut light, width, sensor.blur_px);
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

/// A speck or a fibre somewhere in the picture.
fn drop_dirt(light: &mut [f32], [width, height]: [usize; 2], random: &mut Xoshiro256PlusPlus) {
    let mut unit = || uniform(random);
    let centre = [unit() * width as f64, unit() * height as f64];
    let is_fibre = unit() < 0.5;
    let radius_px = if is_fibre { 0.8 + 0.8 * unit() } else { 1.0 + 4.0 * unit() };
    let length_px = if is_fibre { 8.0 + 40.0 * unit() } else { 2.0 * unit() };
    let (sin, cos) = (TAU * unit()).sin_cos();
    let reach_px = (radius_px + 0.5 * length_px + 1.0).ceil() as i64;
    let at = centre.map(|px| px as i64);
    for y in (at[1] - reach_px).max(0)..(at[1] + reach_px).min(height as i64) {
        for x in (at[0] - reach_px).max(0)..(at[0] + reach_px).min(width as i64) {
            let (dx, dy) = (x as f64 - centre[0], y as f64 - centre[1]);
            let along = dx * cos + dy * sin;
            let beyond = along - along.clamp(-0.5 * length_px, 0.5 * length_px);
            let distance_px = beyond.hypot(dy * cos - dx * sin);
            let share = (radius_px + 0.5 - distance_px).clamp(0.0, 1.0) as f32;
            let value = &mut light[y as usize * width + x as usize];
            *value += share * (DIRT - *value);
        }
    }
}

/// Gaussian blur, along rows and then along columns; the border goes on beyond the picture.
fn blur(light: &mut [f32], width: usize, sigma_px: f64) {
    if sigma_px <= 0.0 {
        return;
    }
    let reach = (4.0 * sigma_px).ceil() as usize;
    let weights: Vec<f64> =
        (0..=reach).map(|i| (-0.5 * (i as f64 / sigma_px).powi(2)).exp()).collect();
    let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
    let weights: Vec<f32> = weights.iter().map(|weight| (weight / sum) as f32).collect();
    let height = light.len() / width;
    let mut along = vec![0.0; light.len()];
    for (from, to) in light.chunks(width).zip(along.chunks_mut(width)) {
        for (x, value) in to.iter_mut().enumerate() {
            *value = weights[0] * from[x];
            for (i, weight) in weights.iter().enumerate().skip(1) {
                *value += weight * (from[x.saturating_sub(i)] + from[(x + i).min(width - 1)]);
            }
        }
    }
    for (y, to) in light.chunks_mut(width).enumerate() {
        let row = |y: usize| &along[y * width..(y + 1) * width];
        to.iter_mut().zip(row(y)).for_each(|(value, from)| *value = weights[0] * from);
        for (i, weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (row(y.saturating_sub(i)), row((y + i).min(height - 1)));
            for (value, (a, b)) in to.iter_mut().zip(above.iter().zip(below)) {
                *value += weight * (a + b);
            }
        }
    }
}
