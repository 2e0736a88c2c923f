//! Delays from a picture in one HTML page: what was found where, the regression, what was left out.

use crate::calibration_report::{next, warnings};
use crate::cards::{Card, draw};
use crate::chart::AXIS_COLORS;
use crate::jump_report::header;
use crate::picture_view::{self, PictureView, SightKind};
use crate::scatter::{self, Cloud};
use crate::text::{escaped, number, put};
use ftheta_model::warning::Warning;

/// Most rows of what was left out.
const N_ROWS_MAX: usize = 40;

/// Everything the page shows, in plain numbers.
#[derive(Clone, Debug)]
pub struct DelayReportInput<'a> {
    /// Name of the machine.
    pub machine: &'a str,
    /// `comb` or `rectangle`.
    pub method: &'a str,
    /// Lateness of start, stop and their mean, µs, each with its deviation.
    pub late_us: [(f64, f64); 3],
    /// Settings during marking, and those to write, µs: on and off.
    pub set_us: [f64; 2],
    /// See there.
    pub settings_us: [f64; 2],
    /// Start and stop by the patent's formula, µs.
    pub patent_us: Option<[f64; 2]>,
    /// By speed, rising.
    pub speeds: &'a [SpeedRow],
    /// Speed, mm/s, what an end is off the regression, µm, and whether it is a start.
    pub residuals: &'a [(f64, f64, bool)],
    /// Deviation of the ends from the regression, µm rms, if there are enough of them.
    pub rms_um: Option<f64>,
    /// Line, end and reason of what was left out.
    pub rejects: &'a [(String, &'static str, &'static str)],
    /// Ends in all.
    pub n_ends: usize,
    /// What the picture is like: name and value.
    pub facts: &'a [(&'static str, String)],
    /// The picture, and enlarged parts of it with their captions.
    pub views: &'a [(String, PictureView<'a>)],
    /// What to do next, sentences without full stops, the most useful first.
    pub advice: &'a [String],
    /// What was noticed on the way.
    pub warnings: &'a [Warning],
}

/// Lines of one speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedRow {
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Mean place of starts and stops behind the nominal ones, µm; not finite if there are none.
    pub off_um: [f64; 2],
    /// The same as the regression has it.
    pub fitted_um: [f64; 2],
    /// Width of the lines, µm; not finite if it is not known.
    pub width_um: f64,
    /// Growth of the ends that was reckoned with, µm.
    pub growth_um: f64,
}

/// The page as one HTML document without scripts or references to anything outside it.
pub fn delay_report_html(input: &DelayReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 20);
    let title = format!("Delays of {}", input.machine);
    let mut settings = vec![
        ("Machine".to_owned(), input.machine.to_owned()),
        ("Method".into(), input.method.into()),
    ];
    settings.extend(input.facts.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    header(&mut out, "calibration", &title, &settings);
    cards(&mut out, input);
    next(&mut out, input.advice);
    pictures(&mut out, input.views);
    regression(&mut out, input);
    speeds(&mut out, input.speeds);
    patent(&mut out, input);
    rejects(&mut out, input);
    warnings(&mut out, input.warnings);
    out.push_str(
        "<footer>Made by ftheta. Delays are those that the picture shows: the laser's less the \
         mirrors' lag. Positive is late.</footer></body></html>\n",
    );
    out
}

fn cards(out: &mut String, input: &DelayReportInput<'_>) {
    let late = |name, (us, sd_us): (f64, f64), more: String| Card {
        name,
        value: format!("{us:.2} µs"),
        more: format!("± {sd_us:.2} µs{more}"),
        good: None,
    };
    let set = |index: usize| format!(", set {:.2} µs", input.settings_us[index]);
    let [on, off, mean] = input.late_us;
    let n_left_out = input.rejects.len();
    draw(
        out,
        [
            late("Light begins late by", on, set(0)),
            late("Light ends late by", off, set(1)),
            late("Mean of both", mean, String::new()),
            Card {
                name: "Off the regression",
                value: input.rms_um.map_or("–".into(), |rms| format!("{} µm", number(rms))),
                more: "rms of the line ends".into(),
                good: None,
            },
            Card {
                name: "Left out",
                value: n_left_out.to_string(),
                more: format!("of {} line ends", input.n_ends),
                good: Some(20 * n_left_out <= input.n_ends),
            },
        ],
    );
    let [on_us, off_us] = input.set_us;
    put(
        out,
        format_args!(
            "<p class=note style='margin-top:16px'>Marked with on {on_us:.2} µs and off \
             {off_us:.2} µs; later is positive.</p>"
        ),
    );
}

