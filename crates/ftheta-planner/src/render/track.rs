//! Renders tracks: places along a path, averaged, as the commands that take the mirrors there.

use super::words::Words;
use ftheta_model::plan::{Knot, Motion, PlanDraft, Station};
use ftheta_physics::follow::{Inverse, N_TAPS, TAPS_BEFORE, Taps, dot};
use kurbo::{Point, Vec2};

/// Ticks from the profile's tick to that of the sample: sample j commands the voltage from tick
/// j - 1 on, which is the one after the tick at which it is sent.
const SAMPLE_AHEAD: i64 = 2;

/// A track as far as it has been rendered.
#[derive(Clone)]
pub(super) struct Track {
    smoothing_ticks: usize,
    /// Where the places that the next samples need begin.
    cursor: TrackCursor,
    /// Tick of the profile of the first of these places; averaging needs half ticks.
    next_tick: f64,
    /// Kept between calls, so that nothing is allocated.
    buffers: Buffers,
}

#[derive(Clone, Default)]
struct Buffers {
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A walk along a track's path and its speed profile.
#[derive(Clone)]
struct TrackCursor {
    first_vertex: usize,
    last_vertex: usize,
    first_station: Option<usize>,
    last_knot: usize,
    knot: usize,
    acceleration_mm_s2: f64,
    leg: Leg,
}

/// A leg of the path as a cubic of the distance from its start.
#[derive(Clone, Copy)]
struct Leg {
    vertex: usize,
    start_mm: f64,
    end_mm: f64,
    from: Point,
    tangent: Vec2,
    bend: Vec2,
    twist: Vec2,
}

impl Track {
    /// Before the first sample; `None` for other motion.
    pub(super) fn new(plan: &PlanDraft, motion: &Motion) -> Option<Self> {
        let &Motion::Track { smoothing_ticks, .. } = motion else {
            return None;
        };
        let smoothing_ticks = smoothing_ticks as usize;
        let half = 1.5 * (smoothing_ticks - 1) as f64;
        let next_tick = (1 - SAMPLE_AHEAD) as f64 - TAPS_BEFORE as f64 - half;
        let cursor = TrackCursor::new(plan, motion)?;
        Some(Self { smoothing_ticks, cursor, next_tick, buffers: Buffers::default() })
    }

