//! Renders a plan into blocks of output words: the only place where millimetres become codes.

mod axes;
mod lens;
mod mirrors;
mod pulses;
pub(crate) mod track;
mod words;

use axes::Axes;
use ftheta_model::block::{Block, LaserEdge};
use ftheta_model::plan::{Motion, Planner, SpeedProfile};
use ftheta_model::recipe::Interpolation;
use ftheta_model::space::DacCodes;
use ftheta_physics::correction::CorrectionTable;
use ftheta_physics::plan::Plan;
use kurbo::{Point, Vec2};
use lens::LensPath;
pub use mirrors::PlayedMirrors;
use pulses::Triggers;
use track::Track;
use words::Words;

/// Samples of a block.
pub const BLOCK_SAMPLES: usize = 4096;

/// A DDA adds increments of this share of a word's step.
const DDA_FRACTION: f64 = 1.0 / 256.0;

/// Yields the blocks of a plan one after the other; memory does not grow with the plan.
#[derive(Clone)]
pub struct Renderer<'a> {
    plan: &'a Plan,
    words: Words<'a>,
    axes: Axes,
    lens: Option<LensPath<'a>>,
    segment_index: usize,
    /// Samples of the segment already rendered.
    n_rendered: u32,
    cursor: Cursor,
    track: Option<Track>,
    next_index: u64,
    /// Laser edges already given: the mark they belong to, and how many of it.
    mark_index: usize,
    n_edges: usize,
    triggers: Triggers,
}

/// The state of a walk along a path.
#[derive(Clone, Copy, Debug)]
struct Cursor {
    /// Vertex at the start of the leg.
    leg: usize,
    /// Path length up to that vertex, and up to the leg's end, mm.
    start_mm: f64,
    end_mm: f64,
    from: Point,
    direction: Vec2,
}

impl<'a> Renderer<'a> {
    /// Starts before the first sample.
    pub fn new(plan: &'a Plan) -> Self {
        Self::with_words(plan, Words::new(plan))
    }

    fn with_words(plan: &'a Plan, words: Words<'a>) -> Self {
        let mirrors = Self::of_mirrors(plan, words);
        match plan.machine.optics.focus {
            Some(_) => Self { lens: LensPath::new(plan, mirrors.clone()), ..mirrors },
            None => mirrors,
        }
    }

    /// The same without a focusing lens.
    fn of_mirrors(plan: &'a Plan, words: Words<'a>) -> Self {
        let mut renderer = Self {
            plan,
            words,
            axes: Axes::new(&plan.machine, plan.planner == Planner::Optimal),
            lens: None,
            segment_index: 0,
            n_rendered: 0,
            cursor: Cursor::at(&plan.vertices, 0),
            track: None,
            next_index: 0,
            mark_index: 0,
            n_edges: 0,
            triggers: Triggers::new(&plan.machine.laser),
        };
        renderer.enter();
        renderer
    }

    /// Prepares for the segment that comes next.
    fn enter(&mut self) {
        self.n_rendered = 0;
        if let Some(segment) = self.plan.segments.get(self.segment_index) {
            if let (Motion::Travel { .. }, Some((first, _))) =
                (segment.motion, segment.motion.ends())
            {
                self.cursor = Cursor::at(&self.plan.vertices, first);
            }
            self.track = Track::new(self.plan, &segment.motion);
        }
    }

    /// Corrects all words and voltages by a table, for the head as it really is over the plan's
    /// work plane.
    #[must_use]
    pub fn correct_by(mut self, table: &CorrectionTable) -> Self {
        self.words.correct_by(table.clone());
        self
    }

