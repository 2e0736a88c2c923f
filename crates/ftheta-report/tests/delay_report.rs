//! The page about delays: all of its numbers and pictures are there, and nothing gets in as HTML.

use ftheta_model::picture::PixelPoint;
use ftheta_model::warning::Warning;
use ftheta_report::delay_report::{DelayReportInput, SpeedRow, delay_report_html};
use ftheta_report::picture_view::{PictureView, Sight, SightKind};

const HOSTILE: &str = "<script>alert('x')</script>";

fn input() -> DelayReportInput<'static> {
    DelayReportInput {
        machine: HOSTILE,
        method: "comb",
        late_us: [(85.25, 0.05), (60.5, 0.06), (72.875, 0.03)],
        set_us: [-20.0, -15.0],
        settings_us: [-105.25, -75.5],
        patent_us: Some([90.75, 55.0]),
        speeds: &[],
        residuals: &[(1000.0, 1.5, true), (9000.0, -2.5, false), (9000.0, f64::NAN, false)],
        rms_um: Some(2.0),
        rejects: &[],
        n_ends: 40,
        facts: &[],
        views: &[],
        advice: &[],
        warnings: &[],
    }
}

#[test]
fn numbers_pictures_and_reasons_are_on_the_page() {
    let row = |speed_mm_s: f64| SpeedRow {
        speed_mm_s,
        off_um: [85.25e-3 * speed_mm_s, f64::NAN],
        fitted_um: [85.0e-3 * speed_mm_s, 60.0e-3 * speed_mm_s],
        width_um: 74.125,
        growth_um: f64::NAN,
    };
    let rejects: Vec<_> = (0..50)
        .map(|index| (format!("{HOSTILE}{index}"), "start", "there is no clear edge"))
        .collect();
    let place = PixelPoint::new(30.0, 40.0);
    let sight = |kind, places| Sight { kind, places, label: HOSTILE.into() };
    let sights = [
        sight(SightKind::Used, vec![place]),
        sight(SightKind::LeftOut, vec![place]),
        sight(
            SightKind::Extra,
            vec![place, PixelPoint::new(50.0, 40.0), PixelPoint::new(50.0, 60.0)],
        ),
        sight(SightKind::Used, vec![PixelPoint::new(500.0, 40.0)]),
    ];
    let region_px = [0.0, 0.0, 200.0, 100.0];
    let view = PictureView { jpeg: b"jpeg", region_px, sights: &sights, sign: 0.01 };
    let advice = [HOSTILE.to_owned()];
    let warnings = [Warning::new(HOSTILE, HOSTILE)];
    let speeds = [row(1000.0), row(9000.0)];
    let facts = [("Scale", "20.0 µm/px".to_owned())];
    let views = [(HOSTILE.to_owned(), view)];
    let page = delay_report_html(&DelayReportInput {
        speeds: &speeds,
        rejects: &rejects,
        views: &views,
        advice: &advice,
        warnings: &warnings,
        facts: &facts,
        ..input()
    });
    assert!(!page.contains("<script"), "nothing gets in");
    for text in [
        "85.25",
        "60.50",
        "-105.25",
        "90.75",
        "5.50 µs",
        "20.0 µm/px",
        "74.1",
        "and 10 more",
        "anBlZw==",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!page.contains("NaN") && !page.contains("inf"), "what is not known is a dash");
    // One cross, one ring, one figure; what lies beyond the part is not drawn.
    let n = |text: &str| page.matches(text).count();
    assert_eq!((n("<title>"), n("r='3.00'"), n("50.00 60.00Z")), (3 + 1, 1, 1));
}

#[test]
fn an_empty_page_is_one() {
    let page = delay_report_html(&input());
    assert!(page.starts_with("<!") && page.trim_end().ends_with("</html>"));
    assert!(!page.contains("NaN"));
}
