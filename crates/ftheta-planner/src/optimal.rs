//! Planner `optimal`: marks at constant dose, between them motion at the limit of motors and
//! resonance.
//!
//! Every mark is a track: the place of the beam over time, with a speed that corners and bends
//! allow. The mirrors arrive at its first place with its speed, and leave its last place with it.

mod fly_by;
mod glide;
mod heat;
mod join;
pub(crate) mod lens;
mod marking;
mod path;
mod pieces;
mod relief;
mod smoothing;
mod speed;
mod turn;
mod weave;

use crate::PlanError;
use crate::classic::check_pen;
use crate::corner::Corners;
use crate::jump::Transitions;
use fly_by::FlyBy;
use ftheta_model::machine::{Drive, Machine, Scanner, Servo};
use ftheta_model::plan::{PlanDraft, Planner};
use ftheta_model::recipe::Pen;
use ftheta_model::toolpath::Toolpath;
use ftheta_physics::follow::Inverse;
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::angles_from_field;
use ftheta_physics::servo::Gains;
use glide::Glide;
use heat::Heat;
use join::joined;
use kurbo::Point;
use lens::LensAxis;
use marking::Marking;
use smoothing::Smoothing;
use std::num::NonZero;
use std::thread;
use weave::{Mover, Weave};

/// How much of the machine planned motion may use: how much the servo's answer needs besides is
/// seen when the plan is audited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restraint {
    /// Part of the coil's steady heat that motion between marks may use.
    pub heat_share: f64,
    /// Part of the current that it leaves.
    pub current_reserve: f64,
    /// Part of the voltage that it leaves, of what the user's reserve has left.
    pub voltage_reserve: f64,
    /// Part of the coil's steady heat that marks may make as long as they bend one way.
    pub bend_heat_share: f64,
}

/// In the order to be tried.
pub const RESTRAINTS: [Restraint; 4] = [
    restraint(0.95, 0.02, 0.0, f64::INFINITY),
    restraint(0.8, 0.08, 0.08, 0.8),
    restraint(0.6, 0.2, 0.2, 0.6),
    restraint(0.4, 0.4, 0.4, 0.4),
];

const fn restraint(
    heat_share: f64,
    current_reserve: f64,
    voltage_reserve: f64,
    bend_heat_share: f64,
) -> Restraint {
    Restraint { heat_share, current_reserve, voltage_reserve, bend_heat_share }
}

/// Rest before the first motion and after the last, ticks.
const N_REST_TICKS: u32 = 4;

/// Ways at mark speed before and after light, for a servo that is not known, in its lags.
const RUN_LAGS: [f64; 2] = [2.5, 1.0];

/// Longest way between marks that counts as near, mm.
pub const NEAR_MM: f64 = 1.0;
/// How many times the torque constant's uncertainty is held on near ways, and up to which one:
/// there it costs next to no time, on long ones it does.
const NEAR_KT_FACTOR: f64 = 4.0;
const NEAR_KT_MAX: f64 = 0.02;

/// How corners are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Corner {
    /// What costs least for what the laser can do.
    #[default]
    Auto,
    /// Stops in the corner; power follows the speed.
    Exact,
    /// Stays within the tolerance; power follows the speed.
    Blend,
    /// Runs out, turns with the laser off, and runs in again at mark speed.
    Sky,
}

impl Corner {
    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Exact => "exact",
            Self::Blend => "blend",
            Self::Sky => "sky",
        }
    }
}

/// How a toolpath is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OptimalOptions {
    /// Greatest distance of the beam from a mark's curve, mm.
    pub tolerance_mm: f64,
    /// Part of what a plan may miss a curve by that it does: less leaves more to the machine.
    pub care: f64,
    /// How corners are taken.
    pub corner: Corner,
    /// Part of the voltage that planned motion leaves to the servo, the restraint's included.
    pub voltage_reserve: f64,
    /// How much of the machine may be used.
    pub restraint: Restraint,
}

