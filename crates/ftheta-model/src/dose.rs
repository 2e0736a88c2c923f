//! A map of the energy that reached the work plane, in sparse tiles.

use std::collections::BTreeMap;

/// Pixels along one side of a tile.
pub const TILE_PIXELS: usize = 64;

/// Energy per pixel of the field, J. Only tiles that saw light exist.
///
/// Pixel (i, j) is centred on `(i · pixel_mm, j · pixel_mm)`; i along x, j along y (up).
#[derive(Clone, Debug)]
pub struct DoseMap {
    /// Side of a pixel, mm.
    pub pixel_mm: f64,
    /// Tiles by (row, column) = (j, i) of the tile; pixels row by row, y up.
    pub tiles: BTreeMap<(i32, i32), Box<[f32; TILE_PIXELS * TILE_PIXELS]>>,
}

impl DoseMap {
    /// An empty map.
    pub fn new(pixel_mm: f64) -> Self {
        Self { pixel_mm, tiles: BTreeMap::new() }
    }

    /// Energy of pixel (i, j), J; zero where no tile is.
    pub fn energy_j(&self, i: i32, j: i32) -> f32 {
        let (key, index) = tile_of(i, j);
        self.tiles.get(&key).map_or(0.0, |tile| tile[index])
    }

    /// Adds energy to pixel (i, j), J.
    pub fn add(&mut self, i: i32, j: i32, energy_j: f32) {
        let (key, index) = tile_of(i, j);
        let tile =
            self.tiles.entry(key).or_insert_with(|| Box::new([0.0; TILE_PIXELS * TILE_PIXELS]));
        tile[index] += energy_j;
    }

    /// All energy on the map, J.
    pub fn total_j(&self) -> f64 {
        self.tiles.values().flat_map(|tile| tile.iter()).map(|&energy| f64::from(energy)).sum()
    }
}

/// The tile of pixel (i, j) and the pixel's index in it.
pub fn tile_of(i: i32, j: i32) -> ((i32, i32), usize) {
    let side = TILE_PIXELS as i32;
    let key = (j.div_euclid(side), i.div_euclid(side));
    (key, (j.rem_euclid(side) * side + i.rem_euclid(side)) as usize)
}
