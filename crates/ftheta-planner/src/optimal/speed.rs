//! Speed along a path: as fast as corners, bends and motors allow, at most the mark speed.
//!
//! Averaging cuts a corner the more, the faster it is passed. A vertex passed at speed v with
//! acceleration a on both sides is missed by `sin(θ/2) (v m₁ + a m₂ / 2)`, with the mean and the
//! mean square of the averaged time. What several vertices within that time miss adds up.

use super::path::{Path, angle};
use super::relief::Relief;
use super::smoothing::{Smoothing, shares};
use ftheta_model::plan::Knot;

/// Part of what may be missed by which the acceleration alone may miss a reversal.
const ACCELERATION_SHARE: f64 = 1.4;
/// Steps by which a speed is lowered until bends are passed within the allowance.
const SLOWER: f64 = 0.9;
/// Part of the way averaged over within which slight turns are one.
const LUMP_SHARE: f64 = 1.0 / 12.0;
/// A turn that is slight, rad, and the most that several are together.
const SLIGHT_RAD: f64 = 0.02;
const LUMP_MAX_RAD: f64 = 0.1;
/// Part of the mark speed below which none is tried.
const SLOWEST: f64 = 1e-3;
/// Turns below this, rad, are left out: what 32-bit coordinates make of a straight line.
const TURN_MIN_RAD: f64 = 1e-7;

/// What limits the speed along marks.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedLimits {
    /// Mark speed, mm/s.
    pub(super) speed_mm_s: f64,
    /// Greatest acceleration along the path, mm/s².
    pub(super) acceleration_mm_s2: f64,
    /// By how much averaging may miss a vertex, mm.
    pub(super) miss_mm: f64,
    /// Greatest change of velocity at once, mm/s.
    pub(super) change_mm_s: f64,
    /// Corners sharper than this are stopped in, rad; infinite for none.
    pub(super) stop_rad: f64,
}

/// A vertex where the path turns.
#[derive(Clone, Copy, Debug)]
struct Turn {
    at_mm: f64,
    angle_rad: f64,
    corner_rad: f64,
}

/// A place with its greatest speed, and how long to stay there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    pub(super) at_mm: f64,
    pub(super) speed_mm_s: f64,
    pub(super) wait_s: f64,
}

/// The speed profile of a path, at least one knot; and whether its speed is constant and all that
/// turns within reach of any place is too little to strain a motor.
pub(super) fn profile(
    path: &Path,
    limits: &SpeedLimits,
    smoothing: &Smoothing,
    relief: &Relief,
) -> (Vec<Knot>, bool) {
    let acceleration_mm_s2 =
        limits.acceleration_mm_s2.min(ACCELERATION_SHARE * limits.miss_mm / smoothing.variance_s2);
    let acceleration_mm_s2 = relief.acceleration_share * acceleration_mm_s2;
    let mut calm = relief.is_none();
    let turns = turns(path, LUMP_SHARE * limits.speed_mm_s * smoothing.half_s);
    let mut slow: Vec<Limit> = Vec::new();
    let mut passing = Passing::new(&turns, limits, smoothing, acceleration_mm_s2);
    let mut turning = Turning { first: 0, end: 0, sum_rad: 0.0 };
    let (reach_mm, calm_rad) = (limits.speed_mm_s * smoothing.half_s, calm_rad(limits, smoothing));
    for (index, turn) in turns.iter().enumerate() {
        let turned_rad = turning.around(&turns, index, reach_mm);
        let speed_mm_s = if turn.corner_rad.abs() > limits.stop_rad {
            0.0
        } else if turned_rad < calm_rad {
            limits.speed_mm_s
        } else {
            calm = false;
            passing.speed_mm_s(index)
        };
        let wait_s = if speed_mm_s == 0.0 { 2.0 * smoothing.half_s } else { 0.0 };
        if speed_mm_s < limits.speed_mm_s {
            slow.push(Limit { at_mm: turn.at_mm, speed_mm_s, wait_s });
        }
    }
    calm &= slow.is_empty();
    if !relief.slow.is_empty() {
        slow.extend(relief.slow.iter().filter(|limit| limit.speed_mm_s < limits.speed_mm_s));
        slow.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
    }
    (knots(path.length_mm(), slow, limits.speed_mm_s, acceleration_mm_s2), calm)
}

