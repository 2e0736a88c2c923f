//! Renders a plan into blocks of output words: the only place where millimetres become codes.

use ftheta_model::block::{Block, LaserEdge};
use ftheta_model::plan::{Motion, SpeedProfile};
use ftheta_model::recipe::Interpolation;
use ftheta_model::space::{DacCodes, FieldPoint};
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::map_table::MapTable;
use ftheta_physics::optics::angles_from_field;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use kurbo::{Point, Vec2};

/// Samples of a block.
pub const BLOCK_SAMPLES: usize = 4096;

/// Cells around the centre of the table that are left to the exact inverse: keeps 1 nm there.
const EXACT_CELLS: f64 = 3.0;

/// A DDA adds increments of this share of a word's step.
const DDA_FRACTION: f64 = 1.0 / 256.0;

/// Yields the blocks of a plan one after the other; memory does not grow with the plan.
#[derive(Clone)]
pub struct Renderer<'a> {
    plan: &'a Plan,
    words: Words<'a>,
    jumps: Vec<JumpShape>,
    segment_index: usize,
    /// Samples of the segment already rendered.
    n_rendered: u32,
    cursor: Cursor,
    next_index: u64,
    /// Laser edges already given: two per mark.
    n_edges: usize,
}

/// The references of one sequence.
#[derive(Clone)]
struct JumpShape {
    /// Where it leads, rad.
    step_rad: f64,
    /// References of its ticks at a factor of one, rad from the start.
    references_rad: Vec<f64>,
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

/// Turns places into words.
#[derive(Clone)]
struct Words<'a> {
    plan: &'a Plan,
    table: Option<MapTable>,
    words_per_rad: f64,
}

impl<'a> Renderer<'a> {
    /// Starts before the first sample.
    pub fn new(plan: &'a Plan) -> Self {
        let optics = &plan.machine.optics;
        let table = MapTable::new(0.5 * optics.field_mm, EXACT_CELLS, |x, y| {
            let angles = angles_from_field(optics, FieldPoint::new(x, y))?;
            Some([angles.x_rad, angles.y_rad])
        });
        Self::with_table(plan, table)
    }

    fn with_table(plan: &'a Plan, table: Option<MapTable>) -> Self {
        let words_per_rad = 1.0 / plan.machine.output.word_step_rad();
        let words = Words { plan, table, words_per_rad };
        let cursor = Cursor::at(&plan.vertices, 0);
        let jumps = jump_shapes(plan);
        Self {
            plan,
            words,
            jumps,
            segment_index: 0,
            n_rendered: 0,
            cursor,
            next_index: 0,
            n_edges: 0,
        }
    }

