//! The part of a long job that stands for all of it while delays are tuned.

use ftheta_model::toolpath::Toolpath;
use ftheta_report::score::Score;

/// Stretches of marks that follow each other.
const N_STRETCHES: usize = 6;
/// Worst marks that are taken in.
const N_WORST: usize = 6;
/// What a mark takes beside its length, about, s.
const OVERHEAD_S: f64 = 5e-4;

/// Marks of a job in their order: stretches spread over its time, as long as `time_s` together, and
/// the marks with the largest errors, each with the one before it.
///
/// * `score` of the whole job with any delays
pub fn excerpt(toolpath: &Toolpath, score: &Score, time_s: f64) -> Toolpath {
    let marks = &toolpath.marks;
    let times_s: Vec<f64> = marks
        .iter()
        .map(|mark| mark.length_mm() / toolpath.pens[mark.pen_index].mark_speed_mm_s + OVERHEAD_S)
        .collect();
    let share = time_s / times_s.iter().sum::<f64>();
    let mut taken = vec![false; marks.len()];
    let (mut at_s, total_s) = (0.0, time_s / share);
    for (taken, mark_s) in taken.iter_mut().zip(times_s) {
        // Where the middle of the mark lies in its stretch of the whole.
        let place = (at_s + 0.5 * mark_s) / total_s * N_STRETCHES as f64;
        *taken = place.fract() < share;
        at_s += mark_s;
    }
    for worst in score.worst_marks.iter().take(N_WORST) {
        let before = worst.mark_index.saturating_sub(1);
        taken.iter_mut().take(worst.mark_index + 1).skip(before).for_each(|taken| *taken = true);
    }
    let marks = marks.iter().zip(taken).filter(|(_, taken)| *taken);
    Toolpath { pens: toolpath.pens.clone(), marks: marks.map(|(mark, _)| mark.clone()).collect() }
}
