//! A calibration in one HTML page: errors before and after, what is expected elsewhere, outliers,
//! what was found of the head, and what to do next.

mod arrows;
mod maps;

use crate::cards::{Card, draw};
use crate::jump_report::header;
use crate::picture_view::{self, PictureView, SightKind};
use crate::text::{escaped, number, put};
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::Warning;

/// Most rows of outliers and of warnings.
const N_ROWS_MAX: usize = 30;

/// Everything the page shows, in plain numbers.
#[derive(Clone, Debug)]
pub struct CalibrationReportInput<'a> {
    /// Name of the machine.
    pub machine: &'a str,
    /// Name of the model.
    pub model: &'a str,
    /// Why this model, a sentence without a full stop.
    pub why: &'a str,
    /// The measured points, in the order of the file.
    pub points: &'a [ReportPoint],
    /// Errors of the points without a correction, outliers not counted, µm.
    pub before_um: ErrorSummary,
    /// The same with the correction.
    pub after_um: ErrorSummary,
    /// Errors to expect in the whole field, µm.
    pub expected_um: ErrorSummary,
    /// Where in the field to expect which error.
    pub expected_map: ErrorMap<'a>,
    /// What was found of the axes.
    pub axes: AxesFound,
    /// What was found of the head.
    pub parameters: &'a [ReportParameter],
    /// What to do next, sentences without full stops, the most useful first.
    pub advice: &'a [String],
    /// What was noticed on the way.
    pub warnings: &'a [Warning],
    /// Pictures that the points were measured in, with captions.
    pub pictures: &'a [(String, PictureView<'a>)],
}

/// A measured point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportPoint {
    /// Where the mark should be, mm.
    pub target_mm: FieldPoint,
    /// Measured less target, in x and y, without a correction, mm.
    pub error_before_mm: [f64; 2],
    /// What the correction leaves of it, mm.
    pub error_after_mm: [f64; 2],
    /// Whether it was left out as an outlier.
    pub outlier: bool,
    /// Line of the file of points, from 1.
    pub line: u32,
}

/// Root mean square and greatest of errors' lengths, µm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Root mean square, µm.
    pub rms: f64,
    /// The greatest, µm.
    pub max: f64,
}

/// Errors on an even square grid about the field's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorMap<'a> {
    /// From the centre to the border of the outermost cells, mm.
    pub half_width_mm: f64,
    /// Errors in the middle of n × n cells, µm: rows of rising y, in each row x rising.
    pub errors_um: &'a [f64],
}

/// How the axes were connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxesFound {
    /// The command for x moves y and the other way round.
    pub swapped: bool,
    /// x goes the wrong way.
    pub x_reversed: bool,
    /// y goes the wrong way.
    pub y_reversed: bool,
}

/// Something that was found of the head.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportParameter {
    /// What it is.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; `None` where there is none.
    pub sigma: Option<f64>,
    /// Its unit.
    pub unit: String,
}

impl ReportPoint {
    /// Whether all its numbers are finite.
    fn is_finite(&self) -> bool {
        let FieldPoint { x_mm, y_mm } = self.target_mm;
        let errors = self.error_before_mm.iter().chain(&self.error_after_mm);
        [x_mm, y_mm].iter().chain(errors).all(|value| value.is_finite())
    }
}

impl AxesFound {
    /// What was found, for people.
    pub fn sentence(&self) -> String {
        let reversed = match (self.x_reversed, self.y_reversed) {
            (true, true) => "x and y reversed",
            (true, false) => "x reversed",
            (false, true) => "y reversed",
            (false, false) => "",
        };
        match (self.swapped, reversed) {
            (false, "") => "as they should be".into(),
            (true, "") => "swapped".into(),
            (false, reversed) => reversed.into(),
            (true, reversed) => format!("swapped, {reversed}"),
        }
    }
}

/// The page as one HTML document without scripts or references to anything outside it.
pub fn calibration_report_html(input: &CalibrationReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 18);
    let title = format!("Calibration of {}", input.machine);
    let n_rows = input.points.len();
    let settings = [
        ("Machine".to_owned(), input.machine.to_owned()),
        ("Model".into(), input.model.into()),
        ("Points".into(), n_rows.to_string()),
        ("Axes".into(), input.axes.sentence()),
    ];
    header(&mut out, "calibration", &title, &settings);
    cards(&mut out, input);
    put(
        &mut out,
        format_args!("<p class=note style='margin-top:16px'>{}.</p>", escaped(input.why)),
    );
    next(&mut out, input.advice);
    pictures(&mut out, input.pictures);
    arrows::before_and_after(&mut out, input);
    maps::residual_and_expected(&mut out, input);
    outliers(&mut out, input.points);
    parameters(&mut out, input.parameters);
    warnings(&mut out, input.warnings);
    out.push_str(
        "<footer>Made by ftheta. Errors are lengths over x and y; the errors after are those of \
         the points that the table was made from, the expected ones those of any place.</footer>\
         </body></html>\n",
    );
    out
}

