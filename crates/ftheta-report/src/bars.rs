//! Bars: what the time goes into, how far limits are used, and how the dose is spread.

use crate::report::TimeSplit;
use crate::score::Score;
use crate::tally::DOSE_BAR;
use crate::text::{put, tick, tick_step, ticks, time};
use ftheta_physics::audit::Limits;

/// A bar of marking, jumping and waiting, with its key.
pub fn split_html(times: TimeSplit) -> String {
    let parts = [
        ("marking", times.mark_s, "#1d6fb8"),
        ("jumps", times.jump_s, "#8fb4d6"),
        ("delays", times.delay_s, "#d9a441"),
    ];
    let total_s: f64 = parts.iter().map(|part| part.1).sum();
    let mut bar = String::from("<div class=split>");
    let mut key = String::from("<div class=key>");
    for (name, part_s, color) in parts {
        let percent = match total_s > 0.0 {
            true => 100.0 * part_s / total_s,
            false => 0.0,
        };
        put(&mut bar, format_args!("<b style='width:{percent:.2}%;background:{color}'></b>"));
        put(
            &mut key,
            format_args!(
                "<span><i style='color:{color}'></i>{name} {}, {percent:.0} %</span>",
                time(part_s)
            ),
        );
    }
    format!("{bar}</div>{key}</div>")
}

/// One bar per limit, red where it is passed.
pub fn limits_svg(peaks: &Limits) -> String {
    let rows = [
        ("angle", peaks.angle),
        ("speed", peaks.speed),
        ("voltage", peaks.voltage),
        ("current", peaks.current),
        ("heat", peaks.heat),
    ];
    let mut out = String::from("<svg viewBox='0 0 460 190' role=img>");
    for (i, (name, ratio)) in rows.into_iter().enumerate() {
        let y = 10.0 + 32.0 * i as f64;
        let width = 330.0 * ratio.clamp(0.0, 1.0);
        let class = if ratio > 1.0 + 1e-9 { "bar high" } else { "bar" };
        let percent = 100.0 * ratio;
        put(
            &mut out,
            format_args!(
                "<text class=label x='58' y='{0}' text-anchor=end>{name}</text>\
                 <rect class=track x='68' y='{y}' width='330' height='16' rx='3'/>\
                 <rect class='{class}' x='68' y='{y}' width='{width:.1}' height='16' rx='3'/>\
                 <text class=value x='406' y='{0}'>{percent:.0} %</text>",
                y + 12.0
            ),
        );
    }
    put(
        &mut out,
        format_args!("<path class=limit d='M398 4V160'/><text x='398' y='176' text-anchor=middle>"),
    );
    out.push_str("limit</text></svg>");
    out
}

/// Histogram of the dose ratio.
pub fn dose_svg(score: &Score) -> String {
    let bars = &score.dose_bars;
    let top = bars.iter().copied().fold(0.0, f64::max);
    if top <= 0.0 {
        return "<p class=note>Every mark is shorter than the window.</p>".into();
    }
    let (left, right, bottom) = (44.0, 450.0, 150.0);
    let width = (right - left) / bars.len() as f64;
    let mut out = String::from("<svg viewBox='0 0 460 190' role=img>");
    let step = tick_step(100.0 * top, 3.0);
    for percent in ticks(0.0, 100.0 * top, step) {
        let y = bottom - 1.36 * percent / top;
        let label = tick(percent, step);
        put(
            &mut out,
            format_args!(
                "<path class=grid d='M{left} {y:.1}H{right}'/>\
                 <text x='{}' y='{:.1}' text-anchor=end>{label} %</text>",
                left - 5.0,
                y + 4.0
            ),
        );
    }
    for (i, share) in bars.iter().enumerate() {
        let height = 136.0 * share / top;
        let (x, y) = (left + width * i as f64, bottom - height);
        if height > 0.0 {
            put(
                &mut out,
                format_args!(
                    "<rect class=bar x='{:.1}' y='{y:.1}' width='{:.1}' height='{height:.1}'/>",
                    x + 0.5,
                    width - 1.0
                ),
            );
        }
    }
    for label in ["0", "0.5", "1", "1.5", "2 +"] {
        let ratio: f64 = label.trim_end_matches(" +").parse().unwrap_or_default();
        let x = left + width * ratio / DOSE_BAR;
        put(
            &mut out,
            format_args!(
                "<text x='{x:.1}' y='{}' text-anchor=middle>{label}</text>",
                bottom + 15.0
            ),
        );
    }
    put(
        &mut out,
        format_args!(
            "<path class=axis d='M{left} {bottom}H{right}'/>\
             <text class=label x='{}' y='{}' text-anchor=middle>dose over what was asked</text>",
            0.5 * (left + right),
            bottom + 33.0
        ),
    );
    out.push_str("</svg>");
    out
}
