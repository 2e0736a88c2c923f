//! A plan's content: motion and laser edges on one tick grid, before it is audited.

use crate::block::LaserEdge;
use crate::machine::Machine;
use crate::recipe::{Interpolation, Pen};
use kurbo::{BezPath, Point, Vec2};

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
    /// Direction and arc length at vertices of curved tracks; tracks refer to ranges of it.
    pub stations: Vec<Station>,
    /// Speed over time along tracks; tracks refer to ranges of it.
    pub knots: Vec<Knot>,
    /// What both axes are driven by, a pair per tick: volts, or angles in rad on a machine of which
    /// only the lag is known. Drives refer to ranges of it.
    pub drives: Vec<[f32; 2]>,
    /// Motion from the first sample on, without a gap.
    pub segments: Vec<Segment>,
}

/// The planners there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planner {
    /// What RTC- and EZCAD-type controllers do.
    Classic,
    /// Marks at constant dose, between them the fastest motion that motors and resonance allow.
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
    /// Power from the on edge, W.
    pub power_w: f64,
    /// Later changes of power, in order, all between the edges and none of them to zero.
    pub steps: Vec<LaserEdge>,
}

impl PlannedMark {
    /// First and last tick with its light, which follows the edges by the laser's latencies; two
    /// ticks or more.
    pub fn lit_ticks(&self, machine: &Machine) -> (u64, u64) {
        let laser = &machine.laser;
        let period_ns = i128::from(machine.output.period_ns);
        let on_ns = i128::from(self.on_ns) + i128::from(laser.on_latency_ns);
        let off_ns = i128::from(self.off_ns) + i128::from(laser.off_latency_ns);
        // An edge is rounded to a nanosecond.
        let (first, last) = ((on_ns - 1).div_euclid(period_ns) + 1, off_ns.div_euclid(period_ns));
        let (first, last) = match last > first {
            true => (first, last),
            false => (on_ns.div_euclid(period_ns), last.max(on_ns.div_euclid(period_ns) + 1)),
        };
        (first.max(0) as u64, last.max(1) as u64)
    }
}

/// Direction and arc length at a vertex of a curve.
///
/// Between two of them the path is the cubic with these ends, directions and length: of an arc of
/// 10 degrees it is off by 1e-6 of the radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Direction in which the path comes, length 1.
    pub arriving: Vec2,
    /// Direction in which it goes on, length 1; another one in a corner.
    pub leaving: Vec2,
    /// Arc length from the track's first vertex, mm.
    pub distance_mm: f64,
}

/// A point of a speed profile; between two of them the acceleration is constant, before the first
/// and after the last the speed is. Two at the same time are a change of speed at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Time from the track's beginning, s.
    pub time_s: f64,
    /// Arc length from the track's first vertex, mm.
    pub distance_mm: f64,
    /// Speed, mm/s.
    pub speed_mm_s: f64,
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
    /// Follows vertices, straight on past both ends. The place is averaged three times over
    /// `smoothing_ticks` ticks, so that speed and direction never change at once; then comes the
    /// command by which the nominal servo takes the mirror there, exactly at polynomials.
    ///
    /// Sample j (from 1) commands the voltage that acts between ticks j - 1 and j of the profile.
    /// Where the servo is not known, sample j is the angle itself at tick j of the profile.
    Track {
        /// Index of the first vertex.
        first_vertex: u32,
        /// Number of vertices, two or more.
        n_vertices: u32,
        /// Index of the first of as many stations as vertices, if the path is curved.
        first_station: Option<u32>,
        /// Index of the first knot.
        first_knot: u32,
        /// Number of knots, one or more.
        n_knots: u32,
        /// Ticks of each of three averages; 1 averages nothing.
        smoothing_ticks: u32,
    },
    /// Goes on from the state that the motion before has left, by voltages as they are: sample j
    /// (from 1) is the reference for which the nominal servo applies voltage j in the tick that
    /// follows. Where the servo is not known, the samples are the angles themselves.
    Drive {
        /// Index of the first of as many pairs as there are samples.
        first: u32,
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

    /// Arc length of a track, mm; zero for other motion.
    pub fn track_length_mm(&self, motion: &Motion) -> f64 {
        let (&Motion::Track { first_station, n_vertices, .. }, Some((first, last))) =
            (motion, motion.ends())
        else {
            return 0.0;
        };
        match first_station {
            Some(station) => self.stations[(station + n_vertices - 1) as usize].distance_mm,
            None => {
                let vertices = &self.vertices[first..=last];
                vertices.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
            }
        }
    }
}

impl Motion {
    /// Indices of the vertices it starts and ends on, if it is bound to any.
    pub fn ends(&self) -> Option<(usize, usize)> {
        match *self {
            Self::Hold { vertex } => Some((vertex as usize, vertex as usize)),
            Self::Travel { first_vertex, n_vertices, .. }
            | Self::Track { first_vertex, n_vertices, .. } => {
                let first = first_vertex as usize;
                Some((first, (first + n_vertices as usize).saturating_sub(1)))
            }
            Self::Drive { .. } => None,
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
