//! Stops and starts in little room: where the angle limit is near, a moving end is first brought to
//! rest, or comes from rest.

use super::fan::{Sum, Term};
use super::program::{Ends, Goal, Request, Way};
use super::{Axis, JumpError};
use ftheta_physics::galvo::State;

/// Rooms that are solved, each larger than the last by this factor.
const RATIO: f64 = 1.2;
/// The smallest of them, rad.
const ROOM_MIN_RAD: f64 = 2e-5;
/// The largest, rad.
const ROOM_MAX_RAD: f64 = 0.8;

/// By this part a speed may exceed what the rooms say: with more ticks, the mode can be swung up.
/// On S25 that is worth up to 0.46 %, on S10 0.1 %, and two of its periods give all of it.
const LONGER_GAIN: f64 = 0.01;

/// Which end moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// From speed to rest.
    Stop,
    /// From rest to speed.
    Start,
}

/// The greatest speed that can be stopped, or reached, in a room, for a row of rooms.
#[derive(Clone, Debug)]
pub(super) struct Brakes {
    end: End,
    rooms: Vec<Room>,
}

/// A solved room.
#[derive(Clone, Debug)]
struct Room {
    room_rad: f64,
    speed_rad_s: f64,
    /// From the angle at the start to that at the end, rad.
    distance_rad: f64,
    voltages_v: Vec<f64>,
}

/// A stop or start: its voltages, and how far it goes, rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brake<'a> {
    pub(super) sum: Sum<'a>,
    pub(super) distance_rad: f64,
}

/// Whether a speed fits into a room.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fit<'a> {
    /// It does.
    Yes(Brake<'a>),
    /// Only a program for just this room could tell.
    Unknown,
    /// It does not.
    No,
}

impl Brakes {
    /// Solves the rooms up to a speed.
    ///
    /// * `ticks`: number of ticks that is ample to go twice as far and stop
    ///
    /// # Errors
    /// If a program fails.
    pub(super) fn build(
        axis: &Axis,
        end: End,
        speed_max_rad_s: f64,
        ticks: impl Fn(f64) -> usize,
    ) -> Result<Self, JumpError> {
        let mut rooms: Vec<Room> = Vec::new();
        let mut room_rad = ROOM_MIN_RAD;
        while room_rad < ROOM_MAX_RAD
            && rooms.last().is_none_or(|room| room.speed_rad_s < speed_max_rad_s)
        {
            rooms.extend(solve(axis, end, room_rad, ticks(room_rad))?);
            room_rad *= RATIO;
        }
        Ok(Self { end, rooms })
    }

    /// Whether and how a speed (positive, towards the room's wall) fits into a room.
    ///
    /// The greatest speed is concave in the room: a chord between two solved rooms is reached, the
    /// chords beside it, prolonged, are not passed.
    pub(super) fn fit(&self, room_rad: f64, speed_rad_s: f64) -> Fit<'_> {
        let next = self.rooms.partition_point(|room| room.room_rad <= room_rad);
        if next == 0 {
            return if speed_rad_s == 0.0 { self.rest() } else { Fit::Unknown };
        }
        let low = &self.rooms[next - 1];
        let high = self.rooms.get(next).unwrap_or(low);
        let width_rad = high.room_rad - low.room_rad;
        let share = if width_rad > 0.0 { (room_rad - low.room_rad) / width_rad } else { 0.0 };
        let reached = low.speed_rad_s + share * (high.speed_rad_s - low.speed_rad_s);
        if speed_rad_s <= reached {
            let factor = if reached > 0.0 { speed_rad_s / reached } else { 0.0 };
            let shares = [factor * (1.0 - share), factor * share];
            return Fit::Yes(brake(self.end, [low, high], shares));
        }
        let slope = |a: &Room, b: &Room| {
            (b.speed_rad_s - a.speed_rad_s) / (b.room_rad - a.room_rad).max(f64::MIN_POSITIVE)
        };
        let from_below = match self.rooms.get(next.wrapping_sub(2)) {
            Some(before) => low.speed_rad_s + slope(before, low) * (room_rad - low.room_rad),
            None => f64::INFINITY,
        };
        let from_above = match self.rooms.get(next + 1) {
            Some(after) => high.speed_rad_s - slope(high, after) * (high.room_rad - room_rad),
            None => f64::INFINITY,
        };
        let passed = (1.0 + LONGER_GAIN) * from_below.min(from_above);
        if speed_rad_s > passed { Fit::No } else { Fit::Unknown }
    }

    /// The same by a program for just this room: voltages and distance for the speed.
    ///
    /// # Errors
    /// If the program fails.
    pub(super) fn exact(
        &self,
        axis: &Axis,
        room_rad: f64,
        speed_rad_s: f64,
        n_ticks: usize,
    ) -> Result<Option<(Vec<f64>, f64)>, JumpError> {
        if room_rad <= 0.0 {
            return Ok(None);
        }
        let solved = solve(axis, self.end, room_rad, n_ticks)?;
        Ok(solved.filter(|room| speed_rad_s <= room.speed_rad_s).map(|mut room| {
            let factor = speed_rad_s / room.speed_rad_s;
            room.voltages_v.iter_mut().for_each(|voltage| *voltage *= factor);
            (room.voltages_v, room.distance_rad * factor)
        }))
    }

    fn rest(&self) -> Fit<'_> {
        let sum = Sum { n_ticks: 0, terms: Default::default(), coast_v: 0.0 };
        Fit::Yes(Brake { sum, distance_rad: 0.0 })
    }
}

