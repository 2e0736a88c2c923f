//! The files of a marked job: report, picture, plan.

use crate::Error;
use crate::against::{Against, WAYS};
use crate::focus_report::spot_growth;
use crate::mark::{MarkOptions, Marked};
use crate::output::Output;
use crate::promise::Promise;
use ftheta_model::machine::Drive;
use ftheta_model::plan::Planner;
use ftheta_model::recipe::Interpolation;
use ftheta_model::warning::Warning;
use ftheta_planner::classic::Settings;
use ftheta_planner::optimal::{NEAR_MM, is_servo_known, near_scanner};
use ftheta_report::comparison::Rival;
use ftheta_report::plate::{PlateOptions, plate_png};
use ftheta_report::report::{ReportInput, TimeSplit, report_html};

/// What the report says of a job beside its figures.
#[derive(Clone, Copy)]
pub struct About<'a> {
    /// Name of the job.
    pub job_name: &'a str,
    /// How it was marked.
    pub options: &'a MarkOptions,
    /// Whether it may have corners.
    pub has_corners: bool,
    /// Size of the page, mm.
    pub page_mm: [f64; 2],
    /// What the job was compared with.
    pub against: Option<&'a Against>,
    /// What was ignored or changed.
    pub warnings: &'a [Warning],
}

/// Of a setting that plays no part.
pub const NONE: &str = "–";

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
    let against = about.against.map(rivals).unwrap_or_default();
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
        settings: &settings_rows(marked, about),
        against: &against,
        warnings: about.warnings,
        plate_png,
    })
}

fn rivals(against: &Against) -> Vec<Rival<'_>> {
    let columns = WAYS.iter().zip(&against.columns);
    let rivals = columns.map(|(way, column)| Rival {
        name: way.name,
        score: column.as_ref().map(|column| &column.score),
        settings: column.as_ref().map(|column| delay_rows(&column.settings)).unwrap_or_default(),
    });
    rivals.collect()
}

fn settings_rows(marked: &Marked, about: &About<'_>) -> Vec<(String, String)> {
    let machine = &marked.plan.machine;
    let laser = &machine.laser;
    let mut rows = vec![
        ("Wavelength", format!("{} nm", laser.wavelength_nm)),
        ("Spot diameter", format!("{:.0} µm", laser.spot_diameter_mm * 1e3)),
        ("Light after on edge", time(laser.on_latency_ns as f64 * 1e-9)),
        ("Light after off edge", time(laser.off_latency_ns as f64 * 1e-9)),
        ("Output period", format!("{} µs", f64::from(machine.output.period_ns) * 1e-3)),
        ("Output word", format!("{} bit", machine.output.word_bits)),
    ];
    if let Some(pulse_khz) = laser.pulse_khz {
        let way = if laser.pulses_triggered { "one for each trigger" } else { "free" };
        rows.insert(1, ("Pulses", format!("{pulse_khz} kHz, {way}")));
    }
    if let Some(table) = &about.options.table {
        let (n, about) = (table.planes()[0].angles.n_nodes(), table.about());
        let text = format!("{}, {n} × {n}, {} round(s)", about.model, about.n_rounds);
        rows.push(("Correction table", text));
    }
    if about.options.head.is_some() {
        rows.push(("Head of the twin", "with mounting errors".into()));
    }
    if machine.optics.plane_mm != 0.0 {
        let text = format!("{} mm above the nominal one", machine.optics.plane_mm);
        rows.push(("Work plane", text));
    }
    if let Some(focus) = marked.score.focus_error_um {
        let growth = 100.0 * spot_growth(machine, 1e-3 * focus.max);
        let text = format!("off by {:.3} mm at most, spot +{growth:.1} %", 1e-3 * focus.max);
        rows.push(("Focus on the twin", text));
    }
    let rows = rows.into_iter().map(|(key, value)| (key.to_owned(), value));
    let planned = match marked.plan.planner {
        Planner::Classic => delay_rows(&marked.settings),
        Planner::Optimal => planned_rows(marked, about),
    };
    rows.chain(planned.into_iter().filter(|(_, value)| value != NONE)).collect()
}

/// What planned motion was planned with, and what it promises.
fn planned_rows(marked: &Marked, about: &About<'_>) -> Vec<(String, String)> {
    let options = about.options;
    let machine = &marked.plan.machine;
    let known = is_servo_known(machine);
    let (f1, kt) = (machine.scanner.f1_uncertainty, machine.scanner.kt_uncertainty);
    let near = near_scanner(&machine.scanner).kt_uncertainty;
    let f1 = format!("f1 ±{} %", f1 * 100.0);
    let [kt, kt_near] = [kt, near].map(|part| format!("Kt ±{} %", part * 100.0));
    let sent = match machine.output.drive {
        Drive::Voltage => "voltage and state",
        _ if known => "words, inverse of the servo",
        _ => "words ahead by the lag",
    };
    let transitions = match known {
        true => format!("held by the servo, {f1}, {kt} ({kt_near} up to {NEAR_MM} mm)"),
        false => "smooth angles".into(),
    };
    let promised = |what: &str, error: fn(&Promise) -> f64| {
        let value = marked.promise.map(|promise| format!("{:.1} µm", error(&promise) * 1e3));
        (format!("Promise, {what}"), value.unwrap_or(NONE.into()))
    };
    let reserve = format!("{} %", options.reserve * 100.0);
    vec![
        ("Corners".into(), if about.has_corners { options.corner.name() } else { NONE }.into()),
        ("Drive".into(), sent.into()),
        ("Transitions".into(), transitions),
        ("Voltage reserve".into(), if known { reserve } else { NONE.into() }),
        promised("nominal", |promise| promise.planned_mm),
        promised(&f1, |promise| promise.f1_mm),
        promised(&kt, |promise| promise.kt_mm),
        promised(&kt_near, |promise| promise.kt_near_mm),
    ]
}

/// The settings of a classic controller, for people; what plays no part is a dash.
pub fn delay_rows(settings: &Settings) -> Vec<(String, String)> {
    let interpolation = match settings.interpolation {
        Interpolation::Absolute => "absolute",
        Interpolation::Dda => "DDA",
    };
    let (short_s, long_s) = (settings.jump_delay_min_s, settings.jump_delay_s);
    let jump_delay = match short_s == long_s {
        true => time(long_s),
        false => {
            let limit_mm = settings.jump_length_limit_mm;
            format!("{} to {} over {limit_mm} mm", time(short_s), time(long_s))
        }
    };
    let sky = settings.skywriting();
    let only = |plays: bool, time_s: f64| if plays { time(time_s) } else { NONE.into() };
    [
        ("Jump speed", format!("{} mm/s", settings.jump_speed_mm_s)),
        ("Jump delay", jump_delay),
        ("Mark delay", only(!sky, settings.mark_delay_s)),
        ("Polygon delay at 90°", time(settings.polygon_delay_s)),
        ("Laser-on delay", time(settings.laser_on_delay_ns as f64 * 1e-9)),
        ("Laser-off delay", time(settings.laser_off_delay_ns as f64 * 1e-9)),
        ("Run-in", only(sky, settings.sky_run_in_s)),
        ("Run-out", only(sky, settings.sky_run_out_s)),
        ("Interpolation", interpolation.into()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}

/// A time in µs, hundredths where there are any.
fn time(time_s: f64) -> String {
    let text = format!("{:.2}", time_s * 1e6);
    format!("{} µs", text.trim_end_matches('0').trim_end_matches('.'))
}
