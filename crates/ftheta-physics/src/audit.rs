//! The audit of a plan: every sample within the machine's limits, light only where a mark says so.
//!
//! Small, separate, and without the planner's code: it walks the segments by itself, takes every
//! sample through the exact optics and the nominal servo and motor, and looks at what comes out.

mod beam;
mod lens;
mod light;
mod structure;
mod track;
mod walk;

use crate::axis_loop::AxisLoop;
use crate::follow::Inverse;
use crate::galvo::{CURRENT, Galvo, State};
use crate::optics::{angles_from_field, scale_mm_per_rad};
use crate::servo::{Gains, ServoError};
use beam::Beam;
use ftheta_model::machine::{Drive, Machine};
use ftheta_model::plan::{Motion, PlanDraft};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use lens::LensWalk;
use thiserror::Error;
use walk::{Command, Walk};

/// This share of the commanded angle and of the mirror's speed stays free for a correction table,
/// which is applied after the audit. Not quite 3 %: the corners of the presets' fields take up to
/// 97.3 % of the angle.
pub const CORRECTION_RESERVE: f64 = 0.027;

/// Commands that are computed from voltages lead the mirror, and may go so far, of the greatest
/// angle; the mirror itself leaves [`CORRECTION_RESERVE`].
pub const COMMAND_SHARE: f64 = 0.985;

/// What is called so in messages.
const DRIVER_VOLTAGE: &str = "driver voltage";
const COIL_CURRENT: &str = "coil current";
const COIL_HEAT: &str = "coil heat";

/// Rounding that a ratio of 1 may carry.
const ROUNDING: f64 = 1e-9;

/// Peaks over a whole plan, each divided by the machine's limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Mirror angle.
    pub angle: f64,
    /// Mirror speed.
    pub speed: f64,
    /// Voltage that the servo asks of the driver, before the driver clips it.
    pub voltage: f64,
    /// Coil current that this voltage leads to, before the driver limits it.
    pub current: f64,
    /// Heat of the coil: filtered square of the current by the square of the rms limit.
    pub heat: f64,
    /// Samples past a limit; none in a plan, since the first one refuses it.
    pub violations: u64,
}

/// What the audit found in a plan that it lets pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Audited {
    /// Peaks relative to the machine's limits.
    pub limits: Limits,
    /// Greatest distance of the lit nominal beam from its mark at ticks, mm; `None` for a plan that
    /// promises none: a classic one, or one for a head whose servo is not known.
    pub planned_error_mm: Option<f64>,
}

/// What the audit refuses.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum AuditError {
    /// The plan's parts do not fit together.
    #[error("plan is malformed at {place}: {what}")]
    Malformed {
        /// Segment, mark or vertex.
        place: String,
        /// What is wrong with it.
        what: String,
    },
    /// The optics cannot reach a place.
    #[error("{place}: the optics cannot reach ({x_mm:.3}, {y_mm:.3}) mm")]
    Unreachable {
        /// Sample and mark.
        place: String,
        /// Place, mm.
        x_mm: f64,
        /// Place, mm.
        y_mm: f64,
    },
    /// A limit of the motors is passed.
    #[error("{place}: {quantity} {value} {unit} exceeds the limit {limit} {unit}")]
    Limit {
        /// Sample and mark.
        place: String,
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Its limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// Light where no mark is.
    #[error(
        "{place}: laser {edge} edge lies {value_us:.1} µs away from its mark, limit {limit_us:.1} µs"
    )]
    Light {
        /// Mark.
        place: String,
        /// `on` or `off`.
        edge: &'static str,
        /// Distance in time, µs.
        value_us: f64,
        /// Greatest distance, µs.
        limit_us: f64,
    },
    /// Power out of range.
    #[error("{place}: power {value_w} W is outside 0 to {limit_w} W")]
    Power {
        /// Mark.
        place: String,
        /// Power, W.
        value_w: f64,
        /// Greatest power of the laser, W.
        limit_w: f64,
    },
    /// The nominal servo cannot be built.
    #[error(transparent)]
    Servo(#[from] ServoError),
}

impl AuditError {
    /// Whether driver or coils are asked too much, which gentler or rarer motion mends.
    pub fn is_strain(&self) -> bool {
        let strains = [DRIVER_VOLTAGE, COIL_CURRENT, COIL_HEAT];
        matches!(self, Self::Limit { quantity, .. } if strains.contains(quantity))
    }

    /// Whether the beam misses its mark, or its dose, which more care mends.
    pub fn is_miss(&self) -> bool {
        matches!(self, Self::Limit { quantity, .. } if beam::MISSES.contains(quantity))
    }

    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Malformed { place, what } => (place.clone(), what.clone(), String::new()),
            Self::Unreachable { place, x_mm, y_mm } => {
                (place.clone(), format!("({x_mm:.3}, {y_mm:.3}) mm"), "optics".into())
            }
            Self::Limit { place, value, limit, unit, .. } => {
                (place.clone(), format!("{value} {unit}"), format!("{limit} {unit}"))
            }
            Self::Light { place, value_us, limit_us, .. } => {
                (place.clone(), format!("{value_us} µs"), format!("{limit_us} µs"))
            }
            Self::Power { place, value_w, limit_w } => {
                (place.clone(), format!("{value_w} W"), format!("{limit_w} W"))
            }
            Self::Servo(error) => error.fault(),
        }
    }
}