/// Two rooms in shares; both stop from the same tick on, or start towards the same.
fn brake<'a>(end: End, rooms: [&'a Room; 2], shares: [f64; 2]) -> Brake<'a> {
    let n_ticks = rooms[0].voltages_v.len().max(rooms[1].voltages_v.len());
    let term = |index: usize| {
        let sequence_v = &rooms[index].voltages_v[..];
        let delay = match end {
            End::Stop => 0,
            End::Start => n_ticks - sequence_v.len(),
        };
        Term { sequence_v, share: shares[index], delay }
    };
    let distance_rad = shares[0] * rooms[0].distance_rad + shares[1] * rooms[1].distance_rad;
    Brake { sum: Sum { n_ticks, terms: [term(0), term(1)], coast_v: 0.0 }, distance_rad }
}

fn solve(axis: &Axis, end: End, room_rad: f64, n_ticks: usize) -> Result<Option<Room>, JumpError> {
    let moving = State::new(0.0, 1.0, 0.0, 0.0, 0.0);
    let (ends, way) = match end {
        End::Stop => {
            (Ends { start: moving, end: State::zeros(), place: false }, Way::Below(room_rad))
        }
        End::Start => {
            (Ends { start: State::zeros(), end: moving, place: false }, Way::Behind(room_rad))
        }
    };
    let found = axis.best(&Request { n_ticks, ends, goal: Goal::Farthest, way })?;
    Ok(found
        .map(|(speed_rad_s, voltages_v)| within(axis, &ends, room_rad, speed_rad_s, voltages_v)))
}

/// The room with voltages that keep it: those of the program, which may pass its rows by its
/// tolerance, scaled down by as much.
fn within(
    axis: &Axis,
    ends: &Ends,
    room_rad: f64,
    mut speed_rad_s: f64,
    mut voltages_v: Vec<f64>,
) -> Room {
    let mut state = ends.start * speed_rad_s;
    let (mut least_rad, mut most_rad) = (0.0_f64, 0.0_f64);
    for &voltage in &voltages_v {
        for angle in axis.mirror_rad(state, voltage) {
            (least_rad, most_rad) = (least_rad.min(angle), most_rad.max(angle));
        }
        state = axis.advance(&state, voltage);
    }
    let end_rad = axis.galvo.mirror_row().dot(&state);
    let used_rad = if ends.start == State::zeros() { end_rad - least_rad } else { most_rad };
    if used_rad > room_rad {
        let factor = room_rad / used_rad;
        speed_rad_s *= factor;
        voltages_v.iter_mut().for_each(|voltage| *voltage *= factor);
    }
    // Where the axis creeps to, less what the speed at the end will still add.
    let change = (ends.end - ends.start) * speed_rad_s;
    let distance_rad = axis.creep_rad(&voltages_v) - axis.creep_row().dot(&change);
    Room { room_rad, speed_rad_s, distance_rad, voltages_v }
}
