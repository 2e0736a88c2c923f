//! A delay pattern as rows along its lines and columns across them.

use super::error::DelayError;
use ftheta_model::pattern::{FeatureShape, Pattern};
use ftheta_model::space::FieldPoint;
use kurbo::{Point, Vec2};

/// Lines are parallel to within this, rad.
const PARALLEL_RAD: f64 = 0.02;
/// Rows nearer than this lie on top of each other, mm.
const APART_MM: f64 = 1e-3;

/// The pattern, turned so that its lines run along the first coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Direction of the lines in the field: along x or y, or anything between.
    pub along: Vec2,
    /// Rows by where they lie across, in rising order.
    pub rows: Vec<Row>,
    /// Where reference lines across the rows lie along them, mm, in rising order.
    pub columns_mm: Vec<f64>,
}

/// A line of the pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of its feature.
    pub id: String,
    /// Where it lies across, mm.
    pub across_mm: f64,
    /// Where it begins and ends along, in the order in which it was marked, mm.
    pub ends_mm: [f64; 2],
    /// How it was marked; `None` for a reference.
    pub process: Option<RowProcess>,
}

/// How a line was marked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowProcess {
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Power over the pattern's power.
    pub power_ratio: f64,
}

impl Row {
    /// 1 where it runs along, -1 where it runs back.
    pub fn sense(&self) -> f64 {
        (self.ends_mm[1] - self.ends_mm[0]).signum()
    }
}

impl Layout {
    /// The rows and columns of a pattern.
    ///
    /// # Errors
    /// If it has no lines, or lines that are not parallel or lie on top of each other.
    pub fn new(pattern: &Pattern) -> Result<Self, DelayError> {
        let ends = |from: &FieldPoint, to: &FieldPoint| (Point::from(*from), Point::from(*to));
        let lines: Vec<_> = pattern
            .features
            .iter()
            .filter_map(|feature| match &feature.shape {
                FeatureShape::Line { from_mm, to_mm, process } => {
                    Some((feature.id.clone(), ends(from_mm, to_mm), Some(*process)))
                }
                FeatureShape::Reference { from_mm, to_mm, burned: true } => {
                    Some((feature.id.clone(), ends(from_mm, to_mm), None))
                }
                _ => None,
            })
            .filter(|(_, (from, to), _)| from != to)
            .collect();
        let Some((_, (from, to), _)) = lines.iter().find(|(.., process)| process.is_some()) else {
            return Err(DelayError::NoLines { kind: pattern.kind.clone() });
        };
        let mut along = (*to - *from).normalize();
        // Towards +x, or +y if it is steep: the same for either way of marking.
        if along.x < -0.5 || along.x < 0.5 && along.y < 0.0 {
            along = -along;
        }
        let across = Vec2::new(-along.y, along.x);
        let (mut rows, mut columns_mm) = (Vec::new(), Vec::new());
        for (id, (from, to), process) in lines {
            let direction = (to - from).normalize();
            let sine = along.cross(direction).abs();
            let at = |place: Point| [along.dot(place.to_vec2()), across.dot(place.to_vec2())];
            let ([from_mm, a_mm], [to_mm, b_mm]) = (at(from), at(to));
            if sine < PARALLEL_RAD {
                let process = process.map(|process| RowProcess {
                    speed_mm_s: process.speed_mm_s,
                    power_ratio: process.power_ratio,
                });
                let across_mm = 0.5 * (a_mm + b_mm);
                rows.push(Row { id, across_mm, ends_mm: [from_mm, to_mm], process });
            } else if process.is_none() && sine > 1.0 - PARALLEL_RAD {
                columns_mm.push(0.5 * (from_mm + to_mm));
            } else if process.is_some() {
                return Err(DelayError::NotParallel { id });
            }
        }
        rows.sort_by(|a, b| a.across_mm.total_cmp(&b.across_mm));
        // A reference that is burned both ways is one.
        rows.dedup_by(|b, a| {
            let both = a.process.is_none() && b.process.is_none();
            both && b.across_mm - a.across_mm < APART_MM
        });
        columns_mm.sort_by(f64::total_cmp);
        columns_mm.dedup_by(|a, b| (*a - *b).abs() < APART_MM);
        if let Some(pair) = rows.windows(2).find(|p| p[1].across_mm - p[0].across_mm < APART_MM) {
            return Err(DelayError::OnTop { ids: [pair[0].id.clone(), pair[1].id.clone()] });
        }
        Ok(Self { along, rows, columns_mm })
    }

    /// Smallest distance of neighbouring rows, mm.
    pub fn pitch_mm(&self) -> f64 {
        let gaps = self.rows.windows(2).map(|pair| pair[1].across_mm - pair[0].across_mm);
        gaps.fold(f64::INFINITY, f64::min)
    }
}
