//! Planner `optimal`: marks at constant dose, between them motion at the limit of motors and
//! resonance.
//!
//! Every mark is a track: the place of the beam over time, with a speed that corners and bends
//! allow. The mirrors arrive at its first place with its speed, and leave its last place with it.

mod fly_by;
mod heat;
mod path;
mod smoothing;
mod speed;
mod weave;

use crate::PlanError;
use crate::classic::check_pen;
use crate::jump::Transitions;
use fly_by::FlyBy;
use ftheta_model::machine::{Drive, Machine, Servo};
use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::recipe::Pen;
use ftheta_model::toolpath::{Mark, Toolpath};
use ftheta_physics::follow::Inverse;
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::{angles_from_field, scale_mm_per_rad};
use ftheta_physics::servo::Gains;
use heat::Heat;
use kurbo::Point;
use path::Path;
use smoothing::Smoothing;
use speed::{SpeedLimits, profile, time_at_s};
use weave::{Stretch, Weave};

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
}

/// In the order to be tried.
pub const RESTRAINTS: [Restraint; 4] = [
    Restraint { heat_share: 0.95, current_reserve: 0.02, voltage_reserve: 0.0 },
    Restraint { heat_share: 0.8, current_reserve: 0.08, voltage_reserve: 0.08 },
    Restraint { heat_share: 0.6, current_reserve: 0.2, voltage_reserve: 0.2 },
    Restraint { heat_share: 0.4, current_reserve: 0.4, voltage_reserve: 0.4 },
];

/// Part of the tolerance by which a plan itself may miss a curve; the rest is for the machine.
const MISS_SHARE: f64 = 0.85;
/// Part of the greatest angular acceleration that the beam may have along a mark.
const ALONG_SHARE: f64 = 0.35;
/// Part of the voltage and current that marks may use.
const MARK_SHARE: f64 = 0.8;
/// Rest before the first motion and after the last, ticks.
const N_REST_TICKS: u32 = 4;

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
    /// How corners are taken.
    pub corner: Corner,
    /// Part of the voltage that planned motion leaves to the servo, the restraint's included.
    pub voltage_reserve: f64,
    /// How much of the machine may be used.
    pub restraint: Restraint,
}

/// Why motion of this machine cannot be planned by voltage, if it cannot.
pub fn obstacle(machine: &Machine) -> Option<&'static str> {
    match (machine.output.drive, machine.scanner.servo) {
        (Drive::BlackBox, _) => Some("the drive is a black box: what its servo does is not known"),
        (_, Servo::Pid { .. }) => Some("the memory of a PID servo would outlast the jump"),
        (_, Servo::StateFeedback { .. }) => None,
    }
}

/// The content of a plan, before the audit.
///
/// The beam starts and ends in the field centre.
///
/// * `transitions`: of this machine's scanner and period, with an atlas that reaches as far as
///   [`longest_step_rad`]
///
/// # Errors
/// If a pen is out of the machine's range, a mark cannot be reached, or a program fails.
pub fn draft(
    toolpath: Toolpath,
    machine: &Machine,
    transitions: &Transitions,
    options: &OptimalOptions,
) -> Result<PlanDraft, PlanError> {
    if toolpath.marks.is_empty() {
        return Err(PlanError::Empty);
    }
    toolpath.pens.iter().try_for_each(|pen| check_pen(pen, machine))?;
    let galvo = Galvo::new(&machine.scanner);
    let tick_s = machine.output.period_s();
    let gains = Gains::design(&machine.scanner, tick_s)?;
    let inverse = Inverse::new(&galvo, &gains, tick_s).ok_or(PlanError::Immovable)?;
    let smoothing = Smoothing::new(machine, &galvo, &gains, &inverse);
    let Restraint { heat_share, current_reserve, .. } = options.restraint;
    let current_max_a = (1.0 - 0.5 * current_reserve) * machine.scanner.current_max_a;
    let fly_by =
        FlyBy::new(transitions, machine, gains, options.voltage_reserve, current_max_a);
    let Toolpath { pens, marks } = toolpath;
    let draft = PlanDraft {
        machine: machine.clone(),
        planner: Planner::Optimal,
        tolerance_mm: options.tolerance_mm,
        pens,
        marks: Vec::with_capacity(marks.len()),
        vertices: Vec::new(),
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments: Vec::new(),
    };
    let heat = Heat::new(machine, heat_share);
    let weave = Weave::new(machine, &inverse, &smoothing, fly_by, heat, draft);
    let mut marking = Marking { weave, options, galvo };
    marking.weave.rest_in_centre(N_REST_TICKS);
    for mark in marks {
        marking.mark(mark)?;
    }
    if !marking.weave.fly_home()? {
        return Err(PlanError::NoRoom { place: "the way back to the centre".into() });
    }
    let n_last = marking.lead_out_ticks();
    marking.weave.rest_in_centre(n_last);
    Ok(marking.weave.draft)
}