    /// Starts before the first sample of another plan for the same machine, and saves making the
    /// table of its optics again.
    pub fn for_plan<'b>(&self, plan: &'b Plan) -> Renderer<'b> {
        Renderer::with_table(plan, self.words.table.clone())
    }

    /// Fills `block` with what comes next; `false` after the end.
    pub fn next_block(&mut self, block: &mut Block) -> bool {
        block.first_index = self.next_index;
        block.words.clear();
        block.edges.clear();
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
                self.n_rendered = 0;
                if let Some(next) = self.plan.segments.get(self.segment_index) {
                    self.cursor = Cursor::at(&self.plan.vertices, next.motion.first_vertex());
                }
            }
        }
        self.next_index += block.words.len() as u64;
        self.push_edges(block);
        !block.words.is_empty()
    }

    /// Appends samples `n_rendered + 1 ..= end` of a segment of `n_ticks`.
    fn render(&mut self, motion: &Motion, end: u32, n_ticks: u32, words: &mut Vec<DacCodes>) {
        let period_s = self.plan.machine.output.period_s();
        let first = self.n_rendered + 1;
        match *motion {
            Motion::Hold { vertex } => {
                let word = self.words.at(self.plan.vertices[vertex as usize]);
                words.resize(words.len() + (end + 1 - first) as usize, word);
            }
            Motion::Jump { from_vertex, to_vertex, sequence } => {
                let place = |vertex: u32| self.words.exact(self.plan.vertices[vertex as usize]);
                let (from, to) = (place(from_vertex), place(to_vertex));
                let JumpShape { step_rad, references_rad } = &self.jumps[sequence as usize];
                let factors = [(to[0] - from[0]) / step_rad, (to[1] - from[1]) / step_rad];
                let references = &references_rad[(first - 1) as usize..end as usize];
                words.extend(references.iter().map(|reference| {
                    let angle = |axis: usize| from[axis] + factors[axis] * reference;
                    self.words.rounded([angle(0), angle(1)])
                }));
            }
            Motion::Travel { profile, interpolation: Interpolation::Dda, .. } => {
                let (start, step) = self.dda(&profile, n_ticks);
                for tick in first..=end {
                    words.push(self.words.at(start + step * f64::from(tick)));
                }
            }
            Motion::Travel { profile, .. } => {
                let last = motion.last_vertex();
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
        while let Some(mark) = self.plan.marks.get(self.n_edges / 2) {
            let edge = if self.n_edges.is_multiple_of(2) {
                LaserEdge { time_ns: mark.on_ns, power_w: mark.power_w }
            } else {
                LaserEdge { time_ns: mark.off_ns, power_w: 0.0 }
            };
            if edge.time_ns >= end_ns {
                break;
            }
            block.edges.push(edge);
            self.n_edges += 1;
        }
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

impl Words<'_> {
    /// The word pair for a place.
    #[inline]
    fn at(&self, place: Point) -> DacCodes {
        let tabled = self.table.as_ref().and_then(|table| table.value(place.x, place.y));
        self.rounded(tabled.unwrap_or_else(|| self.exact(place)))
    }

    /// The word pair for angles, rad.
    #[inline]
    fn rounded(&self, [x_rad, y_rad]: [f64; 2]) -> DacCodes {
        DacCodes {
            x: (x_rad * self.words_per_rad).round_ties_even() as i32,
            y: (y_rad * self.words_per_rad).round_ties_even() as i32,
        }
    }

    /// The exact inverse, for places that the table leaves out.
    #[cold]
    fn exact(&self, place: Point) -> [f64; 2] {
        angles_from_field(&self.plan.machine.optics, place.into())
            .map(|angles| [angles.x_rad, angles.y_rad])
            .expect("the audit has reached every place of the plan")
    }
}

/// The references of every sequence of a plan.
fn jump_shapes(plan: &Plan) -> Vec<JumpShape> {
    let (scanner, tick_s) = (&plan.machine.scanner, plan.machine.output.period_s());
    let galvo = Galvo::new(scanner);
    let Ok(gains) = Gains::design(scanner, tick_s) else {
        // The audit has built the same servo.
        return Vec::new();
    };
    let shape = |sequence_v: &Vec<f64>| JumpShape {
        step_rad: sequence_v.iter().sum::<f64>() * tick_s / galvo.torque_constant,
        references_rad: references_rad(sequence_v, &galvo, &gains, tick_s),
    };
    plan.sequences_v.iter().map(shape).collect()
}

/// The references for which the nominal servo applies these voltages from rest, rad from the start:
/// reference k is sent one tick before voltage k acts.
///
/// Source: `design/control.md` C, set-up b.
pub(crate) fn references_rad(
    sequence_v: &[f64],
    galvo: &Galvo,
    gains: &Gains,
    tick_s: f64,
) -> Vec<f64> {
    let step = galvo.step(tick_s);
    let (mut state, mut acting_v) = (State::zeros(), 0.0);
    sequence_v
        .iter()
        .map(|&next_v| {
            let reference_rad = gains.reference_rad(&state, acting_v, next_v);
            state = step.a * state + step.b * acting_v;
            acting_v = next_v;
            reference_rad.expect("the audit refuses jumps of a servo that has no such reference")
        })
        .collect()
}
