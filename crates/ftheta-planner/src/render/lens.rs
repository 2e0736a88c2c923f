//! Commands of a focusing lens: where there is light the lens keeps the focus on the beam's place,
//! in the dark it takes the gentlest way to where the next light begins.

use super::Renderer;
use super::mirrors::PlayedMirrors;
use ftheta_model::machine::Focus;
use ftheta_physics::focus::{lens_travel_mm, travel_max_mm};
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::field_from_angles;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use std::collections::VecDeque;

/// Parts of the lens' acceleration that a way in the dark is tried with.
const SHARES: [f64; 8] = [0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 0.9, 1.0 + ROUNDING];
/// Part by which limits may be passed.
const ROUNDING: f64 = 1e-6;
/// Halvings until a speed is found to rounding.
const N_HALVINGS: u32 = 60;

/// The lens at a time.
#[derive(Clone, Copy, Debug)]
struct Moving {
    time_s: f64,
    at_mm: f64,
    speed_mm_s: f64,
}

/// A way from a state on: accelerations, each for a time; after them the speed stays.
#[derive(Clone, Copy, Debug)]
struct Way {
    from: Moving,
    phases: [(f64, f64); 3],
    end_s: f64,
}

/// The lens' travel over time, known as far as it has been asked for.
#[derive(Clone)]
pub(super) struct LensPath<'a> {
    lit: LitTicks<'a>,
    focus: &'a Focus,
    travel_max_mm: f64,
    tick_s: f64,
    end: Moving,
    /// The last tick with light, and the lens' travel there.
    before: Option<(u64, f64)>,
    /// The lens between the last two ticks of one light, or before any.
    left: Moving,
    /// Whether `left` belongs to the light at hand.
    is_bound: bool,
    ways: VecDeque<Way>,
    n_given: u64,
}

impl<'a> LensPath<'a> {
    /// Before the first sample; `None` for a head without such a lens.
    ///
    /// * `ahead`: the plan's words for the nominal head, from the first sample on
    pub(super) fn new(plan: &'a Plan, ahead: Renderer<'a>) -> Option<Self> {
        let (machine, tick_s) = (&plan.machine, plan.machine.output.period_s());
        let focus = machine.optics.focus.as_ref()?;
        let centre_mm = lens_travel_mm(&machine.optics, Default::default())?;
        let rest = |time_s| Moving { time_s, at_mm: centre_mm, speed_mm_s: 0.0 };
        Some(Self {
            lit: LitTicks::new(plan, ahead),
            focus,
            travel_max_mm: travel_max_mm(focus, plan.tolerance_mm),
            tick_s,
            end: rest(plan.n_samples() as f64 * tick_s),
            before: None,
            left: rest(focus.lag_s),
            is_bound: false,
            ways: VecDeque::from([Way::rest(rest(0.0), focus.lag_s)]),
            n_given: 0,
        })
    }

    /// Appends the commands of the next ticks, each for its middle, ahead by the lens' lag.
    pub(super) fn push(&mut self, n_ticks: usize, lens_mm: &mut Vec<f64>) {
        for _ in 0..n_ticks {
            let time_s = (self.n_given as f64 + 0.5) * self.tick_s + self.focus.lag_s;
            lens_mm.push(self.at_mm(time_s));
            self.n_given += 1;
        }
    }

    fn at_mm(&mut self, time_s: f64) -> f64 {
        loop {
            match self.ways.front() {
                Some(way) if time_s <= way.end_s => return way.at_mm(time_s),
                Some(_) => drop(self.ways.pop_front()),
                None => self.go_on(),
            }
        }
    }

    /// Finds the next way: through light from between two ticks to between the next two, so that
    /// speeds go on; or through the dark.
    fn go_on(&mut self) {
        let Some((tick, at_mm)) = self.lit.next() else {
            let rest = Way::rest(self.end, f64::INFINITY);
            self.ways.extend([self.dark(self.end), rest]);
            return;
        };
        match self.before.replace((tick, at_mm)) {
            Some((last, last_mm)) if last + 1 == tick => {
                let now = Moving {
                    time_s: (tick as f64 - 0.5) * self.tick_s,
                    at_mm: 0.5 * (at_mm + last_mm),
                    speed_mm_s: (at_mm - last_mm) / self.tick_s,
                };
                let way =
                    if self.is_bound { Way::straight(self.left, now) } else { self.dark(now) };
                self.ways.push_back(way);
                self.left = now;
                self.is_bound = true;
            }
            _ => self.is_bound = false,
        }
    }