/// Where the path turns, with half of every curved leg's bend counted at each of its ends.
///
/// * `lump_mm`: slight turns within it are one
fn turns(path: &Path, lump_mm: f64) -> Vec<Turn> {
    let mut first_mm = 0.0;
    let bend = |leg: usize| match path.is_curved() {
        true => angle(path.ways(leg)[1], path.ways(leg + 1)[0]),
        false => 0.0,
    };
    let last = path.vertices.len() - 1;
    let mut turns: Vec<Turn> = Vec::new();
    for (index, &at_mm) in path.distances_mm.iter().enumerate() {
        let [arriving, leaving] = path.ways(index);
        let corner_rad = match index {
            0 => 0.0,
            _ if index == last => 0.0,
            _ => angle(arriving, leaving),
        };
        let before = if index > 0 { bend(index - 1) } else { 0.0 };
        let after = if index < last { bend(index) } else { 0.0 };
        let angle_rad = corner_rad + 0.5 * (before + after);
        if angle_rad.abs() > TURN_MIN_RAD {
            let turn = Turn { at_mm, angle_rad, corner_rad };
            match turns.last_mut() {
                Some(last) if turn.at_mm - first_mm < lump_mm && last.lumps_with(&turn) => {
                    last.add(&turn);
                }
                _ => {
                    first_mm = turn.at_mm;
                    turns.push(turn);
                }
            }
        }
    }
    turns
}

impl Turn {
    /// Whether both are so slight, and to one side, that one of their sum stands for them.
    fn lumps_with(&self, other: &Self) -> bool {
        self.angle_rad.abs() < LUMP_MAX_RAD
            && self.corner_rad.abs() < SLIGHT_RAD
            && other.angle_rad.abs() < SLIGHT_RAD
            && self.angle_rad * other.angle_rad > 0.0
    }

    /// Adds another turn, in the middle of both by their angles.
    fn add(&mut self, other: &Self) {
        let sum_rad = self.angle_rad + other.angle_rad;
        self.at_mm += (other.at_mm - self.at_mm) * (other.angle_rad / sum_rad);
        self.angle_rad = sum_rad;
        self.corner_rad = 0.0;
    }
}

/// Turns that sum up to less within reach, whatever their sign, are passed at mark speed, rad.
fn calm_rad(limits: &SpeedLimits, smoothing: &Smoothing) -> f64 {
    let by_change = 0.5 * limits.change_mm_s / limits.speed_mm_s;
    let by_miss = limits.miss_mm / (limits.speed_mm_s * smoothing.mean_s);
    // Less what rounding makes of sums.
    2.0 * (1.0 - 1e-6) * by_change.min(by_miss).clamp(0.0, 1.0).asin()
}

/// Sum of turns around one after the other.
struct Turning {
    first: usize,
    end: usize,
    sum_rad: f64,
}

impl Turning {
    /// Sum of the turns within a reach of this one, each without its sign, rad.
    fn around(&mut self, turns: &[Turn], index: usize, reach_mm: f64) -> f64 {
        let at_mm = turns[index].at_mm;
        while let Some(turn) = turns.get(self.end)
            && turn.at_mm <= at_mm + reach_mm
        {
            self.sum_rad += turn.angle_rad.abs();
            self.end += 1;
        }
        while turns[self.first].at_mm < at_mm - reach_mm {
            self.sum_rad -= turns[self.first].angle_rad.abs();
            self.first += 1;
        }
        self.sum_rad
    }
}

/// Speeds that turns are tried at, and what is known of the path.
struct Passing<'a> {
    turns: &'a [Turn],
    limits: &'a SpeedLimits,
    smoothing: &'a Smoothing,
    acceleration_mm_s2: f64,
    /// From the mark speed down.
    speeds_mm_s: Vec<f64>,
    /// Index of the speed at which the turn before is passed.
    before: usize,
}

impl<'a> Passing<'a> {
    fn new(
        turns: &'a [Turn],
        limits: &'a SpeedLimits,
        smoothing: &'a Smoothing,
        acceleration_mm_s2: f64,
    ) -> Self {
        let speeds_mm_s = std::iter::successors(Some(limits.speed_mm_s), |speed| {
            (*speed >= SLOWEST * limits.speed_mm_s).then_some(speed * SLOWER)
        });
        let speeds_mm_s = speeds_mm_s.collect();
        Self { turns, limits, smoothing, acceleration_mm_s2, speeds_mm_s, before: 0 }
    }

    /// Greatest speed past a turn and its neighbours, tried from that of the turn before on.
    fn speed_mm_s(&mut self, index: usize) -> f64 {
        let last = self.speeds_mm_s.len() - 1;
        let mut at = self.before;
        let mut found = self.at(index, at);
        while found.is_none() && at < last {
            at += 1;
            found = self.at(index, at);
        }
        while at > 0
            && let Some(faster) = self.at(index, at - 1)
        {
            at -= 1;
            found = Some(faster);
        }
        self.before = at;
        found.unwrap_or(self.speeds_mm_s[last])
    }

