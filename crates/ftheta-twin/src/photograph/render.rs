//! The light that comes from the plate, pixel by pixel.

use super::burn::{Fluence, Segment};
use super::camera::Camera;
use super::grain::grain;
use super::print::Print;
use ftheta_model::picture::PixelPoint;
use kurbo::{Affine, Point, Rect, Vec2};
use std::num::NonZero;
use std::thread;

/// Side of the squares within which places are interpolated and things are looked up, px.
const TILE: usize = 8;
/// Parts of a pixel along each side that are told from each other.
pub(super) const FINE: usize = 2;
/// Longest piece of a thing that is looked up by its bounding box, px.
const PIECE_PX: f64 = 24.0;
/// Dose over the threshold that is too little to matter beside another line.
const FAINT: f64 = 0.02;
/// What a line at its threshold has of its darkest.
const FIRST_SHADE: f64 = 0.8;
/// Sizes of the material's grain, mm.
const FINE_MM: f64 = 0.04;
const COARSE_MM: f64 = 0.5;

/// How the material looks; brightness from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Of the bare plate.
    pub plate: f64,
    /// Where it is burned most.
    pub burned: f64,
    /// Unevenness of the plate's brightness, relative.
    pub texture: f64,
    /// Unevenness of the threshold, relative.
    pub threshold_texture: f64,
    /// Seed of the grain.
    pub seed: u64,
}

/// A plate with all that is on it.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What was burned.
    pub segments: Vec<Segment>,
    /// Where the beam's intensity has fallen to 1/e², mm.
    pub spot_radius_mm: f64,
    /// Fluence that burns, J/mm².
    pub threshold_j_mm2: f64,
    /// What was printed before.
    pub prints: Vec<Print>,
    /// The material.
    pub look: Look,
}

/// What may be seen in a tile, by index.
#[derive(Clone, Default)]
struct Tile {
    segments: Vec<u32>,
    prints: Vec<u32>,
}

impl Scene {
    /// Brightness of the quarters of every pixel, row by row of quarters: the mean over its area.
    ///
    /// A lens blurs before a pixel gathers light, so that a line thinner than a pixel still moves
    /// its middle by less than one: what blurs has to see finer than pixels.
    pub(super) fn radiance(&self, camera: &Camera) -> Vec<f32> {
        let (width, height) = (FINE * camera.width, FINE * camera.height);
        let n_columns = camera.width.div_ceil(TILE);
        let rendering = Rendering { scene: self, camera, reach_mm: self.reach_mm() };
        let tiles = rendering.tiles();
        let mut picture = vec![0.0; width * height];
        let n_threads = thread::available_parallelism().map_or(1, NonZero::get);
        let mut bands: Vec<Vec<(usize, &mut [f32])>> = (0..n_threads).map(|_| Vec::new()).collect();
        for (row, band) in picture.chunks_mut(FINE * TILE * width).enumerate() {
            bands[row % n_threads].push((row, band));
        }
        thread::scope(|scope| {
            for band in bands {
                scope.spawn(|| {
                    for (row, pixels) in band {
                        let tiles = &tiles[row * n_columns..(row + 1) * n_columns];
                        rendering.band(row, tiles, pixels);
                    }
                });
            }
        });
        picture
    }

    /// How far from a segment anything of it is seen, mm.
    fn reach_mm(&self) -> f64 {
        let peaks = self.segments.iter().map(|segment| segment.peak(self.spot_radius_mm));
        let greatest = peaks.fold(0.0, f64::max) / self.threshold_j_mm2;
        self.spot_radius_mm * (0.5 * (greatest / FAINT).max(1.0).ln()).sqrt()
    }
}

/// A scene that is being rendered.
struct Rendering<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    reach_mm: f64,
}