    /// Wanted mirror angles of so many samples that come next, with those that the weights need
    /// around them: sample i has angles i .. i + N_TAPS. Two samples more than asked for are there.
    pub(super) fn angles(
        &mut self,
        plan: &PlanDraft,
        words: &Words<'_>,
        n_samples: usize,
    ) -> [&[f64]; 2] {
        let n_angles = n_samples + 1 + N_TAPS;
        let n_places = n_angles + 3 * (self.smoothing_ticks - 1);
        let tick_s = plan.machine.output.period_s();
        let Buffers { x, y } = &mut self.buffers;
        x.clear();
        y.clear();
        let mut cursor = self.cursor.clone();
        for index in 0..n_places {
            if index == n_samples {
                // What the next call begins with.
                self.cursor = cursor.clone();
            }
            let place = cursor.place(plan, (self.next_tick + index as f64) * tick_s);
            x.push(place.x);
            y.push(place.y);
        }
        self.next_tick += n_samples as f64;
        for _ in 0..3 {
            average([&mut *x, &mut *y], self.smoothing_ticks);
        }
        for (x, y) in x.iter_mut().zip(y.iter_mut()) {
            [*x, *y] = words.angles(Point::new(*x, *y));
        }
        [x, y]
    }
}

/// Places of a track, averaged, at every tick from the first to the last of `n_ticks`.
pub(crate) fn places(plan: &PlanDraft, motion: &Motion, n_ticks: u32) -> Vec<Point> {
    averaged(plan, motion, 0.0, n_ticks as usize + 1)
}

/// The same, with those that weights need before the first and after the last one.
pub(crate) fn places_around(plan: &PlanDraft, motion: &Motion, n_ticks: u32) -> Vec<Point> {
    averaged(plan, motion, -(TAPS_BEFORE as f64), n_ticks as usize + N_TAPS)
}

/// Wanted mirror angles of each axis around a tick of a track's profile; `Err` with a place that
/// `angles` does not reach.
pub(crate) fn angles_around(
    plan: &PlanDraft,
    motion: &Motion,
    tick: u32,
    angles: impl Fn(Point) -> Option<[f64; 2]>,
) -> Result<[Taps; 2], Point> {
    let first_tick = f64::from(tick) - TAPS_BEFORE as f64;
    let mut around = [[0.0; N_TAPS]; 2];
    for (tap, place) in averaged(plan, motion, first_tick, N_TAPS).into_iter().enumerate() {
        [around[0][tap], around[1][tap]] = angles(place).ok_or(place)?;
    }
    Ok(around)
}

/// Averaged places of a track from a tick on; none of other motion.
fn averaged(plan: &PlanDraft, motion: &Motion, first_tick: f64, n_places: usize) -> Vec<Point> {
    let (&Motion::Track { smoothing_ticks, .. }, Some(mut cursor)) =
        (motion, TrackCursor::new(plan, motion))
    else {
        return Vec::new();
    };
    let n = smoothing_ticks as usize;
    let first_tick = first_tick - 1.5 * (n - 1) as f64;
    let tick_s = plan.machine.output.period_s();
    let base = (0..n_places + 3 * (n - 1))
        .map(|index| cursor.place(plan, (first_tick + index as f64) * tick_s));
    let (mut x, mut y): (Vec<f64>, Vec<f64>) = base.map(|place| (place.x, place.y)).unzip();
    for _ in 0..3 {
        average([&mut x, &mut y], n);
    }
    x.into_iter().zip(y).map(|(x, y)| Point::new(x, y)).collect()
}

/// Replaces values by the mean of `n` neighbours each; there are n - 1 fewer of them.
///
/// Both coordinates go side by side, and what enters less what leaves is one sum: the time of this
/// is that of additions which wait for each other.
fn average([x, y]: [&mut Vec<f64>; 2], n: usize) {
    let n_values = x.len().min(y.len());
    if n == 1 {
        return;
    }
    let share = 1.0 / n as f64;
    let mut sum: [f64; 2] = [x[..n].iter().sum(), y[..n].iter().sum()];
    let last = n_values - n;
    for index in 0..last {
        let change = [x[index + n] - x[index], y[index + n] - y[index]];
        [x[index], y[index]] = sum.map(|sum| sum * share);
        sum = [sum[0] + change[0], sum[1] + change[1]];
    }
    [x[last], y[last]] = sum.map(|sum| sum * share);
    x.truncate(last + 1);
    y.truncate(last + 1);
}

/// The commands of samples from the angles around them.
pub(super) fn references<'a>(
    taps: &'a Taps,
    [x_rad, y_rad]: [&'a [f64]; 2],
) -> impl Iterator<Item = [f64; 2]> + 'a {
    x_rad.windows(N_TAPS).zip(y_rad.windows(N_TAPS)).map(move |(x, y)| [dot(taps, x), dot(taps, y)])
}

/// State and voltage of both axes at the tick of a sample from the angles around it.
pub(super) fn state(
    inverse: &Inverse,
    angles_rad: [&[f64]; 2],
    sample: usize,
) -> [(ftheta_physics::galvo::State, f64); 2] {
    angles_rad.map(|angles| {
        let around: Taps = std::array::from_fn(|tap| angles[sample + tap]);
        inverse.state(&around)
    })
}

impl TrackCursor {
    fn new(plan: &PlanDraft, motion: &Motion) -> Option<Self> {
        let &Motion::Track { first_station, first_knot, n_knots, .. } = motion else {
            return None;
        };
        let (first_vertex, last_vertex) = motion.ends()?;
        let first_station = first_station.map(|first| first as usize);
        let leg = Leg::new(plan, first_station.map(|first| (first, 0)), first_vertex, 0.0);
        let knot = first_knot as usize;
        let last_knot = knot + n_knots as usize - 1;
        Some(Self {
            first_vertex,
            last_vertex,
            first_station,
            last_knot,
            knot,
            acceleration_mm_s2: acceleration_mm_s2(plan, knot, last_knot),
            leg,
        })
    }

