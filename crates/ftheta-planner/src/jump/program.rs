//! The program of the longest transition: voltages and states as variables, sparse and banded.
//!
//! The condensed form, with voltages alone, is dense and loses the end condition in rounding;
//! with the states as variables every row couples neighbours only.

use super::JumpError;
use super::axis::{Axis, Weights};
use super::held::N_DEVIATIONS;
use crate::convex::{self, Rows};
use clarabel::solver::{NonnegativeConeT, SecondOrderConeT, ZeroConeT};
use ftheta_physics::galvo::{CURRENT, State};

/// States in which a plant's end differs from the nominal one; the angle does not act on anything.
const DEVIATING: [usize; 4] = [1, 2, 3, 4];

/// What a program is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    /// Ticks from start to end.
    pub(super) n_ticks: usize,
    /// Where it leads, for a factor of one.
    pub(super) ends: Ends,
    /// What is best.
    pub(super) goal: Goal,
    /// Where the mirror must be on the way.
    pub(super) way: Way,
}

/// Start and end states for a factor of one; the start is at angle zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ends {
    /// State at the start.
    pub(super) start: State,
    /// State at the end.
    pub(super) end: State,
    /// Whether the angle at the end counts.
    pub(super) place: bool,
}

/// What is best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// The greatest factor.
    Farthest,
    /// The least heat in the coil at this factor.
    Coolest(f64),
}

/// Where the mirror must be on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    /// Anywhere.
    Free,
    /// From a tick on near the end, for good.
    Near(Tube),
    /// Never farther than this, rad.
    Below(f64),
    /// Never farther than this before the end, rad.
    Behind(f64),
    /// Between these, rad.
    Within(f64, f64),
}

/// From a tick on the mirror stays near the end, for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tube {
    /// Ticks until the mirror is near.
    pub(super) arrival: usize,
    /// How near, rad.
    pub(super) epsilon_rad: f64,
}

/// What the program gives.
pub(super) struct Solution {
    /// Factor on the ends.
    pub(super) factor: f64,
    /// Voltage of each tick, V; inexact by the tolerance.
    pub(super) voltages_v: Vec<f64>,
}

impl Ends {
    /// From rest to rest, one radian away.
    pub(super) fn rest() -> Self {
        let end = State::new(1.0, 0.0, 0.0, 0.0, 0.0);
        Self { start: State::zeros(), end, place: true }
    }
}

/// Units in which the variables are of order one.
struct Units {
    voltage: f64,
    state: State,
    factor: f64,
}

impl Units {
    fn new(axis: &Axis, request: &Request) -> Self {
        let galvo = &axis.galvo;
        let total = axis.tick_s * request.n_ticks as f64;
        let voltage = axis.voltage_max_v;
        let current = axis.current_max_a.min(voltage * total / galvo.inductance);
        let acceleration = galvo.torque_constant / galvo.inertia() * current;
        let angle = acceleration * total * total / 4.0;
        let twist = galvo.torque_constant / galvo.rotor_inertia * current;
        let period = galvo.omega.recip().min(total);
        let state =
            State::new(angle, angle / total, twist * period * period, twist * period, current);
        let Ends { start, end, .. } = request.ends;
        let size = start.component_div(&state).amax().max(end.component_div(&state).amax());
        Self { voltage, state, factor: size.recip() }
    }

    /// Unit of a held plant's deviation: hundredths of the state's own.
    fn deviation(&self, index: usize) -> f64 {
        0.01 * self.state.get(index).copied().unwrap_or(self.voltage)
    }
}

/// Where each variable stands: voltage and then states for each tick, the factor, and for each
/// uncertain plant its deviation from the nominal end, and what it has to creep at each look.
struct Layout {
    n_ticks: usize,
    n_states: usize,
    n_plants: usize,
    n_looks: usize,
    n_held: usize,
    /// Whether the place of rest off its target is a variable, the last.
    rests_anywhere: bool,
}

impl Layout {
    fn voltage(&self, tick: usize) -> usize {
        tick * (1 + self.n_states)
    }

    /// Column of a state before this tick, which is not the first; after the last is the end.
    fn state(&self, tick: usize, position: usize) -> usize {
        self.voltage(tick - 1) + 1 + position
    }

    fn factor(&self) -> usize {
        self.voltage(self.n_ticks)
    }

    /// Column of a plant's deviation in this of the [`DEVIATING`] states.
    fn deviation(&self, plant: usize, position: usize) -> usize {
        self.factor() + 1 + (DEVIATING.len() + self.n_looks) * plant + position
    }

