//! A mark's curve as a path for tracks: vertices, directions and arc lengths.

use ftheta_model::plan::Station;
use ftheta_model::toolpath::Mark;
use kurbo::{
    BezPath, Line, ParamCurve, ParamCurveArclen, ParamCurveDeriv, PathEl, PathSeg, Point, Vec2,
};

/// Vertices closer than this are one, mm: half the trace's resolution.
const SAME_PLACE_MM: f64 = 5e-7;
/// Most that a curve turns between two vertices, rad: the cubic between is then within 1e-8 of the
/// radius.
const TURN_MAX_RAD: f64 = 0.1;
/// Tangents of turns whose angle is five terms of its series, to rounding.
const SLIGHT_TURN: f64 = 0.03;
/// A curve is halved at most so often.
const N_HALVINGS_MAX: u32 = 14;
/// Error of a leg's arc length, relative to it.
const LENGTH_ERROR: f64 = 1e-11;

/// Vertices of a path without a double, with what is known there.
#[derive(Clone, Debug, Default)]
pub(super) struct Path {
    pub(super) vertices: Vec<Point>,
    /// Arc length up to each vertex, mm.
    pub(super) distances_mm: Vec<f64>,
    /// Directions in which each vertex is reached and left, length 1; none where every leg is a
    /// straight line, since a dense path spends its time on memory.
    directions: Option<Vec<[Vec2; 2]>>,
    /// Where on the curve each vertex is: index of the segment plus the parameter in it; none where
    /// that is the vertex's own index. Places would not tell, since a curve may come back to them.
    curve_at: Option<Vec<f64>>,
}

impl Path {
    /// No path yet, with room for so many vertices: else a dense one spends its time growing.
    fn with_room(n_vertices: usize, curved: bool) -> Self {
        Self {
            vertices: Vec::with_capacity(n_vertices),
            distances_mm: Vec::with_capacity(n_vertices),
            directions: curved.then(|| Vec::with_capacity(n_vertices)),
            curve_at: curved.then(|| Vec::with_capacity(n_vertices)),
        }
    }

    /// The path of a mark; `None` if it has no length.
    pub(super) fn new(mark: &Mark) -> Option<Self> {
        let elements = mark.curve.elements();
        let bends = |element: &PathEl| matches!(element, PathEl::QuadTo(..) | PathEl::CurveTo(..));
        let segments = mark.curve.segments();
        if !elements.iter().any(bends) {
            let ends = segments.map(|segment| [segment.start(), segment.end()]);
            return Self::of_lines(ends, elements.len());
        }
        let mut path = Self::with_room(elements.len(), true);
        for (index, segment) in segments.enumerate() {
            match segment {
                PathSeg::Line(line) => path.push_line(line, index),
                PathSeg::Quad(_) | PathSeg::Cubic(_) => {
                    path.push_curve(&segment, index as f64, N_HALVINGS_MAX);
                }
            }
        }
        (path.vertices.len() >= 2).then_some(path)
    }

    /// A straight path through points.
    pub(super) fn straight(points: &[Point]) -> Option<Self> {
        Self::of_lines(points.windows(2).map(|pair| [pair[0], pair[1]]), points.len())
    }

    /// A path of straight lines, each of which begins where the one before ends.
    fn of_lines(ends: impl Iterator<Item = [Point; 2]>, n_vertices: usize) -> Option<Self> {
        let mut ends = ends.peekable();
        let mut at = ends.peek()?[0];
        let mut distance_mm = 0.0;
        let mut path = Self::with_room(n_vertices, false);
        path.vertices.push(at);
        path.distances_mm.push(distance_mm);
        for (index, [_, end]) in ends.enumerate() {
            let length_mm = (end - at).hypot();
            if length_mm > SAME_PLACE_MM {
                at = end;
                distance_mm += length_mm;
                path.vertices.push(end);
                path.distances_mm.push(distance_mm);
                if let Some(all) = &mut path.curve_at {
                    all.push((index + 1) as f64);
                }
            } else {
                let n_so_far = path.vertices.len();
                path.curve_at.get_or_insert_with(|| (0..n_so_far).map(|i| i as f64).collect());
            }
        }
        (path.vertices.len() >= 2).then_some(path)
    }

    /// Whether a leg may be anything but a straight line.
    pub(super) fn is_curved(&self) -> bool {
        self.directions.is_some()
    }

