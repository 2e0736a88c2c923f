//! The page of a calibration: whole, legible, and needing nothing else.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta_model::space::FieldPoint;
use ftheta_model::warning::Warning;
use ftheta_report::calibration_report::{
    AxesFound, CalibrationReportInput, ErrorMap, ErrorSummary, ReportParameter, ReportPoint,
    calibration_report_html,
};

/// Points of a grid with barrel distortion before and a little after, one of them an outlier.
fn points(n_side: u32) -> Vec<ReportPoint> {
    let at = |index: u32| 280.0 * (f64::from(index) / f64::from(n_side - 1) - 0.5);
    let point = |index: u32| {
        let (x, y) = (at(index % n_side), at(index / n_side));
        let outlier = index == n_side + 1;
        let slip_mm = if outlier { 1.2 } else { 0.0 };
        let radius = (x * x + y * y) / (140.0 * 140.0);
        let left_mm = 0.004 * (f64::from(index * 7 % 5) - 2.0);
        ReportPoint {
            target_mm: FieldPoint::new(x, y),
            error_before_mm: [0.012 * x * radius + slip_mm, -0.02 * y * radius],
            error_after_mm: [left_mm + slip_mm, -0.5 * left_mm],
            outlier,
            line: index + 2,
        }
    };
    (0..n_side * n_side).map(point).collect()
}

fn page(points: &[ReportPoint], errors_um: &[f64]) -> String {
    let parameter = |name: &str, value, sigma, unit: &str| ReportParameter {
        name: name.into(),
        value,
        sigma,
        unit: unit.into(),
    };
    calibration_report_html(&CalibrationReportInput {
        machine: "S14-f420",
        model: "physical",
        why: "25 points bear the model of the head, and it leaves the least",
        points,
        before_um: ErrorSummary { rms: 2642.4, max: 5911.0 },
        after_um: ErrorSummary { rms: 7.31, max: 16.2 },
        expected_um: ErrorSummary { rms: 8.2, max: 19.4 },
        expected_map: ErrorMap { half_width_mm: 140.0, errors_um },
        axes: AxesFound { swapped: false, x_reversed: false, y_reversed: true },
        parameters: &[
            parameter("focal length", 419.2, Some(0.31), "mm"),
            parameter("gain of x", 1.0031, None, ""),
        ],
        advice: &["measure 81 points: 5 µm rms are to be expected".into()],
        warnings: &[Warning::new("m.csv:8", "does not fit the others <by 1.2 mm>")],
        pictures: &[],
    })
}

/// The text between the tags, a line for each run of it; what is in pictures is left out.
fn text(html: &str) -> String {
    let body = html.split_once("</head>").unwrap().1;
    let outside = body.split("<svg").map(|part| part.rsplit("</svg>").next().unwrap_or_default());
    let body = outside.collect::<String>();
    let runs = body.split('<').filter_map(|run| Some(run.split_once('>')?.1.trim()));
    let runs = runs.filter(|run| !run.is_empty()).map(|run| format!("| {run}"));
    runs.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_page_is_whole_and_needs_nothing_else() {
    let html = page(&points(5), &[4.0, 5.0, 6.5, 19.4]);
    for forbidden in ["<script", "http", "src=", "NaN", "<by"] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    // Arrows before and after, two maps with their colours.
    assert_eq!(html.matches("<svg").count(), 6);
    assert_eq!(html.matches("<svg").count(), html.matches("</svg>").count());
    // The outlier is ringed in three pictures.
    assert_eq!(html.matches("class=ring").count(), 3);
}

#[test]
fn the_page_says_what_was_found() {
    let html = page(&points(5), &[4.0, 5.0, 6.5, 19.4]);
    expect![[r#"
        | ftheta · calibration
        | Calibration of S14-f420
        | Machine
        | S14-f420
        | Model
        | physical
        | Points
        | 25
        | Axes
        | y reversed
        | Before, rms
        | 2642
        | µm
        | at most 5911 µm, at the points
        | After, rms
        | 7.31
        | µm
        | at most 16.2 µm, at the points
        | Expected, rms
        | 8.2
        | µm
        | at most 19.4 µm, in the field
        | Outliers
        | 1
        | of 25 points
        | Axes
        | changed
        | y reversed
        | 25 points bear the model of the head, and it leaves the least.
        | What to do next
        | measure 81 points: 5 µm rms are to be expected.
        | Errors before
        | Arrows lead from where a mark should be to where it is, 5 times as long as the error. Outliers are ringed, with their line of the file; their arrows may be cut short.
        | Errors after
        | Arrows lead from where a mark should be to where it is, 5000 times as long as the error. Outliers are ringed, with their line of the file; their arrows may be cut short.
        | What is left at the points
        | Length of the error that the table leaves; outliers are ringed.
        | What to expect elsewhere
        | Error to expect at each place, at most 19.4 µm. Without points near by it grows.
        | Outliers
        | Points that do not fit the others; they were left out. Measure them again, or look for a slip of the pen in these lines of the file.
        | Line
        | Target x, y, mm
        | Off the table in x, y, mm
        | 8
        | -70, -70
        | +1.200, +0.000
        | What was found of the head
        | With the standard deviation that the measured points leave. What is smaller than twice its deviation may as well be zero.
        | Parameter
        | Value
        | ±
        | Unit
        | focal length
        | 419.20
        | 0.31
        | mm
        | gain of x
        | 1.00310
        | Warnings
        | m.csv:8
        | does not fit the others &lt;by 1.2 mm&gt;
        | Made by ftheta. Errors are lengths over x and y; the errors after are those of the points that the table was made from, the expected ones those of any place."#]].assert_eq(&text(&html));
}

#[test]
fn pages_of_nothing_of_nonsense_and_of_very_much_are_still_pages() {
    let html = page(&[], &[]);
    assert!(html.ends_with("</html>\n") && !html.contains("class=ring"));
    let mut wrong = points(3);
    wrong[0].target_mm.x_mm = f64::NAN;
    wrong[1].error_after_mm = [f64::INFINITY, 0.0];
    let html = page(&wrong, &[f64::NAN, 1.0, 1.0, 1.0]);
    assert!(!html.contains("NaN") && !html.contains("inf"));
    let same = vec![ReportPoint { error_before_mm: [0.0; 2], ..points(3)[0] }; 4];
    let html = page(&same, &[1.0; 3]);
    assert!(html.contains("All errors are zero.") && !html.contains("NaN"));
    let html = page(&points(201), &[5.0; 101 * 101]);
    assert!(html.len() < 3_000_000, "{} bytes", html.len());
}
