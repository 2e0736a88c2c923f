//! The twin: a sink for blocks that keeps what the beam did.

use crate::beam::{Beam, Command};
use crate::exposure::Exposure;
use crate::lens::LensAxis;
use crate::light::LaserState;
use crate::mismatch::Mismatch;
use crate::pulses::{Pulses, Until};
use ftheta_model::block::{Block, SampleSink, VoltageSample};
use ftheta_model::dose::DoseMap;
use ftheta_model::machine::Machine;
use ftheta_model::space::{DacCodes, FieldPoint};
use ftheta_model::trace::{Pulse, Trace, TracePoint};
use ftheta_physics::head::{Head, Tracer};
use ftheta_physics::servo::ServoError;
use std::collections::VecDeque;
use thiserror::Error;

/// What the twin is told beside the machine file.
#[derive(Clone, Copy, Debug)]
pub struct TwinOptions {
    /// How its plant differs.
    pub mismatch: Mismatch,
    /// Seed of all noise.
    pub seed: u64,
    /// Side of a pixel of the dose map, mm.
    pub pixel_mm: f64,
    /// The states of every n-th tick are kept.
    pub state_stride: u64,
}

/// Why the twin does not go on.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TwinError {
    /// A block is missing or out of order.
    #[error("block starts at sample {found}, expected {expected}")]
    Gap {
        /// Index of the block's first sample.
        found: u64,
        /// Index that follows on.
        expected: u64,
    },
}

/// A machine in the computer. A clone goes on from the same state; the tables are shared.
#[derive(Clone)]
pub struct Twin {
    beam: Beam,
    laser: LaserState,
    pulses: Pulses,
    exposure: Exposure,
    lens: Option<LensAxis>,
    trace: Trace,
    last: FieldPoint,
    state_stride: u64,
    spot_diameter_mm: f64,
    rad_per_word: f64,
    period_ns: u64,
    next_index: u64,
    /// Ticks taken and not yet played: light that leads its signal is known no sooner.
    held: VecDeque<Tick>,
    n_held: usize,
}

/// What a tick brings.
#[derive(Clone, Copy)]
struct Tick {
    word: DacCodes,
    volts: Option<[VoltageSample; 2]>,
    lens_mm: Option<f64>,
}

impl Twin {
    /// A machine at rest, beam in the centre, laser off.
    ///
    /// # Errors
    /// If the machine's servo cannot be built.
    pub fn new(machine: &Machine, options: &TwinOptions) -> Result<Self, ServoError> {
        let beam = Beam::new(machine, &options.mismatch, options.seed)?;
        let period_ns = u64::from(machine.output.period_ns);
        let [on_ns, off_ns] = options.mismatch.late_ns;
        let latencies_ns =
            [machine.laser.on_latency_ns + on_ns, machine.laser.off_latency_ns + off_ns];
        let lead_ns = latencies_ns.map(|ns| ns.min(0).unsigned_abs()).into_iter().fold(0, u64::max);
        let step_ns = period_ns / beam.n_substeps() as u64;
        let trace = Trace { step_ns, ..Trace::default() };
        Ok(Self {
            beam,
            laser: LaserState::new(latencies_ns[0], latencies_ns[1]),
            pulses: Pulses::new(&machine.laser, latencies_ns[0], step_ns),
            exposure: Exposure::new(options.pixel_mm),
            lens: LensAxis::new(machine, options.mismatch.lens_late_ns as f64 * 1e-9),
            trace: Trace { points: vec![TracePoint::default()], ..trace },
            last: FieldPoint::default(),
            state_stride: options.state_stride.max(1),
            spot_diameter_mm: machine.laser.spot_diameter_mm,
            rad_per_word: machine.output.word_step_rad(),
            period_ns,
            next_index: 0,
            held: VecDeque::new(),
            n_held: lead_ns.div_ceil(period_ns) as usize,
        })
    }

    /// The same machine with a head as it was really built behind its motors.
    ///
    /// * `head`: mirror 1 moves its first coordinate, whichever that is on the machine
    #[must_use]
    pub fn with_head(mut self, head: &Head) -> Self {
        self.beam.set_head(Tracer::new(head));
        self
    }

    /// Plays what is held back, after the last block.
    pub fn finish(&mut self) {
        while let Some(tick) = self.held.pop_front() {
            self.play(tick);
        }
    }