/// Peaks of a plan on the nominal machine.
///
/// # Errors
/// The first thing that the machine does not allow. Angle and speed may use 97.3 % of their limits
/// (see [`CORRECTION_RESERVE`]).
pub fn audit(draft: &PlanDraft) -> Result<Audited, AuditError> {
    let scanner = &draft.machine.scanner;
    let (galvo, tick_s) = (Galvo::new(scanner), draft.machine.output.period_s());
    let gains = Gains::design(scanner, tick_s)?;
    let invertible = gains.reference_rad(&State::zeros(), 0.0, 0.0).is_some();
    let inverse = Inverse::new(&galvo, &gains, tick_s);
    structure::check_structure(draft)?;
    let by_voltage = invertible && draft.machine.output.drive != Drive::BlackBox;
    if by_voltage && inverse.is_none() {
        let what = "no voltage moves its mirrors".into();
        return Err(AuditError::Malformed { place: "the machine".into(), what });
    }
    light::check_light(draft, gains.lag_s(&galvo), by_voltage)?;
    let mut walk = Walk::new(draft, gains, inverse.as_ref(), by_voltage);
    let mut meter = Meter::new(draft, gains);
    let mut beam = Beam::new(draft, by_voltage);
    let mut lens = LensWalk::new(draft);
    let period_ns = f64::from(draft.machine.output.period_ns);
    let gap_max_rad = draft.tolerance_mm / scale_mm_per_rad(&draft.machine.optics);
    while let Some((command, segment_index)) = walk.next() {
        let gap_rad = walk.gap_rad();
        if gap_rad.is_nan() || gap_rad > gap_max_rad {
            let place = describe(draft, segment_index, meter.n_samples);
            let (value, limit) = (six_digits(gap_rad), six_digits(gap_max_rad));
            let quantity = "distance from where the motion before ends";
            return Err(AuditError::Limit { place, quantity, value, limit, unit: "rad" });
        }
        meter.sample(draft, command, segment_index)?;
        // The samples before this one have moved the mirrors to the end of its tick.
        beam.sample(meter.n_samples as f64 * period_ns, meter.angles())?;
        lens.sample(meter.n_samples, meter.angles())?;
    }
    lens.finish(meter.n_samples)?;
    Ok(Audited { limits: meter.limits, planned_error_mm: beam.worst_mm() })
}

/// Drives the nominal axes and keeps the peaks.
struct Meter {
    axes: [AxisLoop; 2],
    heat_a2: [f64; 2],
    heat_decay: f64,
    angle_row: State,
    speed_row: State,
    n_samples: u64,
    limits: Limits,
}

impl Meter {
    fn new(draft: &PlanDraft, gains: Gains) -> Self {
        let scanner = &draft.machine.scanner;
        let tick_s = draft.machine.output.period_s();
        let plant = Galvo::new(scanner);
        let axis = AxisLoop::new(&plant, gains, scanner, tick_s);
        Self {
            axes: [axis.clone(), axis],
            heat_a2: [0.0; 2],
            heat_decay: (-tick_s / scanner.thermal_time_s).exp(),
            angle_row: plant.mirror_row(),
            speed_row: plant.mirror_speed_row(),
            n_samples: 0,
            limits: Limits::default(),
        }
    }

    /// The mirrors now.
    fn angles(&self) -> MirrorAngles {
        let [x_rad, y_rad] = [0, 1].map(|axis| self.angle_row.dot(self.axes[axis].state()));
        MirrorAngles { x_rad, y_rad }
    }

    fn sample(
        &mut self,
        draft: &PlanDraft,
        command: Command,
        segment_index: usize,
    ) -> Result<(), AuditError> {
        let where_ = || describe(draft, segment_index, self.n_samples);
        let angles = match command {
            Command::Angles(angles) => angles,
            Command::Place(place) => {
                angles_from_field(&draft.machine.optics, place).ok_or_else(|| {
                    AuditError::Unreachable { place: where_(), x_mm: place.x_mm, y_mm: place.y_mm }
                })?
            }
        };
        let scanner = &draft.machine.scanner;
        let commanded_rad = angles.x_rad.abs().max(angles.y_rad.abs());
        let commanded = commanded_rad / scanner.angle_max_rad;
        let mut now = Limits { angle: commanded, ..Limits::default() };
        for (axis, command) in [angles.x_rad, angles.y_rad].into_iter().enumerate() {
            let (demand_v, demand_a) = self.axes[axis].demand();
            self.axes[axis].tick(command, 0.0);
            let state = self.axes[axis].state();
            let current_a = state[CURRENT];
            let heat = &mut self.heat_a2[axis];
            *heat = current_a * current_a + (*heat - current_a * current_a) * self.heat_decay;
            let angle_rad = self.angle_row.dot(state).abs();
            now.angle = now.angle.max(angle_rad / scanner.angle_max_rad);
            let speed_rad_s = self.speed_row.dot(state).abs();
            now.speed = now.speed.max(speed_rad_s / scanner.speed_max_rad_s);
            now.voltage = now.voltage.max(demand_v.abs() / scanner.voltage_max_v);
            now.current = now.current.max(demand_a.abs() / scanner.current_max_a);
            now.heat = now.heat.max(*heat / (scanner.current_rms_a * scanner.current_rms_a));
        }
        let computed = matches!(
            draft.segments[segment_index].motion,
            Motion::Track { .. } | Motion::Drive { .. }
        );
        let share = if computed { COMMAND_SHARE } else { 1.0 - CORRECTION_RESERVE };
        refuse(draft, (commanded, share), &now, where_)?;
        self.n_samples += 1;
        self.limits.keep_peaks(&now);
        Ok(())
    }
}

