//! Delays from a picture, as settings of a controller and as a machine file.

use crate::report_picture::Part;
use ftheta_calibrate::delay::error::DelayError;
use ftheta_calibrate::delay::growth::Growth;
use ftheta_calibrate::delay::{Delays, LineEndSeen, Method, estimate};
use ftheta_formats::picture_file::PictureRead;
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{LaserDelays, Pattern};
use ftheta_model::picture::{Picture, PixelPoint};
use ftheta_model::warning::Warning;
use ftheta_report::delay_report::{DelayReportInput, SpeedRow, delay_report_html};
use ftheta_report::picture_view::{Sight, SightKind};

pub use ftheta_calibrate::delay::DelayOptions;

/// Delays below this are as good as none, µs: a second pass would not change them.
const SETTLED_US: f64 = 1.0;
/// A mean longer than this is more likely the mirrors' than the laser's, µs.
const LONG_US: f64 = 150.0;
/// A delay of this deviation is worth a better picture, µs.
const UNSURE_US: f64 = 1.0;
/// Side of an enlarged part, px.
const PART_PX: f64 = 160.0;
/// What the ends of a line are called.
const ENDS: [&str; 2] = ["start", "stop"];
/// Share of the line ends that may be left out without a word.
const LEFT_OUT_SHARE: f64 = 0.05;

/// What the delays are put down to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Apply {
    /// The laser: both latencies are what the picture says.
    Laser,
    /// The mirrors: they are moved by the mean of both, and the difference stays.
    Mirrors,
    /// The mean is the mirrors', the difference the laser's.
    Both,
}

/// What a picture says about a machine's delays.
#[derive(Clone, Debug)]
pub struct DelayCalibration {
    /// What was measured.
    pub delays: Delays,
    /// Settings with which the pattern was marked, µs, later is positive.
    pub set: LaserDelays,
    /// Settings to write, µs.
    pub settings: LaserDelays,
    /// What to do next, the most useful first; sentences without full stops.
    pub advice: Vec<String>,
    /// What was noticed.
    pub warnings: Vec<Warning>,
}

/// Measures delays in a picture of a pattern.
///
/// * `machine`: whose settings are taken if the pattern does not state its own, and whose spot
///   tells how far ends grow
///
/// # Errors
/// If the picture does not show the pattern, or not well enough.
pub fn calibrate_delay(
    picture: &PictureRead,
    pattern: &Pattern,
    machine: &Machine,
    method: Option<Method>,
) -> Result<DelayCalibration, DelayError> {
    let spot_radius_mm = Some(0.5 * machine.laser.spot_diameter_mm);
    let options = DelayOptions { method, spot_radius_mm };
    let delays = estimate(&picture.picture, pattern, &options)?;
    let set = pattern.laser.unwrap_or_else(|| crate::pattern::sheet::delays(&machine.laser));
    let settings = LaserDelays {
        on_us: set.on_us - delays.tau_on_s * 1e6,
        off_us: set.off_us - delays.tau_off_s * 1e6,
    };
    let mut warnings = warnings(&delays, pattern);
    warnings.extend(picture.notes.iter().map(|note| Warning::new("picture", note.clone())));
    Ok(DelayCalibration { advice: advice(&delays, machine), delays, set, settings, warnings })
}

impl DelayCalibration {
    /// The page that shows it.
    ///
    /// * `picture`: the one that was measured
    pub fn report(&self, picture: &Picture, machine: &str) -> String {
        let delays = &self.delays;
        let us = |s: f64| s * 1e6;
        let mean_us = 0.5 * us(delays.tau_on_s + delays.tau_off_s);
        let [on_sd, off_sd, mean_sd] = delays.sd_s.map(us);
        let late_us =
            [(us(delays.tau_on_s), on_sd), (us(delays.tau_off_s), off_sd), (mean_us, mean_sd)];
        let sights = self.sights();
        let parts = parts(delays, picture);
        let views: Vec<_> = parts.iter().map(|part| part.view(&sights)).collect();
        let comb = delays.method == Method::Comb;
        delay_report_html(&DelayReportInput {
            machine,
            method: if comb { "comb" } else { "rectangle" },
            late_us,
            set_us: [self.set.on_us, self.set.off_us],
            settings_us: [self.settings.on_us, self.settings.off_us],
            patent_us: delays.patent_s.map(|both| both.map(us)),
            speeds: &speed_rows(delays),
            residuals: &residuals(delays),
            rms_um: comb.then_some(delays.rms_mm * 1e3),
            rejects: &self.rejects(),
            n_ends: 2 * delays.lines.len(),
            facts: &facts(delays),
            views: &views,
            advice: &self.advice,
            warnings: &self.warnings,
        })
    }

