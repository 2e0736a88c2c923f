//! Transitions: from any angle and speed to any other, in the fewest ticks that are known to do.
//!
//! Rest to rest comes from the atlas. Moving ends come from the fans, number of ticks by number of
//! ticks, since feasible numbers have gaps. Where the angle limit stands in the way of every one of
//! them, the axis stops, jumps and starts again. What even that cannot do, nothing can.

use super::brake::{Brakes, End, Fit};
use super::fan::{Ask, Fan, Sum, Term};
use super::program::Way;
use super::{Atlas, AtlasOptions, Axis, AxisOptions, JumpError};
use crate::solved::{RAY, Solved, of_kind};
use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, State};
use std::sync::OnceLock;

/// Fewest ticks with fans; fewer do not move anything.
const N_TICKS_MIN: usize = 6;
/// Most ticks with fans: by then every axis has had time to stop and start.
const N_TICKS_MAX: usize = 512;
/// Above this many ticks only every second has a fan, above twice as many every fourth.
const N_TICKS_EACH: usize = 64;
/// After the first number of ticks that meets the ends, this part more are tried for the angles.
const LONGER: f64 = 0.3;
/// Parts by which the jump between a stop and a start is longer than need be, tried in this order:
/// where a mirror swings past the ends of the fastest jump into the wall, a slower one swings less.
const STRETCHES: [f64; 5] = [0.0, 0.1, 0.3, 0.6, 1.0];
/// Most ticks of a way without turning that gets a program of its own.
const N_TICKS_STRAIGHT: usize = 150;
/// Periods of the mode by which a stop or start without room to spare is longer than others.
const N_SWINGS: f64 = 2.0;
/// A displacement may exceed the longest step of its ticks by this part, when the ends move.
const SLACK: f64 = 1.1;
/// Rounding that an angle, speed or current may carry.
const ROUNDING: f64 = 1e-9;

/// Where and how fast a transition starts and ends, without twist and current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Route {
    /// Angle at the start, rad mechanical.
    pub from_rad: f64,
    /// Angle at the end, rad mechanical.
    pub to_rad: f64,
    /// Speed at the start, rad/s.
    pub from_rad_s: f64,
    /// Speed at the end, rad/s.
    pub to_rad_s: f64,
}

/// Voltages from end to end, in phases that follow on.
#[derive(Clone, Debug)]
pub struct Transition<'a> {
    phases: [Phase<'a>; 3],
}

/// A stretch of voltages.
#[derive(Clone, Debug)]
enum Phase<'a> {
    /// No voltage for so many ticks.
    Rest(usize),
    /// Sequences in shares.
    Sum(Sum<'a>),
    /// Solved for this transition alone.
    Own(Vec<f64>),
}

/// Solves transitions of one axis; what it needs is solved when it is first needed.
#[derive(Debug)]
pub struct Transitions {
    axis: Axis,
    atlas: Atlas,
    angle_max_rad: f64,
    speed_max_rad_s: f64,
    /// Steps that no axis exceeds by number of ticks, as far as they are known, rad.
    longest_rad: Vec<f64>,
    /// One for each number of ticks of the schedule.
    fans: Vec<Fan>,
    brakes: OnceLock<Result<[Brakes; 2], JumpError>>,
}

impl Phase<'_> {
    fn n_ticks(&self) -> usize {
        match self {
            Self::Rest(n_ticks) => *n_ticks,
            Self::Sum(sum) => sum.n_ticks,
            Self::Own(voltages_v) => voltages_v.len(),
        }
    }

    fn voltage_v(&self, tick: usize) -> f64 {
        match self {
            Self::Rest(_) => 0.0,
            Self::Sum(sum) => sum.voltage_v(tick),
            Self::Own(voltages_v) => voltages_v[tick],
        }
    }
}

impl<'a> Transition<'a> {
    fn single(sum: Sum<'a>) -> Self {
        Self { phases: [Phase::Sum(sum), Phase::Rest(0), Phase::Rest(0)] }
    }

    /// Duration, ticks.
    pub fn n_ticks(&self) -> usize {
        self.phases.iter().map(Phase::n_ticks).sum()
    }