/// What a machine lets one know of its servo, and so how its mirrors are moved.
#[derive(Clone, Copy, Debug)]
pub enum Motions<'a> {
    /// By voltages, through the inverse of a servo that is known.
    Known {
        /// Of this machine's scanner and period, with an atlas that reaches as far as
        /// [`longest_step_rad`].
        transitions: &'a Transitions,
        /// The same for ways of at most [`NEAR_MM`], on motors of [`near_scanner`].
        near: &'a Transitions,
        /// Of the same as `transitions`.
        corners: &'a Corners,
    },
    /// By angles, which the servo follows after its lag.
    Lag,
}

/// The scanner as less certain as near ways can be planned for.
pub fn near_scanner(scanner: &Scanner) -> Scanner {
    let kt = scanner.kt_uncertainty;
    Scanner { kt_uncertainty: kt.max(NEAR_KT_MAX.min(NEAR_KT_FACTOR * kt)), ..scanner.clone() }
}

/// Whether commands can be computed from voltages.
pub fn is_servo_known(machine: &Machine) -> bool {
    let feedback = matches!(machine.scanner.servo, Servo::StateFeedback { .. });
    feedback && machine.output.drive != Drive::BlackBox
}

/// Plans jobs on one machine; what does not depend on the job is prepared once.
pub struct OptimalPlanner<'a> {
    machine: &'a Machine,
    corners: Option<&'a Corners>,
    options: OptimalOptions,
    galvo: Galvo,
    inverse: Inverse,
    smoothing: Smoothing,
    lag_s: f64,
    mover: Mover<'a>,
}

impl<'a> OptimalPlanner<'a> {
    /// Prepares for jobs.
    ///
    /// # Errors
    /// If the servo cannot be designed, or no voltage moves the mirrors.
    pub fn new(
        machine: &'a Machine,
        motions: Motions<'a>,
        options: OptimalOptions,
    ) -> Result<Self, PlanError> {
        let galvo = Galvo::new(&machine.scanner);
        let tick_s = machine.output.period_s();
        let gains = Gains::design(&machine.scanner, tick_s)?;
        let inverse = Inverse::new(&galvo, &gains, tick_s).ok_or(PlanError::Immovable)?;
        let lag_s = gains.lag_s(&galvo);
        let mut smoothing = Smoothing::new(machine, &galvo, &gains, &inverse);
        let (mover, corners) = match motions {
            Motions::Known { transitions, near, corners } => {
                let current_share = 1.0 - 0.5 * options.restraint.current_reserve;
                let current_max_a = current_share * machine.scanner.current_max_a;
                let reserve = options.voltage_reserve;
                let fly_by =
                    FlyBy::new([transitions, near], machine, gains, reserve, current_max_a);
                (Mover::Voltage(Box::new(fly_by)), Some(corners))
            }
            Motions::Lag => {
                smoothing = smoothing.with_servo(lag_s);
                (Mover::Angle(Glide::new(machine, lag_s), lag_s), None)
            }
        };
        Ok(Self { machine, corners, options, galvo, inverse, smoothing, lag_s, mover })
    }

    /// Solves what a toolpath needs, on all processors, so that [`Self::draft`] finds it solved.
    ///
    /// Nothing comes of marks that cannot be planned; the draft tells of them.
    pub fn solve(&self, toolpath: &Toolpath) {
        if toolpath.pens.iter().any(|pen| check_pen(pen, self.machine, f64::INFINITY).is_err()) {
            return;
        }
        let n_threads = thread::available_parallelism().map_or(1, NonZero::get);
        let marks = joined(toolpath.marks.iter().cloned(), self.options.tolerance_mm);
        let n_marks = marks.len();
        let n_each = n_marks.div_ceil(n_threads).max(1);
        thread::scope(|scope| {
            for first in (0..n_marks).step_by(n_each) {
                // With the mark before, for the way from it to the first.
                let marks = &marks[first.saturating_sub(1)..n_marks.min(first + n_each)];
                let (starts, ends) = (first == 0, first + n_each >= n_marks);
                scope.spawn(move || {
                    let mut marking = self.marking(toolpath.pens.clone(), marks.len());
                    let _ = marking.all(marks.iter().cloned(), [starts, ends]);
                });
            }
        });
    }

