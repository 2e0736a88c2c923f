//! Corners without stopping: the beam leaves one leg and joins the next within a tolerance.
//!
//! Along the legs' directions the beam is `p(t) = α(t) d1 + β(t) d2`. With equal motors on both
//! axes each of α and β is a motion of one axis, and the mirror axes take the voltages
//! `u_α d1 + u_β d2`. The distance to the first leg is `|β| sin θ`, to the second `|α| sin θ`, so
//! the corner falls apart into two programs of one axis that share the tick of the corner: α
//! comes to rest, and after the corner it stays in a band; β stays in a band up to the corner, and
//! then coasts (`design/control.md` D5).

mod course;
mod side;

use crate::jump::{AxisOptions, JumpError, check_axis};
use crate::solved::{CORNER_SIDE, Solved, of_kind};
use course::Plants;
use ftheta_model::machine::{Scanner, Servo};
use ftheta_physics::galvo::Galvo;
use ftheta_physics::servo::Gains;
pub use side::{End, Side};
use side::{Limits, Response, Shape};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Part of the voltage that each side may use; both may peak at once on one mirror axis.
const VOLTAGE_SHARE: f64 = 0.5;
/// The least voltage of a side, in units of what coasting needs.
const COAST_SHARE: f64 = 1.25;
/// Ticks on each side of the corner, in lags of the servo, tried in this order: the fewer, the
/// shorter the segments between two corners may be, but few do not stand another plant.
const LENGTHS: [f64; 4] = [0.85, 1.2, 1.7, 2.4];
/// Lags through which other plants are watched after the end.
const TAIL: f64 = 2.0;
/// Blocks and looks in a lag, at least.
const N_BLOCKS: f64 = 16.0;
const N_LOOKS: f64 = 130.0;
/// Fewest blocks on each side of the corner.
const N_BLOCKS_MIN: usize = 5;
/// Part of the lag that may be lost for gentler voltages, on each side.
const SLACK: f64 = 1.0 / 40.0;
/// Part of the lag by which a corner may be cut short; a wider band is not used.
const CUT_MAX: f64 = 0.25;
/// Cells in a factor of two, of speed and of band over speed.
const CELLS: [f64; 2] = [4.0, 16.0];

/// A corner taken at a speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Corner {
    /// Ticks before the corner.
    pub n_before: usize,
    /// Ticks after the corner.
    pub n_after: usize,
    /// Voltage along the first leg's direction in each tick, V.
    pub arrive_v: Vec<f64>,
    /// Voltage along the second leg's direction in each tick, V.
    pub depart_v: Vec<f64>,
    /// From where the corner begins to the vertex, along the first leg, rad.
    pub arrive_rad: f64,
    /// From the vertex to where the corner ends, along the second leg, rad.
    pub depart_rad: f64,
    /// Mirror's nominal angle from the vertex along the first leg's direction, at each tick from
    /// the first to the end, rad.
    pub arrive_mirror_rad: Vec<f64>,
    /// The same along the second leg's direction.
    pub depart_mirror_rad: Vec<f64>,
    /// Time lost against constant speed through the vertex, s; negative where the corner is cut.
    pub loss_s: f64,
    /// Greatest sum of both voltages, either sign: no mirror axis needs more, V.
    pub peak_voltage_v: f64,
}

/// Where a side stands in the grid of speeds and bands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Cell {
    /// Which side.
    end: End,
    /// Quarter powers of two of the speed in rad/s.
    speed: i32,
    /// Sixteenth powers of two of band over speed in s.
    band: i32,
}

/// A side, once it is solved; `None` if no voltages that stay in the band are found.
type Slot = Arc<OnceLock<Option<Side>>>;

/// Solves corners of equal axes; a cell is solved when it is first needed.
#[derive(Debug)]
pub struct Corners {
    plants: Plants,
    tick_s: f64,
    lag_s: f64,
    speed_max_rad_s: f64,
    voltage_max_v: f64,
    current_max_a: f64,
    /// Voltage of coasting at 1 rad/s.
    coast_v: f64,
    /// For each end and length.
    responses: [[OnceLock<Response>; LENGTHS.len()]; 2],
    slots: Mutex<BTreeMap<Cell, Slot>>,
}

