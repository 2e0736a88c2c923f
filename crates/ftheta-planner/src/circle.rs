//! Uniform circles, ellipses and spirals, exact through optics and motor.
//!
//! The mirrors' angles on a closed path are periodic, so they are sums of harmonics. A motor is
//! linear: each harmonic of the angle is one of the voltage, divided by the motor's response at the
//! ticks. A run-in from rest ends exactly in the states of the path, light is on for exactly one
//! turn, and a run-out leads back to rest (`design/control.md` E).

mod harmonics;
mod spiral;

use crate::PlanError;
use crate::jump::{AxisOptions, CurrentBound, JumpError, Model, Passage, fewest_ticks_of_passages};
use crate::optimal::lens::LensAxis;
use ftheta_model::machine::{Machine, Scanner};
use ftheta_model::plan::{Motion, PlanDraft, PlannedMark, Planner, Segment};
use ftheta_model::recipe::Pen;
use ftheta_physics::audit::CORRECTION_RESERVE;
use ftheta_physics::galvo::State;
use ftheta_physics::optics::scale_mm_per_rad;
use harmonics::{Harmonics, States};
use kurbo::{Point, Vec2};
pub use spiral::{Spiral, spiral};

/// Ticks at rest in the centre after everything.
const N_TICKS_LAST: u32 = 2;
/// Part of the tolerance by which a mirror may be off after a run-in, on any motor within the
/// machine file's uncertainties.
const HELD_SHARE: f64 = 0.5;
/// Where on a turn a run-in may end, a power of two; the one that takes the fewest ticks is taken.
const N_STARTS: u32 = 8;

/// In the field's centre.
const REST: States = [State::new(0.0, 0.0, 0.0, 0.0, 0.0); 2];

/// An ellipse, its axes along those of the field, passed at constant speed against the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Its centre, field mm.
    pub centre: Point,
    /// Half its axes along x and y, mm.
    pub radii_mm: Vec2,
    /// Speed of the beam, mm/s.
    pub speed_mm_s: f64,
}

impl Ellipse {
    /// An ellipse by its centre and half its axes, mm, and its speed, mm/s.
    pub fn new(centre_mm: [f64; 2], radii_mm: [f64; 2], speed_mm_s: f64) -> Self {
        let ([x, y], [along_x, along_y]) = (centre_mm, radii_mm);
        Self { centre: Point::new(x, y), radii_mm: Vec2::new(along_x, along_y), speed_mm_s }
    }
}

/// How an ellipse is marked.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleOptions {
    /// Power and name; the speed is the ellipse's.
    pub pen: Pen,
    /// Greatest distance of the beam that the audit allows between motions, mm.
    pub tolerance_mm: f64,
    /// Part of the voltage kept for the servo's feedback, 0 to below 1.
    pub voltage_reserve: f64,
}

/// A planned ellipse.
#[derive(Clone, Debug)]
pub struct CircleDraft {
    /// Run-in, one turn, run-out.
    pub draft: PlanDraft,
    /// Run-in from rest in the centre to the first light, s.
    pub run_in_s: f64,
    /// Run-out to rest, s.
    pub run_out_s: f64,
    /// One turn, s.
    pub turn_s: f64,
}

/// The voltages of a motion, tick by tick, for both axes.
type Voltages = Vec<[f64; 2]>;

/// Plans one turn of an ellipse.
///
/// # Errors
/// If the optics do not reach it, a turn takes less than ten ticks, the axes cannot get into it,
/// or a program fails.
///
/// # Accuracy
/// The nominal mirror is on the ellipse within 1 nm at the ticks, as long as what the lens makes of
/// it has no harmonics beyond a quarter of the ticks' rate.
pub fn draft(
    machine: &Machine,
    ellipse: &Ellipse,
    options: &CircleOptions,
) -> Result<CircleDraft, PlanError> {
    let period_s = machine.output.period_s();
    let harmonics = Harmonics::new(machine, ellipse)?;
    let turn_s = ellipse.length_mm() / ellipse.speed_mm_s;
    let passages = Passages::new(machine, options);
    let epsilon_rad = HELD_SHARE * options.tolerance_mm / scale_mm_per_rad(&machine.optics);
    let (run_in, start) = run_in(&passages, &harmonics, epsilon_rad)?;
    let n_turn = (turn_s / period_s - 1e-9).ceil() as usize;
    let phase = |tick: usize| start + tick as f64 * period_s / turn_s;
    let turn: Voltages = (0..n_turn).map(|tick| harmonics.voltages_v(phase(tick))).collect();
    let way_out = [harmonics.states(phase(n_turn)), REST];
    let run_out = passages.between(Model::Flexible, way_out, 1)?.ok_or_else(no_room)?;
    let laser = &machine.laser;
    let way_in = [REST, harmonics.states(phase(0))];
    let [n_first, n_last] = rests(machine, [(&run_in, way_in), (&run_out, way_out)])?;
    let mut builder = Builder { drives: Vec::new(), segments: Vec::new() };
    builder.hold(n_first);
    let n_in = run_in.len();
    builder.drive(None, &run_in);
    builder.drive(Some(0), &turn);
    let n_out = run_out.len();
    builder.drive(None, &run_out);
    builder.hold(n_last);
    // Computed voltages act a tick after their sample.
    let on_s = (f64::from(n_first) + n_in as f64 + 1.0) * period_s;
    let edge_ns =
        |light_s: f64, latency_ns: i64| ((light_s * 1e9).round() as i64 - latency_ns) as u64;
    let mark = PlannedMark {
        curve: ellipse.curve(start),
        pen_index: 0,
        source: "circle".into(),
        on_ns: edge_ns(on_s, laser.on_latency_ns),
        off_ns: edge_ns(on_s + turn_s, laser.off_latency_ns),
        power_w: options.pen.power_w,
        steps: Vec::new(),
    };
    let pen = Pen { mark_speed_mm_s: ellipse.speed_mm_s, ..options.pen.clone() };
    Ok(CircleDraft {
        draft: PlanDraft {
            machine: machine.clone(),
            planner: Planner::Optimal,
            tolerance_mm: options.tolerance_mm,
            pens: vec![pen],
            marks: vec![mark],
            vertices: vec![Point::ZERO],
            stations: Vec::new(),
            knots: Vec::new(),
            drives: builder.drives,
            segments: builder.segments,
        },
        run_in_s: n_in as f64 * period_s,
        run_out_s: n_out as f64 * period_s,
        turn_s,
    })
}

