//! The report: one HTML page that needs nothing else, for the screen and for A4.

use crate::axes_view::curves;
use crate::bars::{dose_svg, limits_svg, split_html};
use crate::cards::cards;
use crate::comparison::{Rival, comparison};
use crate::field_view::{error_legend_svg, errors_svg, marks_svg, pens_html};
use crate::light_view::light;
use crate::score::Score;
use crate::text::{escaped, number, put};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use ftheta_model::plan::PlanDraft;
use ftheta_model::trace::AxisStates;
use ftheta_model::warning::Warning;
use ftheta_physics::audit::Limits;

/// Largest picture that is put into the page, bytes; keeps the page below some 3 MB.
const PICTURE_MAX: usize = 1_400_000;
/// Most rows of warnings and of worst marks.
const N_ROWS_MAX: usize = 10;
/// Everything the report shows.
#[derive(Clone, Debug)]
pub struct ReportInput<'a> {
    /// The job's name, for the title; any text.
    pub job_name: &'a str,
    /// The plan that was played.
    pub plan: &'a PlanDraft,
    /// Its id, as text.
    pub plan_id: &'a str,
    /// The twin's seed.
    pub seed: u64,
    /// Peaks over the machine's limits, from the audit.
    pub peaks: &'a Limits,
    /// Figures of the marked field.
    pub score: &'a Score,
    /// What the axes did, in order of time; thinned by the twin or not.
    pub states: &'a [AxisStates],
    /// What the time went into.
    pub times: TimeSplit,
    /// Laser, delays and other settings: what, and its value with unit.
    pub settings: &'a [(String, String)],
    /// The same job planned in other ways, if it was; shown beside this one.
    pub against: &'a [Rival<'a>],
    /// What was ignored or changed on the way.
    pub warnings: &'a [Warning],
    /// The plate picture as PNG, best 1 200 pixels; left out where empty or above 1.4 MB.
    pub plate_png: &'a [u8],
}

/// What a plan's time goes into, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimeSplit {
    /// Moving along marks.
    pub mark_s: f64,
    /// Jumping.
    pub jump_s: f64,
    /// Standing still in delays.
    pub delay_s: f64,
}

/// The report as one HTML document without scripts or references to anything outside it.
///
/// Drawings and curves are thinned, so that the size stays below some 3 MB for any job.
pub fn report_html(input: &ReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 20);
    let title = escaped(input.job_name);
    put(
        &mut out,
        format_args!(
            "<!doctype html>\n<html lang=en><head><meta charset=utf-8>\
             <meta name=viewport content='width=device-width, initial-scale=1'>\
             <title>{title} – ftheta</title><style>{}</style></head><body>",
            include_str!("report.css")
        ),
    );
    header(&mut out, input, &title);
    cards(&mut out, input);
    plate(&mut out, input);
    fields(&mut out, input);
    distributions(&mut out, input);
    light(&mut out, input.plan, input.states);
    curves(&mut out, input.plan, input.states);
    comparison(&mut out, input);
    tables(&mut out, input);
    warnings(&mut out, input.warnings);
    out.push_str(
        "<footer>Made by ftheta. Errors are those of the beam centre against the exact curves of \
         the plan, on the twin of the machine.</footer></body></html>\n",
    );
    out
}

fn header(out: &mut String, input: &ReportInput<'_>, title: &str) {
    let plan = input.plan;
    let planner = plan.planner.name().to_owned();
    let tolerance = format!("{} µm", number(1e3 * plan.tolerance_mm));
    let facts = [
        ("Machine", escaped(&plan.machine.name)),
        ("Planner", planner),
        ("Plan", format!("<code>{}</code>", escaped(input.plan_id))),
        ("Seed", input.seed.to_string()),
        ("Tolerance", tolerance),
        ("Marks", plan.marks.len().to_string()),
    ];
    put(
        out,
        format_args!(
            "<header><div class=brand>ftheta · marking report</div><h1>{title}</h1>\
             <dl class=facts>"
        ),
    );
    for (name, value) in facts {
        put(out, format_args!("<div><dt>{name}</dt><dd>{value}</dd></div>"));
    }
    out.push_str("</dl></header>");
}

