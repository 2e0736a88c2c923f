//! Lays a job out as a toolpath: strokes and hatches within the field, in order.

use crate::clip::{cut_curve, cut_line, first_outside};
use crate::error::LayError;
use crate::hatch::hatch_runs;
use crate::order::{self, Stop};
use crate::subpath::{Subpath, flattened, subpaths};
use crate::unit::Unit;
use ftheta_model::job::{FillRule, Job, Paint, Shape};
use ftheta_model::recipe::{Hatch, Pen};
use ftheta_model::toolpath::{Mark, Toolpath};
use ftheta_model::warning::{Imported, Warning};
use kurbo::{BezPath, Line, PathEl, Point};

/// Most marks of a toolpath; one takes some 300 bytes.
const N_MARKS_MAX: u64 = 5_000_000;
/// Least spacing of hatch lines, mm.
const SPACING_MIN_MM: f64 = 1e-3;
/// Least flattening tolerance, mm.
const TOLERANCE_MIN_MM: f64 = 1e-6;

/// How a job is laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct LayOptions {
    /// Greatest distance of a flattened curve from the true one, mm.
    pub flatten_tolerance_mm: f64,
    /// The order of the marks of one pen.
    pub order: Order,
    /// Half the side of the square field, mm.
    pub half_field_mm: f64,
    /// Cut marks at the edge of the field instead of refusing them.
    pub clip: bool,
    /// Places that the search for a short way may look at or move; a second does some 5·10⁸.
    pub moves_budget: u64,
}

/// The order of the marks of one pen; pens always follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Short jumps; marks may be reversed and contours start anywhere, inner contours first.
    Shortest,
    /// As the drawing has them, in its directions.
    Keep,
}

impl Default for LayOptions {
    /// 2 µm, shortest, ±60 mm, no clipping, 500 million places.
    fn default() -> Self {
        Self {
            flatten_tolerance_mm: 0.002,
            order: Order::Shortest,
            half_field_mm: 60.0,
            clip: false,
            moves_budget: 500_000_000,
        }
    }
}

/// Lays a job out as marks in the order in which they are made.
///
/// Pens follow each other and are never mixed. Areas become hatch lines; hatch lines of one
/// connected part go to and fro. Passes follow each other directly; with [`Order::Shortest`] every
/// second pass of an open mark goes backwards.
///
/// # Errors
/// A mark outside the field (without `clip`), too many marks, a missing pen, a coordinate that is
/// not finite, a spacing or tolerance too small.
///
/// # Limits
/// The short way is an improved greedy one, typically 6 % longer than the shortest there is. It is
/// never longer than the drawing's own order, unless that marks an outer contour first.
pub fn lay(job: &Job, options: &LayOptions) -> Result<Imported<Toolpath>, LayError> {
    at_least("flatten_tolerance_mm", options.flatten_tolerance_mm, TOLERANCE_MIN_MM)?;
    let mut layout = Layout {
        options,
        units: vec![Vec::new(); job.pens.len()],
        warned: vec![false; job.pens.len()],
        warnings: Vec::new(),
        n_marks: 0,
    };
    let mut shapes = job.shapes().peekable();
    while let Some(shape) = shapes.next() {
        let stroked = shapes.peek().is_some_and(|next| strokes_outline(next, shape));
        let pen = job.pens.get(shape.pen_index).ok_or(LayError::PenMissing {
            place: shape.source.clone(),
            pen_index: shape.pen_index,
            n_pens: job.pens.len(),
        })?;
        if !shape.path.is_finite() {
            return Err(LayError::NotFinite { place: shape.source.clone() });
        }
        match (shape.paint, &pen.hatch) {
            (Paint::Stroke, _) => layout.add_outline(shape, pen)?,
            (Paint::Fill(rule), Some(hatch)) => {
                let outline = hatch.outline && !stroked;
                layout.add_hatch(shape, pen, rule, &Hatch { outline, ..*hatch })?;
            }
            (Paint::Fill(_), None) if stroked => {}
            (Paint::Fill(_), None) => {
                layout.warn_no_hatch(shape.pen_index, pen);
                layout.add_outline(shape, pen)?;
            }
        }
    }
    let Layout { units, warnings, .. } = layout;
    Ok(Imported {
        value: Toolpath { pens: job.pens.clone(), marks: in_order(units, options) },
        warnings,
    })
}

