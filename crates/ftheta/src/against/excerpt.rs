//! The part of a long job that stands for all of it while delays are tuned.

use ftheta_model::toolpath::Toolpath;
use ftheta_report::score::Score;

/// Stretches of marks that follow each other.
const N_STRETCHES: usize = 6;
/// Worst marks that are taken in.
const N_WORST: usize = 4;
/// What a mark takes beside its length, about, s.
const OVERHEAD_S: f64 = 5e-4;

/// Marks of a job in their order: stretches spread over its time, as long as `time_s` together, and
/// the marks with the largest errors.
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
        taken[worst.mark_index] = true;
    }
    let marks = marks.iter().zip(taken).filter(|(_, taken)| *taken);
    Toolpath { pens: toolpath.pens.clone(), marks: marks.map(|(mark, _)| mark.clone()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ftheta_model::recipe::Pen;
    use ftheta_model::toolpath::Mark;
    use ftheta_report::score::MarkError;
    use kurbo::{Line, Point, Shape};

    #[test]
    fn an_excerpt_is_spread_over_the_job_and_has_its_worst_marks() {
        // A second of marks of half a millisecond, as much again beside them.
        let marks = (0..1000).map(|n| {
            let (from, to) = (Point::new(0.0, f64::from(n)), Point::new(0.5, f64::from(n)));
            Mark {
                curve: Line::new(from, to).to_path(1e-3),
                points: vec![from, to],
                closed: false,
                pen_index: 0,
                source: String::new(),
            }
        });
        let toolpath = Toolpath { pens: vec![Pen::default()], marks: marks.collect() };
        let worst = MarkError { mark_index: 499, error_um: 9.0, x_mm: 0.0, y_mm: 0.0 };
        let score = Score { worst_marks: vec![worst], ..Score::default() };
        let rows: Vec<f64> =
            excerpt(&toolpath, &score, 0.1).marks.iter().map(|mark| mark.start().y).collect();
        assert!((95..=110).contains(&rows.len()), "{} marks", rows.len());
        assert!(rows.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(rows.contains(&499.0));
        for sixth in 0..6 {
            let part = f64::from(sixth) * 1000.0 / 6.0..f64::from(sixth + 1) * 1000.0 / 6.0;
            assert!(rows.iter().filter(|row| part.contains(row)).count() > 10);
        }
    }
}
