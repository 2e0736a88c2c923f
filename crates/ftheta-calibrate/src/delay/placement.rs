//! Which stroke of a picture is which line of the pattern, whichever way the picture was taken.

use super::coarse::Coarse;
use super::error::DelayError;
use super::frame::{Found, Frame, main_direction};
use super::layout::Layout;
use super::pairing::{Pairing, n_agreeing, pairings};
use super::strokes::{Stroke, Strokes};
use ftheta_model::picture::PixelPoint;
use std::f64::consts::{FRAC_PI_2, PI};

/// Share of the pattern's lines that has to be found.
const FOUND_SHARE: f64 = 0.8;
/// Strokes along the lines beyond the pattern's, as a share of them and more, that are not
/// another pattern.
const EXTRA_SHARE: f64 = 0.25;
const N_EXTRA: f64 = 2.0;
/// Weight of a burned reference along the lines by that of all lines.
const REFERENCE: f64 = 0.12;
/// The best way leaves no more than this, px.
const LEFT_PX: f64 = 12.0;
/// Ways that leave no more than this agree with the picture, px.
const AGREES_PX: f64 = 4.0;
/// The right way to lay the pattern on the picture is better than any other by this factor.
const CLEARLY: f64 = 1.6;
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
    /// Whether it might as well be upside down, and only was taken for upright.
    pub upright_assumed: bool,
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
    let (n_found, direction) = main_direction(&strokes.list);
    if n_found < 2 {
        let (n_lines, n_strokes) = (layout.rows.len(), strokes.list.len());
        let limit = n_least(layout);
        return Err(DelayError::LinesMissing { n_found, n_lines, n_strokes, limit });
    }
    // A rectangle has about as many strokes along as across.
    let along = place_along(layout, &strokes.list, direction);
    along.or_else(|error| {
        place_along(layout, &strokes.list, direction + FRAC_PI_2).map_err(|_| error)
    })
}

/// Fewest rows that have to be found.
fn n_least(layout: &Layout) -> usize {
    (FOUND_SHARE * layout.rows.len() as f64).ceil() as usize
}

fn place_along(
    layout: &Layout,
    strokes: &[Stroke],
    direction: f64,
) -> Result<Placement, DelayError> {
    let frame = Frame::new(strokes, direction);
    let n_lines = layout.rows.len();
    let limit = n_least(layout);
    let n_found = frame.rows.len() + frame.n_beside;
    let most = n_lines as f64 * (1.0 + EXTRA_SHARE) + N_EXTRA;
    let n_columns = layout.columns_mm.len();
    let columns = n_columns > 0 && frame.columns.len() == n_columns;
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
        let n_agreeing = n_agreeing(layout, &frame.across_px());
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
    if !columns && n_columns > 0 {
        return Err(DelayError::References { n_found: frame.columns.len(), n_columns });
    }
    let (best, assumed) = frame.right_way(layout, &hypotheses)?;
    if best.mirrored {
        return Err(DelayError::Mirrored);
    }
    Ok(Placement { upright_assumed: assumed, ..frame.placement(layout, best, columns) })
}

impl Frame {
    /// The pattern laid on the frame one way; `None` if it does not fit.
    fn hypothesis(
        &self,
        layout: &Layout,
        flip: [bool; 2],
        columns: bool,
        limit: usize,
    ) -> Option<Hypothesis> {
        let candidates = pairings(layout, &self.across_px(), flip[1]);
        let most = candidates.iter().map(|pairing| pairing.pairs.len()).max()?;
        let fitting = candidates.into_iter().filter(|Pairing { pairs, .. }| {
            pairs.len() >= limit && pairs.len() + layout.rows.len() / 20 + 1 > most
        });
        // Turned by its direction the frame is a picture's: y down, so one flip makes it y up.
        let mirrored = flip[0] == flip[1];
        let judged = fitting.filter_map(|Pairing { pairs, mm_per_px }| {
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

    /// The way the pattern lies, the best of these, and whether that was only assumed.
    fn right_way<'a>(
        &self,
        layout: &Layout,
        hypotheses: &'a [Hypothesis],
    ) -> Result<(&'a Hypothesis, bool), DelayError> {
        let best = &hypotheses[0];
        let limit_px = CLEARLY * best.left_px.max(COARSE_PX);
        let Some(second) = hypotheses.get(1).filter(|second| second.left_px < limit_px) else {
            return Ok((best, false));
        };
        if best.left_px > AGREES_PX {
            return Err(DelayError::NotThePattern { n_lines: layout.rows.len() });
        }
        // A pattern without references looks the same either way as long as delays are small.
        let same = layout.columns_mm.is_empty() && layout.rows.iter().all(|r| r.process.is_some());
        let upright = |hypothesis: &&Hypothesis| !self.upside_down(layout, hypothesis.flip[0]);
        match [best, second].into_iter().find(upright) {
            Some(upright) if same => Ok((upright, true)),
            _ => {
                let (first_px, second_px) = (best.left_px, second.left_px);
                Err(DelayError::Orientation { first_px, second_px, limit_px })
            }
        }
    }

    fn across_px(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row.across_px).collect()
    }

    /// Whether the picture shows the pattern upside down.
    fn upside_down(&self, layout: &Layout, flip_along: bool) -> bool {
        // The pattern's own direction is along x or y, y up.
        let upright_rad = -layout.along.atan2();
        let off_rad = (self.turned(flip_along) - upright_rad + PI).rem_euclid(2.0 * PI) - PI;
        off_rad.abs() > 0.75 * PI
    }

    /// Direction in the picture in which the pattern's rows run, rad.
    fn turned(&self, flip_along: bool) -> f64 {
        self.direction_rad + if flip_along { PI } else { 0.0 }
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
        // References do not move, so together they weigh half as much as all lines.
        let weight = (0.5 * coarse.len() as f64 / layout.columns_mm.len().max(1) as f64).sqrt();
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
        Placement {
            rows: rows.collect(),
            columns: found.collect(),
            direction_rad: self.turned(flip_along),
            mm_per_px: best.mm_per_px,
            upside_down: self.upside_down(layout, flip_along),
            upright_assumed: false,
        }
    }
}