    /// The speed at which a turn is passed, if this one, or one that is found from it, does.
    fn at(&self, index: usize, speed: usize) -> Option<f64> {
        let Self { turns, limits, smoothing, acceleration_mm_s2, .. } = *self;
        let speed_mm_s = self.speeds_mm_s[speed];
        let (missed, turned) = weighed(turns, index, speed_mm_s * smoothing.half_s);
        let change = 2.0 * (0.5 * turned.abs()).min(std::f64::consts::FRAC_PI_2).sin();
        if change * speed_mm_s > limits.change_mm_s {
            return None;
        }
        let sine = (0.5 * missed.abs()).min(std::f64::consts::FRAC_PI_2).sin();
        let room_mm = limits.miss_mm / sine;
        if speed == 0 && speed_mm_s * smoothing.mean_s <= room_mm {
            return Some(speed_mm_s);
        }
        // Slower than the mark speed there is acceleration on both sides.
        let bend_mm = 0.5 * acceleration_mm_s2 * smoothing.variance_s2;
        let passing = (room_mm - bend_mm) / smoothing.mean_s;
        if speed_mm_s <= passing {
            return Some(speed_mm_s);
        }
        let close = passing > 0.5 * speed_mm_s;
        let alone = close && alone(turns, index, speed_mm_s * smoothing.half_s);
        alone.then_some(passing)
    }
}

/// Whether no other turn lies within a reach.
fn alone(turns: &[Turn], index: usize, reach_mm: f64) -> bool {
    let at_mm = turns[index].at_mm;
    (index == 0 || at_mm - turns[index - 1].at_mm > reach_mm)
        && turns.get(index + 1).is_none_or(|next| next.at_mm - at_mm > reach_mm)
}

/// Turns around one: each by its share in what is missed there, and all within the reach, rad.
fn weighed(turns: &[Turn], index: usize, reach_mm: f64) -> (f64, f64) {
    let at_mm = turns[index].at_mm;
    let (mut missed, mut turned) = (turns[index].angle_rad, turns[index].angle_rad);
    let per_mm = reach_mm.recip();
    let mut add = |turn: &Turn| {
        let near = 1.0 - (turn.at_mm - at_mm).abs() * per_mm;
        if near <= 0.0 {
            return false;
        }
        // What three averages make of a turn beside the middle, within a few hundredths.
        missed += turn.angle_rad * (near * near * near);
        turned += turn.angle_rad * near;
        true
    };
    for turn in turns[..index].iter().rev() {
        if !add(turn) {
            break;
        }
    }
    for turn in &turns[index + 1..] {
        if !add(turn) {
            break;
        }
    }
    (missed, turned)
}

/// Knots under limits at places, with one acceleration up and down.
fn knots(
    length_mm: f64,
    mut slow: Vec<Limit>,
    most_mm_s: f64,
    acceleration_mm_s2: f64,
) -> Vec<Knot> {
    let steady = Knot { time_s: 0.0, distance_mm: 0.0, speed_mm_s: most_mm_s };
    if slow.is_empty() {
        return vec![steady];
    }
    spread(&mut slow, acceleration_mm_s2);
    let mut knots: Vec<Knot> = Vec::with_capacity(4 * slow.len());
    let ramp_mm = |from: f64, to: f64| (to * to - from * from).abs() / (2.0 * acceleration_mm_s2);
    let first = slow[0];
    // Before the first limit and after the last there is nothing to slow down for.
    let before_mm = ramp_mm(first.speed_mm_s, most_mm_s);
    let start_mm_s = match first.at_mm > before_mm {
        true => most_mm_s,
        false => (first.speed_mm_s.powi(2) + 2.0 * acceleration_mm_s2 * first.at_mm).sqrt(),
    };
    knots.push(Knot { speed_mm_s: start_mm_s, ..steady });
    let mut from = Limit { at_mm: 0.0, speed_mm_s: start_mm_s, wait_s: 0.0 };
    let end = Limit { at_mm: length_mm, speed_mm_s: f64::INFINITY, wait_s: 0.0 };
    for to in slow.into_iter().chain([end]) {
        leg(&mut knots, from, to, most_mm_s, acceleration_mm_s2);
        from = to;
    }
    knots
}