    /// What has happened since the last call. The first point of a stretch is the last one of
    /// the stretch before; light that goes on is cut at the end of the stretch.
    pub fn take_trace(&mut self) -> Trace {
        let now_ns = self.next_index * self.period_ns;
        let cut = self.laser.cut(now_ns).map(|light| self.pulses.spread(light, Until::Cut));
        self.trace.light.extend(cut);
        let last_point = self.trace.points[self.trace.points.len() - 1];
        let next = Trace {
            step_ns: self.trace.step_ns,
            first_index: self.next_index * self.beam.n_substeps() as u64,
            points: vec![last_point],
            ..Trace::default()
        };
        std::mem::replace(&mut self.trace, next)
    }

    /// The energy on the work plane after everything that was played.
    pub fn into_dose(self) -> DoseMap {
        self.exposure.blurred(self.spot_diameter_mm)
    }

    /// Plays one tick.
    fn play(&mut self, Tick { word, volts, lens_mm }: Tick) {
        let angles_rad = [f64::from(word.x), f64::from(word.y)].map(|w| w * self.rad_per_word);
        let command = volts.as_ref().map_or(Command::Angles(angles_rad), Command::Volts);
        let mut places = [FieldPoint::default(); 100];
        let n_substeps = self.beam.n_substeps();
        let mut n_visited = 0;
        self.beam.tick(command, |place| {
            places[n_visited] = place;
            n_visited += 1;
        });
        let mut now_ns = self.next_index * self.period_ns;
        for &place in &places[..n_substeps] {
            let end_ns = now_ns + self.trace.step_ns;
            if self.laser.power_w() > 0.0 || self.laser.next_ns() < end_ns {
                self.expose(now_ns, self.last, place);
            }
            self.trace.points.push(place.into());
            self.last = place;
            now_ns = end_ns;
        }
        if let (Some(lens), Some(command_mm)) = (&mut self.lens, lens_mm) {
            self.trace.lens_mm.push(lens.tick(command_mm));
        }
        self.next_index += 1;
        if self.next_index.is_multiple_of(self.state_stride) {
            self.trace.states.push(self.beam.states(now_ns));
        }
    }

    /// Spreads energy over a sub-step in which light may change.
    fn expose(&mut self, from_ns: u64, from: FieldPoint, to: FieldPoint) {
        let end_ns = from_ns + self.trace.step_ns;
        let place = |time_ns: f64| {
            let share = (time_ns - from_ns as f64) / self.trace.step_ns as f64;
            FieldPoint::new(
                from.x_mm + share * (to.x_mm - from.x_mm),
                from.y_mm + share * (to.y_mm - from.y_mm),
            )
        };
        let mut now_ns = from_ns;
        self.pulses.skip_to(from_ns);
        loop {
            let pulse_ns = self.pulses.next_ns();
            let until_ns = self.laser.next_ns().min(pulse_ns).min(end_ns);
            let power_w = self.laser.power_w();
            if power_w > 0.0 && until_ns > now_ns && !self.pulses.are_seen() {
                let middle = place(0.5 * (now_ns + until_ns) as f64);
                self.exposure.add(middle, power_w * (until_ns - now_ns) as f64 * 1e-9);
            }
            if until_ns == end_ns {
                return;
            }
            now_ns = until_ns.max(now_ns);
            if self.laser.next_ns() <= now_ns {
                let ended = self.laser.change();
                let until = if self.laser.power_w() > 0.0 { Until::Cut } else { Until::Off };
                let ended = ended.map(|light| self.pulses.spread(light, until));
                self.trace.light.extend(ended);
            } else {
                let energy_j = self.pulses.fire(power_w);
                if let Some(light) = self.laser.cut(now_ns) {
                    self.exposure.add(place(now_ns as f64), energy_j);
                    let pulse = Pulse { index: light.index, time_ns: now_ns, energy_j };
                    self.trace.pulses.push(pulse);
                    self.trace.light.push(self.pulses.spread(light, Until::Pulse(energy_j)));
                }
            }
        }
    }
}

impl SampleSink for Twin {
    type Error = TwinError;

    fn push(&mut self, block: &Block) -> Result<(), TwinError> {
        let expected = self.next_index + self.held.len() as u64;
        if block.first_index != expected {
            return Err(TwinError::Gap { found: block.first_index, expected });
        }
        block.edges.iter().for_each(|&edge| self.laser.take(edge));
        block.triggers_ns.iter().for_each(|&time_ns| self.pulses.take(time_ns));
        for (index, &word) in block.words.iter().enumerate() {
            let (volts, lens_mm) = (block.volts.get(index), block.lens_mm.get(index));
            self.held.push_back(Tick { word, volts: volts.copied(), lens_mm: lens_mm.copied() });
            if self.held.len() > self.n_held
                && let Some(tick) = self.held.pop_front()
            {
                self.play(tick);
            }
        }
        Ok(())
    }
}
