//! Rehearsal of a calibration: the pattern is marked on the twin's own head, and measured there as
//! a user would, with noise.

use crate::Error;
use crate::atlas_store::AtlasStore;
use crate::lit::Lit;
use crate::mark::{MarkOptions, Stage, lay_out, play_watched};
use crate::output::write_file;
use crate::planning::Planning;
use ftheta_model::calibration::MeasuredPoint;
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::{Machine, Optics};
use ftheta_model::pattern::{FeatureShape, GridMark, MarkStyle, Pattern};
use ftheta_model::plan::Planner;
use ftheta_model::recipe::{Pen, Recipe};
use ftheta_model::space::FieldPoint;
use ftheta_physics::correction::CorrectionTable;
use ftheta_planner::classic::Settings;
use ftheta_toolpath::lay::Order;
use ftheta_twin::hidden_head::hidden_head;
use kurbo::{BezPath, Circle, Line, Point, Shape as _, Vec2};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use std::path::Path;

/// How a pattern is marked and measured.
#[derive(Clone, Debug)]
pub struct MeasureOptions {
    /// Optics that the head was meant to have: the machine's, or another's where the machine file
    /// does not know them all.
    pub true_optics: Optics,
    /// Seed of the head's hidden errors and of the noise.
    pub seed: u64,
    /// Noise of each measured coordinate, mm rms.
    pub noise_mm: f64,
    /// Table that the pattern is marked through.
    pub table: Option<CorrectionTable>,
    /// Round of measurement.
    pub round: u32,
    /// How the pattern's motion is planned; `None` is the best that the machine allows.
    pub planner: Option<Planner>,
    /// Where what has been solved is kept.
    pub atlas_store: AtlasStore,
}

/// A place where something can be measured, and what is seen there.
struct Sight {
    id: String,
    target: FieldPoint,
    seen: Seen,
}

/// What marks a place.
enum Seen {
    /// Two strokes that cross: which, and which part of each is looked at.
    Crossing([(usize, [f64; 2]); 2]),
    /// A closed stroke around it.
    Ring(usize),
}

/// Part of a cross' arms that is looked at, in the middle: ends are no straight lines.
const ARMS: [f64; 2] = [0.05, 0.95];
/// Length of a long line that is looked at beside a crossing, mm.
const BESIDE_MM: f64 = 3.0;
/// Lines that come this near to each other cross, mm.
const TOUCH_MM: f64 = 1e-3;
/// Accuracy of circles as curves, mm.
const CIRCLE_MM: f64 = 1e-6;