/// Whether `next` marks the outline of the area `shape`, so that it is not to be marked twice.
fn strokes_outline(next: &Shape, shape: &Shape) -> bool {
    next.paint == Paint::Stroke && next.source == shape.source && next.path == shape.path
}

/// What has been laid so far.
struct Layout<'a> {
    options: &'a LayOptions,
    /// Per pen, in the order of the drawing.
    units: Vec<Vec<Unit>>,
    /// Per pen: whether a warning about its missing hatch was given.
    warned: Vec<bool>,
    warnings: Vec<Warning>,
    n_marks: u64,
}

impl Layout<'_> {
    fn add_outline(&mut self, shape: &Shape, pen: &Pen) -> Result<(), LayError> {
        let fill = shape.paint != Paint::Stroke;
        let (curves, n_empty) = subpaths(&shape.path, fill);
        if n_empty > 0 {
            let message = format!("{n_empty} part(s) without length left out");
            self.warnings.push(Warning::new(&shape.source, message));
        }
        let half_mm = self.options.half_field_mm;
        let (mut n_cut, mut n_dropped) = (0, 0);
        for curve in curves {
            let points = flattened(&curve.curve, self.options.flatten_tolerance_mm);
            if !self.options.clip {
                self.check_field(shape, &points)?;
                self.add_mark(shape, pen, curve, points)?;
                continue;
            }
            let n_before = curve.curve.elements().len();
            let was_closed = curve.closed;
            let parts = cut_curve(curve, half_mm);
            match &parts[..] {
                [] => n_dropped += 1,
                [part] if part.closed == was_closed && part.curve.elements().len() == n_before => {}
                _ => n_cut += 1,
            }
            for part in parts {
                let points = flattened(&part.curve, self.options.flatten_tolerance_mm);
                self.add_mark(shape, pen, part, points)?;
            }
        }
        self.warn_clipped(shape, n_cut, n_dropped, "curve");
        Ok(())
    }

    fn add_mark(
        &mut self,
        shape: &Shape,
        pen: &Pen,
        part: Subpath,
        points: Vec<Point>,
    ) -> Result<(), LayError> {
        if points.len() < 2 {
            return Ok(());
        }
        self.count(shape, u64::from(pen.n_passes.max(1)))?;
        self.units[shape.pen_index].push(Unit {
            marks: vec![Mark {
                curve: part.curve,
                points,
                closed: part.closed,
                pen_index: shape.pen_index,
                source: shape.source.clone(),
            }],
            n_passes: pen.n_passes.max(1),
        });
        Ok(())
    }

    fn add_hatch(
        &mut self,
        shape: &Shape,
        pen: &Pen,
        rule: FillRule,
        hatch: &Hatch,
    ) -> Result<(), LayError> {
        let place = format!("hatch spacing of pen {}", pen.name);
        at_least(&place, hatch.spacing_mm, SPACING_MIN_MM)?;
        let contours: Vec<Vec<Point>> = subpaths(&shape.path, true)
            .0
            .iter()
            .map(|part| flattened(&part.curve, self.options.flatten_tolerance_mm))
            .collect();
        if !self.options.clip {
            for points in &contours {
                self.check_field(shape, points)?;
            }
        }
        let n_passes = pen.n_passes.max(1);
        let half_mm = self.options.half_field_mm;
        let n_max = N_MARKS_MAX.saturating_sub(self.n_marks) / u64::from(n_passes);
        let reach_mm = 1.5 * half_mm;
        let runs = hatch_runs(&contours, rule, hatch, reach_mm, n_max);
        let runs = runs.map_err(|too_many| LayError::TooManyMarks {
            place: shape.source.clone(),
            n_marks: self.n_marks + too_many.0 * u64::from(n_passes),
            n_marks_max: N_MARKS_MAX,
        })?;
        let (mut n_cut, mut n_dropped) = (0, 0);
        for run in runs {
            let mut marks = Vec::with_capacity(run.len());
            for line in run {
                let kept = match self.options.clip {
                    true => cut_line(line, half_mm),
                    false => Some(line),
                };
                n_cut += usize::from(kept.is_some_and(|kept| kept != line));
                n_dropped += usize::from(kept.is_none());
                marks.extend(kept.map(|line| line_mark(line, shape)));
            }
            if !marks.is_empty() {
                self.count(shape, marks.len() as u64 * u64::from(n_passes))?;
                self.units[shape.pen_index].push(Unit { marks, n_passes });
            }
        }
        self.warn_clipped(shape, n_cut, n_dropped, "hatch line");
        if hatch.outline {
            self.add_outline(shape, pen)?;
        }
        Ok(())
    }

    fn check_field(&self, shape: &Shape, points: &[Point]) -> Result<(), LayError> {
        match first_outside(points, self.options.half_field_mm) {
            Some(p) => Err(LayError::OutsideField {
                place: shape.source.clone(),
                x_mm: p.x,
                y_mm: p.y,
                half_field_mm: self.options.half_field_mm,
            }),
            None => Ok(()),
        }
    }

    fn count(&mut self, shape: &Shape, n_marks: u64) -> Result<(), LayError> {
        self.n_marks += n_marks;
        if self.n_marks <= N_MARKS_MAX {
            return Ok(());
        }
        Err(LayError::TooManyMarks {
            place: shape.source.clone(),
            n_marks: self.n_marks,
            n_marks_max: N_MARKS_MAX,
        })
    }

    fn warn_no_hatch(&mut self, pen_index: usize, pen: &Pen) {
        if !self.warned[pen_index] {
            self.warned[pen_index] = true;
            self.warnings.push(Warning::new(
                format!("pen {}", pen.name),
                "no hatch is set, so filled areas are marked along their outline",
            ));
        }
    }

    fn warn_clipped(&mut self, shape: &Shape, n_cut: usize, n_dropped: usize, what: &str) {
        if n_cut + n_dropped > 0 {
            let message = format!(
                "outside the field: {n_cut} {what}(s) cut at its edge, {n_dropped} left out"
            );
            self.warnings.push(Warning::new(&shape.source, message));
        }
    }
}

