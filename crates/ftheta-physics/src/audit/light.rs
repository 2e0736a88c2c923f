//! Checks that light falls only while its mark is being made.

use super::AuditError;
use ftheta_model::plan::PlanDraft;

/// Checks power, order and place in time of every light interval.
///
/// The beam follows the command by the servo's lag, and light follows its edge by the laser's
/// latency. In command time an interval has to lie within its mark's segments; settings of a
/// classic controller may be wrong by one lag, never by more.
///
/// * `lag_s`: the nominal servo's lag
pub fn check_light(draft: &PlanDraft, lag_s: f64) -> Result<(), AuditError> {
    let machine = &draft.machine;
    let lag_ns = (lag_s * 1e9) as i64;
    let slack_ns = lag_ns + i64::from(machine.output.period_ns);
    let windows = mark_windows(draft)?;
    let end_ns = draft.n_samples() * u64::from(machine.output.period_ns);
    let mut last_off_ns = 0;
    for (index, (mark, window)) in draft.marks.iter().zip(windows).enumerate() {
        let place = || format!("mark {index} ({})", mark.source);
        if !(0.0 <= mark.power_w && mark.power_w <= machine.laser.power_max_w) {
            let (value_w, limit_w) = (mark.power_w, machine.laser.power_max_w);
            return Err(AuditError::Power { place: place(), value_w, limit_w });
        }
        let ordered = last_off_ns <= mark.on_ns && mark.on_ns <= mark.off_ns;
        if !ordered || mark.off_ns >= end_ns {
            let what = "its laser edges overlap another mark's, or the plan's end".into();
            return Err(AuditError::Malformed { place: place(), what });
        }
        last_off_ns = mark.off_ns;
        let on_ns = mark.on_ns as i64 + machine.laser.on_latency_ns - lag_ns;
        let off_ns = mark.off_ns as i64 + machine.laser.off_latency_ns - lag_ns;
        for (edge, early_ns) in [
            ("on", window.0 - on_ns),
            ("on", on_ns - window.1),
            ("off", window.0 - off_ns),
            ("off", off_ns - window.1),
        ] {
            if early_ns > slack_ns {
                let (value_us, limit_us) = (early_ns as f64 * 1e-3, slack_ns as f64 * 1e-3);
                return Err(AuditError::Light { place: place(), edge, value_us, limit_us });
            }
        }
    }
    Ok(())
}

/// Beginning and end of every mark's segments in command time, ns.
fn mark_windows(draft: &PlanDraft) -> Result<Vec<(i64, i64)>, AuditError> {
    let period_ns = i64::from(draft.machine.output.period_ns);
    let mut windows: Vec<(i64, i64)> = Vec::with_capacity(draft.marks.len());
    let mut n_samples = 0_i64;
    for (index, segment) in draft.segments.iter().enumerate() {
        // A segment starts from the sample before its first.
        let start_ns = (n_samples - 1) * period_ns;
        n_samples += i64::from(segment.n_ticks);
        let end_ns = (n_samples - 1) * period_ns;
        let Some(mark) = segment.mark_index else {
            continue;
        };
        let mark = mark as usize;
        if mark == windows.len() {
            windows.push((start_ns, end_ns));
        } else if mark + 1 == windows.len() && windows[mark].1 == start_ns {
            windows[mark].1 = end_ns;
        } else {
            return Err(AuditError::Malformed {
                place: format!("segment {index}"),
                what: "its mark is out of order".into(),
            });
        }
    }
    if windows.len() != draft.marks.len() {
        return Err(AuditError::Malformed {
            place: format!("mark {}", windows.len()),
            what: "no segment makes it".into(),
        });
    }
    Ok(windows)
}
