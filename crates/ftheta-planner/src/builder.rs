//! From vectors to segments: marks and jumps at constant speed with a classic controller's delays.

use crate::PlanError;
use crate::classic::{Settings, check_pen, fastest_mm_s, legs};
use ftheta_model::machine::Machine;
use ftheta_model::plan::{Motion, PlanDraft, PlannedMark, Planner, Segment, SpeedProfile};
use ftheta_model::recipe::{Interpolation, Pen};
use ftheta_model::toolpath::{Mark, Toolpath};
use kurbo::Point;

/// Ends closer than this are one place, mm: half the trace's resolution.
const SAME_PLACE_MM: f64 = 5e-7;

/// The content of a plan, before the audit.
pub(crate) fn draft(
    toolpath: Toolpath,
    machine: &Machine,
    settings: &Settings,
    tolerance_mm: f64,
) -> Result<PlanDraft, PlanError> {
    if toolpath.marks.is_empty() {
        return Err(PlanError::Empty);
    }
    settings.check(machine)?;
    let fastest_mm_s = fastest_mm_s(machine);
    toolpath.pens.iter().try_for_each(|pen| check_pen(pen, machine, fastest_mm_s))?;
    let n_vertices = toolpath.marks.iter().map(|mark| mark.points.len()).sum::<usize>() + 2;
    let mut builder = Builder {
        machine,
        settings,
        period_s: machine.output.period_s(),
        vertices: Vec::with_capacity(n_vertices),
        segments: Vec::new(),
        marks: Vec::with_capacity(toolpath.marks.len()),
        n_samples: 0,
    };
    builder.vertices.push(Point::ZERO);
    // One tick at rest before anything moves, and room for an early laser-on edge.
    builder.hold(None, settings.lead_in_s(builder.period_s))?;
    for mark in toolpath.marks {
        let pen = &toolpath.pens[mark.pen_index];
        if settings.skywriting() {
            builder.skywrite(mark, pen)?;
            continue;
        }
        builder.jump_to(mark.start())?;
        builder.mark(mark, pen)?;
        builder.hold(None, settings.mark_delay_s)?;
    }
    builder.jump_to(Point::ZERO)?;
    builder.hold(None, settings.lead_out_s())?;
    builder.check_edges()?;
    let Builder { vertices, segments, marks, .. } = builder;
    Ok(PlanDraft {
        machine: machine.clone(),
        planner: Planner::Classic,
        tolerance_mm,
        pens: toolpath.pens,
        marks,
        vertices,
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments,
    })
}

/// Appends motion, one vector after the other.
struct Builder<'a> {
    machine: &'a Machine,
    settings: &'a Settings,
    period_s: f64,
    vertices: Vec<Point>,
    segments: Vec<Segment>,
    marks: Vec<PlannedMark>,
    n_samples: u64,
}

