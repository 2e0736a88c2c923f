//! The figures at the top of the report.

use crate::report::ReportInput;
use crate::score::Score;
use crate::text::{number, put, time};
use ftheta_physics::audit::Limits;

/// A figure at the top of the page.
pub struct Card {
    /// What it is.
    pub name: &'static str,
    /// Its value; one unit behind a blank is written smaller.
    pub value: String,
    /// What else there is to know.
    pub more: String,
    /// Whether it is as it should be, where that can be told.
    pub good: Option<bool>,
}

/// Appends the five figures that matter most.
pub fn cards(out: &mut String, input: &ReportInput<'_>) {
    let score = input.score;
    let tolerance_um = 1e3 * input.plan.tolerance_mm;
    let (contour, coverage) = (score.contour_error_um, score.coverage_error_um);
    let cards = [
        Card {
            name: "Marking time",
            value: time(score.duration_s),
            more: "first light to last light".into(),
            good: None,
        },
        Card {
            name: "Contour error, max",
            value: format!("{} µm", number(contour.max)),
            more: format!("99 % {}, rms {} µm", number(contour.p99), number(contour.rms)),
            good: Some(contour.max <= tolerance_um),
        },
        Card {
            name: "Coverage error, max",
            value: format!("{} µm", number(coverage.max)),
            more: format!("99 % {} µm", number(coverage.p99)),
            good: Some(coverage.max <= tolerance_um),
        },
        dose_card(score),
        limits_card(input.peaks),
    ];
    draw(out, cards);
}

/// Appends five figures side by side.
pub fn draw(out: &mut String, cards: [Card; 5]) {
    out.push_str("<div class=cards>");
    for card in cards {
        let class = match card.good {
            Some(true) => " good",
            Some(false) => " bad",
            None => "",
        };
        let value = match card.value.split_once(' ') {
            Some((value, unit)) if !unit.contains(' ') => format!("{value} <small>{unit}</small>"),
            _ => card.value,
        };
        put(
            out,
            format_args!(
                "<div class='card{class}'><div class=name>{}</div>\
                 <div class=value>{value}</div><div class=more>{}</div></div>",
                card.name, card.more
            ),
        );
    }
    out.push_str("</div>");
}

fn dose_card(score: &Score) -> Card {
    let percent = |ratio: f64| format!("{:.0}", 100.0 * ratio);
    let pulses = score
        .pulse_spacing_ratio
        .map(|pulses| format!("; pulses {}–{} % apart", percent(pulses.p01), percent(pulses.p99)));
    let pulses = pulses.unwrap_or_default();
    let (value, more) = match score.dose_ratio {
        Some(dose) => (
            format!("{}–{} %", percent(dose.p01), percent(dose.p99)),
            format!("extremes {} and {} %{pulses}", percent(dose.min), percent(dose.max)),
        ),
        None => ("–".into(), format!("marks shorter than the window{pulses}")),
    };
    Card { name: "Dose, 1 to 99 %", value, more, good: None }
}

fn limits_card(peaks: &Limits) -> Card {
    let named = [
        ("angle", peaks.angle),
        ("speed", peaks.speed),
        ("voltage", peaks.voltage),
        ("current", peaks.current),
        ("heat", peaks.heat),
    ];
    let (limit, used) =
        named.into_iter().fold(("angle", 0.0), |a, b| if b.1 > a.1 { b } else { a });
    Card {
        name: "Limits used",
        value: format!("{:.0} %", 100.0 * used),
        more: match peaks.violations {
            0 => format!("of {limit}, none exceeded"),
            n => format!("of {limit}, {n} samples past a limit"),
        },
        good: Some(peaks.violations == 0),
    }
}
