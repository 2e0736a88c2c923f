//! Collects energy along the beam's path, and blurs it by the spot once at the end.

use ftheta_model::dose::{DoseMap, TILE_PIXELS, tile_of};
use ftheta_model::space::FieldPoint;
use std::collections::BTreeMap;

type Tile = Box<[f32; TILE_PIXELS * TILE_PIXELS]>;

/// Energy per pixel of an infinitely thin beam, in sparse tiles.
#[derive(Clone)]
pub struct Exposure {
    pixel_mm: f64,
    pixels_per_mm: f64,
    tiles: BTreeMap<(i32, i32), Tile>,
    /// The tile last written to is held out of the map: the beam mostly stays in it.
    current: ((i32, i32), Tile),
}

impl Exposure {
    pub fn new(pixel_mm: f64) -> Self {
        Self {
            pixel_mm,
            pixels_per_mm: 1.0 / pixel_mm,
            tiles: BTreeMap::new(),
            current: ((0, 0), new_tile()),
        }
    }

    /// Leaves energy at a place, J.
    #[inline]
    pub fn add(&mut self, place: FieldPoint, energy_j: f64) {
        let i = (place.x_mm * self.pixels_per_mm).round_ties_even() as i32;
        let j = (place.y_mm * self.pixels_per_mm).round_ties_even() as i32;
        let (key, index) = tile_of(i, j);
        if key != self.current.0 {
            self.turn_to(key);
        }
        self.current.1[index] += energy_j as f32;
    }

    #[cold]
    fn turn_to(&mut self, key: (i32, i32)) {
        let tile = self.tiles.remove(&key).unwrap_or_else(new_tile);
        let (old_key, old_tile) = std::mem::replace(&mut self.current, (key, tile));
        self.tiles.insert(old_key, old_tile);
    }

    /// The map as a Gaussian beam of this 1/e² diameter leaves it. Energy is kept to 1e-6.
    pub fn blurred(mut self, spot_diameter_mm: f64) -> DoseMap {
        let (key, tile) = std::mem::replace(&mut self.current, ((0, 0), new_tile()));
        self.tiles.insert(key, tile);
        self.tiles.retain(|_, tile| tile.iter().any(|&energy| energy > 0.0));
        // 1/e² radius of the intensity is two standard deviations.
        let kernel = kernel(0.25 * spot_diameter_mm * self.pixels_per_mm);
        let along_x = convolve(&self.tiles, &kernel, true);
        let tiles = convolve(&along_x, &kernel, false);
        DoseMap { pixel_mm: self.pixel_mm, tiles }
    }
}

fn new_tile() -> Tile {
    Box::new([0.0; TILE_PIXELS * TILE_PIXELS])
}

/// Half of a symmetric Gaussian, centre first, of sum one; reaches five standard deviations.
fn kernel(sigma_pixels: f64) -> Vec<f32> {
    let reach = (5.0 * sigma_pixels).ceil().min((TILE_PIXELS - 1) as f64) as usize;
    let weights: Vec<f64> =
        (0..=reach).map(|i| (-0.5 * (i as f64 / sigma_pixels).powi(2)).exp()).collect();
    let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.iter().map(|weight| (weight / sum) as f32).collect()
}

/// Convolves along rows or columns. A kernel shorter than a tile only reaches the two tiles
/// beside each one.
fn convolve(
    tiles: &BTreeMap<(i32, i32), Tile>,
    kernel: &[f32],
    rows: bool,
) -> BTreeMap<(i32, i32), Tile> {
    let side = TILE_PIXELS;
    let reach = kernel.len() - 1;
    let stride = if rows { 1 } else { side };
    let mut result: BTreeMap<(i32, i32), Tile> = BTreeMap::new();
    for (&(row, column), tile) in tiles {
        // The line of pixels with what spills over on both sides.
        let mut wide = vec![0.0_f32; side * (side + 2 * reach)];
        let width = side + 2 * reach;
        for line in 0..side {
            let start = if rows { line * side } else { line };
            for along in 0..side {
                let energy = tile[start + along * stride];
                if energy == 0.0 {
                    continue;
                }
                let out = &mut wide[line * width + along..=line * width + along + 2 * reach];
                for (offset, value) in out.iter_mut().enumerate() {
                    *value += energy * kernel[offset.abs_diff(reach)];
                }
            }
        }
        for part in -1..=1_i32 {
            let key = if rows { (row, column + part) } else { (row + part, column) };
            spill(&wide, part, reach, stride, key, &mut result);
        }
    }
    result
}

/// Adds the part of the widened lines that falls on the tile `part` tiles further.
fn spill(
    wide: &[f32],
    part: i32,
    reach: usize,
    stride: usize,
    key: (i32, i32),
    result: &mut BTreeMap<(i32, i32), Tile>,
) {
    let side = TILE_PIXELS;
    let width = side + 2 * reach;
    // Pixel `along` of that tile is pixel `along + part · side` of this one.
    let (first, last) = match part {
        -1 => (side - reach, side),
        0 => (0, side),
        _ => (0, reach),
    };
    let mut add = Vec::new();
    for line in 0..side {
        for along in first..last {
            let from = (along + reach) as i32 + part * side as i32;
            let energy = wide[line * width + from as usize];
            if energy > 0.0 {
                let start = if stride == 1 { line * side } else { line };
                add.push((start + along * stride, energy));
            }
        }
    }
    if !add.is_empty() {
        let tile = result.entry(key).or_insert_with(new_tile);
        add.into_iter().for_each(|(index, energy)| tile[index] += energy);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_keeps_energy_across_tiles_and_has_the_spot_width() {
        let mut exposure = Exposure::new(0.01);
        // On a tile corner, so that all four neighbours share it.
        exposure.add(FieldPoint::new(0.64, -0.64), 2.0);
        let map = exposure.blurred(0.08);
        assert!((map.total_j() - 2.0).abs() < 2e-6, "{}", map.total_j());
        let (centre, edge) = (map.energy_j(64, -64), map.energy_j(68, -64));
        // 40 µm from the centre is the 1/e² radius.
        assert!((f64::from(edge / centre) - (-2.0_f64).exp()).abs() < 1e-3);
        assert!((map.energy_j(60, -64) - edge).abs() < 1e-6);
        assert!((map.energy_j(64, -60) - edge).abs() < 1e-6);
    }
}