impl Builder<'_> {
    fn last_vertex(&self) -> u32 {
        (self.vertices.len() - 1) as u32
    }

    /// Stays on the last vertex for the whole ticks in `time_s`.
    fn hold(&mut self, mark_index: Option<u32>, time_s: f64) -> Result<(), PlanError> {
        let vertex = self.last_vertex();
        self.push(mark_index, (time_s / self.period_s).round(), Motion::Hold { vertex })
    }

    fn push(
        &mut self,
        mark_index: Option<u32>,
        n_ticks: f64,
        motion: Motion,
    ) -> Result<(), PlanError> {
        if n_ticks < 1.0 {
            return Ok(());
        }
        if n_ticks > f64::from(u32::MAX) {
            let place = mark_index.map_or("jump".into(), |index| format!("mark {index}"));
            return Err(PlanError::TooLong { place, value: n_ticks, limit: u32::MAX });
        }
        self.segments.push(Segment { mark_index, n_ticks: n_ticks as u32, motion });
        self.n_samples += n_ticks as u64;
        Ok(())
    }

    /// Time of the command that was sent last, s.
    fn now_s(&self) -> f64 {
        (self.n_samples - 1) as f64 * self.period_s
    }

    /// Follows the vertices from `first_vertex` to the last one; returns the time it takes, s.
    fn travel(
        &mut self,
        mark_index: Option<u32>,
        (first_vertex, last_vertex): (u32, u32),
        profile: SpeedProfile,
    ) -> Result<f64, PlanError> {
        let duration_s = profile.duration_s();
        let motion = Motion::Travel {
            first_vertex,
            n_vertices: last_vertex - first_vertex + 1,
            profile,
            // A DDA cannot follow a leg's vertices without a stop.
            interpolation: match self.settings.skywriting() {
                true => Interpolation::Absolute,
                false => self.settings.interpolation,
            },
        };
        // Rounding must not add a tick to a time that is a whole number of them.
        let n_ticks = (duration_s / self.period_s - 1e-6).ceil().max(1.0);
        self.push(mark_index, n_ticks, motion)?;
        Ok(duration_s)
    }

    fn jump_to(&mut self, target: Point) -> Result<(), PlanError> {
        let from = self.vertices[self.last_vertex() as usize];
        let length_mm = from.distance(target);
        if length_mm <= SAME_PLACE_MM {
            // The next mark starts exactly where the last one ended, so that segments join.
            self.vertices.push(from);
            return Ok(());
        }
        let first_vertex = self.last_vertex();
        self.vertices.push(target);
        let profile = constant_speed(length_mm, self.settings.jump_speed_mm_s);
        self.travel(None, (first_vertex, first_vertex + 1), profile)?;
        self.hold(None, self.settings.jump_delay_for_s(length_mm))
    }

    /// Marks from the last vertex, where the jump ended, along the mark's points.
    fn mark(&mut self, mark: Mark, pen: &Pen) -> Result<(), PlanError> {
        let mark_index = Some(self.marks.len() as u32);
        let start_s = self.now_s();
        let mut run = Run { first_vertex: self.last_vertex(), length_mm: 0.0 };
        let mut end_s = start_s;
        let points = &mark.points;
        for index in 1..points.len() {
            // From the vertex, not the point before: the first may differ by what is one place.
            run.length_mm += self.vertices[self.last_vertex() as usize].distance(points[index]);
            self.vertices.push(points[index]);
            let wait_s = match points.get(index + 1) {
                Some(&next) => {
                    self.settings.polygon_delay_for_s(points[index - 1], points[index], next)
                }
                None => f64::INFINITY,
            };
            let dda = self.settings.interpolation == Interpolation::Dda;
            if !dda && wait_s < self.period_s {
                continue;
            }
            let last_vertex = self.last_vertex();
            let profile = SpeedProfile {
                length_mm: run.length_mm,
                speed_mm_s: pen.mark_speed_mm_s,
                acceleration_mm_s2: self.settings.acceleration_mm_s2,
                deceleration_mm_s2: self.settings.deceleration_mm_s2,
            };
            end_s = self.now_s();
            end_s += self.travel(mark_index, (run.first_vertex, last_vertex), profile)?;
            if wait_s.is_finite() {
                // A controller counts whole ticks, so what is left over is dropped.
                let n_ticks = (wait_s / self.period_s + 1e-6).floor();
                self.push(mark_index, n_ticks, Motion::Hold { vertex: last_vertex })?;
            }
            run = Run { first_vertex: last_vertex, length_mm: 0.0 };
        }
        self.push_light(mark, pen, start_s, end_s)
    }

    /// Marks every leg at full speed from end to end, running in before it and on after it.
    fn skywrite(&mut self, mark: Mark, pen: &Pen) -> Result<(), PlanError> {
        let (settings, period_s) = (self.settings, self.period_s);
        let legs =
            legs(mark, |from, at, to| settings.polygon_delay_for_s(from, at, to) >= period_s);
        legs.into_iter().try_for_each(|leg| self.leg(leg, pen))
    }

    fn leg(&mut self, leg: Mark, pen: &Pen) -> Result<(), PlanError> {
        let mark_index = Some(self.marks.len() as u32);
        let tick_mm = pen.mark_speed_mm_s * self.period_s;
        let n_ticks = |time_s: f64| (time_s / self.period_s).round();
        let (n_in, n_out) =
            (n_ticks(self.settings.sky_run_in_s), n_ticks(self.settings.sky_run_out_s));
        let points = &leg.points;
        let n = points.len();
        let ahead = (points[1] - points[0]).normalize();
        self.jump_to(points[0] - ahead * (n_in * tick_mm))?;
        self.run(None, &points[..1], pen)?;
        let start_s = self.now_s();
        let length_mm =
            self.vertices[self.last_vertex() as usize].distance(points[0]) + leg.length_mm();
        let end_s = start_s + length_mm / pen.mark_speed_mm_s;
        // A leg goes on for the rest of its last tick, so that the run-out takes whole ones.
        let rest_mm = (length_mm / tick_mm - 1e-6).ceil().max(1.0) * tick_mm - length_mm;
        let beyond = (points[n - 1] - points[n - 2]).normalize();
        let mut path = points[1..].to_vec();
        if rest_mm > SAME_PLACE_MM {
            path.push(points[n - 1] + beyond * rest_mm);
        }
        self.run(mark_index, &path, pen)?;
        let from = self.vertices[self.last_vertex() as usize];
        self.run(None, &[from + beyond * (n_out * tick_mm)], pen)?;
        self.push_light(leg, pen, start_s, end_s)
    }

    /// Follows `points` from the last vertex at the pen's speed.
    fn run(
        &mut self,
        mark_index: Option<u32>,
        points: &[Point],
        pen: &Pen,
    ) -> Result<(), PlanError> {
        let first_vertex = self.last_vertex();
        let mut from = self.vertices[first_vertex as usize];
        let mut length_mm = 0.0;
        for &point in points {
            length_mm += from.distance(point);
            self.vertices.push(point);
            from = point;
        }
        if length_mm <= SAME_PLACE_MM {
            self.vertices.truncate(first_vertex as usize + 1);
            return Ok(());
        }
        let profile = constant_speed(length_mm, pen.mark_speed_mm_s);
        self.travel(mark_index, (first_vertex, self.last_vertex()), profile).map(|_| ())
    }

    fn push_light(
        &mut self,
        mark: Mark,
        pen: &Pen,
        start_s: f64,
        end_s: f64,
    ) -> Result<(), PlanError> {
        let on_ns = nanoseconds(start_s) + self.settings.laser_on_delay_ns;
        let off_ns = nanoseconds(end_s) + self.settings.laser_off_delay_ns;
        if on_ns < 0 || off_ns < on_ns {
            return Err(PlanError::EdgesReversed {
                mark: self.marks.len(),
                origin: mark.source,
                on_us: on_ns as f64 * 1e-3,
                off_us: off_ns as f64 * 1e-3,
            });
        }
        self.marks.push(PlannedMark {
            curve: mark.curve,
            pen_index: mark.pen_index,
            source: mark.source,
            on_ns: on_ns as u64,
            off_ns: off_ns as u64,
            power_w: pen.power_w.min(self.machine.laser.power_max_w),
            steps: Vec::new(),
        });
        Ok(())
    }

    fn check_edges(&self) -> Result<(), PlanError> {
        for (index, pair) in self.marks.windows(2).enumerate() {
            if pair[1].on_ns < pair[0].off_ns {
                return Err(PlanError::EdgesOverlap {
                    mark: index,
                    origin: pair[0].source.clone(),
                    value_us: (pair[0].off_ns - pair[1].on_ns) as f64 * 1e-3,
                });
            }
        }
        Ok(())
    }
}

/// A stretch of a mark without a stop.
struct Run {
    first_vertex: u32,
    length_mm: f64,
}

fn constant_speed(length_mm: f64, speed_mm_s: f64) -> SpeedProfile {
    SpeedProfile {
        length_mm,
        speed_mm_s,
        acceleration_mm_s2: f64::INFINITY,
        deceleration_mm_s2: f64::INFINITY,
    }
}

fn nanoseconds(time_s: f64) -> i64 {
    (time_s * 1e9).round() as i64
}
