//! Tracks in the audit: places along the path by their definition, averaged, as mirror angles.

use crate::follow::{N_TAPS, TAPS_BEFORE};
use crate::optics::angles_from_field;
use ftheta_model::machine::Optics;
use ftheta_model::plan::{Knot, Motion, PlanDraft, Station};
use ftheta_model::space::FieldPoint;
use kurbo::{Point, Vec2};
use std::collections::VecDeque;

/// A path with its speed profile.
pub struct Path<'a> {
    vertices: &'a [Point],
    stations: Option<&'a [Station]>,
    knots: &'a [Knot],
    /// Leg that was found last, and its arc length up to its first vertex.
    leg: usize,
    leg_start_mm: f64,
    /// Knot that was passed last.
    knot: usize,
}

impl<'a> Path<'a> {
    /// The path of a track; `None` for other motion. Indices have been checked.
    pub fn new(draft: &'a PlanDraft, motion: &Motion) -> Option<Self> {
        let &Motion::Track { first_station, first_knot, n_knots, .. } = motion else {
            return None;
        };
        let (first, last) = motion.ends()?;
        let vertices = &draft.vertices[first..=last];
        let stations = first_station
            .map(|first| &draft.stations[first as usize..first as usize + vertices.len()]);
        let knots = &draft.knots[first_knot as usize..(first_knot + n_knots) as usize];
        Some(Self { vertices, stations, knots, leg: 0, leg_start_mm: 0.0, knot: 0 })
    }

    /// Arc length and speed at a time; times may not fall.
    pub fn progress(&mut self, time_s: f64) -> (f64, f64) {
        while self.knots.get(self.knot + 1).is_some_and(|next| next.time_s <= time_s) {
            self.knot += 1;
        }
        let from = &self.knots[self.knot];
        let since_s = time_s - from.time_s;
        let acceleration_mm_s2 = match self.knots.get(self.knot + 1) {
            Some(to) if since_s >= 0.0 => {
                (to.speed_mm_s - from.speed_mm_s) / (to.time_s - from.time_s)
            }
            _ => 0.0,
        };
        let gained_mm_s = acceleration_mm_s2 * since_s;
        let distance_mm = from.distance_mm + (from.speed_mm_s + 0.5 * gained_mm_s) * since_s;
        (distance_mm, from.speed_mm_s + gained_mm_s)
    }

    /// The place at an arc length; lengths may not fall.
    pub fn place(&mut self, distance_mm: f64) -> Point {
        let last_leg = self.vertices.len() - 2;
        let mut length_mm = self.leg_length_mm();
        while distance_mm > self.leg_start_mm + length_mm && self.leg < last_leg {
            self.leg_start_mm += length_mm;
            self.leg += 1;
            length_mm = self.leg_length_mm();
        }
        let along_mm = distance_mm - self.leg_start_mm;
        let (from, to) = (self.vertices[self.leg], self.vertices[self.leg + 1]);
        let Some(stations) = self.stations else {
            return from + (to - from) * (along_mm / length_mm);
        };
        let (start, end) = (stations[self.leg].leaving, stations[self.leg + 1].arriving);
        if along_mm < 0.0 {
            from + start * along_mm
        } else if along_mm > length_mm {
            to + end * (along_mm - length_mm)
        } else {
            cubic(from, start * length_mm, to, end * length_mm, along_mm / length_mm)
        }
    }

    /// Arc length of the leg that was found last.
    fn leg_length_mm(&self) -> f64 {
        match self.stations {
            Some(stations) => stations[self.leg + 1].distance_mm - stations[self.leg].distance_mm,
            None => self.vertices[self.leg].distance(self.vertices[self.leg + 1]),
        }
    }
}

/// The cubic from point to point with these derivatives at its ends, by de Casteljau.
fn cubic(from: Point, start: Vec2, to: Point, end: Vec2, share: f64) -> Point {
    let (a, b) = (from + start / 3.0, to - end / 3.0);
    let (p, q, r) = (from.lerp(a, share), a.lerp(b, share), b.lerp(to, share));
    p.lerp(q, share).lerp(q.lerp(r, share), share)
}

/// Mirror angles along a track, tick by tick.
pub struct TrackWalk<'a> {
    path: Path<'a>,
    optics: &'a Optics,
    tick_s: f64,
    /// Shares of places in their average.
    shares: Vec<f64>,
    places: VecDeque<Point>,
    /// Wanted angles around the tick, oldest first.
    angles_rad: VecDeque<[f64; 2]>,
    /// Tick of the place that comes next.
    next: f64,
}

impl<'a> TrackWalk<'a> {
    /// A track's angles around tick -1.
    /// `None` for other motion.
    ///
    /// # Errors
    /// A place that the optics do not reach.
    pub fn new(draft: &'a PlanDraft, motion: &Motion) -> Option<Result<Self, FieldPoint>> {
        let &Motion::Track { smoothing_ticks, .. } = motion else {
            return None;
        };
        let path = Path::new(draft, motion)?;
        let once = vec![1.0 / f64::from(smoothing_ticks); smoothing_ticks as usize];
        let shares = convolved(&convolved(&once, &once), &once);
        let half = 0.5 * (shares.len() - 1) as f64;
        let mut walk = Self {
            path,
            optics: &draft.machine.optics,
            tick_s: draft.machine.output.period_s(),
            shares,
            places: VecDeque::new(),
            angles_rad: VecDeque::new(),
            next: -1.0 - TAPS_BEFORE as f64 - half,
        };
        for _ in 1..walk.shares.len() {
            walk.push_place();
        }
        for _ in 0..N_TAPS {
            if let Err(place) = walk.advance() {
                return Some(Err(place));
            }
        }
        Some(Ok(walk))
    }

    /// Moves on by a tick.
    ///
    /// # Errors
    /// A place that the optics do not reach.
    pub fn advance(&mut self) -> Result<(), FieldPoint> {
        self.push_place();
        let mean = self
            .places
            .iter()
            .zip(&self.shares)
            .fold(Vec2::ZERO, |sum, (place, share)| sum + place.to_vec2() * *share);
        self.places.pop_front();
        let place = mean.to_point().into();
        let angles = angles_from_field(self.optics, place).ok_or(place)?;
        self.angles_rad.push_back([angles.x_rad, angles.y_rad]);
        if self.angles_rad.len() > N_TAPS {
            self.angles_rad.pop_front();
        }
        Ok(())
    }

    /// Wanted angles of an axis around the tick, at first tick -1.
    pub fn around(&self, axis: usize) -> [f64; N_TAPS] {
        std::array::from_fn(|tap| self.angles_rad[tap][axis])
    }

    /// Wanted angles at the tick.
    pub fn now(&self) -> [f64; 2] {
        self.angles_rad[TAPS_BEFORE]
    }

    /// Wanted angles two ticks after.
    pub fn after(&self) -> [f64; 2] {
        self.angles_rad[TAPS_BEFORE + 2]
    }

    fn push_place(&mut self) {
        let (distance_mm, _) = self.path.progress(self.next * self.tick_s);
        self.places.push_back(self.path.place(distance_mm));
        self.next += 1.0;
    }
}

fn convolved(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            sum[i + j] += x * y;
        }
    }
    sum
}