    /// Directions in which a vertex is reached and left; at the path's ends both are the same.
    ///
    /// They have length 1 where the path is curved; else they are its legs.
    pub(super) fn ways(&self, vertex: usize) -> [Vec2; 2] {
        if let Some(directions) = &self.directions {
            return directions[vertex];
        }
        let leg = |first: usize| self.vertices[first + 1] - self.vertices[first];
        let last_leg = self.vertices.len() - 2;
        [leg(vertex.saturating_sub(1)), leg(vertex.min(last_leg))]
    }

    /// Directions in which a vertex is reached and left, length 1.
    pub(super) fn directions(&self, vertex: usize) -> [Vec2; 2] {
        let ways = self.ways(vertex);
        if self.is_curved() { ways } else { ways.map(Vec2::normalize) }
    }

    /// All that is known of the vertices.
    pub(super) fn stations(&self) -> impl Iterator<Item = Station> {
        self.distances_mm.iter().enumerate().map(|(vertex, &distance_mm)| {
            let [arriving, leaving] = self.directions(vertex);
            Station { arriving, leaving, distance_mm }
        })
    }

    /// Arc length, mm.
    pub(super) fn length_mm(&self) -> f64 {
        self.distances_mm[self.distances_mm.len() - 1]
    }

    /// The paths and curves between vertices.
    pub(super) fn cut(&self, curve: &BezPath, vertices: &[usize]) -> Vec<(Self, BezPath)> {
        let segments: Vec<PathSeg> = curve.segments().collect();
        let last = self.vertices.len() - 1;
        let (mut first, mut from_at) = (0, 0.0);
        let mut part = |to: usize| {
            let to_at = if to == last { segments.len() as f64 } else { self.curve_at(to) };
            let own = (from_at as usize..segments.len())
                .take_while(|&index| (index as f64) < to_at)
                .map(|index| between(segments[index], index as f64, [from_at, to_at]));
            let part = (self.part(first, to), BezPath::from_path_segments(own));
            (first, from_at) = (to, to_at);
            part
        };
        vertices.iter().chain([&last]).map(|&vertex| part(vertex)).collect()
    }

    /// The part from one vertex to another.
    pub(super) fn part(&self, first: usize, last: usize) -> Self {
        let start_mm = self.distances_mm[first];
        let part = &self.distances_mm[first..=last];
        Self {
            vertices: self.vertices[first..=last].to_vec(),
            distances_mm: part.iter().map(|distance_mm| distance_mm - start_mm).collect(),
            directions: self.directions.as_ref().map(|all| all[first..=last].to_vec()),
            curve_at: Some((first..=last).map(|vertex| self.curve_at(vertex)).collect()),
        }
    }

    /// Where on the curve a vertex is.
    fn curve_at(&self, vertex: usize) -> f64 {
        self.curve_at.as_ref().map_or(vertex as f64, |all| all[vertex])
    }

    /// Arc lengths of the points nearest to places, each looked for near an arc length, mm.
    ///
    /// * `near_mm`: how near, so that a path that comes back to the place is not mistaken
    pub(super) fn nearest_mm(&self, places: &[Point], around_mm: &[f64], near_mm: f64) -> Vec<f64> {
        let n_legs = self.vertices.len() - 1;
        let mut first = 0;
        let nearest = |(place, middle_mm): (&Point, &f64)| {
            let (low_mm, high_mm) = (middle_mm - near_mm, middle_mm + near_mm);
            while first + 1 < n_legs && self.distances_mm[first + 1] < low_mm {
                first += 1;
            }
            let mut nearest = (f64::INFINITY, *middle_mm);
            for leg in first..n_legs {
                if leg > first && self.distances_mm[leg] > high_mm {
                    break;
                }
                let (off_mm2, along_mm) = self.foot(leg, *place, (low_mm, high_mm));
                if off_mm2 < nearest.0 {
                    nearest = (off_mm2, along_mm);
                }
            }
            nearest.1
        };
        places.iter().zip(around_mm).map(nearest).collect()
    }

    /// Square of the distance of a place from a leg, mm², and arc length of the leg's nearest point
    /// between two; before the first leg and after the last it goes straight on.
    fn foot(&self, leg: usize, place: Point, (low_mm, high_mm): (f64, f64)) -> (f64, f64) {
        let (from, to) = (self.vertices[leg], self.vertices[leg + 1]);
        let start_mm = self.distances_mm[leg];
        let end_mm = self.distances_mm[leg + 1];
        let length_mm = end_mm - start_mm;
        let chord = to - from;
        let share = (place - from).dot(chord) / chord.hypot2();
        let (is_first, is_last) = (leg == 0, leg + 2 == self.vertices.len());
        let mut share = match (is_first, is_last) {
            (false, false) => share.clamp(0.0, 1.0),
            (false, true) => share.max(0.0),
            (true, false) => share.min(1.0),
            (true, true) => share,
        };
        // Most legs lie between both.
        if is_first || is_last || start_mm < low_mm || end_mm > high_mm {
            share =
                share.max((low_mm - start_mm) / length_mm).min((high_mm - start_mm) / length_mm);
        }
        ((from + chord * share - place).hypot2(), start_mm + share * length_mm)
    }

