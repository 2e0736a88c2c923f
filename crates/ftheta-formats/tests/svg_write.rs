//! A job written as SVG reads back as the same job.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_formats::{svg, svg_write};
use ftheta_model::job::Job;
use ftheta_model::recipe::Recipe;

fn read(text: &str) -> Job {
    svg::read(text.as_bytes(), &Recipe::default(), &svg::SvgOptions::default()).unwrap().value
}

#[test]
fn written_jobs_read_back() {
    let job = read(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="25mm" viewBox="0 0 400 250"
            xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">
            <g inkscape:groupmode="layer" inkscape:label="A &amp; &quot;B&quot;">
              <circle cx="100" cy="100" r="50" fill="none" stroke="#f00" stroke-width="0"/>
              <path fill-rule="evenodd" d="M10 10 C 20 0 40 0 50 10 Q 60 40 10 10 Z M20 12 h5 v5 z"/>
            </g><g id="second"><text x="50" y="200" font-size="40">Ok</text></g></svg>"##,
    );
    let again = read(&svg_write::to_svg(&job));
    assert_eq!(again.page_mm, job.page_mm);
    let names =
        |job: &Job| -> Vec<String> { job.layers.iter().map(|layer| layer.name.clone()).collect() };
    assert_eq!(names(&again), names(&job));
    assert_eq!(again.shapes().count(), job.shapes().count());
    for (found, wanted) in again.shapes().zip(job.shapes()) {
        assert_eq!((found.paint, found.pen_index), (wanted.paint, wanted.pen_index));
        let pairs = found.path.segments().zip(wanted.path.segments());
        for (a, b) in pairs {
            use kurbo::ParamCurve;
            assert!((a.start() - b.start()).hypot() < 1e-9 && (a.end() - b.end()).hypot() < 1e-9);
        }
    }
}
