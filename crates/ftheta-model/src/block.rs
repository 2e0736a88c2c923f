//! A block: consecutive samples and the laser edges between them, and what takes blocks.

use crate::space::DacCodes;

/// Consecutive samples of a plan.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// Index of the first sample in the plan; blocks follow on.
    pub first_index: u64,
    /// One word pair per tick.
    pub words: Vec<DacCodes>,
    /// What a driver that is sent voltages gets instead of words, one pair per tick; empty where
    /// words are sent.
    pub volts: Vec<[VoltageSample; 2]>,
    /// Travel of the focusing lens from the middle of its range, mm, one per tick; empty for a head
    /// without one. The lens is there after its lag.
    pub lens_mm: Vec<f64>,
    /// Laser edges whose time lies within this block, in order; those whose light leads its signal
    /// come with the block in which the light does.
    pub edges: Vec<LaserEdge>,
    /// Signals that ask for one pulse each, ns from the plan's first sample, in order; empty where
    /// pulses run free. They come with the block of their light, as edges do.
    pub triggers_ns: Vec<u64>,
}

/// A voltage with the state that the axis should be in: the driver adds what its servo makes of the
/// difference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageSample {
    /// Voltage that acts from the next tick on, V.
    pub next_v: f64,
    /// Voltage that acts until then, as planned, V.
    pub acting_v: f64,
    /// State now, as planned: angle rad, speed rad/s, twist rad, its speed rad/s, current A.
    pub state: [f64; 5],
}

/// A change of the laser's signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserEdge {
    /// Time of the signal from the plan's first sample, ns.
    pub time_ns: u64,
    /// Power from here on, W; zero is off.
    pub power_w: f64,
}

/// Takes blocks in order: a device, or the twin.
pub trait SampleSink {
    /// What can go wrong.
    type Error;

    /// Takes the next block.
    ///
    /// # Errors
    /// If the block does not follow on, or cannot be taken.
    fn push(&mut self, block: &Block) -> Result<(), Self::Error>;
}