impl Corners {
    /// Corners of a scanner.
    ///
    /// * `axis`: its tick and reserve count
    /// * `servo`: state feedback, under which torque constant and mode may differ by what the
    ///   scanner states, one at a time; with `None` only the nominal axis keeps the band
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(
        scanner: &Scanner,
        axis: AxisOptions,
        servo: Option<&Gains>,
    ) -> Result<Self, JumpError> {
        check_axis(scanner, axis)?;
        let lag_s = match scanner.servo {
            Servo::StateFeedback { lag_s, .. } => lag_s,
            Servo::Pid { bandwidth_hz, damping, .. } => {
                damping / (std::f64::consts::PI * bandwidth_hz)
            }
        };
        let quantity = "servo lag in ticks";
        let (value, low, high) = (lag_s / axis.tick_s, 1.0, 1000.0);
        if !(low..=high).contains(&value) {
            return Err(JumpError::Parameter { quantity, value, low, high });
        }
        let n_looks = (N_LOOKS * axis.tick_s / lag_s).ceil() as usize;
        Ok(Self {
            plants: Plants::new(scanner, axis.tick_s, servo, n_looks),
            tick_s: axis.tick_s,
            lag_s,
            speed_max_rad_s: scanner.speed_max_rad_s,
            voltage_max_v: scanner.voltage_max_v * (1.0 - axis.voltage_reserve),
            current_max_a: scanner.current_max_a,
            coast_v: Galvo::new(scanner).torque_constant,
            responses: Default::default(),
            slots: Mutex::default(),
        })
    }

    /// A corner at this speed along both legs; `None` if no voltages that stay in the band
    /// are found.
    ///
    /// * `speed_rad_s`: mechanical, along the leg
    /// * `epsilon_rad`: greatest `|β|` up to the corner's tick and `|α|` from then on, mechanical
    ///
    /// # Errors
    /// If speed or band is out of range.
    ///
    /// # Accuracy
    /// Ends within 1e-9 of the speed. The band is kept by the nominal axis and by each plant of
    /// [`Corners::new`], also between ticks. Speed and band are rounded to a grid, towards the
    /// safe side: up to 4.5 % of the band stay unused.
    pub fn corner(&self, speed_rad_s: f64, epsilon_rad: f64) -> Result<Option<Corner>, JumpError> {
        let (arrive, depart) = (
            self.side(End::Arrive, speed_rad_s, epsilon_rad)?,
            self.side(End::Depart, speed_rad_s, epsilon_rad)?,
        );
        Ok(arrive.zip(depart).map(|(arrive, depart)| self.join(speed_rad_s, &arrive, &depart)))
    }