    /// Voltage of each tick, V.
    pub fn voltages_v(&self) -> impl Iterator<Item = f64> {
        let voltages = |phase| (0..Phase::n_ticks(phase)).map(|tick| phase.voltage_v(tick));
        self.phases.iter().flat_map(voltages)
    }
}

impl Transitions {
    /// Transitions of this scanner's axes; solves the longest steps, and nothing else yet.
    ///
    /// # Errors
    /// If a parameter is out of range or a program fails.
    pub fn new(scanner: &Scanner, axis: AxisOptions) -> Result<Self, JumpError> {
        let range_rad = 2.0 * scanner.angle_max_rad;
        Self::with_atlas(Atlas::build(scanner, AtlasOptions { axis, range_rad })?)
    }

    /// Transitions with an atlas that reaches as far as steps from rest to rest will.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn with_atlas(atlas: Atlas) -> Result<Self, JumpError> {
        let mut n_ticks = N_TICKS_MIN;
        let mut fans = Vec::new();
        while n_ticks <= N_TICKS_MAX {
            fans.push(Fan::new(&atlas, n_ticks));
            n_ticks += match n_ticks {
                ..N_TICKS_EACH => 1,
                N_TICKS_EACH..128 => 2,
                _ => 4,
            };
        }
        let scanner = atlas.scanner();
        Ok(Self {
            axis: Axis::new(scanner, atlas.axis_options())?,
            angle_max_rad: scanner.angle_max_rad,
            speed_max_rad_s: scanner.speed_max_rad_s,
            longest_rad: atlas.steps_rad().to_vec(),
            atlas,
            fans,
            brakes: OnceLock::new(),
        })
    }

    /// The same for motors that are known less well: without an atlas, so only for
    /// [`Self::meet_both`].
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn less_certain(&self, scanner: &Scanner) -> Result<Self, JumpError> {
        let options = self.atlas.axis_options();
        let other = Self::with_atlas(Atlas::restore(scanner, options, Default::default())?)?;
        Ok(Self { longest_rad: self.longest_rad.clone(), ..other })
    }

    /// The jumps from rest to rest.
    pub fn atlas(&self) -> &Atlas {
        &self.atlas
    }

    /// The rays of fans that are solved so far, without those that come from the atlas.
    pub fn solved(&self) -> Solved {
        let rays = self.fans.iter().flat_map(|fan| {
            let key = |index: usize| [RAY, fan.n_ticks() as i32, index as i32, 0];
            fan.solved(&self.atlas).map(move |(index, numbers)| (key(index), numbers))
        });
        rays.collect()
    }

    /// Takes back what [`Self::solved`] gave of the same scanner and options; what does not fit is
    /// left out.
    pub fn restore(&self, solved: &Solved) {
        for ([n_ticks, index, _], numbers) in of_kind(solved, RAY) {
            let fan = self.fans.binary_search_by_key(&n_ticks, |fan| fan.n_ticks() as i32);
            if let (Ok(fan), Ok(index)) = (fan, usize::try_from(index)) {
                self.fans[fan].restore(index, numbers);
            }
        }
    }

    /// The voltages of a route, or `None` if no motion within the angles makes it.
    ///
    /// # Errors
    /// If an end is out of range or a program fails.
    ///
    /// # Accuracy
    /// Both ends within 1e-9 of the largest state; voltage, current, angle and speed within their
    /// limits; between two looks, a quarter of a tick apart, the mirror may pass its limit by 1e-5
    /// of it. Routes that stop or start with less than a hundredth of speed to spare, and those
    /// that are refused, take programs of their own: milliseconds, not microseconds.
    pub fn plan(&self, route: &Route) -> Result<Option<Transition<'_>>, JumpError> {
        self.check(route)?;
        let mut n_last = usize::MAX;
        if let Some(rest) = self.rest(route) {
            return Ok(Some(rest));
        }
        for [transition] in self.candidates([*route]) {
            let n_ticks = transition.n_ticks();
            n_last = n_last.min((n_ticks as f64 * (1.0 + LONGER)) as usize + 4);
            if n_ticks > n_last {
                break;
            }
            if self.keeps_limits(route, &transition) {
                return Ok(Some(transition));
            }
        }
        match self.detour(route, 0)? {
            Some(transition) => Ok(Some(transition)),
            None => self.straight(route),
        }
    }

    /// A route without turning that the fans miss, by programs of its own: near a wall, where it
    /// can neither stop nor be stretched, a single number of ticks may be all there is.
    fn straight(&self, route: &Route) -> Result<Option<Transition<'_>>, JumpError> {
        let ask = ask(route);
        let (v0, v1, step) = (ask.from_rad_s, ask.to_rad_s, ask.distance_rad.abs());
        if v0 * v1 < 0.0 || ask.distance_rad * (v0 + v1) <= 0.0 {
            return Ok(None);
        }
        let galvo = &self.axis.galvo;
        let most = galvo.torque_constant / galvo.inertia() * self.axis.current_max_a;
        // Slowest where full braking meets full acceleration; slower only by turning.
        let slowest = (0.5 * (v0 * v0 + v1 * v1) - most * step).max(0.0).sqrt();
        let longest_s = (v0.abs() + v1.abs() - 2.0 * slowest) / most;
        let n_longest = ((longest_s / self.axis.tick_s) as usize + 1).min(N_TICKS_STRAIGHT);
        for n_ticks in N_TICKS_MIN..=n_longest {
            if !self.may_meet(route, n_ticks) {
                continue;
            }
            let Some(voltages_v) = self.axis.meet(&ask, Way::Free, n_ticks)? else {
                continue;
            };
            let phases = [Phase::Own(voltages_v), Phase::Rest(0), Phase::Rest(0)];
            let transition = Transition { phases };
            if self.keeps_limits(route, &transition) {
                return Ok(Some(transition));
            }
        }
        Ok(None)
    }

    /// The voltages of two axes that move together, in the same number of ticks; `None` if there is
    /// no such motion within the angles.
    ///
    /// # Errors
    /// As [`Self::plan`].
    pub fn plan_both(&self, routes: &[Route; 2]) -> Result<Option<[Transition<'_>; 2]>, JumpError> {
        if let Some(pair) = self.meet_both(routes)? {
            return Ok(Some(pair));
        }
        let [first, second] = routes;
        let Some(one) = self.detour(first, 0)? else {
            return Ok(None);
        };
        let Some(other) = self.detour(second, one.n_ticks())? else {
            return Ok(None);
        };
        // What was in time before waits; then both take the same time.
        Ok(self.detour(first, other.n_ticks())?.map(|one| [one, other]))
    }

    /// As [`Self::plan_both`] where neither axis has to stop and start again, whatever the reach of
    /// the atlas; `None` if there is no such motion.
    ///
    /// # Errors
    /// If an end is out of range.
    pub fn meet_both(&self, routes: &[Route; 2]) -> Result<Option<[Transition<'_>; 2]>, JumpError> {
        routes.iter().try_for_each(|route| self.check(route))?;
        let keep = |pair: &[Transition<'_>; 2]| {
            routes.iter().zip(pair).all(|(route, one)| self.keeps_limits(route, one))
        };
        Ok(self.candidates(*routes).find(keep))
    }

    /// Voltages that meet the ends of all routes, by number of ticks.
    fn candidates<const N: usize>(
        &self,
        routes: [Route; N],
    ) -> impl Iterator<Item = [Transition<'_>; N]> {
        // The last fan that did not reach far enough, for each route.
        let mut short: [Option<&Fan>; N] = [None; N];
        self.fans.iter().filter_map(move |fan| {
            let n_ticks = fan.n_ticks();
            let may = |(route, short): (&Route, &Option<&Fan>)| {
                self.may_meet(route, n_ticks)
                    && short.is_none_or(|fan| fan.may_grow_to(&self.axis, &ask(route), n_ticks))
            };
            if !routes.iter().zip(&short).all(may) {
                return None;
            }
            let mut met = [const { None }; N];
            for ((route, short), met) in routes.iter().zip(&mut short).zip(&mut met) {
                let sum = fan.meet(&self.axis, &ask(route));
                if sum.is_none() {
                    *short = Some(fan);
                }
                *met = Some(Transition::single(sum?));
            }
            Some(met.map(|one| one.expect("all routes are met")))
        })
    }

    /// Whether a number of ticks is worth solving its fan for.
    fn may_meet(&self, route: &Route, n_ticks: usize) -> bool {
        let ask = ask(route);
        let duration_s = n_ticks as f64 * self.axis.tick_s;
        let displacement = ask.displacement_rad(duration_s).abs();
        let gain_max = self.axis.acceleration_max_rad_s2() * duration_s;
        let gained = ask.gain_rad_s().abs() / gain_max;
        // The greatest torque one way, then the other.
        let farthest_rad = 0.25 * gain_max * duration_s * (1.0 - gained * gained);
        let longest = self.longest_rad.get(n_ticks).copied().unwrap_or(f64::INFINITY);
        displacement <= SLACK * longest.min(farthest_rad) && gained <= 1.0
    }

    /// Rest to rest, from the atlas.
    fn rest(&self, route: &Route) -> Option<Transition<'_>> {
        if route.from_rad_s != 0.0 || route.to_rad_s != 0.0 {
            return None;
        }
        let transition = Transition::single(self.jump(route.to_rad - route.from_rad, 0.0)?);
        self.keeps_limits(route, &transition).then_some(transition)
    }

    /// A jump in this part more than the fewest ticks, as far as the atlas goes.
    fn jump(&self, step_rad: f64, stretch: f64) -> Option<Sum<'_>> {
        let fewest = self.atlas.jump(step_rad)?;
        let n_ticks = (fewest.n_ticks as f64 * (1.0 + stretch)) as usize;
        let n_ticks = n_ticks.min(self.atlas.steps_rad().len() - 1);
        let jump = self.atlas.jump_at(0, step_rad, n_ticks)?;
        let terms = [Term::new(jump.sequence, jump.scale), Term::default()];
        Some(Sum { n_ticks: jump.n_ticks, terms, coast_v: 0.0 })
    }

    /// Stops, jumps, and starts again, in at least so many ticks; `None` if there is not the room.
    fn detour(
        &self,
        route: &Route,
        n_ticks_min: usize,
    ) -> Result<Option<Transition<'_>>, JumpError> {
        for stretch in STRETCHES {
            let Some(transition) = self.stop_and_start(route, stretch, n_ticks_min)? else {
                return Ok(None);
            };
            if self.keeps_limits(route, &transition) {
                return Ok(Some(transition));
            }
        }
        Ok(None)
    }

    /// Stops, jumps in this part more than the fewest ticks, and starts again, in at least so many.
    fn stop_and_start(
        &self,
        route: &Route,
        stretch: f64,
        n_ticks_min: usize,
    ) -> Result<Option<Transition<'_>>, JumpError> {
        let brakes = self.brakes.get_or_init(|| self.solve_brakes());
        let [stops, starts] = brakes.as_ref().map_err(JumpError::clone)?;
        let sides = [route.from_rad_s, route.to_rad_s].map(|speed| 1.0_f64.copysign(speed));
        let stop_room_rad = self.angle_max_rad - sides[0] * route.from_rad;
        let start_room_rad = self.angle_max_rad + sides[1] * route.to_rad;
        let Some((stop, stopped_rad)) =
            self.brake(stops, stop_room_rad, route.from_rad_s.abs(), sides[0])?
        else {
            return Ok(None);
        };
        let Some((start, started_rad)) =
            self.brake(starts, start_room_rad, route.to_rad_s.abs(), sides[1])?
        else {
            return Ok(None);
        };
        let step_rad = route.to_rad - started_rad - (route.from_rad + stopped_rad);
        let Some(mut jump) = self.jump(step_rad, stretch) else {
            return Ok(None);
        };
        let n_ticks = stop.n_ticks() + jump.n_ticks + start.n_ticks();
        // A sequence that has ended adds nothing: the axis waits.
        jump.n_ticks += n_ticks_min.saturating_sub(n_ticks);
        Ok(Some(Transition { phases: [stop, Phase::Sum(jump), start] }))
    }

    /// A stop or start towards one side, and how far it goes.
    fn brake<'a>(
        &'a self,
        brakes: &'a Brakes,
        room_rad: f64,
        speed_rad_s: f64,
        side: f64,
    ) -> Result<Option<(Phase<'a>, f64)>, JumpError> {
        if speed_rad_s == 0.0 {
            return Ok(Some((Phase::Rest(0), 0.0)));
        }
        match brakes.fit(room_rad, speed_rad_s) {
            Fit::Yes(mut brake) => {
                brake.sum.terms.iter_mut().for_each(|term| term.share *= side);
                Ok(Some((Phase::Sum(brake.sum), side * brake.distance_rad)))
            }
            Fit::Unknown => {
                let swing_s = N_SWINGS * std::f64::consts::TAU / self.axis.galvo.omega;
                let n_ticks = self.ample_ticks(room_rad) + (swing_s / self.axis.tick_s) as usize;
                let solved = brakes.exact(&self.axis, room_rad, speed_rad_s, n_ticks)?;
                Ok(solved.map(|(mut voltages_v, distance_rad)| {
                    voltages_v.iter_mut().for_each(|voltage| *voltage *= side);
                    (Phase::Own(voltages_v), side * distance_rad)
                }))
            }
            Fit::No => Ok(None),
        }
    }

    fn solve_brakes(&self) -> Result<[Brakes; 2], JumpError> {
        let build = |end| {
            let ticks = |room_rad| self.ample_ticks(room_rad);
            Brakes::build(&self.axis, end, self.speed_max_rad_s, ticks)
        };
        Ok([build(End::Stop)?, build(End::Start)?])
    }

    /// Ticks in which an axis can go through a room twice and stop.
    fn ample_ticks(&self, room_rad: f64) -> usize {
        let steps_rad = self.atlas.steps_rad();
        let n_ticks = steps_rad.partition_point(|&step| step < 2.0 * room_rad);
        n_ticks.min(steps_rad.len()) + 16
    }

    fn check(&self, route: &Route) -> Result<(), JumpError> {
        let angle = 2.0 * self.angle_max_rad;
        let rows = [
            ("start angle rad", route.from_rad, angle),
            ("end angle rad", route.to_rad, angle),
            ("start speed rad/s", route.from_rad_s, self.speed_max_rad_s),
            ("end speed rad/s", route.to_rad_s, self.speed_max_rad_s),
        ];
        for (quantity, value, high) in rows {
            if !(-high..=high).contains(&value) {
                return Err(JumpError::Parameter { quantity, value, low: -high, high });
            }
        }
        Ok(())
    }

    /// Plays the voltages on the nominal axis.
    fn keeps_limits(&self, route: &Route, transition: &Transition<'_>) -> bool {
        let speed_row = self.axis.galvo.mirror_speed_row();
        let angle_max_rad = self.angle_max_rad * (1.0 + ROUNDING);
        let inside = 1.0 + ROUNDING;
        let mut state = State::new(route.from_rad, route.from_rad_s, 0.0, 0.0, 0.0);
        let mut within = state[0].abs().max(route.to_rad.abs()) <= angle_max_rad;
        for phase in &transition.phases {
            for tick in 0..phase.n_ticks() {
                let voltage = phase.voltage_v(tick);
                // A turn between two ticks would be seen at neither of them.
                let mut angles = self.axis.mirror_rad(state, voltage);
                within &= angles.all(|angle| angle.abs() <= angle_max_rad);
                state = self.axis.advance(&state, voltage);
                within &= speed_row.dot(&state).abs() <= self.speed_max_rad_s * inside
                    && state[CURRENT].abs() <= self.axis.current_max_a * inside;
            }
        }
        within
    }
}

/// What a route asks of its axis, wherever it lies.
pub(super) fn ask(route: &Route) -> Ask {
    Ask {
        distance_rad: route.to_rad - route.from_rad,
        from_rad_s: route.from_rad_s,
        to_rad_s: route.to_rad_s,
    }
}
