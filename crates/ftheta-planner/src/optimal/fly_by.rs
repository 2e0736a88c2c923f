//! Motion between marks: from the state that one leaves to the state that the next begins in.
//!
//! The transition between both places and speeds comes from the fans. What the states have besides
//! (a lens bends straight lines a little, a mark may end in a curve) is added by the voltages of
//! least square that do it in the same time.

use super::NEAR_MM;
use super::heat::Heat;
use crate::jump::{JumpError, Route, Transition, Transitions};
use ftheta_model::machine::Machine;
use ftheta_physics::audit::COMMAND_SHARE;
use ftheta_physics::galvo::{CURRENT, Galvo, State, Step};
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::servo::Gains;
use nalgebra::{SMatrix, SVector};
use std::sync::OnceLock;

/// Factors by which a transition is prolonged, where heat or the angles do not allow it faster.
const LONGER: [f64; 10] = [1.0, 1.1, 1.25, 1.5, 1.8, 2.2, 2.8, 3.6, 5.0, 8.0];
/// Fewest ticks in which states are joined.
const N_TICKS_MIN: usize = 6;
/// Most ticks of a transition.
const N_TICKS_MAX: usize = 4000;
/// Part of the greatest torque with which mirrors are stopped at leisure, and how long it takes to
/// come, ticks.
const STOP_SHARE: f64 = 0.2;
const STOP_TICKS: f64 = 40.0;
/// Part of what the fans leave of the voltage that corrections may use.
const CORRECTION_SHARE: f64 = 0.5;
/// Part by which a near way may be longer than it says: optics and rounding.
const ROUNDING: f64 = 0.01;

/// Both axes at a tick.
pub(super) type States = [State; 2];

/// Voltages of both axes, tick by tick.
pub(super) type Voltages = Vec<[f64; 2]>;

/// Plans motion between states.
pub(super) struct FlyBy<'a> {
    transitions: &'a Transitions,
    near: &'a Transitions,
    near_rad: f64,
    machine: &'a Machine,
    step: Step,
    mirror_row: State,
    speed_row: State,
    gains: Gains,
    voltage_max_v: f64,
    current_max_a: f64,
    /// Angular acceleration with which mirrors can be stopped, whatever else is.
    stop_rad_s2: f64,
    tick_s: f64,
    /// Voltages of least square per number of ticks, once they are needed.
    least: Vec<OnceLock<Option<Vec<State>>>>,
    /// Scales of the states, so that none is lost beside another.
    units: State,
}