fn cards(out: &mut String, input: &CalibrationReportInput<'_>) {
    let errors = |name, errors: ErrorSummary, what: &str| Card {
        name,
        value: format!("{} µm", number(errors.rms)),
        more: format!("at most {} µm, {what}", number(errors.max)),
        good: None,
    };
    let n_outliers = input.points.iter().filter(|point| point.outlier).count();
    let axes = input.axes.sentence();
    draw(
        out,
        [
            errors("Before, rms", input.before_um, "at the points"),
            errors("After, rms", input.after_um, "at the points"),
            errors("Expected, rms", input.expected_um, "in the field"),
            Card {
                name: "Outliers",
                value: n_outliers.to_string(),
                more: format!("of {} points", input.points.len()),
                good: Some(n_outliers == 0),
            },
            Card {
                name: "Axes",
                value: if input.axes == AxesFound::default() { "right" } else { "changed" }.into(),
                more: axes,
                good: None,
            },
        ],
    );
}

/// What to do next, as a list.
pub(crate) fn next(out: &mut String, advice: &[String]) {
    if advice.is_empty() {
        return;
    }
    out.push_str("<section><h2>What to do next</h2><ol>");
    for sentence in advice {
        put(out, format_args!("<li>{}.</li>", escaped(sentence)));
    }
    out.push_str("</ol></section>");
}

fn pictures(out: &mut String, pictures: &[(String, PictureView<'_>)]) {
    if pictures.is_empty() {
        return;
    }
    out.push_str("<section><h2>What was found in the picture</h2>");
    out.push_str(&picture_view::key([
        (SightKind::Used, "marks and signs that were used"),
        (SightKind::LeftOut, "left out or not found"),
        (SightKind::Extra, "looks like a mark and is none of the grid"),
    ]));
    for (caption, view) in pictures {
        put(
            out,
            format_args!(
                "<figure>{}<figcaption class=note>{}</figcaption></figure>",
                picture_view::svg(view),
                escaped(caption)
            ),
        );
    }
    out.push_str("</section>");
}

fn outliers(out: &mut String, points: &[ReportPoint]) {
    let outliers: Vec<&ReportPoint> = points.iter().filter(|point| point.outlier).collect();
    if outliers.is_empty() {
        return;
    }
    out.push_str(
        "<section><h2>Outliers</h2><p class=note>Points that do not fit the others; they were left \
         out. Measure them again, or look for a slip of the pen in these lines of the file.</p>\
         <table><tr><th class=n>Line<th class=n>Target x, y, mm<th class=n>Off the table in x, y, \
         mm</tr>",
    );
    for point in outliers.iter().take(N_ROWS_MAX) {
        let FieldPoint { x_mm, y_mm } = point.target_mm;
        // A zero from below has a sign that means nothing.
        let [x, y] = point.error_after_mm.map(|error_mm| error_mm + 0.0);
        put(
            out,
            format_args!(
                "<tr><td class=n>{}</td><td class=n>{}, {}</td><td class=n>{x:+.3}, {y:+.3}</td>\
                 </tr>",
                point.line,
                number(x_mm),
                number(y_mm)
            ),
        );
    }
    out.push_str("</table>");
    if let Some(n_more @ 1..) = outliers.len().checked_sub(N_ROWS_MAX) {
        put(out, format_args!("<p class=note>and {n_more} more</p>"));
    }
    out.push_str("</section>");
}

fn parameters(out: &mut String, parameters: &[ReportParameter]) {
    if parameters.is_empty() {
        return;
    }
    out.push_str(
        "<section><h2>What was found of the head</h2><p class=note>With the standard deviation \
         that the measured points leave. What is smaller than twice its deviation may as well be \
         zero.</p><table><tr><th>Parameter<th class=n>Value<th class=n>±<th>Unit</tr>",
    );
    for ReportParameter { name, value, sigma, unit } in parameters {
        put(
            out,
            format_args!(
                "<tr><td>{}</td><td class=n>{}</td><td class=n>{}</td><td>{}</td></tr>",
                escaped(name),
                value_text(*value, *sigma),
                sigma.map_or_else(String::new, |sigma| value_text(sigma, Some(sigma))),
                escaped(unit)
            ),
        );
    }
    out.push_str("</table></section>");
}

/// A value with as many decimals as its deviation needs for two digits, or else six digits.
fn value_text(value: f64, sigma: Option<f64>) -> String {
    let known = sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0);
    let finest = known.unwrap_or_else(|| value.abs().max(1e-9) * 1e-4);
    let n_decimals = (1.0 - finest.log10().floor()).clamp(0.0, 12.0) as usize;
    if value.is_finite() { format!("{value:.n_decimals$}") } else { "–".into() }
}

/// What was noticed, as a list.
pub(crate) fn warnings(out: &mut String, warnings: &[Warning]) {
    if warnings.is_empty() {
        return;
    }
    out.push_str("<section><h2>Warnings</h2><ul class=warnings>");
    for Warning { place, message } in warnings.iter().take(N_ROWS_MAX) {
        put(out, format_args!("<li><b>{}</b> {}</li>", escaped(place), escaped(message)));
    }
    if let Some(n_more @ 1..) = warnings.len().checked_sub(N_ROWS_MAX) {
        put(out, format_args!("<li>and {n_more} more</li>"));
    }
    out.push_str("</ul></section>");
}
