//! A plan's content: motion and laser edges on one tick grid, before it is audited.

use crate::machine::Machine;
use crate::recipe::{Interpolation, Pen};
use kurbo::{BezPath, Point};

/// The content of a plan. Only the audit in `ftheta-physics` turns it into a `Plan` to be played.
#[derive(Clone, Debug)]
pub struct PlanDraft {
    /// The machine it is for.
    pub machine: Machine,
    /// Which planner made it.
    pub planner: Planner,
    /// Greatest distance of the beam from a mark's curve that the job allows, mm.
    pub tolerance_mm: f64,
    /// Pens that marks refer to by index.
    pub pens: Vec<Pen>,
    /// What is marked, in order; light interval k belongs to mark k.
    pub marks: Vec<PlannedMark>,
    /// Vertices of all paths, field mm; segments refer to ranges of it.
    pub vertices: Vec<Point>,
    /// Voltages that planned jumps are scaled from, V, one per tick; jumps refer to them by index.
    pub sequences_v: Vec<Vec<f64>>,
    /// Motion from the first sample on, without a gap.
    pub segments: Vec<Segment>,
}

/// The planners there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planner {
    /// What RTC- and EZCAD-type controllers do.
    Classic,
    /// Jumps at the limit of motors and resonance.
    Optimal,
}

impl Planner {
    /// Its name in files, reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Optimal => "optimal",
        }
    }
}

/// A mark and its light.
#[derive(Clone, Debug)]
pub struct PlannedMark {
    /// The exact curve, field mm, in the direction of travel.
    pub curve: BezPath,
    /// Index into [`PlanDraft::pens`].
    pub pen_index: usize,
    /// The element it came from, for messages.
    pub source: String,
    /// Signal edge that switches the laser on, ns from the first sample.
    pub on_ns: u64,
    /// Signal edge that switches the laser off, ns.
    pub off_ns: u64,
    /// Power between the edges, W.
    pub power_w: f64,
}

/// A stretch of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The mark it belongs to, or `None` in a jump.
    pub mark_index: Option<u32>,
    /// Number of samples, one or more.
    pub n_ticks: u32,
    /// What the command does in these samples.
    pub motion: Motion,
}

/// What the command does during a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Stays where it is.
    Hold {
        /// Index of the vertex it stays on.
        vertex: u32,
    },
    /// Follows vertices. Sample j of the segment (from 1) is at time j ticks of the profile;
    /// the last sample is the last vertex.
    Travel {
        /// Index of the first vertex.
        first_vertex: u32,
        /// Number of vertices, two or more.
        n_vertices: u32,
        /// Speed along them.
        profile: SpeedProfile,
        /// How samples are computed.
        interpolation: Interpolation,
    },
    /// Goes from rest to rest by voltages, the same sequence on both axes, each with the factor
    /// that takes it from angle to angle. Sample j (from 1) is the reference for which the nominal
    /// servo applies voltage j of the sequence in the tick that follows.
    Jump {
        /// Index of the vertex it starts on.
        from_vertex: u32,
        /// Index of the vertex it ends on.
        to_vertex: u32,
        /// Index into [`PlanDraft::sequences_v`]; as many voltages as the segment has samples.
        sequence: u32,
    },
}

/// A trapezoid of speed along a path; infinite accelerations are constant speed at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Length of the path, mm.
    pub length_mm: f64,
    /// Greatest speed, mm/s.
    pub speed_mm_s: f64,
    /// Acceleration from rest, mm/s²; infinite for none.
    pub acceleration_mm_s2: f64,
    /// Deceleration to rest, mm/s²; infinite for none.
    pub deceleration_mm_s2: f64,
}

impl PlanDraft {
    /// Number of samples.
    pub fn n_samples(&self) -> u64 {
        self.segments.iter().map(|segment| u64::from(segment.n_ticks)).sum()
    }
}

impl Motion {
    /// Index of the vertex it starts on.
    pub fn first_vertex(&self) -> usize {
        match *self {
            Self::Hold { vertex } => vertex as usize,
            Self::Travel { first_vertex, .. } => first_vertex as usize,
            Self::Jump { from_vertex, .. } => from_vertex as usize,
        }
    }

    /// Index of the vertex it ends on.
    pub fn last_vertex(&self) -> usize {
        match *self {
            Self::Hold { vertex } => vertex as usize,
            Self::Travel { first_vertex, n_vertices, .. } => {
                first_vertex as usize + n_vertices as usize - 1
            }
            Self::Jump { to_vertex, .. } => to_vertex as usize,
        }
    }
}

impl SpeedProfile {
    /// Highest speed that is reached: less than `speed_mm_s` where the path is too short.
    pub fn peak_speed_mm_s(&self) -> f64 {
        let ramps_s2_mm = 0.5 / self.acceleration_mm_s2 + 0.5 / self.deceleration_mm_s2;
        if ramps_s2_mm == 0.0 {
            return self.speed_mm_s;
        }
        self.speed_mm_s.min((self.length_mm / ramps_s2_mm).sqrt())
    }

    /// Time from end to end, s.
    pub fn duration_s(&self) -> f64 {
        let v = self.peak_speed_mm_s();
        let ramps_mm =
            0.5 * v * v * (1.0 / self.acceleration_mm_s2 + 1.0 / self.deceleration_mm_s2);
        (self.length_mm - ramps_mm) / v + v / self.acceleration_mm_s2 + v / self.deceleration_mm_s2
    }

    /// Distance covered at `time_s` from the start, mm; held at both ends.
    pub fn distance_mm(&self, time_s: f64) -> f64 {
        let v = self.peak_speed_mm_s();
        let left_s = self.duration_s() - time_s;
        if left_s <= 0.0 {
            self.length_mm
        } else if time_s <= 0.0 {
            0.0
        } else if time_s * self.acceleration_mm_s2 < v {
            0.5 * self.acceleration_mm_s2 * time_s * time_s
        } else if left_s * self.deceleration_mm_s2 < v {
            self.length_mm - 0.5 * self.deceleration_mm_s2 * left_s * left_s
        } else {
            // v²/a is zero for an infinite acceleration, so plain constant speed stays exact.
            v * time_s - 0.5 * v * v / self.acceleration_mm_s2
        }
    }
}