    /// One side of a corner, as [`Self::corner`].
    ///
    /// # Errors
    /// As [`Self::corner`].
    pub fn side(
        &self,
        end: End,
        speed_rad_s: f64,
        epsilon_rad: f64,
    ) -> Result<Option<Side>, JumpError> {
        let tiny = f64::MIN_POSITIVE;
        let ranges = [
            ("speed rad/s", speed_rad_s, 1e-6, self.speed_max_rad_s),
            ("corner's band rad", epsilon_rad, tiny, 1.0),
        ];
        for (quantity, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(JumpError::Parameter { quantity, value, low, high });
            }
        }
        let band_s = (epsilon_rad / speed_rad_s).min(CUT_MAX * self.lag_s);
        let cell = Cell {
            end,
            speed: (CELLS[0] * speed_rad_s.log2()).ceil() as i32,
            band: (CELLS[1] * band_s.log2()).floor() as i32,
        };
        let slot = {
            // A panic elsewhere leaves the map whole: slots are only ever added.
            let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            slots.entry(cell).or_default().clone()
        };
        let side = slot.get_or_init(|| self.solve(cell)).clone();
        Ok(side.map(|side| side.scaled(speed_rad_s)))
    }

    /// The sides that are solved so far.
    pub fn solved(&self) -> Solved {
        let slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let solved = |(cell, slot): (&Cell, &Slot)| {
            let key = [CORNER_SIDE, cell.end as i32, cell.speed, cell.band];
            Some((key, slot.get()?.as_ref().map(Side::numbers)))
        };
        slots.iter().filter_map(solved).collect()
    }

    /// Takes back what [`Self::solved`] gave of the same scanner and options; what does not fit is
    /// left out.
    pub fn restore(&self, solved: &Solved) {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        for ([end, speed, band], numbers) in of_kind(solved, CORNER_SIDE) {
            let end = if end == End::Arrive as i32 { End::Arrive } else { End::Depart };
            let side = numbers.map(Side::from_numbers);
            if side != Some(None) {
                let slot = Slot::new(side.flatten().into());
                slots.entry(Cell { end, speed, band }).or_insert(slot);
            }
        }
    }

    /// The side of a cell, at the cell's own speed, of the first length that can be.
    fn solve(&self, cell: Cell) -> Option<Side> {
        let speed_rad_s = (f64::from(cell.speed) / CELLS[0]).exp2();
        let band_s = (f64::from(cell.band) / CELLS[1]).exp2();
        let share = VOLTAGE_SHARE * self.voltage_max_v;
        let limits = Limits {
            speed_rad_s,
            band_rad: band_s * speed_rad_s,
            voltage_max_v: share
                .max(COAST_SHARE * self.coast_v * speed_rad_s)
                .min(self.voltage_max_v),
            slack_s: SLACK * self.lag_s,
        };
        for length in 0..LENGTHS.len() {
            // A program that fails is as good as none: the beam can still stop in the corner.
            if let Ok(Some(side)) = side::solve(self.response(cell.end, length), limits) {
                return Some(side);
            }
        }
        None
    }

    fn response(&self, end: End, length: usize) -> &Response {
        self.responses[end as usize][length].get_or_init(|| {
            let lag_ticks = self.lag_s / self.tick_s;
            let n_held = (lag_ticks / N_BLOCKS) as usize;
            let n_held = n_held.max(1);
            let n_blocks = (LENGTHS[length] * lag_ticks / n_held as f64).ceil() as usize;
            let shape = Shape {
                end,
                tick_s: self.tick_s,
                n_looks: self.plants.n_looks(),
                n_held,
                n_blocks: n_blocks.max(N_BLOCKS_MIN),
                n_tail: (TAIL * lag_ticks).ceil() as usize,
                current_max_a: self.current_max_a,
            };
            let start = match end {
                End::Arrive => self.plants.coasting(lag_ticks, self.coast_v),
                End::Depart => self.plants.rest(),
            };
            Response::new(&self.plants, &start, shape)
        })
    }

    /// Both sides on common ticks: what is shorter coasts or rests until then.
    fn join(&self, speed_rad_s: f64, arrive: &Side, depart: &Side) -> Corner {
        let n_after = |side: &Side| side.voltages_v.len() - side.n_before;
        let before = arrive.n_before.max(depart.n_before);
        let after = n_after(arrive).max(n_after(depart));
        let coast_v = self.coast_v * speed_rad_s;
        let way_rad = |n_ticks: usize| n_ticks as f64 * self.tick_s * speed_rad_s;
        let n_first = before - arrive.n_before;
        let n_last = after - n_after(depart);
        let arrive_rad = arrive.run_rad + way_rad(n_first);
        let depart_rad = depart.run_rad + way_rad(n_last);
        let arrive_v = [vec![coast_v; n_first], arrive.voltages_v.clone()].concat();
        let arrive_v = padded(arrive_v, before + after, 0.0);
        let depart_v = [vec![0.0; before - depart.n_before], depart.voltages_v.clone()].concat();
        let depart_v = padded(depart_v, before + after, coast_v);
        let first = (0..n_first).map(|tick| way_rad(tick) - arrive_rad);
        let arrive_mirror_rad = first.chain(arrive.mirror_rad.iter().copied()).collect();
        let last = (0..n_last).rev().map(|tick| depart_rad - way_rad(tick));
        let rest = vec![0.0; before - depart.n_before];
        let depart_mirror_rad =
            rest.into_iter().chain(depart.mirror_rad.iter().copied()).chain(last).collect();
        let peaks = arrive_v.iter().zip(&depart_v).map(|(one, other)| one.abs() + other.abs());
        Corner {
            n_before: before,
            n_after: after,
            arrive_rad,
            depart_rad,
            arrive_mirror_rad: padded(arrive_mirror_rad, before + after + 1, 0.0),
            depart_mirror_rad,
            loss_s: arrive.loss_s + depart.loss_s,
            peak_voltage_v: peaks.fold(0.0, f64::max),
            arrive_v,
            depart_v,
        }
    }
}

fn padded(mut values: Vec<f64>, n: usize, value: f64) -> Vec<f64> {
    values.resize(n, value);
    values
}
