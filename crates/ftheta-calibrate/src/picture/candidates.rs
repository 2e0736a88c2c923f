//! Where crosses or dots may be in a picture: what looks like one, coarsely.
//!
//! Every second pixel is held against a few places on and beside the arms of a cross (or in and
//! around a dot) that would be there. The weakest arm counts, so that lines, letters and dirt do
//! not look like crosses.

use ftheta_model::pattern::MarkStyle;
use ftheta_model::picture::PixelPoint;

/// Side of the tiles in which marks look alike, px, and distance of the places that are looked at.
const TILE_PX: usize = 64;
const STRIDE_PX: usize = 2;
/// Where arms are looked at, by half of a cross: clear of its burnt middle and ends.
const ALONG_ARM: [f64; 4] = [0.35, 0.5, 0.65, 0.8];
/// How far beside an arm, by half of a cross and at least, px.
const BESIDE_ARM: f64 = 0.18;
const BESIDE_MIN_PX: f64 = 3.0;
/// Where dots are looked at, by their radius: inside and around.
const INSIDE_DOT: f64 = 0.55;
const AROUND_DOT: f64 = 1.7;
/// Least strength, of full scale, and in deviations of the noise.
const STRENGTH_MIN: f64 = 0.015;
const STRENGTH_NOISE: f64 = 1.2;
/// Two marks are no nearer than this, by half of one.
const APART: f64 = 0.7;
/// Marks are at least of this part of the usual strength.
const USUAL: f64 = 0.3;

/// What may be a mark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Its middle, to a pixel or two.
    pub pixel: PixelPoint,
    /// How much its weakest arm differs from what is beside it.
    pub strength: f64,
}

/// Places on an arm, and those beside it.
#[derive(Clone)]
struct Arm<T> {
    on: Vec<T>,
    beside: Vec<T>,
}

/// How a mark looks somewhere in the picture.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// What it is.
    pub style: MarkStyle,
    /// From its middle to the end of the arm along x, and along y, px; a dot's radius along both.
    pub arms_px: [[f64; 2]; 2],
}

impl Shape {
    /// Length of the shorter arm, px.
    pub fn reach_px(&self) -> f64 {
        self.arms_px.map(|[x, y]| x.hypot(y)).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Places on each arm, and those beside it.
    fn places(&self) -> Vec<Arm<[f64; 2]>> {
        let [x, y] = self.arms_px;
        let at = |u: f64, v: f64| [u * x[0] + v * y[0], u * x[1] + v * y[1]];
        let beside = BESIDE_ARM.max(BESIDE_MIN_PX / self.reach_px());
        match self.style {
            MarkStyle::Cross => [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
                .map(|(u, v)| {
                    let on = ALONG_ARM.map(|t| at(t * u, t * v)).to_vec();
                    let sides = ALONG_ARM
                        .into_iter()
                        .flat_map(|t| [beside, -beside].map(|s| at(t * u + s * v, t * v + s * u)));
                    Arm { on, beside: sides.collect() }
                })
                .into(),
            MarkStyle::Dot => (0..8)
                .map(|index| {
                    let (sin, cos) = (f64::from(index) * std::f64::consts::FRAC_PI_4).sin_cos();
                    let on = vec![[0.0; 2], at(INSIDE_DOT * cos, INSIDE_DOT * sin)];
                    Arm { on, beside: vec![at(AROUND_DOT * cos, AROUND_DOT * sin)] }
                })
                .collect(),
        }
    }
}

/// The picture in which marks are looked for.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// Pixels less their surroundings.
    pub off: &'a [f32],
    /// Pixels a row.
    pub width: usize,
    /// Noise of these, of full scale.
    pub noise: f64,
}

/// Finds what may be a mark, darker than the ground or brighter; the strongest first.
///
/// * `shape`: how a mark would look at a place, if it can be there
/// * `n_marks`: how many there should be
///
/// Returns whether they are bright, and the marks.
pub fn candidates(
    ground: &Ground<'_>,
    shape: &dyn Fn(PixelPoint) -> Option<Shape>,
    n_marks: usize,
) -> (bool, Vec<Candidate>) {
    let height = ground.off.len() / ground.width;
    let (mut dark, mut bright) = (Vec::new(), Vec::new());
    let least = STRENGTH_MIN.max(STRENGTH_NOISE * ground.noise) as f32;
    for top in (0..height).step_by(TILE_PX) {
        for left in (0..ground.width).step_by(TILE_PX) {
            let half = 0.5 * TILE_PX as f64;
            let middle = PixelPoint::new(left as f64 + half, top as f64 + half);
            let Some(shape) = shape(middle) else { continue };
            let tile = Tile::new(ground, &shape);
            for y in (top..(top + TILE_PX).min(height)).step_by(STRIDE_PX) {
                for x in (left..(left + TILE_PX).min(ground.width)).step_by(STRIDE_PX) {
                    if let Some((is_bright, strength)) = tile.strength(x, y, least) {
                        let list = if is_bright { &mut bright } else { &mut dark };
                        list.push((strength, x, y, shape.reach_px() as f32));
                    }
                }
            }
        }
    }
    let [dark, bright] = [dark, bright].map(|list| apart(list, n_marks));
    let sum = |list: &[Candidate]| {
        list.iter().take(n_marks).map(|candidate| candidate.strength).sum::<f64>()
    };
    if sum(&bright) > sum(&dark) { (true, bright) } else { (false, dark) }
}

/// Offsets of the places that are looked at, the same all over a tile.
struct Tile<'a> {
    ground: &'a Ground<'a>,
    /// On and beside each arm, as steps in memory.
    arms: Vec<Arm<isize>>,
    reach: usize,
}

