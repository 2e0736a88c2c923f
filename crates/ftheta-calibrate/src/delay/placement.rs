//! Which stroke of a picture is which line of the pattern, whichever way the picture was taken.

use super::coarse::Coarse;
use super::error::DelayError;
use super::layout::Layout;
use super::strokes::{Stroke, Strokes};
use ftheta_model::picture::PixelPoint;
use std::f64::consts::{FRAC_PI_2, PI};

/// Strokes within this of the main direction run along it, within that of its normal across, rad.
const ALONG_RAD: f64 = 0.06;
const ACROSS_RAD: f64 = 0.12;
/// Steps in which the main direction is looked for, rad.
const DIRECTION_STEP_RAD: f64 = 0.01;
/// A row lies where it is expected to within this part of the distance of rows.
const ROW_GATE: f64 = 0.3;
/// Rows of the pattern and of the picture with which they may begin to agree.
const N_BEGIN: usize = 8;
/// Rows over which the scale is taken, and up to which all scales are tried.
const N_BACK: usize = 8;
const N_FEW: usize = 6;
/// Share of the pattern's lines that has to be found.
const FOUND_SHARE: f64 = 0.8;
/// Strokes along the lines beyond the pattern's, as a share of them and more, that are not
/// another pattern.
const EXTRA_SHARE: f64 = 0.25;
const N_EXTRA: f64 = 2.0;
/// Pieces of a line are no farther apart than this part of the longer one.
const GAP: f64 = 0.25;
/// Strokes of this part of each other's length are about as long.
const AS_LONG: f64 = 0.6;
/// Columns have to span this part of the rows' extent.
const COLUMN_LENGTH: f64 = 0.6;
/// Weight of a burned reference along the lines by that of all lines.
const REFERENCE: f64 = 0.05;
/// The best way leaves no more than this, px.
const LEFT_PX: f64 = 12.0;
/// Ways that leave no more than this agree with the picture, px.
const AGREES_PX: f64 = 4.0;
/// The right way to lay the pattern on the picture is better than any other by this factor.
const CLEARLY: f64 = 2.0;
/// Ways that leave up to so many times the least are about as good.
const ABOUT: f64 = 1.5;
/// What coarse ends leave at least, px: differences below it mean nothing.
const COARSE_PX: f64 = 1.0;

/// Where a line of the pattern is in the picture, coarsely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Index of the row in the layout.
    pub row: usize,
    /// Its ends, the one with the smaller place along the pattern first.
    pub ends: [PixelPoint; 2],
    /// Its width, px.
    pub width_px: f64,
}

/// A reference across the lines, coarsely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Where it is along the pattern, mm.
    pub along_mm: f64,
    /// Its ends in the picture.
    pub ends: [PixelPoint; 2],
}

/// How the pattern lies on the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Rows that were found.
    pub rows: Vec<Located>,
    /// Columns that were found: all of the pattern's, or none.
    pub columns: Vec<Column>,
    /// Direction in the picture in which the pattern's rows run, rad.
    pub direction_rad: f64,
    /// Scale, mm/px.
    pub mm_per_px: f64,
    /// Whether the picture shows the pattern upside down.
    pub upside_down: bool,
}

/// Strokes in one row.
#[derive(Clone, Copy, Debug)]
struct Found {
    across_px: f64,
    along_px: [f64; 2],
    width_px: f64,
}

/// The picture turned so that its strokes run along the first coordinate.
struct Frame {
    direction_rad: f64,
    rows: Vec<Found>,
    /// Strokes beside those of the rows, about as long.
    n_beside: usize,
    columns: Vec<Found>,
}

/// A way to lay the pattern on the picture.
#[derive(Clone, Debug)]
struct Hypothesis {
    /// Whether rising places along, and across, run against the frame.
    flip: [bool; 2],
    /// Index into the frame's rows and the layout's.
    pairs: Vec<(usize, usize)>,
    mm_per_px: f64,
    /// What is left of the coarse ends, px rms.
    left_px: f64,
    mirrored: bool,
}

/// Lays the pattern on the strokes of a picture.
///
/// # Errors
/// If it is not there, not as a whole, twice, or mirrored.
pub fn place(layout: &Layout, strokes: &Strokes) -> Result<Placement, DelayError> {
    let direction = main_direction(&strokes.list, layout)?;
    // A rectangle has about as many strokes along as across.
    let along = place_along(layout, &strokes.list, direction);
    along.or_else(|error| {
        place_along(layout, &strokes.list, direction + FRAC_PI_2).map_err(|_| error)
    })
}

