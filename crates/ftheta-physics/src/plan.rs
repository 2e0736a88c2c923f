//! A plan: audited motion and laser edges, immutable, with an id that is a hash of its content.

use crate::audit::{AuditError, Audited, Limits, audit};
use ftheta_model::machine::{Drive, Lens, Machine, Servo};
use ftheta_model::plan::{Motion, PlanDraft};
use ftheta_model::recipe::Interpolation;
use kurbo::{BezPath, PathEl, Point};
use sha2::{Digest, Sha256};
use std::fmt;
use std::ops::Deref;

/// Motion and laser edges that passed the audit; nothing else reaches a device or the twin.
///
/// It lives here and not beside its content in `ftheta-model` because its constructor runs the
/// audit, and the audit needs motors, servo and optics.
#[derive(Clone, Debug)]
pub struct Plan {
    draft: PlanDraft,
    id: PlanId,
    audited: Audited,
}

/// Hash of a plan's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PlanId(u64);

impl Plan {
    /// Audits `draft` and makes it a plan: the only constructor.
    ///
    /// # Errors
    /// The first thing in the plan that the machine does not allow.
    pub fn new(draft: PlanDraft) -> Result<Self, AuditError> {
        let audited = audit(&draft)?;
        let id = PlanId::of(&draft);
        Ok(Self { draft, id, audited })
    }

    /// Hash of the plan's content, printed wherever the plan is named.
    pub fn id(&self) -> PlanId {
        self.id
    }

    /// Peaks that the audit found, relative to the machine's limits.
    pub fn limits(&self) -> &Limits {
        &self.audited.limits
    }

    /// Greatest distance of the lit nominal beam from its mark that the audit found, mm; see
    /// [`Audited`].
    pub fn planned_error_mm(&self) -> Option<f64> {
        self.audited.planned_error_mm
    }
}

impl Deref for Plan {
    type Target = PlanDraft;

    fn deref(&self) -> &PlanDraft {
        &self.draft
    }
}

impl fmt::Display for PlanId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl PlanId {
    /// First 64 bits of the SHA-256 of the plan's content, numbers as their bits.
    pub fn of(draft: &PlanDraft) -> Self {
        let mut hash = Feed(Sha256::new());
        hash.machine(&draft.machine);
        hash.text(&format!("{:?}", draft.planner));
        hash.number(draft.tolerance_mm);
        for pen in &draft.pens {
            hash.text(&pen.name);
            hash.number(pen.mark_speed_mm_s);
            hash.number(pen.power_w);
        }
        for mark in &draft.marks {
            hash.curve(&mark.curve);
            hash.count(mark.pen_index as u64);
            hash.count(mark.on_ns);
            hash.count(mark.off_ns);
            hash.number(mark.power_w);
            for step in &mark.steps {
                hash.count(step.time_ns);
                hash.number(step.power_w);
            }
        }
        draft.vertices.iter().for_each(|&vertex| hash.point(vertex));
        for station in &draft.stations {
            hash.point(station.arriving.to_point());
            hash.point(station.leaving.to_point());
            hash.number(station.distance_mm);
        }
        for knot in &draft.knots {
            [knot.time_s, knot.distance_mm, knot.speed_mm_s]
                .iter()
                .for_each(|&value| hash.number(value));
        }
        for pair in &draft.drives {
            pair.iter().for_each(|value| hash.0.update(value.to_bits().to_le_bytes()));
        }
        for segment in &draft.segments {
            hash.count(segment.mark_index.map_or(u64::MAX, u64::from));
            hash.count(u64::from(segment.n_ticks));
            hash.motion(&segment.motion);
        }
        let digest = hash.0.finalize();
        let mut first = [0; 8];
        first.copy_from_slice(&digest[..8]);
        Self(u64::from_be_bytes(first))
    }
}

/// Feeds values to the hash in one fixed form.
struct Feed(Sha256);

impl Feed {
    fn number(&mut self, value: f64) {
        self.0.update(value.to_bits().to_le_bytes());
    }

    fn count(&mut self, value: u64) {
        self.0.update(value.to_le_bytes());
    }

    fn text(&mut self, value: &str) {
        self.count(value.len() as u64);
        self.0.update(value);
    }

    fn point(&mut self, point: Point) {
        self.number(point.x);
        self.number(point.y);
    }

