//! The constants of a classic controller, and the values that follow from the scanner's lag.

use crate::PlanError;
use ftheta_model::machine::Machine;
use ftheta_model::recipe::{ClassicRecipe, Interpolation, Pen};
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::servo::Gains;
use kurbo::Point;

/// Delays and speeds of a classic controller, complete.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Speed of jumps, mm/s.
    pub jump_speed_mm_s: f64,
    /// Wait after a jump of no length, s.
    pub jump_delay_min_s: f64,
    /// Wait after jumps of `jump_length_limit_mm` and more, s.
    pub jump_delay_s: f64,
    /// Length from which the jump delay no longer grows, mm.
    pub jump_length_limit_mm: f64,
    /// Wait after a mark, s.
    pub mark_delay_s: f64,
    /// Wait in a corner of 90 degrees, s.
    pub polygon_delay_s: f64,
    /// Laser-on edge after the mark's first command, ns.
    pub laser_on_delay_ns: i64,
    /// Laser-off edge after the mark's last command, ns.
    pub laser_off_delay_ns: i64,
    /// How micro-steps are computed.
    pub interpolation: Interpolation,
    /// Acceleration at the start of every vector of a mark, mm/s²; infinite for none.
    pub acceleration_mm_s2: f64,
    /// Deceleration at the end of every vector of a mark, mm/s²; infinite for none.
    pub deceleration_mm_s2: f64,
    /// Run at mark speed before every leg, s; see [`Settings::skywriting`].
    pub sky_run_in_s: f64,
    /// Run at mark speed after every leg, s.
    pub sky_run_out_s: f64,
}

/// Jump speed that suits most jobs, mm/s: faster jumps overshoot more than they save.
const JUMP_SPEED_MM_S: f64 = 4000.0;

/// Length from which jumps need the whole jump delay, mm.
const JUMP_LENGTH_LIMIT_MM: f64 = 10.0;

/// Longest delay that is not taken for a slip of units, s.
const DELAY_MAX_S: f64 = 0.1;

impl Settings {
    /// The user's settings, and for what is not set the values that follow from the servo's lag.
    ///
    /// One lag after its last command the mirror has all but arrived; long jumps ring out
    /// longer. The laser's edges follow the beam, less the laser's own latency.
    ///
    /// # Errors
    /// If the machine's servo cannot be built.
    pub fn new(machine: &Machine, recipe: &ClassicRecipe) -> Result<Self, PlanError> {
        let scanner = &machine.scanner;
        let gains = Gains::design(scanner, machine.output.period_s())?;
        let lag_s = gains.lag_s(&Galvo::new(scanner));
        let lag_ns = (lag_s * 1e9).round() as i64;
        let fastest_mm_s = fastest_mm_s(machine);
        // Where light is slow to come, the next on edge is early: it must not meet the last off.
        let light_gap_s = machine.output.period_s()
            + (machine.laser.on_latency_ns - machine.laser.off_latency_ns) as f64 * 1e-9;
        Ok(Self {
            jump_speed_mm_s: recipe
                .jump_speed_mm_s
                .unwrap_or(JUMP_SPEED_MM_S.min(0.9 * fastest_mm_s)),
            jump_delay_min_s: recipe.jump_delay_min_s.unwrap_or(lag_s),
            jump_delay_s: recipe.jump_delay_s.unwrap_or(2.0 * lag_s),
            jump_length_limit_mm: recipe.jump_length_limit_mm.unwrap_or(JUMP_LENGTH_LIMIT_MM),
            mark_delay_s: recipe.mark_delay_s.unwrap_or(lag_s.max(light_gap_s)),
            polygon_delay_s: recipe.polygon_delay_s.unwrap_or(lag_s),
            laser_on_delay_ns: recipe
                .laser_on_delay_ns
                .unwrap_or(lag_ns - machine.laser.on_latency_ns),
            laser_off_delay_ns: recipe
                .laser_off_delay_ns
                .unwrap_or(lag_ns - machine.laser.off_latency_ns),
            interpolation: recipe.interpolation.unwrap_or_default(),
            acceleration_mm_s2: recipe.acceleration_mm_s2.unwrap_or(f64::INFINITY),
            deceleration_mm_s2: recipe.deceleration_mm_s2.unwrap_or(f64::INFINITY),
            sky_run_in_s: recipe.sky_run_in_s.unwrap_or(0.0),
            sky_run_out_s: recipe.sky_run_out_s.unwrap_or(0.0),
        })
    }