    /// Column of the size of what a plant has to creep at a look.
    fn creep_size(&self, plant: usize, look: usize) -> usize {
        self.deviation(plant, DEVIATING.len() + look)
    }

    /// Column of a held plant's deviation.
    fn held(&self, plant: usize, index: usize) -> usize {
        self.deviation(self.n_plants, 0) + N_DEVIATIONS * plant + index
    }

    /// Column of how far the place of rest is off the target, in units of the bound.
    fn place(&self) -> usize {
        self.held(self.n_held, 0)
    }

    fn n_columns(&self) -> usize {
        self.place() + usize::from(self.rests_anywhere)
    }
}

/// A program under construction.
struct Program<'a> {
    axis: &'a Axis,
    request: &'a Request,
    layout: Layout,
    units: Units,
    rows: Rows,
}

/// The best voltages for a request.
///
/// # Errors
/// If the solver does not reach its tolerance.
pub(super) fn solve(axis: &Axis, request: &Request) -> Result<Solution, JumpError> {
    let n_ticks = request.n_ticks;
    let layout = Layout {
        n_ticks,
        n_states: axis.active.len(),
        n_plants: axis.plants.len(),
        n_looks: axis.plants.first().map_or(0, |plant| plant.looks.len()),
        n_held: axis.held_in_programs().count(),
        rests_anywhere: axis.rests_anywhere,
    };
    let units = Units::new(axis, request);
    let mut program = Program { axis, request, layout, units, rows: Rows::default() };
    program.motion();
    program.ends();
    program.deviations();
    program.held_deviations();
    let n_equal = program.rows.len();
    program.bounds();
    program.way();
    program.held_bounds();
    program.creep_sizes();
    let n_bounds = program.rows.len() - n_equal;
    program.residuals();
    let mut cones = vec![ZeroConeT(n_equal), NonnegativeConeT(n_bounds)];
    cones.resize(2 + program.plants_and_looks().count(), SecondOrderConeT(3));
    let Program { layout, units, rows, .. } = program;
    let mut cost = vec![0.0; layout.n_columns()];
    let squared = match request.goal {
        Goal::Farthest => {
            cost[layout.factor()] = -1.0;
            Vec::new()
        }
        Goal::Coolest(_) => {
            (1..=n_ticks).map(|tick| layout.state(tick, layout.n_states - 1)).collect()
        }
    };
    let x = convex::minimise(rows, &cones, &cost, squared)
        .and_then(|x| x.ok_or_else(|| "PrimalInfeasible".into()))
        .map_err(|status| JumpError::Unsolved { n_ticks, tick_us: axis.tick_s * 1e6, status })?;
    let voltage = |tick| x[layout.voltage(tick)] * units.voltage;
    Ok(Solution {
        factor: match request.goal {
            Goal::Farthest => x[layout.factor()] * units.factor,
            Goal::Coolest(factor) => factor,
        },
        voltages_v: (0..n_ticks).map(voltage).collect(),
    })
}

