//! The ILDA test pattern, planned, beside what comes of its points played as they are.
//!
//! Geometry and points are our own, made from what is published of the pattern: a frame, diagonals
//! in its corners, a cross in its centre, and a circle of twelve points a turn around a square.
//! Where an axis answers the circle's frequency with [`CIRCLE_GAIN`], the circle touches the
//! square's sides; that is what the pattern is tuned by.

mod playback;

use super::sheet::delays;
use crate::Error;
use crate::lit::Lit;
use crate::mark::{MarkOptions, Marked, Stage, mark, play_watched};
use crate::output::Output;
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{self, FeatureShape, LineProcess, Pattern};
use ftheta_model::recipe::{Pen, Recipe};
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_report::pattern_report::{PatternReportInput, PatternWay, pattern_report_html};
use ftheta_report::plate::{PlateOptions, plate_png};
use kurbo::{BezPath, Circle, Line, Point, Shape as _};
pub use playback::tuned_rate;

/// Part of the commanded radius at which the circle touches the inner square.
pub const CIRCLE_GAIN: f64 = 0.635;
/// Optical angle of the frame's side, at which a "30 kpps" scanner is tuned.
const SIDE_OPTICAL_RAD: f64 = 8.0 * std::f64::consts::PI / 180.0;
/// Half the inner square's side, by half the frame's.
const SQUARE: f64 = 0.314;
/// Pixels along the side of a picture.
const PICTURE_PX: u32 = 1000;
/// Where the corners' diagonals begin, and half the length of the cross's arms.
const DIAGONAL: f64 = 0.75;
const CROSS: f64 = 0.1;

/// The pattern in the field's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ilda {
    /// Half the frame's side, mm.
    half_mm: f64,
}

/// A part of the pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feature {
    /// A straight line.
    Line(Line),
    /// The circle.
    Circle(Circle),
}

/// How well the pattern was followed.
#[derive(Clone, Debug, Default)]
pub struct Traced {
    /// Time of one pattern, s.
    pub duration_s: f64,
    /// Greatest distance of lit beam from the pattern, mm.
    pub error_max_mm: f64,
    /// Root mean square of it, mm.
    pub error_rms_mm: f64,
    /// Mean radius of the circle by its nominal one.
    pub circle_ratio: f64,
}

/// One way in which the pattern was made.
pub struct Way {
    /// Rate of its points; `None` if it was planned.
    pub points_per_s: Option<f64>,
    /// How well it was followed.
    pub traced: Traced,
    /// What was marked, as a PNG.
    picture_png: Vec<u8>,
}

/// The pattern planned, and its points played.
pub struct Comparison {
    /// Plan, score and picture.
    pub planned: Marked,
    /// Planned, played at the rate asked for, played in the time of the plan.
    pub ways: Vec<Way>,
    /// Rate at which the circle touches the square, if it is small, points/s.
    pub tuned_rate: Option<f64>,
}

impl Way {
    /// What it is, for people.
    pub fn name(&self) -> String {
        match self.points_per_s {
            None => "planned".into(),
            Some(rate) => format!("points played at {rate:.0}/s"),
        }
    }
}