    fn curve(&mut self, curve: &BezPath) {
        self.count(curve.elements().len() as u64);
        for &element in curve.elements() {
            let (kind, points): (u64, &[Point]) = match &element {
                PathEl::MoveTo(a) => (0, &[*a]),
                PathEl::LineTo(a) => (1, &[*a]),
                PathEl::QuadTo(a, b) => (2, &[*a, *b]),
                PathEl::CurveTo(a, b, c) => (3, &[*a, *b, *c]),
                PathEl::ClosePath => (4, &[]),
            };
            self.count(kind);
            points.iter().for_each(|&point| self.point(point));
        }
    }

    fn motion(&mut self, motion: &Motion) {
        match *motion {
            Motion::Hold { vertex } => {
                self.count(0);
                self.count(u64::from(vertex));
            }
            Motion::Travel { first_vertex, n_vertices, profile, interpolation } => {
                self.count(1);
                self.count(u64::from(first_vertex));
                self.count(u64::from(n_vertices));
                self.number(profile.length_mm);
                self.number(profile.speed_mm_s);
                self.number(profile.acceleration_mm_s2);
                self.number(profile.deceleration_mm_s2);
                self.count(u64::from(interpolation == Interpolation::Dda));
            }
            Motion::Track {
                first_vertex,
                n_vertices,
                first_station,
                first_knot,
                n_knots,
                smoothing_ticks,
            } => {
                self.count(2);
                self.count(first_station.map_or(u64::MAX, u64::from));
                [first_vertex, n_vertices, first_knot, n_knots, smoothing_ticks]
                    .iter()
                    .for_each(|&n| self.count(u64::from(n)));
            }
            Motion::Drive { first } => {
                self.count(3);
                self.count(u64::from(first));
            }
        }
    }

    /// The parts of the machine that decide what is sent and what it does; names do not count.
    fn machine(&mut self, machine: &Machine) {
        let Machine { name: _, scanner, optics, laser, output } = machine;
        for value in [
            scanner.rotor_inertia_kg_m2,
            scanner.mirror_inertia_kg_m2,
            scanner.torque_constant_n_m_a,
            scanner.resistance_ohm,
            scanner.inductance_h,
            scanner.torsional_mode_hz,
            scanner.damping_ratio,
            scanner.voltage_max_v,
            scanner.current_max_a,
            scanner.current_rms_a,
            scanner.thermal_time_s,
            scanner.angle_max_rad,
            scanner.speed_max_rad_s,
            scanner.losses.torque_falloff,
            scanner.losses.friction_coulomb_n_m,
            scanner.losses.friction_viscous_n_m_s_rad,
            laser.power_max_w,
            laser.on_latency_ns as f64,
            laser.off_latency_ns as f64,
            laser.minimum_on_ns as f64,
            laser.spot_diameter_mm,
            laser.pulse_khz.unwrap_or(0.0),
            f64::from(output.period_ns),
            f64::from(output.word_bits),
            output.word_range_rad,
            match output.drive {
                Drive::ServoKnown => 0.0,
                Drive::Voltage => 1.0,
                Drive::BlackBox => 2.0,
            },
            optics.field_mm,
        ] {
            self.number(value);
        }
        // Other machines keep the ids that they had before there were triggers.
        if laser.pulses_triggered {
            self.text("triggered");
        }
        self.text(&format!("{:?}", optics.first_mirror));
        match &optics.lens {
            Lens::FTheta { coefficients_mm } => {
                coefficients_mm.iter().for_each(|&value| self.number(value));
            }
            Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
                self.number(*mirror_distance_mm);
                self.number(*working_distance_mm);
            }
        }
        if optics.plane_mm != 0.0 {
            self.text("plane");
            self.number(optics.plane_mm);
        }
        // A head without such a lens keeps the ids that it had before there were any.
        if let Some(focus) = &optics.focus {
            self.text("focus");
            [
                focus.magnification,
                focus.travel_mm,
                focus.speed_max_mm_s,
                focus.acceleration_max_mm_s2,
                focus.lag_s,
                f64::from(u8::from(focus.balanced)),
            ]
            .iter()
            .for_each(|&value| self.number(value));
        }
        self.servo(scanner.servo);
    }

    fn servo(&mut self, servo: Servo) {
        match servo {
            Servo::StateFeedback { velocity_weight_s, lag_s } => {
                self.number(velocity_weight_s);
                self.number(lag_s);
            }
            Servo::Pid { bandwidth_hz, damping, integral_time_s, current_bandwidth_hz } => {
                [bandwidth_hz, damping, integral_time_s, current_bandwidth_hz]
                    .iter()
                    .for_each(|&value| self.number(value));
            }
        }
    }
}