    /// The content of a plan, before the audit.
    ///
    /// The beam starts and ends in the field centre.
    ///
    /// # Errors
    /// If a pen is out of the machine's range, a mark cannot be reached, or a program fails.
    pub fn draft(&self, toolpath: Toolpath) -> Result<PlanDraft, PlanError> {
        let Toolpath { pens, marks } = toolpath;
        if marks.is_empty() {
            return Err(PlanError::Empty);
        }
        pens.iter().try_for_each(|pen| check_pen(pen, self.machine, f64::INFINITY))?;
        let marks = joined(marks, self.options.tolerance_mm);
        if let Some(lens) = LensAxis::new(self.machine) {
            lens.check(&marks, self.options.tolerance_mm)?;
        }
        let mut marking = self.marking(pens, marks.len());
        marking.all(marks, [true; 2])?;
        marking.weave.rest_in_centre(lead_out_ticks(self.machine, self.lag_s));
        Ok(marking.weave.draft)
    }

    /// Before the first of so many marks.
    fn marking(&self, pens: Vec<Pen>, n_marks: usize) -> Marking<'_> {
        let Self { machine, corners, lag_s, .. } = *self;
        let draft = PlanDraft {
            machine: machine.clone(),
            planner: Planner::Optimal,
            tolerance_mm: self.options.tolerance_mm,
            pens,
            marks: Vec::with_capacity(n_marks),
            vertices: Vec::new(),
            stations: Vec::new(),
            knots: Vec::new(),
            drives: Vec::new(),
            segments: Vec::new(),
        };
        let heat = Heat::new(machine, self.options.restraint.heat_share);
        let weave = Weave::new(machine, &self.inverse, &self.smoothing, &self.mover, heat, draft);
        let run_s = RUN_LAGS.map(|lags| if corners.is_some() { 0.0 } else { lags * lag_s });
        Marking { weave, options: &self.options, corners, galvo: self.galvo, run_s }
    }
}

/// The longest step that an axis takes from the centre through the marks and back, rad.
pub fn longest_step_rad(toolpath: &Toolpath, machine: &Machine) -> f64 {
    let angles = |place: Point| angles_from_field(&machine.optics, place.into());
    let mut at = angles(Point::ZERO);
    let mut longest_rad = 0.0_f64;
    // Where mirrors wait for a focusing lens, they do so in the centre.
    let waits = machine.optics.focus.is_some();
    for mark in &toolpath.marks {
        let start = angles(mark.start());
        if let (Some(from), Some(to)) = (at, start) {
            let step_rad = (to.x_rad - from.x_rad).abs().max((to.y_rad - from.y_rad).abs());
            longest_rad = longest_rad.max(step_rad);
        }
        at = mark.points.last().and_then(|&end| angles(end));
        for place in [start, at].into_iter().flatten().filter(|_| waits) {
            longest_rad = longest_rad.max(place.x_rad.abs()).max(place.y_rad.abs());
        }
    }
    // And back to the centre.
    let back_rad = at.map_or(0.0, |end| end.x_rad.abs().max(end.y_rad.abs()));
    longest_rad.max(back_rad)
}

/// Rest at the end: until light has ended, and the mirrors have come to rest.
fn lead_out_ticks(machine: &Machine, lag_s: f64) -> u32 {
    let wait_s = 3.0 * lag_s + machine.laser.off_latency_ns.max(0) as f64 * 1e-9;
    N_REST_TICKS + (wait_s / machine.output.period_s()).ceil() as u32
}