fn place_along(
    layout: &Layout,
    strokes: &[Stroke],
    direction: f64,
) -> Result<Placement, DelayError> {
    let frame = Frame::new(strokes, direction);
    let n_lines = layout.rows.len();
    let limit = (FOUND_SHARE * n_lines as f64).ceil() as usize;
    let n_found = frame.rows.len() + frame.n_beside;
    let most = n_lines as f64 * (1.0 + EXTRA_SHARE) + N_EXTRA;
    let columns = !layout.columns_mm.is_empty() && frame.columns.len() == layout.columns_mm.len();
    let mut hypotheses: Vec<Hypothesis> = Vec::new();
    for flip in [[false, true], [true, false], [false, false], [true, true]] {
        if let Some(found) = frame.hypothesis(layout, flip, columns, limit) {
            hypotheses.push(found);
        }
    }
    // A picture is not mirrored unless references say so: without them it looks the same.
    if !columns {
        hypotheses.retain(|hypothesis| !hypothesis.mirrored);
    }
    hypotheses.sort_by(|a, b| a.left_px.total_cmp(&b.left_px));
    let Some(best) = hypotheses.first() else {
        let n_agreeing = frame.n_agreeing(layout);
        return Err(match n_agreeing < limit {
            true => {
                DelayError::LinesMissing { n_found: n_agreeing, n_lines, n_strokes: n_found, limit }
            }
            false => DelayError::NotThePattern { n_lines },
        });
    };
    if n_found as f64 > most {
        return Err(DelayError::TooManyLines { n_found, n_lines });
    }
    if best.left_px > LEFT_PX {
        return Err(DelayError::NotThePattern { n_lines });
    }
    if let Some(second) = hypotheses.get(1) {
        let (least, other) = (best.left_px.max(COARSE_PX), second.left_px.max(COARSE_PX));
        if other < CLEARLY * least && best.left_px > AGREES_PX {
            return Err(DelayError::NotThePattern { n_lines });
        }
        if other < CLEARLY * least {
            return Err(DelayError::Orientation {
                first_px: best.left_px,
                second_px: second.left_px,
            });
        }
    }
    if best.mirrored {
        return Err(DelayError::Mirrored);
    }
    Ok(frame.placement(layout, best, columns))
}