impl Program<'_> {
    /// Adds that each state follows from the one before.
    fn motion(&mut self) {
        let Self { axis, request, layout, units, rows } = self;
        for tick in 0..layout.n_ticks {
            for (position, &to) in axis.active.iter().enumerate() {
                let unit = units.state[to];
                let gain = axis.step.b[to] * units.voltage / unit;
                let mut entries = vec![(layout.voltage(tick), gain)];
                if tick == 0 {
                    let free = (axis.step.a * request.ends.start)[to] * units.factor / unit;
                    entries.push((layout.factor(), free));
                } else {
                    for (from_position, &from) in axis.active.iter().enumerate() {
                        let gain = axis.step.a[(to, from)] * units.state[from] / unit;
                        entries.push((layout.state(tick, from_position), gain));
                    }
                }
                entries.push((layout.state(tick + 1, position), -1.0));
                rows.add(entries, 0.0);
            }
        }
    }

    /// Adds what the end must be, and the factor if it is given.
    fn ends(&mut self) {
        let Self { axis, layout, units, .. } = self;
        let Ends { start, end, place } = self.request.ends;
        for (position, state) in axis.active.iter().enumerate() {
            let counts = axis.rest.contains(state) || (place && !axis.creeps() && *state == 0);
            if counts {
                let target = end[*state] * units.factor / units.state[*state];
                let last = layout.state(layout.n_ticks, position);
                self.rows.add([(last, 1.0), (layout.factor(), -target)], 0.0);
            }
        }
        if place && axis.creeps() {
            let unit = if axis.rests_anywhere { axis.residual_max_rad } else { units.state[0] };
            let gain = axis.creep_rad(&[units.voltage]) / unit;
            let target = axis.creep_row().dot(&(end - start)) * units.factor / unit;
            let off = axis.rests_anywhere.then_some((layout.place(), -1.0));
            let voltages = (0..layout.n_ticks).map(|tick| (layout.voltage(tick), gain));
            self.rows.add(voltages.chain([(layout.factor(), -target)]).chain(off), 0.0);
        }
        if let Goal::Coolest(factor) = self.request.goal {
            self.rows.add([(layout.factor(), 1.0)], factor / units.factor);
        }
    }

    /// Adds how the end of each plant deviates from the nominal one.
    fn deviations(&mut self) {
        let (axis, n_ticks) = (self.axis, self.request.n_ticks);
        for (plant, one) in axis.plants.iter().enumerate() {
            for (position, &to) in DEVIATING.iter().enumerate() {
                let ticks = one.deviation(&axis.step, to, n_ticks);
                let column = self.layout.deviation(plant, position);
                self.deviation(column, self.units.state[to], &ticks);
            }
        }
    }

    /// Adds how each held plant deviates at the end.
    fn held_deviations(&mut self) {
        let (axis, n_ticks) = (self.axis, self.request.n_ticks);
        for (plant, (one, _)) in axis.held_in_programs().enumerate() {
            for index in 0..N_DEVIATIONS {
                let ticks = one.deviation(index, n_ticks);
                let column = self.layout.held(plant, index);
                self.deviation(column, self.units.deviation(index), &ticks);
            }
        }
    }

    /// Adds that a column, in its unit, is the sum of weighted states and voltages of all ticks.
    fn deviation(&mut self, column: usize, unit: f64, ticks: &[Weights]) {
        let Self { axis, request, layout, units, rows } = self;
        let from_factor = ticks[0].0.dot(&request.ends.start) * units.factor / unit;
        let mut entries = vec![(column, -1.0), (layout.factor(), from_factor)];
        for (tick, (weights, gain)) in ticks.iter().enumerate() {
            entries.push((layout.voltage(tick), gain * units.voltage / unit));
            if tick > 0 {
                entries.extend(axis.active.iter().enumerate().map(|(position, &from)| {
                    (layout.state(tick, position), weights[from] * units.state[from] / unit)
                }));
            }
        }
        rows.add(entries, 0.0);
    }

    /// Adds that each held plant is near the nominal mirror at each look.
    fn held_bounds(&mut self) {
        let Self { axis, layout, units, rows, .. } = self;
        for (plant, (one, share)) in axis.held_in_programs().enumerate() {
            for weights in &one.looks {
                for sign in [1.0, -1.0] {
                    let entries = (0..N_DEVIATIONS).map(|index| {
                        let weight = sign * weights[index] * units.deviation(index);
                        (layout.held(plant, index), weight / axis.residual_max_rad)
                    });
                    rows.add(entries, share);
                }
            }
        }
    }

    /// Adds that the size of what each plant has to creep at each look is at least that, either
    /// sign.
    fn creep_sizes(&mut self) {
        for (plant, look) in self.plants_and_looks() {
            let mut creep = self.missed(plant, &self.axis.plants[plant].looks[look][0]);
            if self.axis.rests_anywhere {
                // What is left to creep is short of the place of rest.
                creep.iter_mut().for_each(|(_, weight)| *weight = -*weight);
                creep.push((self.layout.place(), 1.0));
            }
            let size = (self.layout.creep_size(plant, look), -1.0);
            for sign in [1.0, -1.0] {
                let creep = creep.iter().map(|&(column, weight)| (column, sign * weight));
                self.rows.add(creep.chain([size]), 0.0);
            }
        }
    }

    /// Adds circular cones: creep and vibration of each plant at each look are together at most
    /// one, in units of the bound.
    fn residuals(&mut self) {
        for (plant, look) in self.plants_and_looks() {
            self.rows.add([(self.layout.creep_size(plant, look), 1.0)], 1.0);
            for weights in &self.axis.plants[plant].looks[look][1..] {
                let entries = self.missed(plant, weights);
                self.rows.add(entries, 0.0);
            }
        }
    }

    fn plants_and_looks(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (n_plants, n_looks) = (self.layout.n_plants, self.layout.n_looks);
        (0..n_plants).flat_map(move |plant| (0..n_looks).map(move |look| (plant, look)))
    }

    /// By how much a plant misses its end, weighed, in units of the bound.
    fn missed(&self, plant: usize, weights: &State) -> Vec<(usize, f64)> {
        let Self { axis, layout, units, request, .. } = self;
        let bound = axis.residual_max_rad;
        let target = weights.dot(&request.ends.end) * units.factor / bound;
        let mut entries = vec![(layout.factor(), -target)];
        for (position, &state) in axis.active.iter().enumerate() {
            let weight = weights[state] * units.state[state] / bound;
            entries.push((layout.state(layout.n_ticks, position), weight));
        }
        for (position, &state) in DEVIATING.iter().enumerate() {
            let weight = weights[state] * units.state[state] / bound;
            entries.push((layout.deviation(plant, position), weight));
        }
        entries
    }

    /// Adds the limits of voltage and current.
    fn bounds(&mut self) {
        let Self { axis, layout, units, rows, .. } = self;
        let current = axis.current_max_a / units.state[CURRENT];
        let position = axis.active.len() - 1;
        for tick in 0..layout.n_ticks {
            for sign in [1.0, -1.0] {
                rows.add([(layout.voltage(tick), sign)], 1.0);
                if tick > 0 {
                    rows.add([(layout.state(tick, position), sign)], current);
                    for (weights, gain) in &axis.bounded {
                        let entries = axis.active.iter().enumerate().map(|(position, &state)| {
                            let weight = weights[state] * units.state[state] / units.state[CURRENT];
                            (layout.state(tick, position), weight * sign)
                        });
                        let gain = gain * units.voltage / units.state[CURRENT] * sign;
                        rows.add(entries.chain([(layout.voltage(tick), gain)]), current);
                    }
                }
            }
        }
    }

    /// Adds where the mirror must be on the way.
    fn way(&mut self) {
        let n_ticks = self.layout.n_ticks;
        let unit = self.units.state[0];
        let target = self.request.ends.end[0] * self.units.factor / unit;
        match self.request.way {
            Way::Free => {}
            Way::Near(tube) => {
                // From the end of the tick before on, the last of its times.
                for tick in tube.arrival.saturating_sub(1)..n_ticks {
                    for sign in [1.0, -1.0] {
                        let target = [(self.layout.factor(), -sign * target)];
                        if let Some(place) = self.mirror(tick, sign).pop() {
                            let row = place.into_iter().chain(target);
                            self.rows.add(row, tube.epsilon_rad / unit);
                        }
                    }
                }
            }
            Way::Below(limit_rad) => {
                for place in self.mirrors(1.0) {
                    self.rows.add(place, limit_rad / unit);
                }
            }
            Way::Within(low_rad, high_rad) => {
                for (sign, limit_rad) in [(1.0, high_rad), (-1.0, -low_rad)] {
                    for place in self.mirrors(sign) {
                        self.rows.add(place, limit_rad / unit);
                    }
                }
            }
            Way::Behind(limit_rad) => {
                let end = self.mirror(n_ticks - 1, 1.0).pop().unwrap_or_default();
                self.rows.add(end.clone(), limit_rad / unit);
                for place in self.mirrors(-1.0) {
                    self.rows.add(place.into_iter().chain(end.clone()), limit_rad / unit);
                }
            }
        }
    }

    fn mirrors(&self, sign: f64) -> Vec<Vec<(usize, f64)>> {
        (0..self.layout.n_ticks).flat_map(|tick| self.mirror(tick, sign)).collect()
    }

    /// The mirror's angle, either sign, at the times of a tick up to its end, in units.
    fn mirror(&self, tick: usize, sign: f64) -> Vec<Vec<(usize, f64)>> {
        let Self { axis, request, layout, units, .. } = self;
        let unit = sign / units.state[0];
        let at = |(weights, gain): &(State, f64)| {
            let mut entries = vec![(layout.voltage(tick), gain * units.voltage * unit)];
            if tick == 0 {
                let free = weights.dot(&request.ends.start) * units.factor * unit;
                entries.push((layout.factor(), free));
            } else {
                entries.extend(axis.active.iter().enumerate().map(|(position, &state)| {
                    (layout.state(tick, position), weights[state] * units.state[state] * unit)
                }));
            }
            entries
        };
        axis.mirror.iter().map(at).collect()
    }
}