/// Plans the pattern, and plays its points at a rate and in the plan's own time.
///
/// # Errors
/// As [`mark`].
pub fn compare(
    ilda: &Ilda,
    machine: &Machine,
    options: &PatternOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Comparison, Error> {
    let (planned, traced) = ilda.plan(machine, options, observer)?;
    let page_mm = Some([1.1 * ilda.side_mm(); 2]);
    let plate = PlateOptions { page_mm, longest_side_px: PICTURE_PX };
    let slow = playback::n_points(ilda) as f64 / traced.duration_s;
    let picture_png = plate_png(&planned.dose, &plate);
    let mut ways = vec![Way { points_per_s: None, traced, picture_png }];
    for rate in [options.points_per_s, slow] {
        let (traced, dose) = playback::playback(ilda, machine, rate, options)?;
        let picture_png = plate_png(&dose, &plate);
        ways.push(Way { points_per_s: Some(rate), traced, picture_png });
    }
    Ok(Comparison { planned, ways, tuned_rate: tuned_rate(machine) })
}

impl Comparison {
    /// Adds the comparison and the plan; returns kind and path of each.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn add(&self, output: &mut Output) -> Result<Vec<(&'static str, String)>, Error> {
        let plan = &self.planned.plan;
        let way = |way: &Way| PatternWay {
            name: way.name(),
            duration_s: way.traced.duration_s,
            error_mm: [way.traced.error_max_mm, way.traced.error_rms_mm],
            circle_ratio: way.traced.circle_ratio,
            picture_png: way.picture_png.clone(),
        };
        let mut settings = vec![("Machine".to_owned(), plan.machine.name.clone())];
        if let Some(pen) = plan.pens.first() {
            settings.push(("Speed".into(), format!("{} mm/s", pen.mark_speed_mm_s)));
        }
        if let Some(rate) = self.tuned_rate {
            settings.push((
                "A small circle touches its square at".into(),
                format!("{rate:.0} points/s"),
            ));
        }
        let report = pattern_report_html(&PatternReportInput {
            title: "ILDA test pattern",
            settings: &settings,
            ways: &self.ways.iter().map(way).collect::<Vec<_>>(),
        });
        output.add("pattern.html", |out| out.write_all(report.as_bytes()))?;
        output.add_plan("plan.ftheta", plan)?;
        Ok([("report", "pattern.html"), ("plan", "plan.ftheta")]
            .map(|(kind, name)| (kind, output.path(name).display().to_string()))
            .into())
    }
}

/// How the pattern is made.
#[derive(Clone, Debug)]
pub struct PatternOptions {
    /// Power, and the speed of the plan.
    pub pen: Pen,
    /// Rate at which points are played, 1/s.
    pub points_per_s: f64,
    /// How it is planned, and what the twin is told.
    pub mark: MarkOptions,
}

impl Ilda {
    /// The pattern with this side; without it eight optical degrees wide.
    pub fn new(machine: &Machine, side_mm: Option<f64>) -> Self {
        // The beam turns twice as far as the mirror.
        let usual_mm = scale_mm_per_rad(&machine.optics) * 0.5 * SIDE_OPTICAL_RAD;
        Self { half_mm: 0.5 * side_mm.unwrap_or(usual_mm) }
    }

    /// Side of the frame, mm.
    pub fn side_mm(&self) -> f64 {
        2.0 * self.half_mm
    }

    /// Radius of the circle, mm.
    pub fn circle_mm(&self) -> f64 {
        self.half_mm * SQUARE / CIRCLE_GAIN
    }

    /// The strokes in their order: a name, and the features that follow on in it.
    pub fn strokes(&self) -> Vec<(&'static str, Vec<Feature>)> {
        let at = |x: f64, y: f64| Point::new(self.half_mm * x, self.half_mm * y);
        let line = |from: Point, to: Point| Feature::Line(Line::new(from, to));
        let square = |half: f64| {
            let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
            let corner = |index: usize| at(corners[index % 4].0, corners[index % 4].1);
            (0..4).map(|index| line(corner(index), corner(index + 1))).collect::<Vec<_>>()
        };
        let diagonal = |x: f64, y: f64| vec![line(at(DIAGONAL * x, DIAGONAL * y), at(x, y))];
        vec![
            ("frame", square(1.0)),
            ("diagonal-1", diagonal(-1.0, -1.0)),
            ("diagonal-2", diagonal(1.0, -1.0)),
            ("diagonal-3", diagonal(1.0, 1.0)),
            ("diagonal-4", diagonal(-1.0, 1.0)),
            ("square", square(SQUARE)),
            ("circle", vec![Feature::Circle(Circle::new(Point::ZERO, self.circle_mm()))]),
            ("cross-x", vec![line(at(-CROSS, 0.0), at(CROSS, 0.0))]),
            ("cross-y", vec![line(at(0.0, -CROSS), at(0.0, CROSS))]),
        ]
    }

    /// The pattern as a drawing.
    ///
    /// * `pen`: for all of it
    pub fn job(&self, pen: Pen) -> Job {
        let shape = |(name, features): (&str, Vec<Feature>)| Shape {
            source: name.into(),
            path: path(&features),
            paint: Paint::Stroke,
            pen_index: 0,
        };
        let shapes = self.strokes().into_iter().map(shape).collect();
        let page_mm = [2.2 * self.half_mm; 2];
        Job { pens: vec![pen], layers: vec![Layer { name: "ilda".into(), shapes }], page_mm }
    }