    /// Line, end and reason of all ends that were left out.
    pub fn rejects(&self) -> Vec<(String, &'static str, &'static str)> {
        let lines = self.delays.lines.iter();
        let ends = lines.flat_map(|line| line.ends.iter().zip(ENDS).map(move |end| (line, end)));
        ends.filter_map(|(line, (end, which))| Some((line.id.clone(), which, end.reject?.reason())))
            .collect()
    }

    /// Every end that was seen.
    fn sights(&self) -> Vec<Sight> {
        let lines = self.delays.lines.iter();
        let ends = lines.flat_map(|line| line.ends.iter().zip(ENDS).map(move |end| (line, end)));
        ends.filter_map(|(line, (end, which))| {
            let left = end.left_mm.map_or(String::new(), |mm| format!(", {:.1} µm off", mm * 1e3));
            let why = end.reject.map_or(left, |reject| format!(": {}", reject.reason()));
            let label = format!("{which} of {} at {} mm/s{why}", line.id, line.speed_mm_s);
            let (kind, place) = match (end.pixel, end.reject) {
                (Some(pixel), None) => (SightKind::Used, pixel),
                (Some(pixel), Some(_)) => (SightKind::LeftOut, pixel),
                (None, _) => (SightKind::Extra, end.nominal?),
            };
            Some(Sight { kind, places: vec![place], label })
        })
        .collect()
    }

    /// The machine with these delays, and what of them stays, µs on and off.
    ///
    /// The machine is the one whose settings the pattern was marked with.
    pub fn applied(&self, machine: &Machine, apply: Apply) -> (Machine, LaserDelays) {
        let ns = |us: f64| (us * 1e3).round() as i64;
        // A setting of a later signal is a laser that is earlier than the mirrors.
        let wanted_ns = [-ns(self.settings.on_us), -ns(self.settings.off_us)];
        let mut applied = machine.clone();
        let laser = &mut applied.laser;
        let before_ns = [laser.on_latency_ns, laser.off_latency_ns];
        let common_ns = (wanted_ns[0] - before_ns[0] + wanted_ns[1] - before_ns[1]) / 2;
        match apply {
            Apply::Laser => {}
            Apply::Mirrors | Apply::Both => laser.mirror_delay_ns -= common_ns,
        }
        let now_ns = match apply {
            Apply::Mirrors => before_ns.map(|ns| ns + common_ns),
            Apply::Laser | Apply::Both => wanted_ns,
        };
        [laser.on_latency_ns, laser.off_latency_ns] = now_ns;
        let left = |index: usize| (wanted_ns[index] - now_ns[index]) as f64 * 1e-3;
        (applied, LaserDelays { on_us: left(0), off_us: left(1) })
    }
}

/// The whole picture, and parts of it about a start and a stop.
fn parts(delays: &Delays, picture: &Picture) -> Vec<Part> {
    let around = |caption: &str, which: usize| {
        let seen: Vec<PixelPoint> =
            delays.lines.iter().filter_map(|line| line.ends[which].pixel).collect();
        let middle = seen.get(seen.len() / 2)?;
        let corner = [middle.x_px, middle.y_px].map(|px| (px - 0.5 * PART_PX).max(0.0) as usize);
        let side = PART_PX as usize;
        Part::enlarged(caption, picture, [corner[0], corner[1], side, side])
    };
    let whole = Part::whole("the whole picture", picture);
    let start = around("a part of it about a start, enlarged", 0);
    let stop = around("a part of it about a stop, enlarged", 1);
    [whole, start, stop].into_iter().flatten().collect()
}

fn residuals(delays: &Delays) -> Vec<(f64, f64, bool)> {
    let lines = delays.lines.iter();
    let ends = lines.flat_map(|line| {
        line.ends.iter().zip([true, false]).map(move |end| (line.speed_mm_s, end))
    });
    ends.filter(|(_, (end, _))| end.reject.is_none())
        .filter_map(|(speed, (end, start))| Some((speed, end.left_mm? * 1e3, start)))
        .collect()
}

/// Ends by speed: the mean of both ways, in which the pattern's place does not count.
fn speed_rows(delays: &Delays) -> Vec<SpeedRow> {
    let growth_mm = |index: usize| match &delays.growth {
        Growth::Modelled { growth_mm, .. } => growth_mm.get(index).copied().unwrap_or(f64::NAN),
        Growth::Alike => delays.growth_mm,
    };
    let mut speeds: Vec<f64> = delays.lines.iter().map(|line| line.speed_mm_s).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    let row = |(index, &speed_mm_s): (usize, &f64)| {
        let mean = |which: usize, of: fn(&LineEndSeen) -> Option<f64>| {
            let way = |forth: bool| {
                let lines = delays.lines.iter();
                let lines = lines.filter(|l| l.speed_mm_s == speed_mm_s && l.forth == forth);
                let ends = lines.map(|line| &line.ends[which]).filter(|end| end.reject.is_none());
                let values: Vec<f64> = ends.filter_map(of).collect();
                values.iter().sum::<f64>() / values.len() as f64
            };
            0.5e3 * (way(true) + way(false))
        };
        let off_um = [0, 1].map(|which| mean(which, |end| end.off_mm));
        let fitted_um = [0, 1].map(|which| mean(which, |end| Some(end.off_mm? - end.left_mm?)));
        SpeedRow {
            speed_mm_s,
            off_um,
            fitted_um,
            width_um: delays.widths.get(index).map_or(f64::NAN, |width| width.width_mm * 1e3),
            growth_um: growth_mm(index) * 1e3,
        }
    };
    speeds.iter().enumerate().map(row).collect()
}