impl Rendering<'_> {
    /// Renders a row of tiles.
    fn band(&self, row: usize, tiles: &[Tile], pixels: &mut [f32]) {
        let camera = self.camera;
        let width = FINE * camera.width;
        let n_rows = pixels.len() / width / FINE;
        for (column, tile) in tiles.iter().enumerate() {
            let (x0, y0) = ((column * TILE) as f64 - 0.5, (row * TILE) as f64 - 0.5);
            let side = TILE as f64;
            let corners = [(0.0, 0.0), (side, 0.0), (0.0, side), (side, side)]
                .map(|(x, y)| camera.place(PixelPoint::new(x0 + x, y0 + y)));
            // Beyond the horizon there is nothing.
            let [Some(a), Some(b), Some(c), Some(d)] = corners else {
                continue;
            };
            let place = |x: f64, y: f64| a.lerp(b, x / side).lerp(c.lerp(d, x / side), y / side);
            let pixel_mm = 0.5 * (a.distance(d) + b.distance(c)) / (side * 2f64.sqrt());
            for y in 0..n_rows {
                for x in 0..TILE.min(camera.width - column * TILE) {
                    let at = |i: f64, j: f64| place(x as f64 + i, y as f64 + j);
                    let quarters = self.quarters(tile, &at, pixel_mm);
                    for (index, value) in quarters.into_iter().enumerate() {
                        let x = FINE * (column * TILE + x) + index % FINE;
                        pixels[(FINE * y + index / FINE) * width + x] = value as f32;
                    }
                }
            }
        }
    }

    /// Mean brightness of a pixel's quarters; `at` gives its places from (0, 0) to (1, 1).
    fn quarters(
        &self,
        tile: &Tile,
        at: &dyn Fn(f64, f64) -> Point,
        pixel_mm: f64,
    ) -> [f64; FINE * FINE] {
        let centre = at(0.5, 0.5);
        let Look { plate, texture, seed, .. } = self.scene.look;
        let uneven = 0.6 * grain(centre, FINE_MM.max(pixel_mm), seed)
            + 0.4 * grain(centre, COARSE_MM.max(4.0 * pixel_mm), seed + 1);
        let plate = plate * (1.0 + texture * uneven);
        let reach_mm = self.reach_mm + 0.75 * pixel_mm;
        let near: Vec<&Segment> = tile
            .segments
            .iter()
            .map(|&index| &self.scene.segments[index as usize])
            .filter(|segment| segment.distance_mm(centre) < reach_mm)
            .collect();
        if near.is_empty() && tile.prints.is_empty() {
            return [plate; FINE * FINE];
        }
        let across = pixel_mm / (0.15 * self.scene.spot_radius_mm) / FINE as f64;
        let n = if near.is_empty() { 2 } else { across.ceil().clamp(1.0, 4.0) as usize };
        let (step, side_mm) = (1.0 / (n * FINE) as f64, pixel_mm / (n * FINE) as f64);
        std::array::from_fn(|quarter| {
            let (left, top) = ((quarter % FINE * n) as f64, (quarter / FINE * n) as f64);
            let mut sum = 0.0;
            for index in 0..n * n {
                let (x, y) = ((index % n) as f64 + 0.5, (index / n) as f64 + 0.5);
                let place = at((left + x) * step, (top + y) * step);
                let prints = tile.prints.iter().map(|&index| &self.scene.prints[index as usize]);
                let below =
                    plate + prints.map(|print| print.change_at(place, side_mm)).sum::<f64>();
                let burned = self.burned(&near, place, side_mm);
                sum += below + burned * (self.scene.look.burned - below);
            }
            sum / (n * n) as f64
        })
    }

    /// How far a small square is burned, 0 to 1: its share over the threshold, times how dark that
    /// is.
    fn burned(&self, near: &[&Segment], place: Point, side_mm: f64) -> f64 {
        let mut all = Fluence::default();
        for segment in near {
            let one = segment.fluence(place, self.scene.spot_radius_mm);
            all.value += one.value;
            all.slope += one.slope;
        }
        if all.value < FAINT * self.scene.threshold_j_mm2 {
            return 0.0;
        }
        let uneven =
            self.scene.look.threshold_texture * grain(place, FINE_MM, self.scene.look.seed + 2);
        let over = all.value / (self.scene.threshold_j_mm2 * (1.0 + uneven));
        // Distance from the border by the logarithm, which is smooth where the beam is Gaussian.
        let distance_mm = over.ln() * all.value / all.slope.hypot().max(f64::MIN_POSITIVE);
        let share = (0.5 + distance_mm / side_mm).clamp(0.0, 1.0);
        let deep = 1.0 - (-0.5 * (over - 1.0).max(0.0)).exp();
        share * (FIRST_SHADE + (1.0 - FIRST_SHADE) * deep)
    }

    fn tiles(&self) -> Vec<Tile> {
        let camera = self.camera;
        let n_columns = camera.width.div_ceil(TILE);
        let mut tiles = vec![Tile::default(); n_columns * camera.height.div_ceil(TILE)];
        let mut put = |piece: Rect, placed: &Affine, mut add: Box<dyn FnMut(&mut Tile) + '_>| {
            let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
                let x = if i == 0 { piece.x0 } else { piece.x1 };
                let y = if j == 0 { piece.y0 } else { piece.y1 };
                camera.pixel(*placed * Point::new(x, y))
            });
            let Some(bounds) = bounds(&corners) else {
                return;
            };
            let index = |px: f64, n: usize| ((px.max(0.0) as usize) / TILE).min(n);
            let n_rows = camera.height.div_ceil(TILE);
            if bounds.x1 < 0.0 || bounds.y1 < 0.0 {
                return;
            }
            for row in index(bounds.y0, n_rows)..(index(bounds.y1, n_rows) + 1).min(n_rows) {
                let columns = index(bounds.x0, n_columns)..(index(bounds.x1, n_columns) + 1);
                for column in columns.start..columns.end.min(n_columns) {
                    add(&mut tiles[row * n_columns + column]);
                }
            }
        };
        let add = |list: &mut Vec<u32>, index: usize| {
            if list.last() != Some(&(index as u32)) {
                list.push(index as u32);
            }
        };
        let piece_mm = PIECE_PX * pixel_mm(camera);
        let reach_mm = self.reach_mm;
        for (index, segment) in self.scene.segments.iter().enumerate() {
            let along = segment.to - segment.from;
            let placed = Affine::translate(segment.from.to_vec2()) * Affine::rotate(along.angle());
            let whole = Rect::new(0.0, 0.0, along.hypot(), 0.0).inflate(reach_mm, reach_mm);
            for piece in pieces(whole, piece_mm) {
                put(piece, &placed, Box::new(|tile| add(&mut tile.segments, index)));
            }
        }
        for (index, print) in self.scene.prints.iter().enumerate() {
            for piece in pieces(print.rect, piece_mm) {
                put(piece, &print.placed, Box::new(|tile| add(&mut tile.prints, index)));
            }
        }
        tiles
    }
}

