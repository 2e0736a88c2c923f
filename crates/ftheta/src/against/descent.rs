//! Coordinate descent over whole steps, candidates two at a time.

use super::delays::{Delays, JUMP_SPEED};

/// Sizes of step, from coarse to the prescribed one.
const SCALES: [i32; 5] = [16, 8, 4, 2, 1];

/// What is made small: first what a plan lacks, then its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rank {
    /// By how much errors exceed what is allowed, µm; infinite where there is no plan.
    pub excess_um: f64,
    /// Time that is made small, s.
    pub duration_s: f64,
}

impl Rank {
    /// Of what cannot be planned.
    pub const NONE: Self = Self { excess_um: f64::INFINITY, duration_s: f64::INFINITY };

    /// Whether this is better than the other.
    pub fn is_below(&self, other: &Self) -> bool {
        (self.excess_um, self.duration_s) < (other.excess_um, other.duration_s)
    }
}

/// Goes from `start` to where no single step of any of `settings` helps.
///
/// * `rank` of one candidate; two are ranked at a time, on two threads
/// * `spent` ends the search early
pub fn descend(
    start: Delays,
    settings: &[usize],
    rank: &(dyn Fn(Delays) -> Rank + Sync),
    spent: &dyn Fn() -> bool,
) -> (Delays, Rank) {
    let mut at = (start, rank(start));
    for scale in SCALES {
        // One round without a better place ends the scale.
        while settings.iter().fold(false, |moved, &setting| {
            let steps = if setting == JUMP_SPEED { 1 } else { scale };
            !spent() && slide(&mut at, setting, steps, rank) || moved
        }) {}
    }
    at
}

/// Moves along one setting as long as that helps; whether it did.
fn slide(
    at: &mut (Delays, Rank),
    setting: usize,
    steps: i32,
    rank: &(dyn Fn(Delays) -> Rank + Sync),
) -> bool {
    let candidates = [-steps, steps].map(|steps| at.0.moved(setting, steps));
    let ranks = both(candidates, rank);
    let mut moved = false;
    for (side, candidate) in [-steps, steps].into_iter().zip(candidates.into_iter().zip(ranks)) {
        let (Some(mut next), Some(mut found)) = candidate else {
            continue;
        };
        while found.is_below(&at.1) {
            *at = (next, found);
            moved = true;
            let Some(further) = next.moved(setting, side) else {
                break;
            };
            (next, found) = (further, rank(further));
        }
    }
    moved
}

fn both(
    [first, second]: [Option<Delays>; 2],
    rank: &(dyn Fn(Delays) -> Rank + Sync),
) -> [Option<Rank>; 2] {
    std::thread::scope(|scope| {
        let first = scope.spawn(move || first.map(rank));
        let second = second.map(rank);
        // A panic in the other thread is a panic here.
        [first.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), second]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time is least at (40, 7) on a slope with a wall: the sum must not be less than 60.
    fn rank(delays: Delays) -> Rank {
        let [_, jump, mark, ..] = delays.0;
        Rank {
            excess_um: f64::from((60 - jump - mark).max(0)),
            duration_s: f64::from(2 * (jump - 40).abs() + (mark - 7).abs()),
        }
    }

    #[test]
    fn no_single_step_helps_where_it_ends() {
        for start in [[0; 8], [2, 500, 300, 0, 0, 0, 0, 0], [0, 60, 0, 0, 0, 0, 0, 0]] {
            let settings = [1, 2];
            let (found, best) = descend(Delays(start), &settings, &rank, &|| false);
            assert_eq!(best.excess_um, 0.0);
            for setting in settings {
                for steps in [-1, 1] {
                    let near = found.moved(setting, steps).map(rank);
                    assert!(near.is_none_or(|near| !near.is_below(&best)), "{found:?}");
                }
            }
        }
    }

    #[test]
    fn nothing_is_tried_once_it_is_spent() {
        let start = Delays([0; 8]);
        assert_eq!(descend(start, &[1, 2], &rank, &|| true), (start, rank(start)));
    }
}