fn facts(delays: &Delays) -> Vec<(&'static str, String)> {
    let scene = &delays.scene;
    let mut facts = vec![
        ("Lines", delays.lines.len().to_string()),
        ("Scale", format!("{:.2} µm/px", scene.mm_per_px * 1e3)),
        ("Blur", format!("{:.2} px", scene.blur_px)),
        ("Contrast", format!("{:.0} %", scene.contrast * 100.0)),
        ("Noise", format!("{:.1} %", scene.noise * 100.0)),
        ("Rows off the view", format!("{:.3} px rms", scene.view_rms_px)),
    ];
    if let Some(acceleration) = delays.acceleration_mm_s2 {
        facts.push(("Acceleration at starts", format!("{:.0} m/s²", acceleration * 1e-3)));
    }
    facts
}

fn warnings(delays: &Delays, pattern: &Pattern) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let scene = &delays.scene;
    if pattern.laser.is_none() {
        let text =
            "it does not say with which delays it was marked; those of the machine are taken";
        warnings.push(Warning::new("pattern", text));
    }
    if !scene.references {
        let text = "the pattern has no burned reference lines: scale comes from the distance of the \
                    rows, and that the picture is not mirrored is taken for granted";
        warnings.push(Warning::new("picture", text));
    }
    if scene.upright_assumed {
        let text = "nothing in it tells which way is up; it is taken for upright";
        warnings.push(Warning::new("picture", text));
    }
    if scene.upside_down {
        warnings.push(Warning::new("picture", "it is upside down, which was taken into account"));
    }
    let ends = delays.lines.iter().flat_map(|line| &line.ends);
    let n_rejected = ends.clone().filter(|end| end.reject.is_some()).count();
    let n_ends = ends.count();
    if n_rejected as f64 > LEFT_OUT_SHARE * n_ends as f64 {
        let text = format!("{n_rejected} of {n_ends} line ends were left out");
        warnings.push(Warning::new("picture", text));
    }
    warnings
}

fn advice(delays: &Delays, machine: &Machine) -> Vec<String> {
    let mut advice = Vec::new();
    let [on_us, off_us] = [delays.tau_on_s * 1e6, delays.tau_off_s * 1e6];
    let sd_us = 1e6 * delays.sd_s[0].max(delays.sd_s[1]);
    if on_us.abs().max(off_us.abs()) > SETTLED_US.max(3.0 * sd_us) {
        advice.push(
            "Write the settings, mark the pattern again and photograph it: what is left then is \
             free of errors that are in proportion to the delay, such as the picture's scale"
                .into(),
        );
    } else {
        advice.push("The delays are right as they are: nothing to change".into());
    }
    if delays.method == Method::Rectangle {
        advice.push(format!(
            "The difference of both hangs on how far line ends grow, here {:.1} µm by the width of \
             the lines: mark a comb (ftheta pattern delay), which needs no such model, or mark \
             the rectangle faster",
            growth_um(delays)
        ));
    } else if sd_us > UNSURE_US {
        advice.push(
            "Come nearer, light the plate evenly, or mark more lines: the delays are known to \
             more than a microsecond only"
                .into(),
        );
    }
    let mean_us = 0.5 * (on_us + off_us);
    if mean_us.abs() > LONG_US {
        advice.push(format!(
            "Both are {} by {:.0} µs: that is more likely the mirrors than the laser (--apply both)",
            if mean_us > 0.0 { "late" } else { "early" },
            mean_us.abs()
        ));
    }
    if let Some(acceleration) = delays.acceleration_mm_s2 {
        advice.push(format!(
            "Lines begin before the mirrors are at speed (they gain {:.0} m/s²): begin with a \
             longer run-in, or set the delay longer",
            acceleration * 1e-3
        ));
    }
    if machine.laser.pulse_khz.is_some() {
        advice.push(
            "The laser is pulsed: unless its pulses start with the gate the mean delay is half a \
             pulse longer, so calibrate at the pulse rate you mark with"
                .into(),
        );
    }
    advice
}

/// Growth of the ends that was reckoned with, µm.
fn growth_um(delays: &Delays) -> f64 {
    match &delays.growth {
        Growth::Modelled { growth_mm, .. } => growth_mm.first().map_or(0.0, |mm| mm * 1e3),
        _ => 0.0,
    }
}
