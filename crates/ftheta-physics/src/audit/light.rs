//! Checks that light falls only while its mark is being made.

use super::{AuditError, ROUNDING};
use ftheta_model::plan::{Motion, PlanDraft, PlannedMark};

/// When the mirrors make a mark, ns.
#[derive(Clone, Copy)]
struct Window {
    from_ns: i64,
    to_ns: i64,
    /// How far light may lie outside.
    slack_ns: i64,
}

/// Checks power, order and place in time of every light interval.
///
/// Light follows its edge by the laser's latency, and has to lie within its mark's segments, as
/// the mirrors make them; settings of a classic controller may be wrong by one servo lag, never by
/// more.
///
/// * `lag_s`: the nominal servo's lag
/// * `by_voltage`: whether commands of tracks and drives are computed from voltages
pub fn check_light(draft: &PlanDraft, lag_s: f64, by_voltage: bool) -> Result<(), AuditError> {
    let laser = &draft.machine.laser;
    let windows = mark_windows(draft, (lag_s * 1e9) as i64, by_voltage)?;
    let end_ns = draft.n_samples() * u64::from(draft.machine.output.period_ns);
    let mut last_off_ns = 0;
    for (index, (mark, window)) in draft.marks.iter().zip(windows).enumerate() {
        let place = || format!("mark {index} ({})", mark.source);
        // Triggers come at the source's rate at the pen's power, and must not come faster.
        let limit_w = match (laser.pulses_triggered, draft.pens.get(mark.pen_index)) {
            (true, Some(pen)) => laser.power_max_w.min(pen.power_w * (1.0 + ROUNDING)),
            _ => laser.power_max_w,
        };
        check_power(mark, limit_w, &place)?;
        let ordered = last_off_ns <= mark.on_ns && mark.on_ns <= mark.off_ns;
        if !ordered || mark.off_ns >= end_ns {
            let what = "its laser edges overlap another mark's, or the plan's end".into();
            return Err(AuditError::Malformed { place: place(), what });
        }
        last_off_ns = mark.off_ns;
        let on_ns = mark.on_ns as i64 + laser.on_latency_ns;
        let off_ns = mark.off_ns as i64 + laser.off_latency_ns;
        for (edge, early_ns) in [
            ("on", window.from_ns - on_ns),
            ("on", on_ns - window.to_ns),
            ("off", window.from_ns - off_ns),
            ("off", off_ns - window.to_ns),
        ] {
            if early_ns > window.slack_ns {
                let (value_us, limit_us) = (early_ns as f64 * 1e-3, window.slack_ns as f64 * 1e-3);
                return Err(AuditError::Light { place: place(), edge, value_us, limit_us });
            }
        }
    }
    Ok(())
}

/// Checks every power of a mark, and that its changes lie between its edges, in order.
fn check_power(
    mark: &PlannedMark,
    limit_w: f64,
    place: &dyn Fn() -> String,
) -> Result<(), AuditError> {
    let powers_w = mark.steps.iter().map(|step| step.power_w).chain([mark.power_w]);
    for value_w in powers_w {
        if !(0.0 <= value_w && value_w <= limit_w) {
            return Err(AuditError::Power { place: place(), value_w, limit_w });
        }
    }
    let mut last_ns = mark.on_ns;
    for step in &mark.steps {
        if step.time_ns < last_ns || step.time_ns > mark.off_ns || step.power_w == 0.0 {
            let what = "its changes of power are not in order between its edges".into();
            return Err(AuditError::Malformed { place: place(), what });
        }
        last_ns = step.time_ns;
    }
    Ok(())
}

/// When the mirrors make each mark: what is computed from voltages begins a tick after its first
/// sample, other motion a tick before it, and the mirrors follow it by the lag.
fn mark_windows(
    draft: &PlanDraft,
    lag_ns: i64,
    by_voltage: bool,
) -> Result<Vec<Window>, AuditError> {
    let period_ns = i64::from(draft.machine.output.period_ns);
    let mut windows: Vec<Window> = Vec::with_capacity(draft.marks.len());
    let mut n_samples = 0_i64;
    for (index, segment) in draft.segments.iter().enumerate() {
        let computed = matches!(segment.motion, Motion::Track { .. } | Motion::Drive { .. });
        let after_ns = match computed && by_voltage {
            true => period_ns,
            false => lag_ns - period_ns,
        };
        let slack_ns = if computed { period_ns } else { lag_ns + period_ns };
        let from_ns = n_samples * period_ns + after_ns;
        n_samples += i64::from(segment.n_ticks);
        let to_ns = n_samples * period_ns + after_ns;
        let Some(mark) = segment.mark_index else {
            continue;
        };
        let mark = mark as usize;
        if mark == windows.len() {
            windows.push(Window { from_ns, to_ns, slack_ns });
        } else if mark + 1 == windows.len() && windows[mark].to_ns == from_ns {
            windows[mark].to_ns = to_ns;
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