    /// Whether every leg between corners is a mark of its own, at full speed from end to end: the
    /// beam runs in and out beside it, and jumps from one to the next. Then no mark or polygon
    /// delay is waited for, micro-steps are absolute, and there are no ramps.
    pub fn skywriting(&self) -> bool {
        self.sky_run_in_s > 0.0 || self.sky_run_out_s > 0.0
    }

    /// Wait after a jump: grows linearly with its length up to the limit, s.
    pub fn jump_delay_for_s(&self, length_mm: f64) -> f64 {
        let share = (length_mm / self.jump_length_limit_mm).min(1.0);
        self.jump_delay_min_s + share * (self.jump_delay_s - self.jump_delay_min_s)
    }

    /// Wait in the corner `at`: the polygon delay times 1 - cos of the turning angle, s.
    pub fn polygon_delay_for_s(&self, from: Point, at: Point, to: Point) -> f64 {
        let (before, after) = (at - from, to - at);
        let cosine = before.dot(after) / (before.hypot() * after.hypot());
        self.polygon_delay_s * (1.0 - cosine)
    }

    /// Rest before the first motion: a tick, and as long as a laser-on edge may come early, s.
    pub(crate) fn lead_in_s(&self, period_s: f64) -> f64 {
        2.0 * period_s + (-self.laser_on_delay_ns).max(0) as f64 * 1e-9
    }

    /// Rest after the last jump: until the mirror has arrived and light has ended, s.
    pub(crate) fn lead_out_s(&self) -> f64 {
        4.0 * self.jump_delay_s.max(1e-4) + self.laser_off_delay_ns.max(0) as f64 * 1e-9
    }

    /// Checks every value against what the machine and good sense allow.
    pub(crate) fn check(&self, machine: &Machine) -> Result<(), PlanError> {
        let fastest_mm_s = fastest_mm_s(machine);
        let nanosecond = 1e-9;
        let rows = [
            ("jump_speed", self.jump_speed_mm_s, 1e-3, fastest_mm_s, "mm/s"),
            ("jump_delay_min", self.jump_delay_min_s, 0.0, DELAY_MAX_S, "s"),
            ("jump_delay", self.jump_delay_s, 0.0, DELAY_MAX_S, "s"),
            ("jump_length_limit", self.jump_length_limit_mm, 1e-6, 1e6, "mm"),
            ("mark_delay", self.mark_delay_s, 0.0, DELAY_MAX_S, "s"),
            ("polygon_delay", self.polygon_delay_s, 0.0, DELAY_MAX_S, "s"),
            (
                "laser_on_delay",
                self.laser_on_delay_ns as f64 * nanosecond,
                -DELAY_MAX_S,
                DELAY_MAX_S,
                "s",
            ),
            (
                "laser_off_delay",
                self.laser_off_delay_ns as f64 * nanosecond,
                -DELAY_MAX_S,
                DELAY_MAX_S,
                "s",
            ),
            ("sky_run_in", self.sky_run_in_s, 0.0, DELAY_MAX_S, "s"),
            ("sky_run_out", self.sky_run_out_s, 0.0, DELAY_MAX_S, "s"),
            ("acceleration", self.acceleration_mm_s2, 1.0, f64::INFINITY, "mm/s²"),
            ("deceleration", self.deceleration_mm_s2, 1.0, f64::INFINITY, "mm/s²"),
        ];
        for (quantity, value, low, high, unit) in rows {
            check_range("recipe [classic]", quantity, value, (low, high), unit)?;
        }
        Ok(())
    }
}

/// Speed of the beam in the field's centre at the mirrors' greatest speed, whole mm/s.
pub(crate) fn fastest_mm_s(machine: &Machine) -> f64 {
    (machine.scanner.speed_max_rad_s * scale_mm_per_rad(&machine.optics)).floor()
}

/// Checks a pen's power against the machine, and its speed against a limit, mm/s.
pub(crate) fn check_pen(
    pen: &Pen,
    machine: &Machine,
    speed_max_mm_s: f64,
) -> Result<(), PlanError> {
    let place = format!("pen \"{}\"", pen.name);
    let range = (1e-3, speed_max_mm_s);
    check_range(&place, "mark_speed", pen.mark_speed_mm_s, range, "mm/s")?;
    check_range(&place, "power", pen.power_w, (0.0, machine.laser.power_max_w), "W")
}

fn check_range(
    place: &str,
    quantity: &'static str,
    value: f64,
    (low, high): (f64, f64),
    unit: &'static str,
) -> Result<(), PlanError> {
    if low <= value && value <= high {
        return Ok(());
    }
    Err(PlanError::Setting { place: place.into(), quantity, value, low, high, unit })
}