/// The longest step that an axis takes from the centre through the marks and back, rad.
pub fn longest_step_rad(toolpath: &Toolpath, machine: &Machine) -> f64 {
    let angles = |place: Point| angles_from_field(&machine.optics, place.into());
    let mut at = angles(Point::ZERO);
    let mut longest_rad = 0.0_f64;
    for mark in &toolpath.marks {
        if let (Some(from), Some(to)) = (at, angles(mark.start())) {
            let step_rad = (to.x_rad - from.x_rad).abs().max((to.y_rad - from.y_rad).abs());
            longest_rad = longest_rad.max(step_rad);
        }
        at = mark.points.last().and_then(|&end| angles(end));
    }
    // And back to the centre.
    let back_rad = at.map_or(0.0, |end| end.x_rad.abs().max(end.y_rad.abs()));
    longest_rad.max(back_rad)
}

/// Plans mark after mark.
struct Marking<'a> {
    weave: Weave<'a>,
    options: &'a OptimalOptions,
    galvo: Galvo,
}

impl Marking<'_> {
    /// Flies to a mark and makes it.
    fn mark(&mut self, mark: Mark) -> Result<(), PlanError> {
        let pen = self.weave.draft.pens[mark.pen_index].clone();
        let Some(path) = Path::new(&mark).or_else(|| Path::straight(&mark.points)) else {
            return Ok(());
        };
        let knots = profile(&path, &self.limits(&pen), self.weave.smoothing);
        let index = self.weave.draft.marks.len() as u32;
        let place = format!("mark {index} ({})", mark.source);
        let length_mm = path.length_mm();
        let light_s = time_at_s(&knots, length_mm);
        let laid = self.weave.lay(&Stretch { path, knots: knots.clone(), n_ticks: None }, &place)?;
        if !self.weave.fly_to(&laid)? {
            return Err(PlanError::NoRoom { place });
        }
        let start_s = self.weave.now_s();
        self.weave.follow(index, &laid);
        let powers = self.powers(&pen, &knots, laid.n_ticks(), start_s);
        let planned = PlannedMark {
            curve: mark.curve,
            pen_index: mark.pen_index,
            source: mark.source,
            on_ns: 0,
            off_ns: 0,
            power_w: powers.first().map_or(pen.power_w, |&(_, power_w)| power_w),
            steps: Vec::new(),
        };
        self.weave.light(planned, [start_s, start_s + light_s], &powers)
    }

    /// Power at every tick of a mark whose speed changes, s and W.
    fn powers(
        &self,
        pen: &Pen,
        knots: &[ftheta_model::plan::Knot],
        n_ticks: u32,
        start_s: f64,
    ) -> Vec<(f64, f64)> {
        if knots.len() == 1 || !self.weave.machine.laser.power_modulated {
            return Vec::new();
        }
        let speeds_mm_s = self.weave.speeds_mm_s(knots, n_ticks);
        let tick_s = self.weave.machine.output.period_s();
        let power_w = |speed_mm_s: f64| {
            let ratio = (speed_mm_s / pen.mark_speed_mm_s).clamp(1e-3, 1.0);
            pen.power_w * ratio
        };
        speeds_mm_s
            .into_iter()
            .enumerate()
            .map(|(tick, speed_mm_s)| (start_s + tick as f64 * tick_s, power_w(speed_mm_s)))
            .collect()
    }

    fn limits(&self, pen: &Pen) -> SpeedLimits {
        let machine = self.weave.machine;
        let scanner = &machine.scanner;
        let scale = scale_mm_per_rad(&machine.optics);
        let most = self.galvo.torque_constant / self.galvo.inertia() * scanner.current_max_a;
        let speed_mm_s = pen.mark_speed_mm_s;
        let voltage_max_v =
            MARK_SHARE * (1.0 - self.options.voltage_reserve) * scanner.voltage_max_v;
        let current_max_a = MARK_SHARE * scanner.current_max_a;
        SpeedLimits {
            speed_mm_s,
            acceleration_mm_s2: ALONG_SHARE * most * scale,
            miss_mm: MISS_SHARE * self.options.tolerance_mm,
            change_mm_s: self.weave.smoothing.change_max_mm_s(
                speed_mm_s,
                voltage_max_v,
                current_max_a,
            ),
            stop_rad: f64::INFINITY,
        }
    }

    /// Rest at the end: until light has ended, and the mirrors have come to rest.
    fn lead_out_ticks(&self) -> u32 {
        let latency_s = self.weave.machine.laser.off_latency_ns.max(0) as f64 * 1e-9;
        N_REST_TICKS + 50 + (latency_s / self.weave.machine.output.period_s()).ceil() as u32
    }
}
