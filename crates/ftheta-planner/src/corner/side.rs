//! One side of a corner: a stop or a start of one axis that stays in a band past the corner.

use super::course::{Course, Plants, Start};
use crate::convex::{self, Rows};
use crate::jump::JumpError;
use clarabel::solver::{NonnegativeConeT, ZeroConeT};
use ftheta_physics::galvo::{CURRENT, State};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// States that must be met at the end; the angle decides how far the side goes.
const MET: [usize; 4] = [1, 2, 3, 4];
/// Part of the band that a program uses: a mirror bends between two looks.
const BAND_SHARE: f64 = 0.995;
/// Greatest speed along the leg, in units of coasting.
const SPEED_SHARE: f64 = 1.001;
/// What a row that is not in the program yet may be passed by.
const INSIDE: f64 = 1e-6;
/// Most times that rows are added.
const N_ROUNDS: usize = 60;
/// Corrections until the end is met to rounding.
const N_CORRECTIONS: usize = 3;

/// A side of the corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum End {
    /// From coasting along the first leg to rest.
    Arrive,
    /// From rest to coasting along the second leg.
    Depart,
}

/// One side of a corner at a speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Speed of coasting, rad/s.
    pub speed_rad_s: f64,
    /// Ticks before the corner.
    pub n_before: usize,
    /// Voltage of each tick, V.
    pub voltages_v: Vec<f64>,
    /// Mirror's nominal angle from the corner along the leg at each tick and at the end, rad.
    pub mirror_rad: Vec<f64>,
    /// From the coasting end to the corner, rad.
    pub run_rad: f64,
    /// Time lost against coasting as far as the corner, s.
    pub loss_s: f64,
    /// The least that could be lost, with voltages less gentle, s.
    pub least_loss_s: f64,
}

impl Side {
    /// All of it as numbers.
    pub(super) fn numbers(&self) -> Vec<f64> {
        let Self { speed_rad_s, run_rad, loss_s, least_loss_s, .. } = *self;
        let head = [speed_rad_s, self.n_before as f64, run_rad, loss_s, least_loss_s];
        [&head, &self.voltages_v[..], &self.mirror_rad[..]].concat()
    }

    /// The side of [`Self::numbers`]; `None` if they are not of one.
    pub(super) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (head, ticks) = numbers.split_first_chunk()?;
        let &[speed_rad_s, n_before, run_rad, loss_s, least_loss_s] = head;
        let (voltages_v, mirror_rad) = ticks.split_at(ticks.len() / 2);
        let n_before = n_before as usize;
        let whole = numbers.iter().all(|number| number.is_finite())
            && speed_rad_s > 0.0
            && mirror_rad.len() == voltages_v.len() + 1
            && n_before <= voltages_v.len();
        let (voltages_v, mirror_rad) = (voltages_v.to_vec(), mirror_rad.to_vec());
        let side =
            Self { speed_rad_s, n_before, voltages_v, mirror_rad, run_rad, loss_s, least_loss_s };
        whole.then_some(side)
    }

    /// The same at another speed: everything scales with it, the band as well.
    pub(super) fn scaled(mut self, speed_rad_s: f64) -> Self {
        let factor = speed_rad_s / self.speed_rad_s;
        self.speed_rad_s = speed_rad_s;
        self.run_rad *= factor;
        let values = self.voltages_v.iter_mut().chain(&mut self.mirror_rad);
        values.for_each(|value| *value *= factor);
        self
    }
}

/// Ticks and limits of a side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) end: End,
    pub(super) tick_s: f64,
    /// Looks in a tick.
    pub(super) n_looks: usize,
    /// Ticks through which a voltage is held.
    pub(super) n_held: usize,
    /// Voltages before the corner, and as many after.
    pub(super) n_blocks: usize,
    /// Ticks after the end through which plants off the nominal one are watched.
    pub(super) n_tail: usize,
    pub(super) current_max_a: f64,
}

impl Shape {
    /// Ticks before the corner, and as many after.
    pub(super) fn n_half(&self) -> usize {
        self.n_held * self.n_blocks
    }