/// Marks a pattern on the twin's head of a seed, and measures it.
///
/// Returns a point and its name for every cross, dot or crossing of lines, in the pattern's order.
///
/// # Errors
/// If the pattern cannot be marked on the machine.
pub fn measure(
    pattern: &Pattern,
    machine: &Machine,
    options: &MeasureOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Vec<(String, MeasuredPoint)>, Error> {
    let (strokes, sights) = strokes(pattern);
    let recipe = Recipe::default();
    let mark_options = MarkOptions {
        order: Some(Order::Keep),
        planner: options.planner,
        atlas_store: options.atlas_store.clone(),
        seed: options.seed,
        table: options.table.clone(),
        head: Some(hidden_head(&options.true_optics, options.seed)),
        ..MarkOptions::default()
    };
    let n_strokes = strokes.len();
    observer(Stage::Lay);
    let toolpath = lay_out(&job(strokes), machine, &recipe, &mark_options)?;
    observer(Stage::Plan);
    let settings = Settings::new(machine, &recipe.classic)?;
    let planning = Planning { machine, settings: &settings, options: &mark_options };
    let (plan, _) = planning.plan(toolpath.value, &mut Vec::new(), observer)?;
    let mut lit = Lit::default();
    play_watched(&plan, &mark_options, observer, &mut |trace| lit.add(trace))?;
    let mut seen: Vec<Vec<Point>> = vec![Vec::new(); n_strokes];
    for (stroke, place) in lit.places {
        if let Some(places) = seen.get_mut(stroke) {
            places.push(place);
        }
    }
    // A stream of its own, so that rounds and heads do not share their noise.
    let stream = options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(options.round);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(stream);
    let mut noise = || -> f64 {
        let normal: f64 = StandardNormal.sample(&mut random);
        options.noise_mm * normal
    };
    let mut points = Vec::with_capacity(sights.len());
    for (sight, line) in sights.into_iter().zip(2..) {
        let Some(place) = sight.seen.place(&seen) else {
            continue;
        };
        let measured_mm = FieldPoint::new(place.x + noise(), place.y + noise());
        let round = options.round;
        let point = MeasuredPoint { target_mm: sight.target, measured_mm, round, line };
        points.push((sight.id, point));
    }
    Ok(points)
}

/// Writes measured points as the table that `ftheta pattern grid` leaves to be filled in.
///
/// # Errors
/// If there is no point, or the file cannot be written.
pub fn write(points: &[(String, MeasuredPoint)], pattern: &Path, out: &Path) -> Result<(), Error> {
    if points.is_empty() {
        return Err(Error::NoSights { path: pattern.into() });
    }
    let rows = points
        .iter()
        .map(|(id, point)| (id.as_str(), point.target_mm, point.round, Some(point.measured_mm)));
    let text = ftheta_formats::points::write(rows);
    write_file(out, text.as_bytes())
}

/// Everything that is marked, stroke by stroke, and where to look.
fn strokes(pattern: &Pattern) -> (Vec<BezPath>, Vec<Sight>) {
    let (mut strokes, mut sights, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for feature in &pattern.features {
        match &feature.shape {
            FeatureShape::Mark(mark) => {
                let first = strokes.len();
                strokes.extend(mark_curves(mark));
                let seen = match mark.style {
                    MarkStyle::Cross => Seen::Crossing([(first, ARMS), (first + 1, ARMS)]),
                    MarkStyle::Dot => Seen::Ring(first),
                };
                sights.push(Sight { id: feature.id.clone(), target: mark.place_mm, seen });
            }
            FeatureShape::Line { from_mm, to_mm, .. } => {
                let line = Line::new(Point::from(*from_mm), Point::from(*to_mm));
                lines.push((strokes.len(), line));
                strokes.push(line.to_path(CIRCLE_MM));
            }
            _ => {}
        }
    }
    sights.extend(crossings(&lines));
    (strokes, sights)
}

/// The arms of a cross, along x and along y, or the border of a dot.
pub(crate) fn mark_curves(mark: &GridMark) -> Vec<BezPath> {
    let (centre, half_mm) = (Point::from(mark.place_mm), 0.5 * mark.size_mm);
    match mark.style {
        MarkStyle::Cross => [Vec2::new(half_mm, 0.0), Vec2::new(0.0, half_mm)]
            .map(|arm| Line::new(centre - arm, centre + arm).to_path(CIRCLE_MM))
            .to_vec(),
        MarkStyle::Dot => vec![Circle::new(centre, half_mm).to_path(CIRCLE_MM)],
    }
}

/// Places where two lines meet or cross, each once.
fn crossings(lines: &[(usize, Line)]) -> Vec<Sight> {
    let mut found: Vec<Sight> = Vec::new();
    for (index, (first, a)) in lines.iter().enumerate() {
        for (second, b) in &lines[index + 1..] {
            let Some(place) = a.crossing_point(*b) else {
                continue;
            };
            let touches = |line: &Line| {
                let share = (place - line.p0).dot(line.p1 - line.p0) / line.length().powi(2);
                let spare = TOUCH_MM / line.length();
                (-spare..=1.0 + spare).contains(&share).then(|| {
                    let beside = BESIDE_MM / line.length();
                    [
                        (share - beside).max(ARMS[0] * beside),
                        (share + beside).min(1.0 - ARMS[0] * beside),
                    ]
                })
            };
            let (Some(part_a), Some(part_b)) = (touches(a), touches(b)) else {
                continue;
            };
            let known =
                found.iter().any(|sight| Point::from(sight.target).distance(place) < TOUCH_MM);
            if !known {
                let seen = Seen::Crossing([(*first, part_a), (*second, part_b)]);
                let id = format!("crossing-{}", found.len() + 1);
                found.push(Sight { id, target: place.into(), seen });
            }
        }
    }
    found
}

fn job(strokes: Vec<BezPath>) -> Job {
    let shape = |(index, path)| Shape {
        source: format!("stroke {index}"),
        path,
        paint: Paint::Stroke,
        pen_index: 0,
    };
    let shapes = strokes.into_iter().enumerate().map(shape).collect();
    let layer = Layer { name: "pattern".into(), shapes };
    Job { pens: vec![Pen::default()], layers: vec![layer], page_mm: [0.0; 2] }
}

impl Seen {
    /// Where the beam's light puts it.
    fn place(&self, seen: &[Vec<Point>]) -> Option<Point> {
        match self {
            Self::Crossing([a, b]) => {
                let fitted = |(stroke, [from, to]): &(usize, [f64; 2])| {
                    let places = &seen[*stroke];
                    let at = |share: f64| (share * places.len() as f64) as usize;
                    fit(places.get(at(*from)..at(*to))?)
                };
                let (a, b) = (fitted(a)?, fitted(b)?);
                a.crossing_point(b)
            }
            Self::Ring(stroke) => {
                let places = &seen[*stroke];
                let sum = places.iter().fold(Vec2::ZERO, |sum, place| sum + place.to_vec2());
                (!places.is_empty()).then(|| (sum / places.len() as f64).to_point())
            }
        }
    }
}

/// The straight line of least squares of the distances, from two places on.
fn fit(places: &[Point]) -> Option<Line> {
    if places.len() < 2 {
        return None;
    }
    let n = places.len() as f64;
    let centre = (places.iter().fold(Vec2::ZERO, |sum, p| sum + p.to_vec2()) / n).to_point();
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for place in places {
        let off = *place - centre;
        (xx, xy, yy) = (xx + off.x * off.x, xy + off.x * off.y, yy + off.y * off.y);
    }
    let direction = Vec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
    Some(Line::new(centre - direction, centre + direction))
}