    /// The place at a time; times never fall.
    #[inline]
    fn place(&mut self, plan: &PlanDraft, time_s: f64) -> Point {
        self.pass_knots(plan, time_s);
        let Knot { time_s: from_s, distance_mm, speed_mm_s } = plan.knots[self.knot];
        let since_s = time_s - from_s;
        // At constant speed before the first knot.
        let acceleration_mm_s2 = if since_s < 0.0 { 0.0 } else { self.acceleration_mm_s2 };
        let at_mm = distance_mm + (speed_mm_s + 0.5 * acceleration_mm_s2 * since_s) * since_s;
        if at_mm > self.leg.end_mm {
            self.pass_legs(plan, at_mm);
        }
        self.leg.place(at_mm)
    }

    /// Enters the leg of an arc length; of legs that are passed within a tick only lengths count.
    fn pass_legs(&mut self, plan: &PlanDraft, at_mm: f64) {
        let Leg { mut vertex, mut start_mm, mut end_mm, .. } = self.leg;
        while at_mm > end_mm && vertex + 2 <= self.last_vertex {
            vertex += 1;
            start_mm = end_mm;
            end_mm = match self.first_station {
                Some(first) => plan.stations[first + vertex + 1 - self.first_vertex].distance_mm,
                None => start_mm + plan.vertices[vertex + 1].distance(plan.vertices[vertex]),
            };
        }
        if vertex > self.leg.vertex {
            let station = self.first_station.map(|first| (first, vertex - self.first_vertex));
            self.leg = Leg::new(plan, station, vertex, start_mm);
        }
    }

    #[inline]
    fn pass_knots(&mut self, plan: &PlanDraft, time_s: f64) {
        let before = self.knot;
        while self.knot < self.last_knot && plan.knots[self.knot + 1].time_s <= time_s {
            self.knot += 1;
        }
        if self.knot > before {
            self.acceleration_mm_s2 = acceleration_mm_s2(plan, self.knot, self.last_knot);
        }
    }
}

/// Acceleration from a knot on, mm/s²; none after the last one.
fn acceleration_mm_s2(plan: &PlanDraft, knot: usize, last_knot: usize) -> f64 {
    if knot == last_knot {
        return 0.0;
    }
    let (from, to) = (plan.knots[knot], plan.knots[knot + 1]);
    (to.speed_mm_s - from.speed_mm_s) / (to.time_s - from.time_s)
}

impl Leg {
    /// The leg from a vertex on; `station` is the track's first one and the leg's index.
    fn new(
        plan: &PlanDraft,
        station: Option<(usize, usize)>,
        vertex: usize,
        start_mm: f64,
    ) -> Self {
        let (from, to) = (plan.vertices[vertex], plan.vertices[vertex + 1]);
        let chord = to - from;
        let straight = |length_mm: f64| Self {
            vertex,
            start_mm,
            end_mm: start_mm + length_mm,
            from,
            tangent: chord / length_mm,
            bend: Vec2::ZERO,
            twist: Vec2::ZERO,
        };
        let Some((first, index)) = station else {
            return straight(chord.hypot());
        };
        let Station { leaving: tangent, distance_mm: start_mm, .. } = plan.stations[first + index];
        let Station { arriving: end, distance_mm: end_mm, .. } = plan.stations[first + index + 1];
        let length_mm = end_mm - start_mm;
        // One division, since short legs are entered at every tick.
        let per_mm = 1.0 / length_mm;
        let mean = chord * per_mm;
        // Hermite's cubic in powers of the distance from the start.
        let bend = (mean * 3.0 - tangent * 2.0 - end) * per_mm;
        let twist = (tangent + end - mean * 2.0) * (per_mm * per_mm);
        Self { vertex, start_mm, end_mm, from, tangent, bend, twist }
    }

    /// The place at an arc length of the path, straight on outside the leg.
    #[inline]
    fn place(&self, at_mm: f64) -> Point {
        let along_mm = at_mm - self.start_mm;
        if along_mm <= 0.0 {
            return self.from + self.tangent * along_mm;
        }
        let inside_mm = along_mm.min(self.end_mm - self.start_mm);
        let curved = self.tangent + (self.bend + self.twist * inside_mm) * inside_mm;
        let place = self.from + curved * inside_mm;
        if inside_mm == along_mm {
            return place;
        }
        let direction =
            self.tangent + (self.bend * 2.0 + self.twist * (3.0 * inside_mm)) * inside_mm;
        place + direction * (along_mm - inside_mm)
    }
}
