//! The job beside the same job planned in other ways.

use crate::report::ReportInput;
use crate::score::Score;
use crate::text::{escaped, number, put};

/// The same job planned in another way.
#[derive(Clone, Debug)]
pub struct Rival<'a> {
    /// What it is, in a few words; any text.
    pub name: &'a str,
    /// What the twin made of it; `None` where no settings keep the tolerance.
    pub score: Option<&'a Score>,
    /// Its settings: what, and its value with unit; the same ones for all rivals that have any.
    pub settings: Vec<(String, String)>,
}

/// A figure of a score, if it has it.
type Figure = fn(&Score) -> Option<f64>;

/// What is compared, with its unit.
const ROWS: [(&str, Figure); 11] = [
    ("Marking time, ms", |score| Some(1e3 * score.duration_s)),
    ("Contour error, max, µm", |score| Some(score.contour_error_um.max)),
    ("Contour error, rms, µm", |score| Some(score.contour_error_um.rms)),
    ("Coverage error, max, µm", |score| Some(score.coverage_error_um.max)),
    ("End error, max, µm", |score| Some(score.end_error_um.max)),
    ("Dose, 1 % of all places, %", |score| Some(100.0 * score.dose_ratio?.p01)),
    ("Dose, 99 % of all places, %", |score| Some(100.0 * score.dose_ratio?.p99)),
    ("Distance of pulses, 1 %, %", |score| Some(100.0 * score.pulse_spacing_ratio?.p01)),
    ("Distance of pulses, 99 %, %", |score| Some(100.0 * score.pulse_spacing_ratio?.p99)),
    ("Energy off the marks, %", |score| Some(100.0 * score.stray_energy_ratio)),
    ("Light, J", |score| Some(score.energy_j)),
];

/// Appends the table, if there is anything to compare with.
pub(crate) fn comparison(out: &mut String, input: &ReportInput<'_>) {
    let rivals = input.against;
    let planner = input.plan.planner.name();
    if rivals.is_empty() {
        return;
    }
    put(
        out,
        format_args!(
            "<section><h2>Against the classic planner</h2><p class=note>The same marks in the \
             same order on the same twin, delays tuned for the least time. A: contour error within \
             {} µm. B: coverage error as well.</p><table><tr><th><th class=n>{planner}",
            number(1e3 * input.plan.tolerance_mm)
        ),
    );
    for rival in rivals {
        put(out, format_args!("<th class=n>{}", escaped(rival.name)));
    }
    out.push_str("</tr>");
    let scores = || rivals.iter().map(|rival| rival.score);
    for (name, value) in ROWS {
        let own = value(input.score);
        let values: Vec<_> =
            std::iter::once(own).chain(scores().map(|score| value(score?))).collect();
        // A continuous laser has no pulses.
        if values.iter().any(Option::is_some) {
            row(out, name, values.into_iter());
        }
    }
    let own_s = input.score.duration_s;
    let ratios = scores().map(|score| Some(score?.duration_s / own_s));
    let name = format!("Time over that of {planner}");
    row(out, &name, std::iter::once(Some(1.0)).chain(ratios));
    let named = rivals.iter().find(|rival| !rival.settings.is_empty());
    for (name, _) in named.map_or(&[][..], |rival| &rival.settings) {
        put(out, format_args!("<tr><td>{}</td><td class=n>–</td>", escaped(name)));
        for rival in rivals {
            let value = rival.settings.iter().find(|(key, _)| key == name);
            let value = value.map_or("–".into(), |(_, value)| escaped(value));
            put(out, format_args!("<td class=n>{value}</td>"));
        }
        out.push_str("</tr>");
    }
    out.push_str("</table></section>");
}

fn row(out: &mut String, name: &str, values: impl Iterator<Item = Option<f64>>) {
    put(out, format_args!("<tr><td>{}</td>", escaped(name)));
    for value in values {
        put(out, format_args!("<td class=n>{}</td>", value.map_or("–".into(), number)));
    }
    out.push_str("</tr>");
}