impl<'a> Tile<'a> {
    fn new(ground: &'a Ground<'a>, shape: &Shape) -> Self {
        let mut reach = 0.0_f64;
        let places = shape.places();
        let mut steps = |places: &[[f64; 2]]| -> Vec<isize> {
            let step = |&[x, y]: &[f64; 2]| {
                reach = reach.max(x.abs()).max(y.abs());
                y.round() as isize * ground.width as isize + x.round() as isize
            };
            places.iter().map(step).collect()
        };
        let arms = places.iter().map(|arm| Arm { on: steps(&arm.on), beside: steps(&arm.beside) });
        let arms = arms.collect();
        Self { ground, arms, reach: reach.ceil() as usize + 1 }
    }

    /// Whether a mark is bright, and how strong, if something is there.
    fn strength(&self, x: usize, y: usize, least: f32) -> Option<(bool, f32)> {
        let Ground { off, width, .. } = *self.ground;
        let height = off.len() / width;
        let fits =
            x >= self.reach && y >= self.reach && x + self.reach < width && y + self.reach < height;
        if !fits {
            return None;
        }
        let here = (y * width + x) as isize;
        let mean = |steps: &[isize]| {
            steps.iter().map(|step| off[(here + step) as usize]).sum::<f32>() / steps.len() as f32
        };
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for Arm { on, beside } in &self.arms {
            let differs = mean(beside) - mean(on);
            (low, high) = (low.min(differs), high.max(differs));
            if low < least && high > -least {
                return None;
            }
        }
        if low >= least {
            return Some((false, low));
        }
        (high <= -least).then_some((true, -high))
    }
}

/// The strongest of what is near each other, and of these what is not much weaker than usual.
fn apart(mut list: Vec<(f32, usize, usize, f32)>, n_marks: usize) -> Vec<Candidate> {
    list.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
    let cell = list.iter().map(|found| found.3).fold(4.0, f32::max) * APART as f32;
    let mut cells: std::collections::HashMap<(i32, i32), Vec<PixelPoint>> = Default::default();
    let mut kept: Vec<Candidate> = Vec::new();
    for (strength, x, y, reach) in list {
        let pixel = PixelPoint::new(x as f64, y as f64);
        let (column, row) = ((x as f32 / cell) as i32, (y as f32 / cell) as i32);
        let near = (row - 1..=row + 1).flat_map(|r| (column - 1..=column + 1).map(move |c| (c, r)));
        let limit_px = APART * f64::from(reach);
        let taken = near
            .filter_map(|key| cells.get(&key))
            .flatten()
            .any(|other| other.distance(pixel) < limit_px);
        if !taken {
            cells.entry((column, row)).or_default().push(pixel);
            kept.push(Candidate { pixel, strength: f64::from(strength) });
        }
    }
    let usual = kept.get(kept.len().min(n_marks) / 2).map_or(0.0, |candidate| candidate.strength);
    kept.retain(|candidate| candidate.strength >= USUAL * usual);
    kept
}
