//! Straight strokes of a picture, coarsely: pieces that are darker or brighter than what is around
//! them, long and thin.

use super::error::DelayError;
use ftheta_model::picture::{Picture, PixelPoint};

/// Side of the surroundings that a pixel is held against, by the picture's shorter side; least, px.
const SURROUNDINGS: f64 = 1.0 / 12.0;
const SURROUNDINGS_MIN_PX: usize = 24;
/// Shade that is made up for, by the picture's mean.
const SHADE_MIN: f32 = 0.25;
/// Share of the pixels that have to be beyond the contrast.
const CONTRAST_SHARE: f64 = 0.003;
/// A stroke differs by this part of the contrast, and by so many deviations of the noise.
const THRESHOLD: f64 = 0.4;
const THRESHOLD_NOISE: f64 = 4.0;
/// Least contrast, in deviations of the noise.
const CONTRAST_NOISE: f64 = 6.0;
/// Least contrast, of full scale.
const CONTRAST_MIN: f64 = 0.02;
/// Noise by the contrast from which a picture is smoothed, and what one to three rounds of that
/// leave of the noise.
const NOISY: f64 = 0.05;
const SMOOTHED: [f64; 3] = [0.375, 0.273, 0.226];
/// A stroke is so many times as long as wide, and at least so long.
const ELONGATION: f64 = 5.0;
const LENGTH_MIN_PX: f64 = 15.0;
/// Most pieces that are looked at: a picture of gravel has more.
const N_PIECES_MAX: usize = 400_000;

/// A straight stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its middle.
    pub centre: PixelPoint,
    /// Its direction in the picture, rad from x towards y, from -π/2 to π/2.
    pub direction_rad: f64,
    /// Length, px.
    pub length_px: f64,
    /// Width, px.
    pub width_px: f64,
    /// Whether it reaches the picture's border.
    pub cut: bool,
}

/// All strokes of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Strokes {
    /// The strokes.
    pub list: Vec<Stroke>,
    /// Whether they are brighter than what is around them.
    pub bright: bool,
    /// By how much they differ, of full scale.
    pub contrast: f64,
    /// Standard deviation of the noise between neighbouring pixels, of full scale.
    pub noise: f64,
}

/// Finds the strokes of a picture.
///
/// # Errors
/// If nothing stands out, or too much does.
pub fn strokes(picture: &Picture) -> Result<Strokes, DelayError> {
    let noise = noise(picture);
    let mut off = difference(picture);
    let (mut low, mut high) = extremes(&off);
    let mut noise_left = noise;
    for share in SMOOTHED {
        if noise_left < NOISY * high.max(-low) {
            break;
        }
        // Lines would fall to pieces; a little of their depth is the smaller loss.
        smooth(&mut off, picture.width());
        (low, high) = extremes(&off);
        noise_left = share * noise;
    }
    let bright = high > -low;
    let contrast = high.max(-low);
    let limit = CONTRAST_MIN.max(CONTRAST_NOISE * noise_left);
    if contrast < limit {
        return Err(DelayError::NoContrast { contrast, noise, limit });
    }
    if !bright {
        off.iter_mut().for_each(|value| *value = -*value);
    }
    let threshold = (THRESHOLD * contrast).max(THRESHOLD_NOISE * noise_left);
    let pieces = pieces(&off, picture.width(), threshold as f32);
    if pieces.len() > N_PIECES_MAX {
        return Err(DelayError::Clutter { n_pieces: pieces.len(), limit: N_PIECES_MAX });
    }
    let (width, height) = (picture.width(), picture.height());
    let list = pieces.iter().filter_map(|piece| piece.stroke(width, height)).collect();
    Ok(Strokes { list, bright, contrast, noise })
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
fn extremes(values: &[f32]) -> (f64, f64) {
    let mut sample: Vec<f32> =
        values.iter().step_by((values.len() / 2_000_000).max(1)).copied().collect();
    let share = ((CONTRAST_SHARE * sample.len() as f64) as usize).min(sample.len() - 1);
    let (_, &mut low, _) = sample.select_nth_unstable_by(share, f32::total_cmp);
    let high_index = sample.len() - 1 - share;
    let (_, &mut high, _) = sample.select_nth_unstable_by(high_index, f32::total_cmp);
    (f64::from(low), f64::from(high))
}

/// Pixels that hang together, as sums over them.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    /// Smallest and greatest x and y.
    bounds: [usize; 4],
}

/// A run of pixels in a row.
#[derive(Clone, Copy)]
struct Run {
    from: usize,
    to: usize,
    piece: usize,
}

