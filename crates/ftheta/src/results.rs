//! The files of a marked job: report, picture, plan.

use crate::Error;
use crate::mark::Marked;
use crate::output::Output;
use ftheta_model::recipe::Interpolation;
use ftheta_model::warning::Warning;
use ftheta_report::plate::{PlateOptions, plate_png};
use ftheta_report::report::{ReportInput, TimeSplit, report_html};

/// What the report says of a job beside its figures.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// Name of the job.
    pub job_name: &'a str,
    /// Size of the page, mm.
    pub page_mm: [f64; 2],
    /// What was ignored or changed.
    pub warnings: &'a [Warning],
}

/// Pixels along the longest side of the picture, which the report shows as well.
const PICTURE_PX: u32 = 1800;

/// Adds the files of a marked job; returns kind and path of each.
///
/// # Errors
/// If a file cannot be written.
pub fn add(
    output: &mut Output,
    marked: &Marked,
    about: &About<'_>,
) -> Result<Vec<(&'static str, String)>, Error> {
    let page_mm = Some(about.page_mm);
    let options = PlateOptions { page_mm, longest_side_px: PICTURE_PX };
    let picture = plate_png(&marked.dose, &options);
    let report = report(marked, about, &picture);
    output.add_plan("plan.ftheta", &marked.plan)?;
    output.add("mark.png", |out| out.write_all(&picture))?;
    output.add("report.html", |out| out.write_all(report.as_bytes()))?;
    Ok([("report", "report.html"), ("image", "mark.png"), ("plan", "plan.ftheta")]
        .map(|(kind, name)| (kind, output.path(name).display().to_string()))
        .into())
}

fn report(marked: &Marked, about: &About<'_>, plate_png: &[u8]) -> String {
    let times = &marked.times;
    report_html(&ReportInput {
        job_name: about.job_name,
        plan: &marked.plan,
        plan_id: &marked.plan.id().to_string(),
        seed: marked.seed,
        peaks: marked.plan.limits(),
        score: &marked.score,
        states: &marked.states,
        times: TimeSplit {
            mark_s: times.mark_s,
            jump_s: times.jump_s - times.delay_s,
            delay_s: times.delay_s,
        },
        settings: &settings_rows(marked),
        warnings: about.warnings,
        plate_png,
    })
}

fn settings_rows(marked: &Marked) -> Vec<(String, String)> {
    let settings = &marked.settings;
    let machine = &marked.plan.machine;
    let laser = &machine.laser;
    let us = |time_s: f64| format!("{:.0} µs", time_s * 1e6);
    let ns = |time_ns: i64| format!("{:.2} µs", time_ns as f64 * 1e-3);
    let interpolation = match settings.interpolation {
        Interpolation::Absolute => "absolute",
        Interpolation::Dda => "DDA",
    };
    let mut rows = vec![
        ("Wavelength", format!("{} nm", laser.wavelength_nm)),
        ("Spot diameter", format!("{:.0} µm", laser.spot_diameter_mm * 1e3)),
        ("Light after on edge", ns(laser.on_latency_ns)),
        ("Light after off edge", ns(laser.off_latency_ns)),
        ("Output period", format!("{} µs", f64::from(machine.output.period_ns) * 1e-3)),
        ("Output word", format!("{} bit", machine.output.word_bits)),
        ("Jump speed", format!("{} mm/s", settings.jump_speed_mm_s)),
        (
            "Jump delay",
            format!(
                "{:.0} to {:.0} µs over {} mm",
                settings.jump_delay_min_s * 1e6,
                settings.jump_delay_s * 1e6,
                settings.jump_length_limit_mm
            ),
        ),
        ("Mark delay", us(settings.mark_delay_s)),
        ("Polygon delay at 90°", us(settings.polygon_delay_s)),
        ("Laser-on delay", ns(settings.laser_on_delay_ns)),
        ("Laser-off delay", ns(settings.laser_off_delay_ns)),
        ("Interpolation", interpolation.into()),
    ];
    if let Some(pulse_khz) = laser.pulse_khz {
        rows.insert(1, ("Pulse rate", format!("{pulse_khz} kHz")));
    }
    rows.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}
