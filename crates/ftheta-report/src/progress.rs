//! Which passage of a curve light belongs to, where the curve lies on itself.
//!
//! Light belongs to the nearest point of the curve. Where several are as near, as on a line that
//! runs back over itself, the light has gone on along the curve: of all ways in which it may have,
//! the one that jumps and turns back least is taken. That is known only later, so ways are kept
//! side by side until one is left.

use crate::contour::{Contour, Nearest};
use crate::line_dose::LineDose;
use kurbo::Point;

/// Most ways that are followed side by side.
const N_COURSES_MAX: usize = 6;
/// A way that costs so much more than the best one is given up, mm.
const COST_MAX_MM: f64 = 0.5;
/// Ways that are nearer to each other are one, mm.
const SAME_MM: f64 = 2e-4;
/// Most steps without a decision: then the best way is taken.
const N_STEPS_MAX: usize = 1 << 16;
/// A node without one before it.
const ROOT: u32 = u32::MAX;

/// One way in which light may have gone along the curve.
#[derive(Clone, Copy, Debug)]
struct Course {
    /// Arc position to which the last light belongs, mm.
    at_mm: f64,
    /// Arc position at which the beam goes on: another one while it only crosses a branch, mm.
    goes_on_mm: f64,
    /// How far it has gone otherwise than forwards as far as the beam, mm.
    cost_mm: f64,
    /// Its last node.
    node: u32,
}

/// A step of a way that is not decided.
#[derive(Clone, Copy)]
struct Node {
    at_mm: f64,
    before: u32,
}

/// How far the beam goes in a step, mm, and the energy that it leaves, J.
#[derive(Clone, Copy)]
struct Step {
    way_mm: f64,
    energy_j: f64,
}

/// The light of a mark, and where along the curve it belongs.
pub struct Progress {
    /// Cheapest first.
    courses: Vec<Course>,
    next: Vec<Course>,
    nodes: Vec<Node>,
    /// Steps that are not decided.
    waiting: Vec<Step>,
    /// Arc position of the last light that is decided, mm.
    decided_mm: f64,
    /// Farther positions do not have the energy of one step between them, mm.
    jump_mm: f64,
}

impl Progress {
    /// Light that begins at an arc position.
    ///
    /// * `jump_mm`: between positions that are farther apart no energy is spread unless the beam
    ///   went as far, mm
    pub fn new(at_mm: f64, jump_mm: f64) -> Self {
        let course = Course { at_mm, goes_on_mm: at_mm, cost_mm: 0.0, node: ROOT };
        Self {
            courses: vec![course],
            next: Vec::new(),
            nodes: Vec::new(),
            waiting: Vec::new(),
            decided_mm: at_mm,
            jump_mm,
        }
    }

    /// Goes on to `beam` by a way in the field, mm, while energy is emitted, J.
    pub fn advance(
        &mut self,
        contour: &Contour,
        (beam, nearest): (Point, &Nearest),
        way_mm: f64,
        (energy_j, dose): (f64, &mut LineDose),
    ) {
        let step = Step { way_mm, energy_j };
        if let ([course], true) = (&mut self.courses[..], self.waiting.is_empty()) {
            let expected_mm = course.goes_on_mm + way_mm;
            if let Some(at_mm) = contour.only(nearest, expected_mm)
                && (at_mm - expected_mm).abs() <= way_mm + SAME_MM
            {
                *course = Course { at_mm, goes_on_mm: at_mm, cost_mm: 0.0, ..*course };
                self.decide(at_mm, step, dose);
                return;
            }
        }
        let mut next = std::mem::take(&mut self.next);
        next.clear();
        for course in &self.courses {
            let expected_mm = course.goes_on_mm + way_mm;
            let mut closest_mm = f64::INFINITY;
            let mut aside_mm = course.at_mm;
            contour.around(beam, nearest, expected_mm, |at_mm| {
                let off_mm = (at_mm - expected_mm).abs();
                let cost_mm = course.cost_mm + off_mm;
                keep(&mut next, Course { at_mm, goes_on_mm: at_mm, cost_mm, ..*course });
                if off_mm < closest_mm {
                    (closest_mm, aside_mm) = (off_mm, at_mm);
                }
            });
            if closest_mm > way_mm + SAME_MM {
                // Another branch comes near for a moment; the beam goes on where it was.
                let cost_mm = course.cost_mm + way_mm;
                let goes_on_mm = expected_mm;
                keep(&mut next, Course { at_mm: aside_mm, goes_on_mm, cost_mm, ..*course });
            }
        }
        let least_mm = next.first().map_or(0.0, |course| course.cost_mm);
        let most_mm = least_mm + COST_MAX_MM;
        next.truncate(next.partition_point(|course| course.cost_mm <= most_mm));
        self.next = std::mem::replace(&mut self.courses, next);
        if self.courses.len() == 1 && self.waiting.is_empty() {
            self.decide(self.courses[0].at_mm, step, dose);
            return;
        }
        self.waiting.push(step);
        for course in &mut self.courses {
            self.nodes.push(Node { at_mm: course.at_mm, before: course.node });
            course.node = (self.nodes.len() - 1) as u32;
        }
        if self.courses.len() == 1 || self.waiting.len() >= N_STEPS_MAX {
            self.settle(dose);
        }
    }

    /// Decides for the best way; returns the arc position at which it ends, mm.
    pub fn settle(&mut self, dose: &mut LineDose) -> f64 {
        let mut best = self.courses[0];
        let mut places_mm = Vec::with_capacity(self.waiting.len());
        let mut at = best.node;
        while let Some(node) = self.nodes.get(at as usize) {
            places_mm.push(node.at_mm);
            at = node.before;
        }
        let mut waiting = std::mem::take(&mut self.waiting);
        for (&at_mm, step) in places_mm.iter().rev().zip(waiting.drain(..)) {
            self.decide(at_mm, step, dose);
        }
        self.waiting = waiting;
        self.nodes.clear();
        best.node = ROOT;
        self.courses.clear();
        self.courses.push(best);
        best.at_mm
    }

    /// Gives the energy of a step to the curve, from the last place on.
    fn decide(&mut self, at_mm: f64, step: Step, dose: &mut LineDose) {
        let Step { way_mm, energy_j } = step;
        let before_mm = std::mem::replace(&mut self.decided_mm, at_mm);
        if (at_mm - before_mm).abs() <= self.jump_mm.max(2.0 * way_mm) {
            dose.add(before_mm, at_mm, energy_j);
        } else {
            dose.add(before_mm, before_mm, 0.5 * energy_j);
            dose.add(at_mm, at_mm, 0.5 * energy_j);
        }
    }
}

/// Adds a course to the cheapest ones, in order, unless a cheaper one is at the same place.
fn keep(courses: &mut Vec<Course>, course: Course) {
    let is_same = |other: &Course| {
        (other.goes_on_mm - course.goes_on_mm).abs() < SAME_MM
            && (other.at_mm - course.at_mm).abs() < SAME_MM
    };
    if let Some(same) = courses.iter().position(is_same) {
        if courses[same].cost_mm <= course.cost_mm {
            return;
        }
        courses.remove(same);
    }
    let place = courses.partition_point(|other| other.cost_mm <= course.cost_mm);
    if place < N_COURSES_MAX {
        courses.truncate(N_COURSES_MAX - 1);
        courses.insert(place, course);
    }
}