    /// The way through the dark. The audit has proved that there is one; rounding may hide it.
    fn dark(&self, to: Moving) -> Way {
        Way::gentlest(self.left, to, self.focus, self.travel_max_mm)
            .unwrap_or_else(|| Way::straight(self.left, to))
    }
}

impl Way {
    fn rest(at: Moving, end_s: f64) -> Self {
        Self { from: at, phases: [(0.0, 0.0); 3], end_s }
    }

    /// One acceleration all the way.
    fn straight(from: Moving, to: Moving) -> Self {
        let time_s = to.time_s - from.time_s;
        let acceleration = (to.speed_mm_s - from.speed_mm_s) / time_s;
        Self { from, phases: [(time_s, acceleration), (0.0, 0.0), (0.0, 0.0)], end_s: to.time_s }
    }

    /// The way with the least acceleration of some; `None` if there is none within the limits.
    fn gentlest(from: Moving, to: Moving, focus: &Focus, travel_max_mm: f64) -> Option<Self> {
        let mut ways = SHARES.iter().filter_map(|share| {
            let most_mm_s2 = share * focus.acceleration_max_mm_s2;
            Self::cruising(from, to, most_mm_s2, focus.speed_max_mm_s)
        });
        ways.find(|way| way.farthest_mm() <= (1.0 + ROUNDING) * travel_max_mm)
    }

    /// To one constant speed in the middle, and on to the end's; `None` if there is no such way.
    fn cruising(from: Moving, to: Moving, most_mm_s2: f64, speed_max_mm_s: f64) -> Option<Self> {
        let (time_s, way_mm) = (to.time_s - from.time_s, to.at_mm - from.at_mm);
        let (u, v) = (from.speed_mm_s, to.speed_mm_s);
        // Between the speeds that the time leaves for.
        let (mean, spare) = (0.5 * (u + v), 0.5 * most_mm_s2 * time_s);
        if spare < 0.5 * (v - u).abs() {
            return None;
        }
        let most = speed_max_mm_s.max(u.abs()).max(v.abs());
        let (mut low, mut high) = ((mean - spare).max(-most), (mean + spare).min(most));
        let phases = |cruise: f64| {
            let ramp = |from: f64, to: f64| {
                ((to - from).abs() / most_mm_s2, most_mm_s2.copysign(to - from))
            };
            let (up, down) = (ramp(u, cruise), ramp(cruise, v));
            [up, ((time_s - up.0 - down.0).max(0.0), 0.0), down]
        };
        let length_mm = |cruise: f64| {
            let [up, along, down] = phases(cruise);
            0.5 * (u + cruise) * up.0 + cruise * along.0 + 0.5 * (cruise + v) * down.0
        };
        if length_mm(low) > way_mm || length_mm(high) < way_mm {
            return None;
        }
        for _ in 0..N_HALVINGS {
            let middle = 0.5 * (low + high);
            *(if length_mm(middle) < way_mm { &mut low } else { &mut high }) = middle;
        }
        Some(Self { from, phases: phases(0.5 * (low + high)), end_s: to.time_s })
    }

    fn at_mm(&self, time_s: f64) -> f64 {
        let mut left_s = (time_s - self.from.time_s).max(0.0);
        let (mut at_mm, mut speed) = (self.from.at_mm, self.from.speed_mm_s);
        for (duration_s, acceleration) in self.phases {
            let here_s = left_s.min(duration_s);
            at_mm += here_s * (speed + 0.5 * acceleration * here_s);
            speed += acceleration * here_s;
            left_s -= here_s;
        }
        at_mm + speed * left_s
    }

    /// Greatest travel on the way, either side, mm: at its ends, or where the lens turns.
    fn farthest_mm(&self) -> f64 {
        let (mut at_mm, mut speed) = (self.from.at_mm, self.from.speed_mm_s);
        let mut farthest_mm = at_mm.abs();
        for (duration_s, acceleration) in self.phases {
            let turn_s = -speed / acceleration;
            if turn_s > 0.0 && turn_s < duration_s {
                farthest_mm = farthest_mm.max((at_mm + 0.5 * speed * turn_s).abs());
            }
            at_mm += duration_s * (speed + 0.5 * acceleration * duration_s);
            speed += acceleration * duration_s;
            farthest_mm = farthest_mm.max(at_mm.abs());
        }
        farthest_mm
    }
}

