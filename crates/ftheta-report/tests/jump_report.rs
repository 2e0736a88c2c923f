//! The page that compares jumps: whole, legible, and needing nothing else.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_report::jump_report::{
    JumpFigures, JumpLaw, JumpReportInput, JumpSample, JumpStep, jump_report_html,
};

mod machine;

fn law(name: &str, total_s: Option<f64>, curved: bool) -> JumpLaw {
    let sample = |i: u32| {
        let time_s = 1e-6 * f64::from(i);
        let sample = JumpSample {
            time_s,
            angle_rad: 1e-3 * (1.0 - (-time_s / 5e-5).exp()),
            speed_rad_s: 20.0 * (-time_s / 5e-5).exp(),
            acceleration_rad_s2: 1e5,
            voltage_v: 12.0,
            current_a: 3.0,
            error_rad: -1e-3 * (-time_s / 5e-5).exp(),
        };
        (sample, (sample.angle_rad, 0.5 * sample.angle_rad))
    };
    let n = if curved { 400 } else { 0 };
    let (samples, path_rad) = (0..n).map(sample).unzip();
    let figures = JumpFigures {
        plan_s: 2e-4,
        total_s,
        passing_rad_s: None,
        peak_voltage_ratio: 1.0,
        peak_current_ratio: if name == "b&<" { 1.2 } else { 0.5 },
    };
    JumpLaw { name: name.into(), figures: Ok(figures), samples, path_rad }
}

fn step(step_deg: f64, refused: bool) -> JumpStep {
    let mut laws = vec![law("optimal", Some(3e-4), true), law("b&<", Some(4e-4), true)];
    laws.push(law("trapezoid", None, false));
    if refused {
        laws[2].figures = Err("from rest to rest only".into());
    }
    let step_rad = step_deg.to_radians();
    JumpStep { step_rad, limit_rigid_s: 2e-4, limit_s: 2.9e-4, laws }
}

fn page(steps: &[JumpStep]) -> String {
    let machine = machine::machine();
    let settings = [("Period".to_owned(), "10 µs".to_owned())];
    jump_report_html(&JumpReportInput {
        machine: &machine,
        tolerance_rad: 3e-5,
        settings: &settings,
        steps,
    })
}

#[test]
fn page_is_whole_and_needs_nothing_else() {
    let html = page(&[step(1.0, false), step(-0.1, true)]);
    for forbidden in ["<script", "http", "src=", "NaN", "b&<"] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    // Times, and five quantities, arrival and path for each step.
    assert_eq!(html.matches("<svg").count(), 1 + 2 * 7);
    assert_eq!(html.matches("<svg").count(), html.matches("</svg>").count());
    for part in
        ["300.0 · 1.03", "never", "position, °", "error, µrad", "b&amp;&lt;", "sharing the time"]
    {
        assert!(html.contains(part), "{part}");
    }
    // Breaking a limit of the machine shows.
    assert!(html.contains("var(--bad)'>400.0 · 1.38"));
}

#[test]
fn a_page_without_steps_or_times_is_still_one() {
    assert!(page(&[]).ends_with("</html>\n"));
    let mut only = step(1.0, true);
    only.laws.truncate(0);
    assert!(!page(&[only]).contains("NaN"));
}