fn pictures(out: &mut String, views: &[(String, PictureView<'_>)]) {
    if views.is_empty() {
        return;
    }
    out.push_str("<section><h2>What was found in the picture</h2>");
    out.push_str(&picture_view::key([
        (SightKind::Used, "ends that were used"),
        (SightKind::LeftOut, "left out, point at it for the reason"),
        (SightKind::Extra, "not found: where it would be without delays"),
    ]));
    out.push_str("<div class=photos>");
    for (caption, view) in views {
        put(
            out,
            format_args!(
                "<figure>{}<figcaption class=note>{}</figcaption></figure>",
                picture_view::svg(view),
                escaped(caption)
            ),
        );
    }
    out.push_str("</div></section>");
}

fn regression(out: &mut String, input: &DelayReportInput<'_>) {
    if input.speeds.len() < 2 {
        return;
    }
    out.push_str(
        "<section><h2>Where lines begin and end, over speed</h2><p class=note>Behind the nominal \
         ends in the direction of marking, mean of lines both ways. The slope is the delay; what \
         is left at rest is the growth of the ends.</p>",
    );
    let cloud = |index: usize| Cloud {
        name: ["starts", "stops"][index],
        color: AXIS_COLORS[index],
        dots: input.speeds.iter().map(|row| (row.speed_mm_s * 1e-3, row.off_um[index])).collect(),
        line: input
            .speeds
            .iter()
            .map(|row| (row.speed_mm_s * 1e-3, row.fitted_um[index]))
            .filter(|(_, um)| um.is_finite())
            .collect(),
    };
    out.push_str(&scatter::svg(&[cloud(0), cloud(1)], ["speed, m/s", "behind nominal, µm"]));
    out.push_str(
        "</section><section><h2>What the regression leaves</h2><p class=note>Every line end, \
         starts to the left of its speed, stops to the right.</p>",
    );
    let cloud = |is_start: bool| Cloud {
        name: if is_start { "starts" } else { "stops" },
        color: AXIS_COLORS[usize::from(!is_start)],
        dots: input
            .residuals
            .iter()
            .filter(|(.., start)| *start == is_start)
            .map(|(speed, um, _)| (speed * 1e-3 + if is_start { -0.06 } else { 0.06 }, *um))
            .collect(),
        line: Vec::new(),
    };
    out.push_str(&scatter::svg(&[cloud(true), cloud(false)], ["speed, m/s", "off, µm"]));
    out.push_str("</section>");
}

fn speeds(out: &mut String, speeds: &[SpeedRow]) {
    if speeds.is_empty() {
        return;
    }
    out.push_str(
        "<section><h2>Lines by speed</h2><table><tr><th class=n>Speed, m/s<th class=n>Starts \
         behind, µm<th class=n>Stops behind, µm<th class=n>Width, µm<th class=n>Growth of an end, \
         µm</tr>",
    );
    for row in speeds {
        let um = |value: f64| if value.is_finite() { format!("{value:.1}") } else { "–".into() };
        put(
            out,
            format_args!(
                "<tr><td class=n>{}</td><td class=n>{}</td><td class=n>{}</td><td class=n>{}</td>\
                 <td class=n>{}</td></tr>",
                number(row.speed_mm_s * 1e-3),
                um(row.off_um[0]),
                um(row.off_um[1]),
                um(row.width_um),
                um(row.growth_um)
            ),
        );
    }
    out.push_str("</table></section>");
}

fn patent(out: &mut String, input: &DelayReportInput<'_>) {
    let Some([on_us, off_us]) = input.patent_us else { return };
    let bias_us = on_us - input.late_us[0].0;
    put(
        out,
        format_args!(
            "<section><h2>By the patent's formula</h2><p class=note>Measured from the outer edge \
             of a side to the visible end it would be on {on_us:.2} µs and off {off_us:.2} µs. \
             That is off by {bias_us:.2} µs, half a line's width less the growth of an end over \
             the speed, the other way round for off; it is taken out above.</p></section>"
        ),
    );
}

fn rejects(out: &mut String, input: &DelayReportInput<'_>) {
    if input.rejects.is_empty() {
        return;
    }
    out.push_str("<section><h2>Left out</h2><table><tr><th>Line<th>End<th>Because</tr>");
    for (id, end, why) in input.rejects.iter().take(N_ROWS_MAX) {
        put(
            out,
            format_args!(
                "<tr><td class=s>{}</td><td>{}</td><td>{}</td></tr>",
                escaped(id),
                escaped(end),
                escaped(why)
            ),
        );
    }
    out.push_str("</table>");
    if let Some(n_more @ 1..) = input.rejects.len().checked_sub(N_ROWS_MAX) {
        put(out, format_args!("<p class=note>and {n_more} more</p>"));
    }
    out.push_str("</section>");
}