/// Lowers limits so that each is reached from its neighbours.
fn spread(slow: &mut [Limit], acceleration_mm_s2: f64) {
    let n_limits = slow.len();
    let mut lower = |from: usize, to: usize| {
        let room_mm = (slow[to].at_mm - slow[from].at_mm).abs();
        let reach = (slow[from].speed_mm_s.powi(2) + 2.0 * acceleration_mm_s2 * room_mm).sqrt();
        slow[to].speed_mm_s = slow[to].speed_mm_s.min(reach);
    };
    for index in 1..n_limits {
        lower(index - 1, index);
    }
    for index in (1..n_limits).rev() {
        lower(index, index - 1);
    }
}

/// Up, along, and down between two limits; then waits.
fn leg(knots: &mut Vec<Knot>, from: Limit, to: Limit, most_mm_s: f64, acceleration_mm_s2: f64) {
    let room_mm = to.at_mm - from.at_mm;
    let (u, v) = (from.speed_mm_s, to.speed_mm_s.min(most_mm_s));
    let last = to.speed_mm_s == f64::INFINITY;
    let a = acceleration_mm_s2;
    let peak = if last {
        (u * u + 2.0 * a * room_mm).sqrt().min(most_mm_s)
    } else {
        (0.5 * (u * u + v * v) + a * room_mm).sqrt().min(most_mm_s)
    };
    let end = if last { peak } else { v };
    let (up_mm, down_mm) =
        ((peak * peak - u * u) / (2.0 * a), (peak * peak - end * end) / (2.0 * a));
    let mut push = |distance_mm: f64, speed_mm_s: f64, duration_s: f64| {
        let before = knots[knots.len() - 1];
        if duration_s > 1e-12 {
            // From the rounded length, so that times and distances fit exactly.
            let mean = 0.5 * (before.speed_mm_s + speed_mm_s);
            let distance_mm = if mean > 0.0 { distance_mm } else { before.distance_mm };
            let duration_s =
                if mean > 0.0 { (distance_mm - before.distance_mm) / mean } else { duration_s };
            let time_s = before.time_s + duration_s;
            knots.push(Knot { time_s, distance_mm, speed_mm_s });
        }
    };
    push(from.at_mm + up_mm, peak, (peak - u) / a);
    push(to.at_mm - down_mm, peak, (room_mm - up_mm - down_mm) / peak);
    push(to.at_mm, end, (peak - end) / a);
    push(to.at_mm, end, to.wait_s);
}

/// Time at which a profile has covered a distance, s.
pub(super) fn time_at_s(knots: &[Knot], distance_mm: f64) -> f64 {
    let index = knots.partition_point(|knot| knot.distance_mm < distance_mm).max(1) - 1;
    let from = knots[index];
    let gap_mm = distance_mm - from.distance_mm;
    let acceleration = knots
        .get(index + 1)
        .map_or(0.0, |to| (to.speed_mm_s - from.speed_mm_s) / (to.time_s - from.time_s));
    let speed = (from.speed_mm_s.powi(2) + 2.0 * acceleration * gap_mm).max(0.0).sqrt();
    // Both roots alike: neither a small acceleration nor a small speed is divided by.
    from.time_s + 2.0 * gap_mm / (from.speed_mm_s + speed)
}

/// Arc length that a profile has covered at every tick up to the last, averaged as places are, mm.
pub(super) fn averaged_mm(
    knots: &[Knot],
    smoothing: &Smoothing,
    n_ticks: u32,
    period_s: f64,
) -> Vec<f64> {
    let shares = shares(smoothing.n_ticks);
    let half = 0.5 * (shares.len() - 1) as f64;
    let mut cursor = 0;
    let base: Vec<f64> = (0..n_ticks as usize + shares.len())
        .map(|index| distance_mm(knots, &mut cursor, (index as f64 - half) * period_s))
        .collect();
    let mean = |first: usize| -> f64 {
        base[first..].iter().zip(&shares).map(|(at_mm, share)| at_mm * share).sum()
    };
    (0..=n_ticks as usize).map(mean).collect()
}

/// Distance that a profile has covered at a time; times may not fall.
fn distance_mm(knots: &[Knot], cursor: &mut usize, time_s: f64) -> f64 {
    while knots.get(*cursor + 1).is_some_and(|next| next.time_s <= time_s) {
        *cursor += 1;
    }
    let from = knots[*cursor];
    let since_s = time_s - from.time_s;
    let gain = match knots.get(*cursor + 1) {
        Some(to) if since_s > 0.0 => {
            (to.speed_mm_s - from.speed_mm_s) / (to.time_s - from.time_s) * since_s
        }
        _ => 0.0,
    };
    from.distance_mm + (from.speed_mm_s + 0.5 * gain) * since_s
}