    fn n_ticks(&self) -> usize {
        2 * self.n_half()
    }

    /// Looks at which the mirror must be in the band.
    fn banded(&self) -> Range<usize> {
        let corner = self.n_looks * self.n_half();
        match self.end {
            // The last look of the tick before the corner is at the corner.
            End::Arrive => corner - 1..self.n_looks * (self.n_ticks() + self.n_tail),
            End::Depart => 0..corner,
        }
    }
}

/// How fast a side is, and where its mirror must stay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) speed_rad_s: f64,
    /// Farthest from the corner past it, rad.
    pub(super) band_rad: f64,
    pub(super) voltage_max_v: f64,
    /// Time that may be lost for the sake of gentleness, s.
    pub(super) slack_s: f64,
}

/// How a side's motion depends on its speed and voltages.
#[derive(Debug)]
pub(super) struct Response {
    shape: Shape,
    /// With a speed of 1 rad/s and no voltage.
    free: Course,
    /// With one volt in each block.
    forced: Vec<Course>,
}

impl Response {
    pub(super) fn new(plants: &Plants, start: &Start, shape: Shape) -> Self {
        let n_tail = if shape.end == End::Arrive { shape.n_tail } else { 0 };
        let mut voltages_v = vec![0.0; shape.n_ticks() + n_tail];
        let free = plants.play(start, &voltages_v);
        let rest = plants.rest();
        let forced = (0..2 * shape.n_blocks).map(|block| {
            voltages_v.fill(0.0);
            voltages_v[block * shape.n_held..][..shape.n_held].fill(1.0);
            plants.play(&rest, &voltages_v)
        });
        let forced = forced.collect();
        Self { shape, free, forced }
    }

    fn end_of<'a>(&self, course: &'a Course) -> &'a State {
        &course.states[self.shape.n_ticks()]
    }

    /// What the end must be at 1 rad/s.
    fn wanted(&self) -> State {
        match self.shape.end {
            End::Arrive => State::zeros(),
            End::Depart => State::new(0.0, 1.0, 0.0, 0.0, 0.0),
        }
    }

    /// A mirror's angle from the corner.
    fn angle_rad(&self, course: &Course, plant: usize, look: usize) -> f64 {
        course.mirrors_rad[plant][look] - self.corner_rad(course)
    }

    /// The corner, which is where the axis rests.
    fn corner_rad(&self, course: &Course) -> f64 {
        match self.shape.end {
            End::Arrive => self.end_of(course)[0],
            End::Depart => 0.0,
        }
    }

    /// Sum of a quantity over a speed and the voltages of the blocks.
    fn total(&self, speed: f64, blocks_v: &[f64], quantity: impl Fn(&Course) -> f64) -> f64 {
        let forced = self.forced.iter().zip(blocks_v);
        forced.map(|(one, voltage)| quantity(one) * voltage).sum::<f64>()
            + quantity(&self.free) * speed
    }
}

/// A row of the program that is there from when it is passed first.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Watched {
    /// Speed at a look.
    Speed(usize),
    /// Angle of a plant at a look, either sign.
    Angle(usize, usize, f64),
}

impl Watched {
    /// What is watched, in units of what it may be.
    fn value(self, response: &Response, limits: &Limits, course: &Course) -> f64 {
        match self {
            Self::Speed(look) => course.speeds_rad_s[look] / (SPEED_SHARE * limits.speed_rad_s),
            Self::Angle(plant, look, sign) => {
                sign * response.angle_rad(course, plant, look) / (BAND_SHARE * limits.band_rad)
            }
        }
    }
}

/// The program of one side.
struct Program<'a> {
    response: &'a Response,
    limits: Limits,
    rows: Rows,
    n_ends: usize,
}