fn plate(out: &mut String, input: &ReportInput<'_>) {
    if input.plate_png.is_empty() || input.plate_png.len() > PICTURE_MAX {
        return;
    }
    let picture = BASE64_STANDARD.encode(input.plate_png);
    put(
        out,
        format_args!(
            "<figure class=plate><img alt='The marked plate' \
             src='data:image/png;base64,{picture}'></figure>"
        ),
    );
}

fn fields(out: &mut String, input: &ReportInput<'_>) {
    put(
        out,
        format_args!(
            "<div class=pair><section><h2>Marks and jumps</h2><p class=note>As planned; marks in \
             the colour of their pen, jumps dashed.</p>{}{}</section>\
             <section><h2>Contour error</h2><p class=note>Distance of the lit beam from its \
             curve; the worst place is ringed.</p>{}{}</section></div>",
            marks_svg(input.plan),
            pens_html(input.plan),
            errors_svg(input.plan, input.score),
            error_legend_svg(input.score)
        ),
    );
}

fn distributions(out: &mut String, input: &ReportInput<'_>) {
    put(
        out,
        format_args!(
            "<section><h2>Where the time goes</h2>{}</section><div class=pair>\
             <section><h2>Limits used</h2><p class=note>Highest value in the whole plan as a \
             share of the machine’s limit.</p>{}</section>\
             <section><h2>Dose along the marks</h2><p class=note>Line energy over what the pen \
             asks for, in a window of one spot; share of all places.</p>{}</section></div>",
            split_html(input.times),
            limits_svg(input.peaks),
            dose_svg(input.score)
        ),
    );
}

fn tables(out: &mut String, input: &ReportInput<'_>) {
    out.push_str("<div class=pair><section><h2>Settings</h2><table>");
    for (name, value) in input.settings {
        put(
            out,
            format_args!("<tr><td>{}</td><td class=n>{}</td></tr>", escaped(name), escaped(value)),
        );
    }
    out.push_str(
        "</table></section><section><h2>Marks with the largest errors</h2><table>\
         <tr><th>Element<th class=n>Mark<th class=n>At x, y in mm<th class=n>Error, µm</tr>",
    );
    for worst in input.score.worst_marks.iter().take(N_ROWS_MAX) {
        let mark = input.plan.marks.get(worst.mark_index);
        put(
            out,
            format_args!(
                "<tr><td class=s>{}</td><td class=n>{}</td><td class=n>{:.3}, {:.3}</td>\
                 <td class=n>{}</td></tr>",
                mark.map_or(String::new(), |mark| escaped(&mark.source)),
                worst.mark_index,
                worst.x_mm,
                worst.y_mm,
                number(worst.error_um)
            ),
        );
    }
    out.push_str("</table></section></div>");
    let score = input.score;
    put(
        out,
        format_args!(
            "<p class=note style='margin-top:14px'>Ends too long or too short: {} µm at most, \
             {} µm in 99 %. Energy off the marks: {} % of {} J. Marks without light: {}.</p>",
            number(score.end_error_um.max),
            number(score.end_error_um.p99),
            number(100.0 * score.stray_energy_ratio),
            number(score.energy_j),
            score.n_unlit_marks
        ),
    );
}

fn warnings(out: &mut String, warnings: &[Warning]) {
    if warnings.is_empty() {
        return;
    }
    out.push_str("<section><h2>Warnings</h2><ul class=warnings>");
    for warning in warnings.iter().take(N_ROWS_MAX) {
        put(
            out,
            format_args!(
                "<li><b>{}</b> {}</li>",
                escaped(&warning.place),
                escaped(&warning.message)
            ),
        );
    }
    if warnings.len() > N_ROWS_MAX {
        put(out, format_args!("<li>and {} more</li>", warnings.len() - N_ROWS_MAX));
    }
    out.push_str("</ul></section>");
}
