//! Jumps compared in one HTML page: times of all laws, and what the axis does under some.

mod curves;
mod route;
mod times;

pub use route::{RouteReportInput, route_report_html};

use crate::text::{escaped, number, put};
use ftheta_model::machine::Machine;

/// Everything the page shows.
#[derive(Clone, Debug)]
pub struct JumpReportInput<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Distance at which the mirror has arrived, rad.
    pub tolerance_rad: f64,
    /// Settings: what, and its value with unit.
    pub settings: &'a [(String, String)],
    /// The steps, in any order.
    pub steps: &'a [JumpStep],
}

/// One step.
#[derive(Clone, Debug)]
pub struct JumpStep {
    /// The step, rad mechanical.
    pub step_rad: f64,
    /// Shortest time with a stiff shaft, s.
    pub limit_rigid_s: f64,
    /// Shortest time to exact rest, s.
    pub limit_s: f64,
    /// All laws.
    pub laws: Vec<JumpLaw>,
}

/// One law on one step.
#[derive(Clone, Debug)]
pub struct JumpLaw {
    /// Its name.
    pub name: String,
    /// Its figures, or why there are none.
    pub figures: Result<JumpFigures, String>,
    /// What the axis did, for the laws whose curves are shown; else empty.
    pub samples: Vec<JumpSample>,
    /// The mirrors' places, rad, as x goes the step and y half of it, each planned by itself;
    /// empty where not shown.
    pub path_rad: Vec<(f64, f64)>,
}

/// Figures of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpFigures {
    /// Duration of the law, s.
    pub plan_s: f64,
    /// Until the mirror is there for good, s; `None` if never.
    pub total_s: Option<f64>,
    /// Speed with which the target is passed instead, rad/s.
    pub passing_rad_s: Option<f64>,
    /// Greatest voltage by the machine's limit.
    pub peak_voltage_ratio: f64,
    /// Greatest current by the machine's limit.
    pub peak_current_ratio: f64,
}

/// The axis at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpSample {
    /// Time, s.
    pub time_s: f64,
    /// The mirror's angle, rad.
    pub angle_rad: f64,
    /// The mirror's speed, rad/s.
    pub speed_rad_s: f64,
    /// The mirror's acceleration, rad/s².
    pub acceleration_rad_s2: f64,
    /// Coil voltage, V.
    pub voltage_v: f64,
    /// Coil current, A.
    pub current_a: f64,
    /// The mirror's distance from where it shall be at the end, rad.
    pub error_rad: f64,
}

/// A colour for each law, in the order of its first step.
const COLORS: [&str; 12] = [
    "#1d6fb8", "#d9541e", "#1f7a4d", "#8e44ad", "#b8860b", "#00838f", "#c2185b", "#6d4c41",
    "#5c6bc0", "#7cb342", "#546e7a", "#e57373",
];

/// The page as one HTML document without scripts or references to anything outside it.
pub fn jump_report_html(input: &JumpReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 20);
    let title = format!("Jumps of {}", input.machine.name);
    header(&mut out, "jumps", &title, input.settings);
    times::chart(&mut out, input);
    table(&mut out, input);
    for step in input.steps {
        curves::step(&mut out, input, step);
    }
    out.push_str(
        "<footer>Made by ftheta. Times are from the start until the mirror stays within the \
         tolerance, on the twin’s plant driven open loop.</footer></body></html>\n",
    );
    out
}

/// Everything up to the first section.
///
/// * `kind`: of page
pub(crate) fn header(out: &mut String, kind: &str, title: &str, settings: &[(String, String)]) {
    let title = escaped(title);
    put(
        out,
        format_args!(
            "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\
             <meta name=viewport content='width=device-width, initial-scale=1'>\
             <title>{title} – ftheta</title><style>{}</style></head><body>\
             <header><div class=brand>ftheta · {kind}</div><h1>{title}</h1>\
             <dl class=facts>",
            include_str!("report.css")
        ),
    );
    for (what, value) in settings {
        let (what, value) = (escaped(what), escaped(value));
        put(out, format_args!("<div><dt>{what}</dt><dd>{value}</dd></div>"));
    }
    out.push_str("</dl></header>");
}

/// All laws side by side: total time and its ratio to the limit.
fn table(out: &mut String, input: &JumpReportInput<'_>) {
    out.push_str(
        "<section><h2>Laws side by side</h2><p class=note>Time until the mirror is there for \
         good, µs, and its ratio to the shortest time to exact rest. Red: breaks a limit of the \
         machine.</p><table><tr><th>Law",
    );
    for step in input.steps {
        put(out, format_args!("<th class=n>{}°", number(step.step_rad.to_degrees())));
    }
    for (name, limit_s) in [
        ("limit, stiff shaft", (|step: &JumpStep| step.limit_rigid_s) as fn(&JumpStep) -> f64),
        ("limit", |step| step.limit_s),
    ] {
        put(out, format_args!("</tr><tr><td>{name}</td>"));
        for step in input.steps {
            put(out, format_args!("<td class=n>{:.1}</td>", 1e6 * limit_s(step)));
        }
    }
    let n_laws = input.steps.first().map_or(0, |step| step.laws.len());
    for index in 0..n_laws {
        let name = input.steps.first().map_or("", |step| step.laws[index].name.as_str());
        put(out, format_args!("</tr><tr><td>{}</td>", escaped(name)));
        for step in input.steps {
            let cell = step.laws.get(index).map_or_else(String::new, |law| cell(step, law));
            put(out, format_args!("<td class=n>{cell}</td>"));
        }
    }
    out.push_str("</tr></table></section>");
}

fn cell(step: &JumpStep, law: &JumpLaw) -> String {
    let Ok(figures) = &law.figures else { return "–".into() };
    let Some(total_s) = figures.total_s else {
        return figures.passing_rad_s.map_or("never".into(), |speed| {
            format!("{:.1}, passing at {} rad/s", 1e6 * figures.plan_s, number(speed))
        });
    };
    let text = format!("{:.1} · {:.2}", 1e6 * total_s, total_s / step.limit_s);
    if figures.peak_voltage_ratio.max(figures.peak_current_ratio) > 1.0 + 1e-3 {
        return format!("<span style='color:var(--bad)'>{text}</span>");
    }
    text
}