    /// Every feature's nominal place.
    ///
    /// * `speed_mm_s`: of the beam along all of them
    pub fn pattern(&self, machine: &Machine, speed_mm_s: f64) -> Pattern {
        let process = LineProcess { speed_mm_s, power_ratio: 1.0 };
        let mut features = Vec::new();
        for (name, parts) in self.strokes() {
            for (index, part) in parts.iter().enumerate() {
                let id =
                    if parts.len() > 1 { format!("{name}-{}", index + 1) } else { name.into() };
                let shape = match part {
                    Feature::Line(line) => FeatureShape::Line {
                        from_mm: line.p0.into(),
                        to_mm: line.p1.into(),
                        process,
                    },
                    Feature::Circle(circle) => FeatureShape::Circle {
                        centre_mm: circle.center.into(),
                        radius_mm: circle.radius,
                        process,
                    },
                };
                features.push(pattern::Feature { id, shape });
            }
        }
        Pattern {
            kind: "ilda".into(),
            field_mm: self.side_mm(),
            features,
            machine: Some(machine.name.clone()),
            laser: Some(delays(&machine.laser)),
        }
    }

    /// Plans the pattern and plays it on the twin.
    fn plan(
        &self,
        machine: &Machine,
        options: &PatternOptions,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<(Marked, Traced), Error> {
        let (job, recipe) = (self.job(options.pen.clone()), Recipe::default());
        let marked = mark(&job, machine, &recipe, &options.mark, observer)?;
        let mut lit = Lit::default();
        play_watched(&marked.plan, &options.mark, &mut |_| {}, &mut |trace| lit.add(trace))?;
        let circle = marked.plan.marks.iter().position(|mark| mark.source == "circle");
        let traced = self.traced(&lit, circle, marked.times.duration_s);
        Ok((marked, traced))
    }

    /// Distance of a place from the pattern, mm.
    fn distance_mm(&self, features: &[Feature], place: Point) -> f64 {
        let distance_mm = |feature: &Feature| match feature {
            Feature::Line(line) => {
                let along = line.p1 - line.p0;
                let share = ((place - line.p0).dot(along) / along.hypot2()).clamp(0.0, 1.0);
                line.p0.lerp(line.p1, share).distance(place)
            }
            Feature::Circle(circle) => (circle.center.distance(place) - circle.radius).abs(),
        };
        features.iter().map(distance_mm).fold(f64::INFINITY, f64::min)
    }

    /// Figures of what was lit.
    ///
    /// * `circle`: which interval of light was the circle
    fn traced(&self, lit: &Lit, circle: Option<usize>, duration_s: f64) -> Traced {
        let features: Vec<Feature> =
            self.strokes().into_iter().flat_map(|(_, features)| features).collect();
        let errors_mm: Vec<f64> =
            lit.places.iter().map(|(_, place)| self.distance_mm(&features, *place)).collect();
        let squares: f64 = errors_mm.iter().map(|error| error * error).sum();
        let on_circle = lit.places.iter().filter(|(index, _)| Some(*index) == circle);
        let radii_mm: Vec<f64> = on_circle.map(|(_, place)| place.to_vec2().hypot()).collect();
        let radius_mm = radii_mm.iter().sum::<f64>() / radii_mm.len().max(1) as f64;
        Traced {
            duration_s,
            error_max_mm: errors_mm.iter().copied().fold(0.0, f64::max),
            error_rms_mm: (squares / errors_mm.len().max(1) as f64).sqrt(),
            circle_ratio: radius_mm / self.circle_mm(),
        }
    }
}

/// The curve through features that follow on.
fn path(features: &[Feature]) -> BezPath {
    let mut path = BezPath::new();
    for feature in features {
        match feature {
            Feature::Line(line) => {
                if path.is_empty() {
                    path.move_to(line.p0);
                }
                path.line_to(line.p1);
            }
            Feature::Circle(circle) => path.extend(circle.path_elements(1e-6)),
        }
    }
    path
}
