//! Which row of a picture is which row of the pattern, by where they lie across.

use super::layout::Layout;

/// A row lies where it is expected to within this part of the distance of rows.
const ROW_GATE: f64 = 0.3;
/// Rows of the pattern and of the picture with which they may begin to agree.
const N_BEGIN: usize = 8;
/// Rows over which the scale is taken, and up to which all scales are tried.
const N_BACK: usize = 8;
const N_FEW: usize = 6;

/// A way to pair rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Pairing {
    /// Index into the picture's rows, and into the layout's.
    pub pairs: Vec<(usize, usize)>,
    /// Scale across, mm/px.
    pub mm_per_px: f64,
}

/// Ways to pair rows of the picture and the pattern in order.
///
/// * `found_px`: where the picture's rows lie across, in rising order
/// * `flip`: whether the pattern's run the other way
pub fn pairings(layout: &Layout, found_px: &[f64], flip: bool) -> Vec<Pairing> {
    let n_rows = layout.rows.len();
    let order = |index: usize| if flip { n_rows - 1 - index } else { index };
    let sign = if flip { -1.0 } else { 1.0 };
    let rows_mm: Vec<f64> =
        (0..n_rows).map(|index| sign * layout.rows[order(index)].across_mm).collect();
    let mut all: Vec<Pairing> = Vec::new();
    for scale in scales(&rows_mm, found_px) {
        for first_found in 0..found_px.len().min(N_BEGIN) {
            for first_row in 0..n_rows.min(N_BEGIN) {
                let begin = (first_found, first_row);
                let pairs = paired(&rows_mm, found_px, begin, scale, layout.pitch_mm());
                let (first, last) = (pairs[0], pairs[pairs.len() - 1]);
                let span_px = found_px[last.0] - found_px[first.0];
                let mm_per_px = (rows_mm[last.1] - rows_mm[first.1]) / span_px;
                let pairs = pairs.into_iter().map(|(found, row)| (found, order(row))).collect();
                if mm_per_px.is_finite() && !all.iter().any(|known| known.pairs == pairs) {
                    all.push(Pairing { pairs, mm_per_px });
                }
            }
        }
    }
    all
}

/// Most rows that agree with the pattern's, whichever way it lies.
pub fn n_agreeing(layout: &Layout, found_px: &[f64]) -> usize {
    let both = [false, true].into_iter().flat_map(|flip| pairings(layout, found_px, flip));
    both.map(|pairing| pairing.pairs.len()).max().unwrap_or(0)
}

/// Scales to begin with, mm/px: that of the usual distance of rows, and where rows are few all that
/// two of them can have.
fn scales(rows_mm: &[f64], found_px: &[f64]) -> Vec<f64> {
    let gaps = |places: &[f64]| {
        let mut gaps: Vec<f64> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps.sort_by(f64::total_cmp);
        gaps
    };
    let (gaps_mm, gaps_px) = (gaps(rows_mm), gaps(found_px));
    if gaps_mm.is_empty() || gaps_px.is_empty() {
        return Vec::new();
    }
    let mut scales = vec![gaps_mm[gaps_mm.len() / 2] / gaps_px[gaps_px.len() / 2]];
    if rows_mm.len() <= N_FEW && found_px.len() <= 2 * N_FEW {
        let longest_mm = rows_mm[rows_mm.len() - 1] - rows_mm[0];
        for (index, from) in found_px.iter().enumerate() {
            scales.extend(found_px[index + 1..].iter().map(|to| longest_mm / (to - from)));
        }
    }
    scales
}

/// Pairs rows in order from a first pair on, each with the nearest that is still free.
fn paired(
    rows_mm: &[f64],
    found_px: &[f64],
    begin: (usize, usize),
    mut scale: f64,
    pitch_mm: f64,
) -> Vec<(usize, usize)> {
    let mut pairs = vec![begin];
    for found in begin.0 + 1..found_px.len() {
        let (last_found, last_row) = pairs[pairs.len() - 1];
        let expected_mm = rows_mm[last_row] + (found_px[found] - found_px[last_found]) * scale;
        let off_mm = |index: usize| (rows_mm[index] - expected_mm).abs();
        let nearest = (last_row + 1..rows_mm.len())
            .take_while(|&index| rows_mm[index] < expected_mm + pitch_mm)
            .min_by(|&a, &b| off_mm(a).total_cmp(&off_mm(b)));
        let Some(row) = nearest.filter(|&row| off_mm(row) < ROW_GATE * pitch_mm) else {
            continue;
        };
        pairs.push((found, row));
        // Perspective changes the scale slowly.
        let back = pairs[pairs.len().saturating_sub(N_BACK)];
        scale = (rows_mm[row] - rows_mm[back.1]) / (found_px[found] - found_px[back.0]);
    }
    pairs
}