/// The side that loses least time, and among those that lose no more than the slack the one with
/// least voltage; `None` if no voltages stay in the band.
///
/// Rows for looks are added where they are passed, since few of thousands matter.
pub(super) fn solve(response: &Response, limits: Limits) -> Result<Option<Side>, JumpError> {
    let mut program = Program { response, limits, rows: Rows::default(), n_ends: 0 };
    program.ends();
    program.bounds();
    program.first();
    // Distance in units of the band, since that is what it trades against.
    let unit = limits.voltage_max_v / limits.band_rad;
    let cost: Vec<f64> =
        response.forced.iter().map(|course| -response.end_of(course)[0] * unit).collect();
    let Some(best) = program.optimum(&cost, Vec::new())? else {
        return Ok(None);
    };
    let least: f64 = cost.iter().zip(&best).map(|(cost, x)| cost * x).sum();
    let slack = limits.slack_s * limits.speed_rad_s / limits.band_rad;
    program.rows.add(cost.iter().copied().enumerate(), least + slack);
    let all = (0..cost.len()).collect();
    let Some(gentle) = program.optimum(&vec![0.0; cost.len()], all)? else {
        return Ok(None);
    };
    let volts = |x: Vec<f64>| x.into_iter().map(|x| x * limits.voltage_max_v).collect();
    Ok(program.side(volts(gentle), volts(best)))
}

