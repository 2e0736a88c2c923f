//! A trace: what the beam did, as a perfect observer would have recorded it.

use crate::space::FieldPoint;

/// A stretch of what the beam did. A long run is handed over as consecutive stretches.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Time between neighbouring points, ns.
    pub step_ns: u64,
    /// Index of the first point; point i is at time `i · step_ns`.
    pub first_index: u64,
    /// Beam centre, one point per step.
    pub points: Vec<TracePoint>,
    /// Travel of the focusing lens at the end of each tick of the stretch, mm; empty for a head
    /// without one.
    pub lens_mm: Vec<f64>,
    /// Light that ended, or was cut at the end of the stretch, in order.
    pub light: Vec<Light>,
    /// Pulses of a pulsed laser, in order; a continuous one has none.
    pub pulses: Vec<Pulse>,
    /// One state per tick of the axes, for curves; thinned by the twin.
    pub states: Vec<AxisStates>,
}

/// A place of the beam centre in whole nanometres: half the memory of two floats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TracePoint {
    /// x, nm.
    pub x_nm: i32,
    /// y, nm.
    pub y_nm: i32,
}

/// An interval in which light left the laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Which interval of the run, from 0; the same index again is the same interval going on.
    pub index: usize,
    /// First light, ns from the first sample.
    pub on_ns: u64,
    /// Last light, ns from the first sample.
    pub off_ns: u64,
    /// Power, W. Of pulses the mean: each counts half before and half after itself.
    pub power_w: f64,
}

/// A pulse of light, short beside the motion of the beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// The interval of [`Light`] that it belongs to.
    pub index: usize,
    /// When, ns from the first sample.
    pub time_ns: u64,
    /// Its energy, J.
    pub energy_j: f64,
}

/// What the two axes were doing at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct AxisStates {
    /// Time from the first sample, ns.
    pub time_ns: u64,
    /// Mirror angles, mechanical rad.
    pub angle_rad: [f64; 2],
    /// Mirror speeds, mechanical rad/s.
    pub speed_rad_s: [f64; 2],
    /// Coil currents, A.
    pub current_a: [f64; 2],
    /// Driver voltages, V.
    pub voltage_v: [f64; 2],
}

impl From<TracePoint> for FieldPoint {
    fn from(point: TracePoint) -> Self {
        Self::new(f64::from(point.x_nm) * 1e-6, f64::from(point.y_nm) * 1e-6)
    }
}

impl From<FieldPoint> for TracePoint {
    /// Rounds to whole nanometres; a place beyond ±2.1 m is held there.
    fn from(point: FieldPoint) -> Self {
        Self { x_nm: (point.x_mm * 1e6).round() as i32, y_nm: (point.y_mm * 1e6).round() as i32 }
    }
}