impl<'a> FlyBy<'a> {
    /// * `transitions`: for all ways, and for near ones
    /// * `voltage_reserve`: part of the voltage that transitions leave
    pub(super) fn new(
        [transitions, near]: [&'a Transitions; 2],
        machine: &'a Machine,
        gains: Gains,
        voltage_reserve: f64,
        current_max_a: f64,
    ) -> Self {
        let scanner = &machine.scanner;
        let galvo = Galvo::new(scanner);
        let tick_s = machine.output.period_s();
        let speed = galvo.torque_constant / galvo.inertia() * scanner.current_max_a * tick_s;
        let free = 1.0 - voltage_reserve * CORRECTION_SHARE;
        Self {
            transitions,
            near,
            near_rad: (1.0 + ROUNDING) * NEAR_MM / scale_mm_per_rad(&machine.optics),
            machine,
            step: galvo.step(tick_s),
            mirror_row: galvo.mirror_row(),
            speed_row: galvo.mirror_speed_row(),
            gains,
            voltage_max_v: free * scanner.voltage_max_v,
            current_max_a,
            stop_rad_s2: STOP_SHARE * speed / tick_s,
            tick_s,
            least: vec![OnceLock::new(); N_TICKS_MAX + 1],
            units: State::new(speed * tick_s, speed, speed * tick_s, speed, scanner.current_max_a),
        }
    }

    /// The voltages from states to states, in the fewest ticks that are known to do, or more where
    /// the coils are hot; `None` if there is no room.
    ///
    /// * `n_least`: ticks that it takes at least
    ///
    /// # Errors
    /// If a program fails.
    pub(super) fn between(
        &self,
        [from, to]: [&States; 2],
        heat: &Heat,
        n_least: usize,
    ) -> Result<Option<Voltages>, JumpError> {
        let routes = [0, 1].map(|axis| Route {
            from_rad: self.mirror_row.dot(&from[axis]),
            to_rad: self.mirror_row.dot(&to[axis]),
            from_rad_s: self.speed_row.dot(&from[axis]),
            to_rad_s: self.speed_row.dot(&to[axis]),
        });
        let planned = self.fewest(&routes)?;
        let n_least = n_least.max(N_TICKS_MIN);
        let mut n_fewest = n_least;
        if let Some([x, y]) = planned {
            n_fewest = x.n_ticks().max(n_least);
            let voltages: Voltages =
                x.voltages_v().zip(y.voltages_v()).map(|(x, y)| [x, y]).collect();
            if n_fewest == voltages.len()
                && let Some(voltages) = self.corrected(voltages, from, to)
                && self.allows(&voltages, from, heat)
            {
                return Ok(Some(voltages));
            }
        }
        for factor in LONGER {
            let n_ticks = (n_fewest as f64 * factor).ceil() as usize;
            if n_ticks > N_TICKS_MAX {
                break;
            }
            if let Some(voltages) = self.corrected(vec![[0.0; 2]; n_ticks], from, to)
                && self.allows(&voltages, from, heat)
            {
                return Ok(Some(voltages));
            }
        }
        Ok(None)
    }

    /// The transitions of both axes in the fewest ticks that hold what is not known of the motors.
    fn fewest(&self, routes: &[Route; 2]) -> Result<Option<[Transition<'_>; 2]>, JumpError> {
        let [x_rad, y_rad] = routes.each_ref().map(|route| route.to_rad - route.from_rad);
        if x_rad.hypot(y_rad) <= self.near_rad
            && let Some(pair) = self.near.meet_both(routes)?
        {
            return Ok(Some(pair));
        }
        self.transitions.plan_both(routes)
    }

    /// Adds what makes both ends exact.
    pub(super) fn corrected(
        &self,
        mut voltages: Voltages,
        from: &States,
        to: &States,
    ) -> Option<Voltages> {
        let n_ticks = voltages.len();
        if n_ticks < N_TICKS_MIN {
            return None;
        }
        let mut end = *from;
        for pair in &voltages {
            for axis in 0..2 {
                end[axis] = self.step.a * end[axis] + self.step.b * pair[axis];
            }
        }
        let least = self.least(n_ticks)?;
        for axis in 0..2 {
            let left = to[axis] - end[axis];
            for (pair, weights) in voltages.iter_mut().zip(least) {
                pair[axis] += weights.dot(&left);
            }
        }
        Some(voltages)
    }

    /// Whether mirrors that move so are so far from their greatest angles that stopping is no
    /// question: with a part of the torque, begun late.
    pub(super) fn has_room(&self, states: &States) -> bool {
        let Self { machine, stop_rad_s2, tick_s, .. } = *self;
        let angle_max_rad =
            (1.0 - ftheta_physics::audit::CORRECTION_RESERVE) * machine.scanner.angle_max_rad;
        states.iter().all(|state| {
            let speed = self.speed_row.dot(state).abs();
            let way_rad = speed * (0.5 * speed / stop_rad_s2 + STOP_TICKS * tick_s);
            self.mirror_row.dot(state).abs() + way_rad < angle_max_rad
        })
    }

    /// Greatest voltage, V, and current, A.
    pub(super) fn most(&self) -> (f64, f64) {
        (self.voltage_max_v, self.current_max_a)
    }

    /// A state one tick later.
    pub(super) fn advance(&self, state: &State, voltage_v: f64) -> State {
        self.step.a * state + self.step.b * voltage_v
    }

    /// Weights of a change of state in each voltage that makes it with the least square.
    fn least(&self, n_ticks: usize) -> Option<&[State]> {
        let solve = || least_square(&self.step, &self.units, n_ticks);
        self.least.get(n_ticks)?.get_or_init(solve).as_deref()
    }

    /// Whether voltages keep every limit of motor, mirror and output word.
    pub(super) fn allows(&self, voltages: &[[f64; 2]], from: &States, heat: &Heat) -> bool {
        let scanner = &self.machine.scanner;
        let command_max_rad =
            COMMAND_SHARE * scanner.angle_max_rad.min(self.machine.output.word_range_rad);
        let free = 1.0 - ftheta_physics::audit::CORRECTION_RESERVE;
        let (angle_max_rad, speed_max_rad_s) =
            (free * scanner.angle_max_rad, free * scanner.speed_max_rad_s);
        let mut hot = heat.clone();
        let mut states = *from;
        let mut acting = voltages.first().copied().unwrap_or_default();
        for (tick, pair) in voltages.iter().enumerate() {
            let next = voltages.get(tick + 1).copied().unwrap_or(*pair);
            for axis in 0..2 {
                let state = &states[axis];
                let command = self.gains.reference_rad(state, acting[axis], next[axis]);
                let after = self.step.a * state + self.step.b * pair[axis];
                let fine = pair[axis].abs() <= self.voltage_max_v
                    && after[CURRENT].abs() <= self.current_max_a
                    && self.mirror_row.dot(&after).abs() <= angle_max_rad
                    && self.speed_row.dot(&after).abs() <= speed_max_rad_s
                    && command.is_none_or(|rad| rad.abs() <= command_max_rad);
                if !fine {
                    return false;
                }
                states[axis] = after;
            }
            hot.tick([states[0][CURRENT], states[1][CURRENT]]);
            acting = next;
        }
        !hot.is_hot()
    }
}

/// `Bᵀ (B Bᵀ)⁻¹` of `n_ticks` voltages, in scaled states.
fn least_square(step: &Step, units: &State, n_ticks: usize) -> Option<Vec<State>> {
    let scaled = |state: &State| state.component_div(units);
    let mut effects: Vec<State> = Vec::with_capacity(n_ticks);
    let mut effect = step.b;
    for _ in 0..n_ticks {
        effects.push(scaled(&effect));
        effect = step.a * effect;
    }
    effects.reverse();
    let mut gram = SMatrix::<f64, 5, 5>::zeros();
    effects.iter().for_each(|effect| gram += effect * effect.transpose());
    let inverse = gram.cholesky()?.inverse();
    Some(effects.iter().map(|effect| scaled(&SVector::from(inverse * effect))).collect())
}