/// Side of a pixel in the picture's middle, mm.
fn pixel_mm(camera: &Camera) -> f64 {
    let (x, y) = (0.5 * camera.width as f64, 0.5 * camera.height as f64);
    let places = [0.0, 1.0].map(|step| camera.place(PixelPoint::new(x + step, y)));
    match places {
        [Some(a), Some(b)] => a.distance(b),
        _ => 1.0,
    }
}

/// A rectangle cut into pieces that are not much longer than this, mm.
fn pieces(whole: Rect, longest_mm: f64) -> impl Iterator<Item = Rect> {
    let n = whole.size().to_vec2() / longest_mm;
    let [n_x, n_y] = [n.x, n.y].map(|n| n.ceil().clamp(1.0, 1e4) as usize);
    let step = Vec2::new(whole.width() / n_x as f64, whole.height() / n_y as f64);
    (0..n_x * n_y).map(move |index| {
        let (i, j) = ((index % n_x) as f64, (index / n_x) as f64);
        let low = whole.origin() + Vec2::new(i * step.x, j * step.y);
        Rect::from_points(low, low + step)
    })
}

/// Bounds of these pixels, and what interpolation may be off.
fn bounds(pixels: &[Option<PixelPoint>]) -> Option<Rect> {
    let points = pixels.iter().map(|pixel| pixel.map(|pixel| Point::new(pixel.x_px, pixel.y_px)));
    let points: Vec<Point> = points.collect::<Option<_>>()?;
    let first = Rect::from_points(*points.first()?, *points.first()?);
    Some(points.iter().fold(first, |bounds, point| bounds.union_pt(*point)).inflate(2.0, 2.0))
}