/// Ticks with light, and the lens' travel for the beam's place on the nominal motors there.
#[derive(Clone)]
struct LitTicks<'a> {
    plan: &'a Plan,
    mirrors: Box<PlayedMirrors<'a>>,
    mark_index: usize,
}

impl<'a> LitTicks<'a> {
    fn new(plan: &'a Plan, ahead: Renderer<'a>) -> Self {
        let scanner = &plan.machine.scanner;
        let gains = Gains::design(scanner, plan.machine.output.period_s());
        let gains = gains.expect("the audit has designed it");
        let mirrors = PlayedMirrors::of(ahead, &Galvo::new(scanner), gains);
        Self { plan, mirrors: Box::new(mirrors), mark_index: 0 }
    }
}

impl Iterator for LitTicks<'_> {
    type Item = (u64, f64);

    fn next(&mut self) -> Option<(u64, f64)> {
        let machine = &self.plan.machine;
        while self.mirrors.advance() {
            let tick = self.mirrors.tick();
            let mut lit = self.plan.marks[self.mark_index..].iter().map(|m| m.lit_ticks(machine));
            let n_past = lit.position(|(_, last)| tick <= last)?;
            self.mark_index += n_past;
            if self.plan.marks[self.mark_index].lit_ticks(machine).0 <= tick {
                let place = field_from_angles(&machine.optics, self.mirrors.angles());
                return Some((tick, lens_travel_mm(&machine.optics, place)?));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at once")]

    use super::{Moving, Way};
    use ftheta_model::machine::Focus;
    use proptest::prelude::*;

    const FOCUS: Focus = Focus {
        magnification: 4.0,
        travel_mm: 5.0,
        speed_max_mm_s: 280.0,
        acceleration_max_mm_s2: 2e5,
        lag_s: 0.0,
        balanced: true,
    };

    proptest! {
        /// Where a lens has wound its way within the limits, there is a way, and it ends there.
        #[test]
        fn ways_are_found_where_there_are_any(
            start in (-4.0..4.0_f64, -280.0..280.0_f64),
            pushes in prop::collection::vec((-1.3..1.3_f64, 1e-5..2e-3_f64), 1..12),
        ) {
            let from = Moving { time_s: 0.1, at_mm: start.0, speed_mm_s: start.1 };
            let mut to = from;
            for (push, mut duration_s) in pushes {
                let acceleration = FOCUS.acceleration_max_mm_s2 * push.clamp(-1.0, 1.0);
                // As long as the speed allows.
                let room = FOCUS.speed_max_mm_s - to.speed_mm_s * acceleration.signum();
                duration_s = duration_s.min(room / acceleration.abs());
                let leg = Way {
                    from: to,
                    phases: [(duration_s, acceleration), (0.0, 0.0), (0.0, 0.0)],
                    end_s: to.time_s + duration_s,
                };
                prop_assume!(leg.farthest_mm() <= FOCUS.travel_mm);
                to = Moving {
                    time_s: leg.end_s,
                    at_mm: leg.at_mm(leg.end_s),
                    speed_mm_s: to.speed_mm_s + acceleration * duration_s,
                };
            }
            let way = Way::gentlest(from, to, &FOCUS, FOCUS.travel_mm).unwrap();
            prop_assert!((way.at_mm(to.time_s) - to.at_mm).abs() < 1e-6);
            let step_s = 1e-3 * (to.time_s - from.time_s);
            let end_speed = (way.at_mm(to.time_s) - way.at_mm(to.time_s - step_s)) / step_s;
            let most = FOCUS.acceleration_max_mm_s2 * step_s + 1e-3;
            prop_assert!((end_speed - to.speed_mm_s).abs() <= most, "{end_speed} {}", to.speed_mm_s);
            let time_s: f64 = way.phases.iter().map(|phase| phase.0).sum();
            prop_assert!((time_s - (to.time_s - from.time_s)).abs() < 1e-9);
        }
    }
}