/// The angle between two directions of lines, rad, -π/2 to π/2.
fn between(a: f64, b: f64) -> f64 {
    (a - b + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2
}

/// The direction, rad, in which most strokes run.
fn main_direction(strokes: &[Stroke], layout: &Layout) -> Result<f64, DelayError> {
    let n_near = |direction: f64| {
        strokes.iter().filter(|s| between(s.direction_rad, direction).abs() < ALONG_RAD).count()
    };
    let n_steps = (PI / DIRECTION_STEP_RAD) as i32;
    let tried = (0..n_steps).map(|step| f64::from(step) * DIRECTION_STEP_RAD - FRAC_PI_2);
    // The first of the best, so that the result does not hang on rounding.
    let best = tried.map(|direction| (n_near(direction), direction));
    let best = best.fold((0, 0.0), |best, here| if here.0 > best.0 { here } else { best });
    if best.0 < 2 {
        return Err(DelayError::LinesMissing {
            n_found: best.0,
            n_lines: layout.rows.len(),
            n_strokes: strokes.len(),
            limit: (FOUND_SHARE * layout.rows.len() as f64).ceil() as usize,
        });
    }
    Ok(best.1)
}

impl Frame {
    fn new(strokes: &[Stroke], direction: f64) -> Self {
        let near = strokes.iter().filter(|s| between(s.direction_rad, direction).abs() < ALONG_RAD);
        let weighed =
            near.map(|s| (s.length_px, s.length_px * between(s.direction_rad, direction)));
        let (weight, sum) = weighed.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        let mut direction_rad = direction + if weight > 0.0 { sum / weight } else { 0.0 };
        // To the right, as pictures are mostly taken; down where it is steep.
        if direction_rad > FRAC_PI_2 {
            direction_rad -= PI;
        }
        let (sin, cos) = direction_rad.sin_cos();
        let turned = |s: &Stroke| {
            let PixelPoint { x_px, y_px } = s.centre;
            let [along, across] = [cos * x_px + sin * y_px, cos * y_px - sin * x_px];
            let half = 0.5 * s.length_px;
            Found {
                across_px: across,
                along_px: [along - half, along + half],
                width_px: s.width_px,
            }
        };
        let of = |direction: f64, limit: f64| {
            move |s: &&Stroke| between(s.direction_rad, direction).abs() < limit
        };
        let rows: Vec<_> =
            strokes.iter().filter(of(direction_rad, ALONG_RAD)).map(turned).collect();
        let across = strokes.iter().filter(of(direction_rad + FRAC_PI_2, ACROSS_RAD));
        let columns: Vec<_> = across
            .map(|s| {
                let found = turned(s);
                let middle = 0.5 * (found.along_px[0] + found.along_px[1]);
                let half = 0.5 * s.length_px;
                let along_px = [found.across_px - half, found.across_px + half];
                Found { across_px: middle, along_px, width_px: s.width_px }
            })
            .collect();
        let (rows, n_beside) = in_rows(rows);
        let span = match rows[..] {
            [first, .., last] => last.across_px - first.across_px,
            _ => 0.0,
        };
        let (mut columns, _) = in_rows(columns);
        columns.retain(|column| column.length_px() > COLUMN_LENGTH * span);
        Self { direction_rad, rows, n_beside, columns }
    }

    /// The pattern laid on the frame one way; `None` if it does not fit.
    fn hypothesis(
        &self,
        layout: &Layout,
        flip: [bool; 2],
        columns: bool,
        limit: usize,
    ) -> Option<Hypothesis> {
        let candidates = self.pairings(layout, flip[1]);
        let most = candidates.iter().map(|(pairs, _)| pairs.len()).max()?;
        let fitting = candidates.into_iter().filter(|(pairs, _)| {
            pairs.len() >= limit && pairs.len() + layout.rows.len() / 20 + 1 > most
        });
        // Turned by its direction the frame is a picture's: y down, so one flip makes it y up.
        let mirrored = flip[0] == flip[1];
        let judged = fitting.filter_map(|(pairs, mm_per_px)| {
            let mut found = Hypothesis { flip, pairs, mm_per_px, left_px: 0.0, mirrored };
            found.left_px = self.left_px(layout, &found, columns)?;
            Some(found)
        });
        let mut judged: Vec<Hypothesis> = judged.collect();
        let least = judged.iter().map(|found| found.left_px).fold(f64::INFINITY, f64::min);
        // Fewer lines leave less; among ways that leave about as much, more lines are better.
        judged.retain(|found| found.left_px <= ABOUT * least.max(COARSE_PX));
        judged
            .into_iter()
            .max_by(|a, b| a.pairs.len().cmp(&b.pairs.len()).then(b.left_px.total_cmp(&a.left_px)))
    }

    /// Ways to pair rows of the picture and the pattern in order, each with its scale.
    fn pairings(&self, layout: &Layout, flip: bool) -> Vec<(Vec<(usize, usize)>, f64)> {
        let n_rows = layout.rows.len();
        let order = |index: usize| if flip { n_rows - 1 - index } else { index };
        let sign = if flip { -1.0 } else { 1.0 };
        let rows_mm: Vec<f64> =
            (0..n_rows).map(|index| sign * layout.rows[order(index)].across_mm).collect();
        let found_px: Vec<f64> = self.rows.iter().map(|row| row.across_px).collect();
        let mut all: Vec<(Vec<(usize, usize)>, f64)> = Vec::new();
        for scale in scales(&rows_mm, &found_px) {
            for first_found in 0..found_px.len().min(N_BEGIN) {
                for first_row in 0..n_rows.min(N_BEGIN) {
                    let begin = (first_found, first_row);
                    let pairs = paired(&rows_mm, &found_px, begin, scale, layout.pitch_mm());
                    let (first, last) = (pairs[0], pairs[pairs.len() - 1]);
                    let span_px = found_px[last.0] - found_px[first.0];
                    let scale = (rows_mm[last.1] - rows_mm[first.1]) / span_px;
                    let pairs = pairs.into_iter().map(|(found, row)| (found, order(row))).collect();
                    if scale.is_finite() && !all.iter().any(|(known, _)| *known == pairs) {
                        all.push((pairs, scale));
                    }
                }
            }
        }
        all
    }

    /// Most rows that agree with the pattern's, whichever way it lies.
    fn n_agreeing(&self, layout: &Layout) -> usize {
        let both = [false, true].into_iter().flat_map(|flip| self.pairings(layout, flip));
        both.map(|(pairs, _)| pairs.len()).max().unwrap_or(0)
    }

    /// What is left of coarse ends, px rms, when delays, growth and the view are fitted.
    fn left_px(&self, layout: &Layout, hypothesis: &Hypothesis, columns: bool) -> Option<f64> {
        let sign = if hypothesis.flip[0] { -1.0 } else { 1.0 };
        let scale = hypothesis.mm_per_px;
        let top = layout.rows.iter().filter_map(|row| row.process.map(|p| p.speed_mm_s));
        let fastest = top.fold(0.0, f64::max);
        let mut coarse = Coarse::new(scale);
        // What does not move counts more than what does.
        let reference = (REFERENCE * hypothesis.pairs.len() as f64).sqrt();
        for &(found, row) in &hypothesis.pairs {
            let row = &layout.rows[row];
            let [a, b] = self.rows[found].along_px.map(|along_px| sign * along_px * scale);
            let (low, high) = (a.min(b), a.max(b));
            let sense = row.sense();
            let ends = if sense > 0.0 { [low, high] } else { [high, low] };
            for (index, end) in ends.into_iter().enumerate() {
                let known = [row.ends_mm[index], row.across_mm];
                let late = row.process.map_or(0.0, |process| sense * process.speed_mm_s / fastest);
                let delays = if index == 0 { [late, 0.0] } else { [0.0, late] };
                let growth = if index == 0 { -sense } else { sense };
                let weight = if row.process.is_none() { reference } else { 1.0 };
                coarse.add(weight, known, [delays[0], delays[1], growth], end);
            }
        }
        // References do not move, so they weigh as much as all lines together.
        let weight = (coarse.len() as f64).sqrt();
        if columns {
            let found = self.columns.iter().map(|column| sign * column.across_px * scale);
            let mut found: Vec<f64> = found.collect();
            found.sort_by(f64::total_cmp);
            let (first, last) = (&layout.rows[0], &layout.rows[layout.rows.len() - 1]);
            let middle_mm = 0.5 * (first.across_mm + last.across_mm);
            for (&found, &known) in found.iter().zip(&layout.columns_mm) {
                coarse.add(weight, [known, middle_mm], [0.0; 3], found);
            }
        }
        for (index, row) in layout.rows.iter().enumerate() {
            if !hypothesis.pairs.iter().any(|&(_, paired)| paired == index) {
                coarse.add_unseen(if row.process.is_none() { reference } else { 1.0 });
            }
        }
        coarse.left_px()
    }

    fn placement(&self, layout: &Layout, best: &Hypothesis, columns: bool) -> Placement {
        let (sin, cos) = self.direction_rad.sin_cos();
        let pixel = |along: f64, across: f64| {
            PixelPoint::new(cos * along - sin * across, sin * along + cos * across)
        };
        let ordered = |[a, b]: [PixelPoint; 2], flip: bool| if flip { [b, a] } else { [a, b] };
        let [flip_along, flip_across] = best.flip;
        let rows = best.pairs.iter().map(|&(found, row)| {
            let Found { across_px, along_px, width_px } = self.rows[found];
            let ends = along_px.map(|along_px| pixel(along_px, across_px));
            Located { row, ends: ordered(ends, flip_along), width_px }
        });
        let known = |index: usize| match flip_along {
            true => layout.columns_mm[layout.columns_mm.len() - 1 - index],
            false => layout.columns_mm[index],
        };
        let found = self.columns.iter().enumerate().filter(|_| columns);
        let found = found.map(|(index, column)| {
            let ends = column.along_px.map(|across_px| pixel(column.across_px, across_px));
            Column { along_mm: known(index), ends: ordered(ends, flip_across) }
        });
        let turn = if flip_along { PI } else { 0.0 };
        let direction_rad = self.direction_rad + turn;
        // The pattern's own direction is along x or y, y up.
        let upright_rad = -layout.along.atan2();
        let off_rad = (direction_rad - upright_rad + PI).rem_euclid(2.0 * PI) - PI;
        Placement {
            rows: rows.collect(),
            columns: found.collect(),
            direction_rad,
            mm_per_px: best.mm_per_px,
            upside_down: off_rad.abs() > 0.75 * PI,
        }
    }
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

/// Joins what lies in one row, and counts what stands beside, about as long.
fn in_rows(mut found: Vec<Found>) -> (Vec<Found>, usize) {
    let mut n_beside = 0;
    found.sort_by(|a, b| a.across_px.total_cmp(&b.across_px));
    let mut rows: Vec<Found> = Vec::new();
    for piece in found {
        if let Some(row) = rows.last_mut()
            && piece.across_px - row.across_px < row.width_px.max(piece.width_px)
        {
            // Beside a line stands lettering, which is no part of it.
            let gap =
                (piece.along_px[0] - row.along_px[1]).max(row.along_px[0] - piece.along_px[1]);
            let longer = piece.length_px() > row.length_px();
            let [short, long] = [row.length_px(), piece.length_px()];
            let (short, long) = (short.min(long), short.max(long));
            if gap > GAP * long {
                n_beside += usize::from(short > AS_LONG * long);
                if longer {
                    *row = piece;
                }
                continue;
            }
            if longer {
                (row.across_px, row.width_px) = (piece.across_px, piece.width_px);
            }
            row.along_px =
                [row.along_px[0].min(piece.along_px[0]), row.along_px[1].max(piece.along_px[1])];
            continue;
        }
        rows.push(piece);
    }
    (rows, n_beside)
}

impl Found {
    fn length_px(&self) -> f64 {
        self.along_px[1] - self.along_px[0]
    }
}
