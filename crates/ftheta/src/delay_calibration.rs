//! Delays from a picture, as settings of a controller and as a machine file.

use ftheta_calibrate::delay::error::DelayError;
use ftheta_calibrate::delay::{Delays, Method, estimate};
use ftheta_formats::picture_file::PictureRead;
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{LaserDelays, Pattern};
use ftheta_model::picture::Picture;
use ftheta_model::warning::Warning;

pub use ftheta_calibrate::delay::DelayOptions;

/// Delays below this are as good as none, µs: a second pass would not change them.
const SETTLED_US: f64 = 1.0;
/// A mean longer than this is more likely the mirrors' than the laser's, µs.
const LONG_US: f64 = 150.0;
/// A delay of this deviation is worth a better picture, µs.
const UNSURE_US: f64 = 1.0;
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
    pub fn report(&self, _picture: &Picture, _pattern: &Pattern, _machine: &str) -> String {
        String::new()
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
        ftheta_calibrate::delay::growth::Growth::Modelled { growth_mm, .. } => {
            growth_mm.first().map_or(0.0, |mm| mm * 1e3)
        }
        _ => 0.0,
    }
}
