//! A test pattern in one HTML page: planned, and its points played as they are.

use crate::jump_report::header;
use crate::text::{escaped, number, put, time};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// Everything the page shows.
#[derive(Clone, Debug)]
pub struct PatternReportInput<'a> {
    /// What the page is called.
    pub title: &'a str,
    /// Settings: what, and its value with unit.
    pub settings: &'a [(String, String)],
    /// The ways in which the pattern was made.
    pub ways: &'a [PatternWay],
}

/// One way in which the pattern was made.
#[derive(Clone, Debug)]
pub struct PatternWay {
    /// What it is.
    pub name: String,
    /// Time of one pattern, s.
    pub duration_s: f64,
    /// Distance of the lit beam from the pattern: greatest and root mean square, mm.
    pub error_mm: [f64; 2],
    /// Mean radius of the circle by its nominal one.
    pub circle_ratio: f64,
    /// What was marked, as a PNG.
    pub picture_png: Vec<u8>,
}

/// The page as one HTML document without scripts or references to anything outside it.
pub fn pattern_report_html(input: &PatternReportInput<'_>) -> String {
    let mut out = String::with_capacity(1 << 20);
    header(&mut out, "pattern", input.title, input.settings);
    out.push_str(
        "<section><h2>Side by side</h2><p class=note>Distance of the lit beam from the nearest \
         line of the pattern, and the circle’s radius by the one asked for.</p><table><tr><th>Way\
         <th class=n>Time<th class=n>Error max, µm<th class=n>rms, µm<th class=n>Circle</tr>",
    );
    for way in input.ways {
        put(
            &mut out,
            format_args!(
                "<tr><td>{}</td><td class=n>{}</td><td class=n>{}</td><td class=n>{}</td>\
                 <td class=n>{:.4}</td></tr>",
                escaped(&way.name),
                time(way.duration_s),
                number(1e3 * way.error_mm[0]),
                number(1e3 * way.error_mm[1]),
                way.circle_ratio
            ),
        );
    }
    out.push_str("</table></section>");
    for way in input.ways {
        let picture = BASE64_STANDARD.encode(&way.picture_png);
        put(
            &mut out,
            format_args!(
                "<section><h2>{name}</h2><figure class=plate><img alt='{name}' \
                 src='data:image/png;base64,{picture}'></figure></section>",
                name = escaped(&way.name)
            ),
        );
    }
    out.push_str("<footer>Made by ftheta, on the digital twin.</footer></body></html>\n");
    out
}
