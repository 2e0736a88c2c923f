//! Areas filled with parallel lines: a scanline sweep in the lines' own frame.

use ftheta_model::job::FillRule;
use ftheta_model::recipe::Hatch;
use kurbo::{Affine, Line, Point};

/// Gaps shorter than this are none, mm.
const GAP_MM: f64 = 1e-9;

/// More lines than there may be; holds how many there are at least.
#[derive(Debug)]
pub struct TooManyLines(pub u64);

/// One piece of a scanline, in the lines' frame.
#[derive(Clone, Copy)]
struct Piece {
    lo_mm: f64,
    hi_mm: f64,
    run_index: usize,
}

/// An edge of the outline that some scanline crosses, in the lines' frame.
#[derive(Clone, Copy)]
struct Edge {
    /// First line crossed, and the one after the last.
    lines: (i64, i64),
    /// x = at_mm + slope · y.
    at_mm: f64,
    slope: f64,
    winding: i32,
    /// Where it crosses the present line.
    x_mm: f64,
}

/// Hatch lines of an area, in runs.
///
/// A run is a part of the area in which every line has one piece that overlaps the next; within it
/// the lines go to and fro. Lines lie on a grid fixed in the field, half a spacing off its centre,
/// so that neighbouring areas line up. Pieces shorter than a quarter of the spacing are left out.
///
/// * `contours`: closed polygons, first point not repeated, mm
/// * `reach_mm`: lines farther than this from the field's centre are left out
/// * `n_max`: most lines there may be
///
/// # Accuracy
/// Exact for polygons. O((edges + crossings) log) time.
pub fn hatch_runs(
    contours: &[Vec<Point>],
    rule: FillRule,
    hatch: &Hatch,
    reach_mm: f64,
    n_max: u64,
) -> Result<Vec<Vec<Line>>, TooManyLines> {
    let turn = Affine::rotate(-hatch.angle_deg.to_radians());
    let back = turn.inverse();
    let reach = (reach_mm / hatch.spacing_mm).ceil() as i64 + 1;
    let mut edges = edges_of(contours, turn, hatch.spacing_mm, reach);
    edges.sort_by_key(|edge| edge.lines.0);
    let mut waiting = edges.into_iter().peekable();
    let mut active: Vec<Edge> = Vec::new();
    let mut runs: Vec<Vec<Line>> = Vec::new();
    let mut before: Vec<Piece> = Vec::new();
    let mut n_lines = 0;
    let mut line = i64::MIN;
    loop {
        line = line.saturating_add(1);
        active.retain(|edge| edge.lines.1 > line);
        if active.is_empty() {
            let Some(next) = waiting.peek() else { break };
            if next.lines.0 > line {
                line = next.lines.0;
                before.clear();
            }
        }
        while let Some(edge) = waiting.next_if(|edge| edge.lines.0 <= line) {
            active.push(edge);
        }
        let y_mm = (line as f64 + 0.5) * hatch.spacing_mm;
        for edge in &mut active {
            edge.x_mm = edge.at_mm + edge.slope * y_mm;
        }
        // Nearly sorted from the line before, which this sort makes use of.
        active.sort_by(|a, b| a.x_mm.total_cmp(&b.x_mm));
        let mut pieces = pieces_of(&active, rule, 0.25 * hatch.spacing_mm);
        join_runs(&before, &mut pieces, &mut runs);
        n_lines += pieces.len() as u64;
        if n_lines > n_max {
            return Err(TooManyLines(n_lines));
        }
        for piece in &pieces {
            let ends = [piece.lo_mm, piece.hi_mm].map(|x_mm| back * Point::new(x_mm, y_mm));
            runs[piece.run_index].push(if line.rem_euclid(2) == 0 {
                Line::new(ends[0], ends[1])
            } else {
                Line::new(ends[1], ends[0])
            });
        }
        before = pieces;
    }
    Ok(runs)
}

fn edges_of(contours: &[Vec<Point>], turn: Affine, spacing_mm: f64, reach: i64) -> Vec<Edge> {
    let mut edges = Vec::new();
    // The first line at or above y: both edges at a vertex agree, so none is missed or doubled.
    let line_at = |y_mm: f64| {
        let line = (y_mm / spacing_mm - 0.5).ceil();
        line.clamp(-reach as f64, reach as f64) as i64
    };
    for contour in contours {
        let turned: Vec<Point> = contour.iter().map(|&p| turn * p).collect();
        for (i, &a) in turned.iter().enumerate() {
            let b = turned[(i + 1) % turned.len()];
            let (low, high, winding) = if a.y < b.y { (a, b, 1) } else { (b, a, -1) };
            let lines = (line_at(low.y), line_at(high.y));
            if lines.0 < lines.1 {
                let slope = (high.x - low.x) / (high.y - low.y);
                edges.push(Edge { lines, at_mm: low.x - slope * low.y, slope, winding, x_mm: 0.0 });
            }
        }
    }
    edges
}

fn pieces_of(active: &[Edge], rule: FillRule, shortest_mm: f64) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut winding = 0;
    let is_inside = |winding: i32| match rule {
        FillRule::NonZero => winding != 0,
        FillRule::EvenOdd => winding % 2 != 0,
    };
    for edge in active {
        let was_inside = is_inside(winding);
        winding += edge.winding;
        match (was_inside, is_inside(winding)) {
            (false, true) => match pieces.last_mut() {
                Some(last) if edge.x_mm - last.hi_mm < GAP_MM => {}
                _ => pieces.push(Piece { lo_mm: edge.x_mm, hi_mm: edge.x_mm, run_index: 0 }),
            },
            (true, false) => {
                if let Some(last) = pieces.last_mut() {
                    last.hi_mm = edge.x_mm;
                }
            }
            _ => {}
        }
    }
    pieces.retain(|piece| piece.hi_mm - piece.lo_mm >= shortest_mm);
    pieces
}

/// Puts each piece into the run of the one piece it overlaps on the line before, or a new one.
fn join_runs(before: &[Piece], pieces: &mut [Piece], runs: &mut Vec<Vec<Line>>) {
    let mut n_after = vec![0; before.len()];
    let mut n_before = vec![0; pieces.len()];
    let mut joins = vec![0; pieces.len()];
    let (mut i, mut j) = (0, 0);
    while i < before.len() && j < pieces.len() {
        let (a, b) = (before[i], pieces[j]);
        if a.lo_mm < b.hi_mm && b.lo_mm < a.hi_mm {
            n_after[i] += 1;
            n_before[j] += 1;
            joins[j] = i;
        }
        if a.hi_mm < b.hi_mm {
            i += 1;
        } else {
            j += 1;
        }
    }
    for (j, piece) in pieces.iter_mut().enumerate() {
        piece.run_index = if n_before[j] == 1 && n_after[joins[j]] == 1 {
            before[joins[j]].run_index
        } else {
            runs.push(Vec::new());
            runs.len() - 1
        };
    }
}
