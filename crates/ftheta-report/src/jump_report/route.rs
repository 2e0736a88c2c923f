//! Two axes between moving ends in one HTML page: their curves, and the path in the field.

use super::curves::quantities;
use super::{COLORS, JumpSample, header};
use crate::chart::Series;
use crate::plot::{Named, Plot};
use crate::text::put;
use ftheta_model::machine::Machine;

/// Everything the page shows.
#[derive(Clone, Debug)]
pub struct RouteReportInput<'a> {
    /// What it is about.
    pub title: &'a str,
    /// The machine.
    pub machine: &'a Machine,
    /// Settings: what, and its value with unit.
    pub settings: &'a [(String, String)],
    /// What x and y do.
    pub axes: [&'a [JumpSample]; 2],
    /// Where the beam goes meanwhile, field mm.
    pub path_mm: &'a [(f64, f64)],
}

/// The page as one HTML document without scripts or references to anything outside it.
pub fn route_report_html(input: &RouteReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 18);
    header(&mut out, "jumps", input.title, input.settings);
    out.push_str("<section><h2>Both axes over time</h2><div class=key>");
    for (name, color) in ["x", "y"].iter().zip(COLORS) {
        put(&mut out, format_args!("<span><i style='color:{color}'></i>{name}</span>"));
    }
    out.push_str("<span><i class=dash style='color:#b3261e'></i>limit of the machine</span></div>");
    let shown = [(input.axes[0], COLORS[0]), (input.axes[1], COLORS[1])];
    quantities(&mut out, input.machine, &shown);
    out.push_str("</section><section><h2>Path of the beam</h2>");
    let series = Series { points: input.path_mm.to_vec(), color: COLORS[0] };
    let lines = [Named { series, name: String::new(), dashed: false }];
    let labels = ["x, mm", "y, mm"];
    let plot = Plot { lines: &lines, labels, logarithmic: false, height: 420.0 };
    out.push_str(&plot.svg());
    out.push_str("</section><footer>Made by ftheta.</footer></body></html>\n");
    out
}
