//! The grid of a pattern, and how a camera sees it.

use super::candidates::Shape;
use super::error::PictureError;
use super::lattice::{Lattice, extent};
use crate::raster::strip::Strip;
use ftheta_model::pattern::{MarkStyle, Pattern};
use ftheta_model::picture::{Picture, PixelPoint};
use ftheta_model::space::FieldPoint;
use ftheta_physics::camera::{Seen, View};
use std::collections::HashMap;

/// Marks lie in their row and column to this part of the pitch.
const IN_LINE: f64 = 0.2;
/// Share of the marks that has to be found.
const MARKS_SHARE: f64 = 0.7;
/// Marks at which the width of lines is looked at.
const N_WIDTHS: usize = 40;

/// A grid of marks.
#[derive(Clone, Debug)]
pub struct Grid {
    /// All marks, in the pattern's order.
    pub marks: Vec<GridPlace>,
    style: MarkStyle,
    size_mm: f64,
    /// Columns and rows.
    size: [usize; 2],
    /// From a column to the next, and from a row to the next, mm.
    pitch_mm: [f64; 2],
    /// Where the first column and row lie, mm.
    first_mm: [f64; 2],
}

/// A mark.
#[derive(Clone, Debug)]
pub struct GridPlace {
    /// Its name.
    pub id: String,
    /// Where it should be, mm.
    pub place_mm: FieldPoint,
    /// Column and row.
    index: (i32, i32),
}

impl Grid {
    /// The grid of a pattern.
    ///
    /// # Errors
    /// If it has no marks, or they are not in rows and columns.
    pub fn new(pattern: &Pattern) -> Result<Self, PictureError> {
        let none = || PictureError::NoMarks { kind: pattern.kind.clone() };
        let (_, first) = pattern.marks().next().ok_or_else(none)?;
        let (style, size_mm) = (first.style, first.size_mm);
        let marks: Vec<GridPlace> = pattern
            .marks()
            .map(|(id, mark)| GridPlace {
                id: id.to_owned(),
                place_mm: mark.place_mm,
                index: (mark.column as i32, mark.row as i32),
            })
            .collect();
        let span = |of: fn(&GridPlace) -> f64, at: fn(&GridPlace) -> i32| {
            let low = marks.iter().min_by_key(|mark| at(mark)).map_or(0.0, of);
            let high = marks.iter().max_by_key(|mark| at(mark)).map_or(0.0, of);
            let most = marks.iter().map(at).max().unwrap_or(0);
            (low, (high - low) / f64::from(most.max(1)), most as usize + 1)
        };
        let (x_mm, x_pitch, columns) = span(|mark| mark.place_mm.x_mm, |mark| mark.index.0);
        let (y_mm, y_pitch, rows) = span(|mark| mark.place_mm.y_mm, |mark| mark.index.1);
        let grid = Self {
            style,
            size_mm,
            size: [columns, rows],
            pitch_mm: [x_pitch, y_pitch],
            first_mm: [x_mm, y_mm],
            marks,
        };
        let mut known = HashMap::new();
        for mark in &grid.marks {
            let nominal = grid.nominal(mark.index);
            let off = [mark.place_mm.x_mm - nominal.x_mm, mark.place_mm.y_mm - nominal.y_mm];
            let far = (0..2).any(|axis| off[axis].abs() > IN_LINE * grid.pitch_mm[axis].abs());
            if far || known.insert(mark.index, ()).is_some() {
                return Err(PictureError::NotAGrid { id: mark.id.clone() });
            }
        }
        let plain = columns > 1 && rows > 1 && x_pitch > 0.0 && y_pitch > 0.0 && size_mm > 0.0;
        plain.then_some(grid).ok_or_else(none)
    }

    fn nominal(&self, (column, row): (i32, i32)) -> FieldPoint {
        let at =
            |axis: usize, index: i32| self.first_mm[axis] + f64::from(index) * self.pitch_mm[axis];
        FieldPoint::new(at(0, column), at(1, row))
    }