/// Pieces of pixels above the threshold that touch, corners included.
fn pieces(values: &[f32], width: usize, threshold: f32) -> Vec<Piece> {
    let mut parents: Vec<usize> = Vec::new();
    let mut sums: Vec<Piece> = Vec::new();
    let (mut above, mut here): (Vec<Run>, Vec<Run>) = (Vec::new(), Vec::new());
    for (y, row) in values.chunks_exact(width).enumerate() {
        here.clear();
        let mut x = 0;
        let mut first_above = 0;
        while x < width {
            if row[x] <= threshold {
                x += 1;
                continue;
            }
            let from = x;
            while x < width && row[x] > threshold {
                x += 1;
            }
            let (to, mut piece) = (x, usize::MAX);
            while first_above < above.len() && above[first_above].to < from {
                first_above += 1;
            }
            for run in above[first_above..].iter().take_while(|run| run.from <= to) {
                let other = root(&mut parents, run.piece);
                if piece == usize::MAX {
                    piece = other;
                } else if piece != other {
                    // The older one stays, so that the order is that of the picture.
                    let (old, young) = (piece.min(other), piece.max(other));
                    parents[young] = old;
                    let sum = sums[young];
                    sums[old].join(&sum);
                    piece = old;
                }
            }
            if piece == usize::MAX {
                piece = parents.len();
                parents.push(piece);
                sums.push(Piece { bounds: [from, from, y, y], ..Piece::default() });
            }
            sums[piece].join(&Piece::of_run(from, to, y));
            here.push(Run { from, to, piece });
        }
        std::mem::swap(&mut above, &mut here);
    }
    (0..sums.len()).filter(|&index| parents[index] == index).map(|index| sums[index]).collect()
}

/// The oldest piece that one was joined to.
fn root(parents: &mut [usize], mut piece: usize) -> usize {
    while parents[piece] != piece {
        parents[piece] = parents[parents[piece]];
        piece = parents[piece];
    }
    piece
}

impl Piece {
    fn of_run(from: usize, to: usize, y: usize) -> Self {
        let n = (to - from) as f64;
        let middle = 0.5 * (from + to - 1) as f64;
        let y_value = y as f64;
        Self {
            n,
            x: n * middle,
            y: n * y_value,
            xx: n * middle * middle + n * (n * n - 1.0) / 12.0,
            xy: n * middle * y_value,
            yy: n * y_value * y_value,
            bounds: [from, to - 1, y, y],
        }
    }

    fn join(&mut self, other: &Self) {
        self.n += other.n;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
        let [a, b] = [self.bounds, other.bounds];
        self.bounds = [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])];
    }

    /// The stroke that it is, if it is one.
    fn stroke(&self, width: usize, height: usize) -> Option<Stroke> {
        let (x, y) = (self.x / self.n, self.y / self.n);
        let xx = self.xx / self.n - x * x + 1.0 / 12.0;
        let yy = self.yy / self.n - y * y + 1.0 / 12.0;
        let xy = self.xy / self.n - x * y;
        let direction_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
        let (middle, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let length_px = (12.0 * (middle + half)).sqrt();
        let width_px = (12.0 * (middle - half)).max(1.0).sqrt();
        let [left, right, top, bottom] = self.bounds;
        let cut = left == 0 || top == 0 || right + 1 == width || bottom + 1 == height;
        let centre = PixelPoint::new(x, y);
        let long = length_px >= LENGTH_MIN_PX && length_px >= ELONGATION * width_px;
        long.then_some(Stroke { centre, direction_rad, length_px, width_px, cut })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_strokes_are_found_on_uneven_ground() {
        let (width, height) = (200, 120);
        let values = (0..width * height).map(|index| {
            let (x, y) = (index % width, index / width);
            let ground = 0.5 + 0.2 * x as f32 / width as f32;
            let on = (40..44).contains(&y) && (30..130).contains(&x)
                || (150..153).contains(&x) && (20..100).contains(&y);
            if on { ground - 0.4 } else { ground }
        });
        let picture = Picture::new(width, height, values.collect()).unwrap();
        let found = strokes(&picture).unwrap();
        assert!(!found.bright);
        let [flat, steep] = found.list[..] else { panic!("{found:?}") };
        let (flat, steep) =
            if flat.direction_rad.abs() < 0.1 { (flat, steep) } else { (steep, flat) };
        assert!(flat.centre.distance(PixelPoint::new(79.5, 41.5)) < 0.01, "{flat:?}");
        assert!((flat.length_px - 100.0).abs() < 0.5 && (flat.width_px - 4.0).abs() < 0.1);
        assert!(steep.centre.distance(PixelPoint::new(151.0, 59.5)) < 0.01, "{steep:?}");
    }

    #[test]
    fn an_empty_sheet_has_no_contrast() {
        let picture = Picture::new(50, 50, vec![0.5; 2500]).unwrap();
        assert!(matches!(strokes(&picture), Err(DelayError::NoContrast { .. })));
    }
}