    /// Starts before the first sample of another plan for the same machine, and saves making the
    /// table of its optics again.
    pub fn for_plan<'b>(&self, plan: &'b Plan) -> Renderer<'b> {
        Renderer::with_words(plan, self.words.for_plan(plan))
    }

    /// Fills `block` with what comes next; `false` after the end.
    pub fn next_block(&mut self, block: &mut Block) -> bool {
        block.first_index = self.next_index;
        block.words.clear();
        block.lens_mm.clear();
        block.edges.clear();
        block.triggers_ns.clear();
        while block.words.len() < BLOCK_SAMPLES {
            let Some(segment) = self.plan.segments.get(self.segment_index) else {
                break;
            };
            let room = (BLOCK_SAMPLES - block.words.len()) as u32;
            let end = segment.n_ticks.min(self.n_rendered.saturating_add(room));
            self.render(&segment.motion, end, segment.n_ticks, &mut block.words);
            self.n_rendered = end;
            if end == segment.n_ticks {
                self.segment_index += 1;
                self.enter();
            }
        }
        self.next_index += block.words.len() as u64;
        self.axes.take_volts(&mut block.volts);
        self.words.correct_volts(&mut block.volts);
        if let Some(lens) = &mut self.lens {
            lens.push(block.words.len(), &mut block.lens_mm);
        }
        self.push_edges(block);
        !block.words.is_empty()
    }

    /// Appends samples `n_rendered + 1 ..= end` of a segment of `n_ticks`.
    fn render(&mut self, motion: &Motion, end: u32, n_ticks: u32, words: &mut Vec<DacCodes>) {
        let period_s = self.plan.machine.output.period_s();
        let first = self.n_rendered + 1;
        match *motion {
            Motion::Hold { vertex } => {
                let place = self.plan.vertices[vertex as usize];
                let mut left = (end + 1 - first) as usize;
                if first == 1
                    && let Some(angles) = self.axes.come_to_rest()
                {
                    words.push(self.words.rounded(angles));
                    left -= 1;
                }
                words.resize(words.len() + left, self.words.at(place));
                self.axes.rest(self.words.exact(place));
                self.axes.stay(left);
            }
            Motion::Drive { first: base } => {
                let pairs = &self.plan.drives[(base + first - 1) as usize..(base + end) as usize];
                words.extend(pairs.iter().map(|pair| {
                    let angles = self.axes.drive(pair.map(f64::from));
                    self.words.rounded(angles)
                }));
            }
            Motion::Track { .. } => {
                let track = self.track.as_mut().expect("entering a track prepares it");
                let n_samples = (end + 1 - first) as usize;
                let angles = track.angles(self.plan, &self.words, n_samples);
                let ends = (first == 1, end == n_ticks);
                self.axes.follow(angles, n_samples, ends, |angles| {
                    words.push(self.words.rounded(angles));
                });
            }
            Motion::Travel { profile, interpolation: Interpolation::Dda, .. } => {
                let (start, step) = self.dda(&profile, n_ticks);
                for tick in first..=end {
                    words.push(self.words.at(start + step * f64::from(tick)));
                }
                self.axes.forget();
            }
            Motion::Travel { profile, .. } => {
                let last = motion.ends().map_or(0, |(_, last)| last);
                let constant = profile.acceleration_mm_s2 == f64::INFINITY
                    && profile.deceleration_mm_s2 == f64::INFINITY;
                for tick in first..=end {
                    let time_s = f64::from(tick) * period_s;
                    let distance_mm = if constant {
                        (profile.speed_mm_s * time_s).min(profile.length_mm)
                    } else {
                        profile.distance_mm(time_s)
                    };
                    let place = if tick == n_ticks {
                        self.plan.vertices[last]
                    } else {
                        self.cursor.advance(&self.plan.vertices, last, distance_mm)
                    };
                    words.push(self.words.at(place));
                }
                self.axes.forget();
            }
        }
    }

    /// Start and rounded increment of a single vector by DDA. Adding the increment tick by tick
    /// and multiplying it by the tick is the same here, since it is a whole number of fractions.
    fn dda(&self, profile: &SpeedProfile, n_ticks: u32) -> (Point, Vec2) {
        let scale = ftheta_physics::optics::scale_mm_per_rad(&self.plan.machine.optics);
        let fraction_mm = scale * DDA_FRACTION / self.words.words_per_rad;
        let exact = self.cursor.direction * (profile.length_mm / f64::from(n_ticks));
        let step = Vec2::new(
            (exact.x / fraction_mm).round() * fraction_mm,
            (exact.y / fraction_mm).round() * fraction_mm,
        );
        (self.cursor.from, step)
    }

    fn push_edges(&mut self, block: &mut Block) {
        let end_ns = self.next_index * u64::from(self.plan.machine.output.period_ns);
        let laser = &self.plan.machine.laser;
        let leads_ns =
            [laser.on_latency_ns, laser.off_latency_ns].map(|ns| ns.min(0).unsigned_abs());
        while let Some(mark) = self.plan.marks.get(self.mark_index) {
            // Pulses that wait for triggers have the pen's energy, each of them.
            let (power_w, steps) = match laser.pulses_triggered {
                true => (self.plan.pens[mark.pen_index].power_w, &[][..]),
                false => (mark.power_w, &mark.steps[..]),
            };
            let edge = if self.n_edges == 0 {
                LaserEdge { time_ns: mark.on_ns, power_w }
            } else if let Some(&step) = steps.get(self.n_edges - 1) {
                step
            } else {
                LaserEdge { time_ns: mark.off_ns, power_w: 0.0 }
            };
            // Light before its signal cannot be had later than the signal's own block.
            let lead_ns = if edge.power_w > 0.0 { leads_ns[0] } else { leads_ns[1] };
            if edge.time_ns.saturating_sub(lead_ns) >= end_ns {
                break;
            }
            block.edges.push(edge);
            let last = self.n_edges == steps.len() + 1;
            self.mark_index += usize::from(last);
            self.n_edges = if last { 0 } else { self.n_edges + 1 };
        }
        self.triggers.push_before(self.plan, end_ns + leads_ns[0], &mut block.triggers_ns);
    }
}

impl Cursor {
    fn at(vertices: &[Point], leg: usize) -> Self {
        let mut cursor =
            Self { leg, start_mm: 0.0, end_mm: 0.0, from: vertices[leg], direction: Vec2::ZERO };
        cursor.enter(vertices);
        cursor
    }

    /// Sets the leg's own values; the leg after the last vertex has no length.
    fn enter(&mut self, vertices: &[Point]) {
        self.from = vertices[self.leg];
        let along = vertices.get(self.leg + 1).map_or(Vec2::ZERO, |&to| to - self.from);
        let length_mm = along.hypot();
        self.end_mm = self.start_mm + length_mm;
        self.direction = if length_mm > 0.0 { along / length_mm } else { Vec2::ZERO };
    }

    /// The place at `distance_mm` along the path; distances never fall.
    #[inline]
    fn advance(&mut self, vertices: &[Point], last: usize, distance_mm: f64) -> Point {
        while distance_mm > self.end_mm && self.leg + 1 < last {
            self.leg += 1;
            self.start_mm = self.end_mm;
            self.enter(vertices);
        }
        self.from + self.direction * (distance_mm - self.start_mm)
    }
}