    fn push_line(&mut self, line: Line, index: usize) {
        let start = *self.vertices.last().unwrap_or(&line.p0);
        let chord = line.p1 - start;
        let length_mm = chord.hypot();
        if length_mm > SAME_PLACE_MM {
            let directions = [chord / length_mm; 2];
            self.push_leg([start, line.p1], directions, length_mm, (index + 1) as f64);
        }
    }

    /// Halves a curve until its parts bend little.
    ///
    /// * `at`: where on the whole curve it begins
    fn push_curve(&mut self, curve: &PathSeg, at: f64, n_halvings: u32) {
        let length_mm = curve.arclen(SAME_PLACE_MM);
        if length_mm <= SAME_PLACE_MM {
            return;
        }
        let chord = curve.end() - curve.start();
        let [start, end] = tangents(curve);
        let share = 0.5_f64.powi((N_HALVINGS_MAX - n_halvings) as i32);
        let bend = angle(start, chord).abs().max(angle(chord, end).abs());
        if n_halvings > 0 && (bend > 0.5 * TURN_MAX_RAD || length_mm > 1.01 * chord.hypot()) {
            let middle_at = at + 0.5 * share;
            self.push_curve(&curve.subsegment(0.0..0.5), at, n_halvings - 1);
            self.push_curve(&curve.subsegment(0.5..1.0), middle_at, n_halvings - 1);
            return;
        }
        let length_mm = curve.arclen((LENGTH_ERROR * length_mm).max(1e-15));
        let length_mm = length_mm.max(chord.hypot());
        self.push_leg([curve.start(), curve.end()], [start, end], length_mm, at + share);
    }

    /// Adds a leg with its directions.
    ///
    /// * `end_at`: where on the curve it ends
    fn push_leg(
        &mut self,
        [from, to]: [Point; 2],
        [leaving, arriving]: [Vec2; 2],
        length_mm: f64,
        end_at: f64,
    ) {
        let start_mm = self.distances_mm.last().copied();
        let curve_at = self.curve_at.get_or_insert_default();
        let directions = self.directions.get_or_insert_default();
        match directions.last_mut() {
            Some(last) => last[1] = leaving,
            None => {
                self.vertices.push(from);
                self.distances_mm.push(0.0);
                curve_at.push(0.0);
                directions.push([leaving; 2]);
            }
        }
        self.vertices.push(to);
        self.distances_mm.push(start_mm.unwrap_or(0.0) + length_mm);
        curve_at.push(end_at);
        directions.push([arriving; 2]);
    }
}

/// What of a curve's segment lies between two places of the curve.
fn between(segment: PathSeg, index: f64, ends_at: [f64; 2]) -> PathSeg {
    let [from, to] = ends_at.map(|at| (at - index).clamp(0.0, 1.0));
    // Whole segments stay what they are, to the last bit.
    if (from, to) == (0.0, 1.0) { segment } else { segment.subsegment(from..to) }
}

/// Signed angle from one direction to another, of any lengths, rad.
pub(super) fn angle(from: Vec2, to: Vec2) -> f64 {
    let (cross, dot) = (from.cross(to), from.dot(to));
    let tangent = cross / dot;
    if dot > 0.0 && tangent.abs() < SLIGHT_TURN {
        // A dense curve has nothing but such turns.
        let square = tangent * tangent;
        let series = [1.0 / 9.0, -1.0 / 7.0, 1.0 / 5.0, -1.0 / 3.0, 1.0];
        return tangent * series.iter().fold(0.0, |sum, term| sum * square + term);
    }
    cross.atan2(dot)
}

/// Directions at the ends, where control points may coincide.
fn tangents(curve: &PathSeg) -> [Vec2; 2] {
    let cubic = curve.to_cubic();
    let chord = cubic.p3 - cubic.p0;
    let derivative = cubic.deriv();
    let unit = |direction: Vec2, point: f64| {
        let least_mm = SAME_PLACE_MM;
        if direction.hypot() > least_mm {
            return direction.normalize();
        }
        let near = derivative.eval(point).to_vec2();
        if near.hypot() > 0.0 { near.normalize() } else { chord.normalize() }
    };
    [unit(cubic.p1 - cubic.p0, 1e-3), unit(cubic.p3 - cubic.p2, 1.0 - 1e-3)]
}