    /// How many marks there are.
    pub fn n_marks(&self) -> usize {
        self.marks.len()
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Fewest marks that have to be found.
    pub fn n_least(&self) -> usize {
        (MARKS_SHARE * self.n_marks() as f64).ceil() as usize
    }

    /// That there are too few.
    pub fn few(&self, n_found: usize) -> PictureError {
        PictureError::FewMarks { n_found, n_marks: self.n_marks(), limit: self.n_least() }
    }

    /// What they are.
    pub fn style(&self) -> MarkStyle {
        self.style
    }

    /// Their size, mm.
    pub fn size_mm(&self) -> f64 {
        self.size_mm
    }

    /// How a mark would look at a pixel; `None` beyond the grid.
    pub fn shape(&self, lie: &Lie<'_>, pixel: PixelPoint) -> Option<Shape> {
        let place = lie.place(pixel)?;
        let far = [place.x_mm, place.y_mm].into_iter().enumerate().any(|(axis, mm)| {
            // A head's own errors, up to a pitch.
            let from = self.first_mm[axis] - self.pitch_mm[axis];
            let to = self.first_mm[axis] + self.size[axis] as f64 * self.pitch_mm[axis];
            !(from..=to).contains(&mm)
        });
        let arms_px = lie.steps_px(pixel, [0.5 * self.size_mm; 2])?;
        (!far).then_some(Shape { style: self.style, arms_px })
    }

    /// From a column, and a row, to the next one at a pixel, px.
    pub fn ways(&self, lie: &Lie<'_>, pixel: PixelPoint) -> Option<[[f64; 2]; 2]> {
        lie.steps_px(pixel, self.pitch_mm)
    }

    /// Column and row of the pattern that the lattice's (0, 0) is.
    ///
    /// # Errors
    /// If the lattice is larger than the grid, or smaller and nothing tells where it lies.
    pub fn anchored(
        &self,
        lattice: &Lattice,
        marks: &[PixelPoint],
        lie: Option<&Lie<'_>>,
    ) -> Result<[i32; 2], PictureError> {
        if lattice.is_empty() {
            return Err(self.few(0));
        }
        let (low, found) = extent(lattice);
        let other = PictureError::OtherGrid { found, known: self.size };
        let mut anchor = [0; 2];
        for axis in 0..2 {
            let room = self.size[axis] as i32 - found[axis] as i32;
            if room < 0 || room > 0 && lie.is_none() {
                return Err(other);
            }
            let shift = lie.map_or(0.0, |lie| self.shift(lattice, marks, lie, axis));
            // As far as there is room for it: of a whole grid it is clear without a view.
            anchor[axis] = (shift.round() as i32).clamp(-low[axis], room - low[axis]);
        }
        Ok(anchor)
    }

    /// By how many columns, or rows, the pattern's index is larger than the lattice's.
    fn shift(&self, lattice: &Lattice, marks: &[PixelPoint], lie: &Lie<'_>, axis: usize) -> f64 {
        let shifts = lattice.iter().filter_map(|(&(column, row), &mark)| {
            let place = lie.place(marks[mark])?;
            let (mm, index) = [(place.x_mm, column), (place.y_mm, row)][axis];
            Some((mm - self.first_mm[axis]) / self.pitch_mm[axis] - f64::from(index))
        });
        let mut shifts: Vec<f64> = shifts.collect();
        if shifts.is_empty() {
            return 0.0;
        }
        let middle = shifts.len() / 2;
        *shifts.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Where each mark is in the picture.
    pub fn pixels(
        &self,
        lattice: &Lattice,
        marks: &[PixelPoint],
        anchor: [i32; 2],
    ) -> Vec<Option<PixelPoint>> {
        let of = |mark: &GridPlace| {
            let (column, row) = mark.index;
            lattice.get(&(column - anchor[0], row - anchor[1])).map(|&mark| marks[mark])
        };
        self.marks.iter().map(of).collect()
    }

    /// Size of a mark, px, from how far marks are apart.
    pub fn size_px(&self, pixels: &[Option<PixelPoint>]) -> f64 {
        let place: HashMap<(i32, i32), PixelPoint> =
            self.marks.iter().zip(pixels).filter_map(|(m, p)| Some((m.index, (*p)?))).collect();
        let mut gaps: Vec<f64> = place
            .iter()
            .filter_map(|(&(c, r), p)| Some(place.get(&(c + 1, r))?.distance(*p)))
            .collect();
        if gaps.is_empty() {
            return 0.0;
        }
        let middle = gaps.len() / 2;
        let gap = *gaps.select_nth_unstable_by(middle, f64::total_cmp).1;
        gap * self.size_mm / self.pitch_mm[0]
    }

    /// Usual width of a cross' lines, px, where half of their depth is; `None` of dots.
    pub fn line_width_px(
        &self,
        picture: &Picture,
        bright: bool,
        pixels: &[Option<PixelPoint>],
    ) -> Option<f64> {
        if self.style == MarkStyle::Dot {
            return None;
        }
        let size_px = self.size_px(pixels);
        let sign = if bright { 1.0 } else { -1.0 };
        let step = (pixels.len() / N_WIDTHS).max(1);
        let mut widths: Vec<f64> = pixels
            .iter()
            .flatten()
            .step_by(step)
            .map(|pixel| {
                // Across the arm to the right, which is about level in most pictures.
                let middle = PixelPoint::new(pixel.x_px + 0.3 * size_px, pixel.y_px);
                let reach_px = 0.25 * size_px;
                let strip = Strip { middle, direction: [1.0, 0.0], half_length_px: 1.0, reach_px };
                let values: Vec<f64> = strip.across(picture).iter().map(|v| sign * v).collect();
                let ground = values.iter().copied().fold(f64::INFINITY, f64::min);
                let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let half = 0.5 * (ground + top);
                values.iter().filter(|value| **value > half).count() as f64
                    * crate::raster::strip::STEP_PX
            })
            .collect();
        if widths.is_empty() {
            return None;
        }
        let middle = widths.len() / 2;
        Some(*widths.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Measured places moved and turned so that they lie on their targets as well as they can.
    pub fn placed_by_marks(&self, measured: &[Option<FieldPoint>]) -> Vec<Option<FieldPoint>> {
        let pairs: Vec<(FieldPoint, FieldPoint)> = self
            .marks
            .iter()
            .zip(measured)
            .filter_map(|(mark, measured)| Some((mark.place_mm, (*measured)?)))
            .collect();
        let n = pairs.len().max(1) as f64;
        let mean =
            |of: &dyn Fn(&(FieldPoint, FieldPoint)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
        let [tx, ty, mx, my] =
            [mean(&|p| p.0.x_mm), mean(&|p| p.0.y_mm), mean(&|p| p.1.x_mm), mean(&|p| p.1.y_mm)];
        // The turn for which the sum of squares is least.
        let (mut dot, mut cross) = (0.0, 0.0);
        for (target, place) in &pairs {
            let (u, v) = (target.x_mm - tx, target.y_mm - ty);
            let (x, y) = (place.x_mm - mx, place.y_mm - my);
            dot += u * x + v * y;
            cross += v * x - u * y;
        }
        let (sin, cos) = cross.atan2(dot).sin_cos();
        let placed = |place: FieldPoint| {
            let (x, y) = (place.x_mm - mx, place.y_mm - my);
            FieldPoint::new(tx + cos * x - sin * y, ty + sin * x + cos * y)
        };
        measured.iter().map(|place| place.map(placed)).collect()
    }
}

/// How the grid lies before the camera: as the sheet does, but for a turn.
#[derive(Clone, Copy, Debug)]
pub struct Lie<'a> {
    /// How the sheet is seen.
    pub view: &'a View,
    /// And the way back.
    pub seen: &'a Seen,
    /// By how much the grid is turned on the sheet, rad.
    pub turn_rad: f64,
}

impl Lie<'_> {
    /// The place that a pixel shows, in the grid's own directions, mm.
    fn place(&self, pixel: PixelPoint) -> Option<FieldPoint> {
        let place = self.seen.place(pixel)?;
        let (sin, cos) = self.turn_rad.sin_cos();
        let FieldPoint { x_mm, y_mm } = place;
        Some(FieldPoint::new(cos * x_mm + sin * y_mm, cos * y_mm - sin * x_mm))
    }

    /// Where steps along the grid's x and y lead in the picture, px.
    fn steps_px(&self, pixel: PixelPoint, steps_mm: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let place = self.seen.place(pixel)?;
        let (sin, cos) = self.turn_rad.sin_cos();
        let along = |dx: f64, dy: f64| {
            let at = |dx: f64, dy: f64| FieldPoint::new(place.x_mm + dx, place.y_mm + dy);
            let (there, here) = (self.view.pixel(at(dx, dy))?, self.view.pixel(at(-dx, -dy))?);
            Some([0.5 * (there.x_px - here.x_px), 0.5 * (there.y_px - here.y_px)])
        };
        let [x, y] = steps_mm;
        Some([along(cos * x, sin * x)?, along(-sin * y, cos * y)?])
    }
}