fn line_mark(line: Line, shape: &Shape) -> Mark {
    Mark {
        curve: BezPath::from_vec(vec![PathEl::MoveTo(line.p0), PathEl::LineTo(line.p1)]),
        points: vec![line.p0, line.p1],
        closed: false,
        pen_index: shape.pen_index,
        source: shape.source.clone(),
    }
}

fn at_least(place: &str, value_mm: f64, limit_mm: f64) -> Result<(), LayError> {
    // A value that is not a number fails too.
    if value_mm >= limit_mm && value_mm.is_finite() {
        return Ok(());
    }
    Err(LayError::TooSmall { place: place.into(), value_mm, limit_mm })
}

fn in_order(units: Vec<Vec<Unit>>, options: &LayOptions) -> Vec<Mark> {
    let shortest = options.order == Order::Shortest;
    let stops = if shortest {
        short_stops(&units, options.moves_budget)
    } else {
        units.iter().map(|units| order::kept(units)).collect()
    };
    let mut marks = Vec::new();
    for (units, stops) in units.into_iter().zip(stops) {
        let mut units: Vec<Option<Unit>> = units.into_iter().map(Some).collect();
        for stop in stops {
            if let Some(unit) = units[stop.unit_index].take() {
                marks.extend(unit.into_marks(
                    stop.pose_index,
                    shortest,
                    options.flatten_tolerance_mm,
                ));
            }
        }
    }
    marks
}

fn short_stops(units: &[Vec<Unit>], mut moves_left: u64) -> Vec<Vec<Stop>> {
    let mut from = Point::ZERO;
    let mut found = Vec::new();
    for units in units {
        let stops = order::shortest(units, from, &mut moves_left);
        if let Some(last) = stops.last() {
            from = units[last.unit_index].pose(last.pose_index).exit;
        }
        found.push(stops);
    }
    let kept: Vec<Vec<Stop>> = units.iter().map(|units| order::kept(units)).collect();
    // The greedy start can lose against a drawing that is well ordered already.
    let allowed =
        || units.iter().zip(&kept).all(|(units, stops)| order::respects_nesting(units, stops));
    if jump_length_mm(units, &kept) < jump_length_mm(units, &found) && allowed() {
        return kept;
    }
    found
}

fn jump_length_mm(units: &[Vec<Unit>], stops: &[Vec<Stop>]) -> f64 {
    let mut length_mm = 0.0;
    let mut from: Option<Point> = None;
    for (units, stops) in units.iter().zip(stops) {
        let (Some(first), Some(last)) = (stops.first(), stops.last()) else {
            continue;
        };
        let end_of = |stop: &Stop| units[stop.unit_index].pose(stop.pose_index);
        length_mm += from.map_or(0.0, |from| from.distance(end_of(first).entry));
        length_mm += order::jump_length_mm(units, stops);
        from = Some(end_of(last).exit);
    }
    length_mm
}