impl Program<'_> {
    /// The voltages, in units of the greatest.
    fn optimum(
        &mut self,
        cost: &[f64],
        squared: Vec<usize>,
    ) -> Result<Option<Vec<f64>>, JumpError> {
        let shape = &self.response.shape;
        let unsolved = |status| JumpError::Unsolved {
            n_ticks: shape.n_ticks(),
            tick_us: shape.tick_s * 1e6,
            status,
        };
        for _ in 0..N_ROUNDS {
            let n_bounds = self.rows.len() - self.n_ends;
            let cones = [ZeroConeT(self.n_ends), NonnegativeConeT(n_bounds)];
            let found = convex::minimise(self.rows.clone(), &cones, cost, squared.clone());
            let Some(x) = found.map_err(unsolved)? else {
                return Ok(None);
            };
            let passed = self.passed(&x);
            if passed.is_empty() {
                return Ok(Some(x));
            }
            passed.into_iter().for_each(|watched| self.watch(watched));
        }
        Err(unsolved(format!("rows still passed after {N_ROUNDS} rounds")))
    }

    /// Adds a row for a quantity that is at most one, linear in speed and voltages.
    fn at_most_one(&mut self, quantity: impl Fn(&Course) -> f64) {
        let Limits { speed_rad_s, voltage_max_v, .. } = self.limits;
        let gains = self.response.forced.iter().map(|one| quantity(one) * voltage_max_v);
        self.rows.add(gains.enumerate(), 1.0 - quantity(&self.response.free) * speed_rad_s);
    }

    /// The end must be met.
    fn ends(&mut self) {
        let Self { response, limits, rows, .. } = self;
        for state in MET {
            let missing =
                (response.wanted() - response.end_of(&response.free))[state] * limits.speed_rad_s;
            let gains = response.forced.iter().map(|course| response.end_of(course)[state]);
            let unit = gains.clone().fold(0.0_f64, |unit, gain| unit.max(gain.abs()));
            let gains = gains.map(|gain| gain / unit).enumerate();
            rows.add(gains, missing / (unit * limits.voltage_max_v));
        }
        self.n_ends = rows.len();
    }

    /// Voltage and current keep their limits.
    fn bounds(&mut self) {
        let shape = self.response.shape;
        for sign in [1.0, -1.0] {
            for block in 0..self.response.forced.len() {
                self.rows.add([(block, sign)], 1.0);
            }
            for tick in (1..shape.n_ticks()).step_by(shape.n_held) {
                let unit = sign / shape.current_max_a;
                self.at_most_one(|course| course.states[tick][CURRENT] * unit);
            }
        }
    }

    /// The rows that are likely to matter: the nominal mirror's at the ends of ticks.
    fn first(&mut self) {
        let shape = self.response.shape;
        for tick in 1..=shape.n_ticks() {
            let look = shape.n_looks * tick - 1;
            self.watch(Watched::Speed(look));
            if shape.banded().contains(&look) {
                [1.0, -1.0].into_iter().for_each(|sign| self.watch(Watched::Angle(0, look, sign)));
            }
        }
    }

    fn watch(&mut self, watched: Watched) {
        let (response, limits) = (self.response, self.limits);
        self.at_most_one(|course| watched.value(response, &limits, course));
    }

    /// Local peaks of what passes its limit.
    fn passed(&self, x: &[f64]) -> Vec<Watched> {
        let shape = &self.response.shape;
        let volts: Vec<f64> = x.iter().map(|x| x * self.limits.voltage_max_v).collect();
        let mut passed = Vec::new();
        let mut seek = |looks: Range<usize>, watched: &dyn Fn(usize) -> Watched| {
            let value = |look: usize| {
                let quantity =
                    |course: &Course| watched(look).value(self.response, &self.limits, course);
                self.response.total(self.limits.speed_rad_s, &volts, quantity)
            };
            let values: Vec<f64> = looks.clone().map(value).collect();
            for (index, look) in looks.enumerate() {
                let before = if index == 0 { f64::NEG_INFINITY } else { values[index - 1] };
                let after = values.get(index + 1).copied().unwrap_or(f64::NEG_INFINITY);
                let value = values[index];
                if value > 1.0 + INSIDE && value >= before && value > after {
                    passed.push(watched(look));
                }
            }
        };
        seek(0..shape.n_looks * shape.n_ticks(), &Watched::Speed);
        for plant in 0..self.response.free.mirrors_rad.len() {
            for sign in [1.0, -1.0] {
                seek(shape.banded(), &|look| Watched::Angle(plant, look, sign));
            }
        }
        passed
    }

    /// The side of these voltages, after the correction of least norm that meets the end to
    /// rounding.
    fn side(&self, mut blocks_v: Vec<f64>, best_v: Vec<f64>) -> Option<Side> {
        let (response, speed_rad_s) = (self.response, self.limits.speed_rad_s);
        let shape = &response.shape;
        let gains = |state: usize| move |course: &Course| response.end_of(course)[state];
        let columns = DMatrix::from_fn(MET.len(), blocks_v.len(), |row, block| {
            gains(MET[row])(&response.forced[block])
        });
        let units = DVector::from_iterator(MET.len(), columns.row_iter().map(|row| row.amax()));
        let columns = DMatrix::from_fn(columns.nrows(), columns.ncols(), |row, column| {
            columns[(row, column)] / units[row]
        });
        let inverse = (&columns * columns.transpose()).lu();
        for _ in 0..N_CORRECTIONS {
            let missing = DVector::from_fn(MET.len(), |row, _| {
                let end = response.total(speed_rad_s, &blocks_v, gains(MET[row]));
                (response.wanted()[MET[row]] * speed_rad_s - end) / units[row]
            });
            let change = columns.transpose() * inverse.solve(&missing)?;
            blocks_v.iter_mut().zip(&change).for_each(|(voltage, change)| *voltage += change);
        }
        let run_rad = |blocks_v: &[f64]| response.total(speed_rad_s, blocks_v, gains(0));
        let coast_s = shape.n_half() as f64 * shape.tick_s;
        let loss_s = |run_rad: f64| coast_s - run_rad / speed_rad_s;
        let mirror_rad = |tick: usize| {
            let angle = |course: &Course| match (shape.n_looks * tick).checked_sub(1) {
                Some(look) => response.angle_rad(course, 0, look),
                None => course.states[0][0] - response.corner_rad(course),
            };
            response.total(speed_rad_s, &blocks_v, angle)
        };
        Some(Side {
            speed_rad_s,
            n_before: shape.n_half(),
            mirror_rad: (0..=shape.n_ticks()).map(mirror_rad).collect(),
            run_rad: run_rad(&blocks_v),
            loss_s: loss_s(run_rad(&blocks_v)),
            least_loss_s: loss_s(run_rad(&best_v)),
            voltages_v: blocks_v
                .iter()
                .flat_map(|&voltage| std::iter::repeat_n(voltage, shape.n_held))
                .collect(),
        })
    }
}
