//! What the order keeps together: a stroke, a contour, or a run of hatch lines.

use ftheta_model::toolpath::Mark;
use kurbo::{BezPath, PathEl, Point};

/// Marks that follow each other, and the ways they can be gone through.
///
/// A way is called a pose. A closed contour has one for every end of its curve's elements; open
/// marks have two, backwards being odd; a run of hatch lines has four, of which 2 and 3 go through
/// every line the other way. Pose 0 is as drawn.
#[derive(Clone, Debug)]
pub struct Unit {
    /// One mark, or a run of hatch lines.
    pub marks: Vec<Mark>,
    /// How often it is gone over, at least 1.
    pub n_passes: u32,
}

/// Where a pose starts and ends.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Where the first mark starts.
    pub entry: Point,
    /// Where the last one ends, after all passes.
    pub exit: Point,
    /// Length of the jumps inside one pass, mm.
    pub inside_mm: f64,
}

impl Unit {
    /// Whether it ends where it starts because its curve does.
    pub fn is_closed(&self) -> bool {
        self.marks.len() == 1 && self.marks[0].closed
    }

    /// Number of poses.
    pub fn n_poses(&self) -> usize {
        match &self.marks[..] {
            [mark] if mark.closed => mark.curve.elements().len() - 1,
            [_] => 2,
            _ => 4,
        }
    }

    /// A pose's ends. Passes alternate, so an even number of them ends at the entry.
    pub fn pose(&self, pose_index: usize) -> Pose {
        if self.is_closed() {
            let entry = self.vertex(pose_index);
            return Pose { entry, exit: entry, inside_mm: 0.0 };
        }
        let flipped = pose_index & 2 != 0;
        let ends = |mark: &Mark| match flipped {
            false => (mark.start(), mark.end()),
            true => (mark.end(), mark.start()),
        };
        let inside_mm =
            self.marks.windows(2).map(|pair| ends(&pair[0]).1.distance(ends(&pair[1]).0)).sum();
        let mut entry = ends(&self.marks[0]).0;
        let mut exit = ends(&self.marks[self.marks.len() - 1]).1;
        if pose_index & 1 != 0 {
            (entry, exit) = (exit, entry);
        }
        if self.returns() {
            exit = entry;
        }
        Pose { entry, exit, inside_mm }
    }

    /// The pose that goes through a pose's places the other way.
    pub fn turned(&self, pose_index: usize) -> usize {
        if self.is_closed() || self.returns() { pose_index } else { pose_index ^ 1 }
    }

    /// Its marks in a pose. With `alternate` every second pass of open marks goes backwards.
    pub fn into_marks(self, pose_index: usize, alternate: bool, tolerance_mm: f64) -> Vec<Mark> {
        let closed = self.is_closed();
        let n_passes = self.n_passes;
        let mut pass = self.marks;
        if closed {
            if pose_index != 0 {
                rotate(&mut pass[0], pose_index, tolerance_mm);
            }
        } else {
            if pose_index & 2 != 0 {
                pass.iter_mut().for_each(reverse);
            }
            if pose_index & 1 != 0 {
                go_back(&mut pass);
            }
        }
        let mut marks = Vec::with_capacity(pass.len() * n_passes as usize);
        for _ in 1..n_passes {
            marks.extend(pass.iter().cloned());
            if alternate && !closed {
                go_back(&mut pass);
            }
        }
        marks.extend(pass);
        marks
    }

    fn returns(&self) -> bool {
        self.n_passes.is_multiple_of(2)
    }

    fn vertex(&self, index: usize) -> Point {
        self.marks[0].curve.elements()[index].end_point().unwrap_or_default()
    }
}

fn go_back(marks: &mut [Mark]) {
    marks.reverse();
    marks.iter_mut().for_each(reverse);
}

fn reverse(mark: &mut Mark) {
    mark.curve = mark.curve.reverse_subpaths();
    mark.points.reverse();
}

/// Starts a closed mark at the end of its element `index`.
fn rotate(mark: &mut Mark, index: usize, tolerance_mm: f64) {
    let els = mark.curve.elements();
    let Some(start) = els[index].end_point() else {
        return;
    };
    let turned: Vec<PathEl> = [PathEl::MoveTo(start)]
        .into_iter()
        .chain(els[index + 1..].iter().copied())
        .chain(els[1..=index].iter().copied())
        .collect();
    mark.curve = BezPath::from_vec(turned);
    mark.points = crate::subpath::flattened(&mark.curve, tolerance_mm);
}