/// Ticks of rest in the centre before the way to an ellipse and after the way back: for light that
/// begins late, for the mirrors, and for a focusing lens that takes longer than they do.
///
/// * `ways`: there and back, and the states at their ends
fn rests(machine: &Machine, ways: [(&Voltages, [States; 2]); 2]) -> Result<[u32; 2], PlanError> {
    let lead_ns = machine.laser.on_latency_ns.max(0) as u64;
    let lead_ticks = lead_ns.div_ceil(u64::from(machine.output.period_ns)) as u32;
    let (mut first, mut last) = (lead_ticks, N_TICKS_LAST);
    if let Some(lens) = LensAxis::new(machine) {
        let wait = |(way, ends): (&Voltages, [States; 2])| -> Result<u32, PlanError> {
            let ends = ends.each_ref().map(|states| lens.state(states));
            // At the edge of light the lens is between two ticks.
            let n_ticks = lens.n_ticks(ends, 1).ok_or_else(no_room)? + 1;
            Ok(n_ticks.saturating_sub(way.len()) as u32)
        };
        let [there, back] = ways;
        // Nothing moves before the lag.
        first = first.max(lens.n_lag_ticks() + wait(there)?);
        last = last.max(wait(back)?);
    }
    Ok([first + 1, last + 1])
}

/// The shortest way from rest in the centre into the ellipse, and the turns at which it gets there.
///
/// * `epsilon_rad`: how far a mirror may be off after it, on any motor within the uncertainties
fn run_in(
    passages: &Passages,
    harmonics: &Harmonics,
    epsilon_rad: f64,
) -> Result<(Voltages, f64), PlanError> {
    let mut best: Option<(usize, f64)> = None;
    for start in (0..N_STARTS).map(|index| f64::from(index) / f64::from(N_STARTS)) {
        let way = [REST, harmonics.states(start)];
        if let Some(found) = passages.between(Model::Flexible, way, 1)?
            && best.is_none_or(|(n_ticks, _)| found.len() < n_ticks)
        {
            best = Some((found.len(), start));
        }
    }
    let (n_ticks, start) = best.ok_or_else(no_room)?;
    let way = [REST, harmonics.states(start)];
    let held = passages.between(Model::Held { epsilon_rad }, way, n_ticks)?;
    Ok((held.ok_or_else(no_room)?, start))
}

/// Solves motion between states of both axes.
struct Passages {
    scanner: Scanner,
    tick_s: f64,
    voltage_reserve: f64,
}

impl Passages {
    fn new(machine: &Machine, options: &CircleOptions) -> Self {
        let angle_max_rad = (1.0 - CORRECTION_RESERVE) * machine.scanner.angle_max_rad;
        let scanner = Scanner { angle_max_rad, ..machine.scanner.clone() };
        let tick_s = machine.output.period_s();
        Self { scanner, tick_s, voltage_reserve: options.voltage_reserve }
    }

    /// The voltages in the fewest ticks, from some number on.
    fn between(
        &self,
        model: Model,
        [from, to]: [States; 2],
        n_ticks_min: usize,
    ) -> Result<Option<Voltages>, JumpError> {
        let Self { tick_s, voltage_reserve, .. } = *self;
        let current_bound = CurrentBound::Always;
        let axis = AxisOptions { model, tick_s, voltage_reserve, current_bound };
        let passages = [0, 1].map(|axis| Passage { from: from[axis], to: to[axis] });
        let found = fewest_ticks_of_passages(&self.scanner, axis, &passages, n_ticks_min)?;
        Ok(found.map(|axes| axes[0].iter().zip(&axes[1]).map(|(x, y)| [*x, *y]).collect()))
    }
}

fn no_room() -> PlanError {
    PlanError::NoRoom { place: "circle".into() }
}

/// Segments and drives under construction.
struct Builder {
    drives: Vec<[f32; 2]>,
    segments: Vec<Segment>,
}

impl Builder {
    fn hold(&mut self, n_ticks: u32) {
        self.segments.push(Segment {
            mark_index: None,
            n_ticks,
            motion: Motion::Hold { vertex: 0 },
        });
    }

    fn drive(&mut self, mark_index: Option<u32>, voltages: &Voltages) {
        let first = self.drives.len() as u32;
        self.drives.extend(voltages.iter().map(|pair| pair.map(|volts| volts as f32)));
        let motion = Motion::Drive { first };
        self.segments.push(Segment { mark_index, n_ticks: voltages.len() as u32, motion });
    }
}