impl Limits {
    fn keep_peaks(&mut self, now: &Self) {
        self.angle = self.angle.max(now.angle);
        self.speed = self.speed.max(now.speed);
        self.voltage = self.voltage.max(now.voltage);
        self.current = self.current.max(now.current);
        self.heat = self.heat.max(now.heat);
        let worst = [now.angle, now.speed, now.voltage, now.current, now.heat];
        self.violations += u64::from(worst.iter().any(|&ratio| ratio > 1.0 + ROUNDING));
    }
}

/// The error for the first quantity of a sample that is past its limit.
fn refuse(
    draft: &PlanDraft,
    (commanded, command_share): (f64, f64),
    now: &Limits,
    place: impl Fn() -> String,
) -> Result<(), AuditError> {
    let scanner = &draft.machine.scanner;
    let free = 1.0 - CORRECTION_RESERVE;
    let word_range_rad = draft.machine.output.word_range_rad;
    let word = commanded * scanner.angle_max_rad / word_range_rad;
    let rows = [
        (word, 1.0, "commanded angle (output word)", word_range_rad.to_degrees(), "deg"),
        (commanded, command_share, "commanded angle", scanner.angle_max_rad.to_degrees(), "deg"),
        (now.angle, 1.0, "mirror angle", scanner.angle_max_rad.to_degrees(), "deg"),
        (now.speed, free, "mirror speed", scanner.speed_max_rad_s, "rad/s"),
        (now.voltage, 1.0, DRIVER_VOLTAGE, scanner.voltage_max_v, "V"),
        (now.current, 1.0, COIL_CURRENT, scanner.current_max_a, "A"),
        (now.heat, 1.0, COIL_HEAT, scanner.current_rms_a * scanner.current_rms_a, "A²"),
    ];
    for (ratio, share, quantity, limit, unit) in rows {
        if ratio.is_nan() || ratio > share + ROUNDING {
            let (value, limit) = (six_digits(ratio * limit), six_digits(share * limit));
            return Err(AuditError::Limit { place: place(), quantity, value, limit, unit });
        }
    }
    Ok(())
}

/// A number as it is best read, without the noise of its last bits.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// Checks that the whole field of a machine can be commanded: reached by the optics, within the
/// angle that plans may use, and within the output word.
///
/// # Errors
/// The first place on the field's edge that cannot.
pub fn check_field(machine: &Machine) -> Result<(), AuditError> {
    const N_STEPS: i32 = 64;
    let half_mm = 0.5 * machine.optics.field_mm;
    let free_rad = (1.0 - CORRECTION_RESERVE) * machine.scanner.angle_max_rad;
    let limit_rad = free_rad.min(machine.output.word_range_rad);
    for step in -N_STEPS..=N_STEPS {
        let along_mm = half_mm * f64::from(step) / f64::from(N_STEPS);
        for place in [FieldPoint::new(along_mm, half_mm), FieldPoint::new(half_mm, along_mm)] {
            let (x_mm, y_mm) = (place.x_mm, place.y_mm);
            let named = || format!("edge of the field at ({x_mm:.3}, {y_mm:.3}) mm");
            let angles = angles_from_field(&machine.optics, place)
                .ok_or_else(|| AuditError::Unreachable { place: named(), x_mm, y_mm })?;
            let commanded_rad = angles.x_rad.abs().max(angles.y_rad.abs());
            if commanded_rad > limit_rad {
                return Err(AuditError::Limit {
                    place: named(),
                    quantity: "commanded angle",
                    value: six_digits(commanded_rad.to_degrees()),
                    limit: six_digits(limit_rad.to_degrees()),
                    unit: "deg",
                });
            }
        }
    }
    Ok(())
}

/// Sample and mark, for messages.
fn describe(draft: &PlanDraft, segment_index: usize, sample: u64) -> String {
    let time_ms = sample as f64 * draft.machine.output.period_s() * 1e3;
    match draft.segments[segment_index].mark_index {
        Some(index) => {
            let source = &draft.marks[index as usize].source;
            format!("mark {index} ({source}), sample {sample} at {time_ms:.3} ms")
        }
        None => format!("jump, sample {sample} at {time_ms:.3} ms"),
    }
}
