//! Delay patterns that the twin burns and photographs, and what is measured in the picture.
#![allow(dead_code, reason = "test and example each use a part")]

use ftheta::calibrate::delay::error::DelayError;
use ftheta::delay_calibration::{DelayCalibration, calibrate_delay};
use ftheta::formats::picture_file::PictureRead;
use ftheta::machines;
use ftheta::model::machine::Machine;
use ftheta::model::pattern::Pattern;
use ftheta::pattern::delay::{DelayOptions, LineAxis, Method, sheet};
use ftheta::photograph::{PhotographOptions, PowerRule, photograph};

/// A pattern, how late light is, and how it is photographed.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    pub method: Method,
    pub axis: LineAxis,
    pub speeds_mm_s: &'static [f64],
    /// How late light appears and goes with the settings in the pattern, µs.
    pub late_us: [f64; 2],
    pub spot_um: f64,
    pub um_per_px: f64,
    pub blur_px: f64,
    pub noise: f64,
    pub jitter_um: f64,
    pub power: Option<PowerRule>,
    pub dose_slope: f64,
    pub bright: bool,
    pub turn_deg: f64,
    pub mirrored: bool,
    pub exposure: f64,
    pub gamma: f64,
}

/// What the picture says beside the truth, µs.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    pub on_us: f64,
    pub off_us: f64,
    /// Of the mean of both.
    pub mean_us: f64,
    /// Deviation that the calibration states for on.
    pub sd_us: f64,
}

/// Speeds of the comb, mm/s.
pub const SPEEDS: [f64; 6] = [1e3, 2e3, 4e3, 6e3, 8e3, 10e3];

impl Setup {
    /// A comb of 10 + 10 lines at each of six speeds, 20 µm/px.
    pub fn comb() -> Self {
        Self {
            method: Method::Comb,
            axis: LineAxis::X,
            speeds_mm_s: &SPEEDS,
            late_us: [85.0, 60.0],
            spot_um: 100.0,
            um_per_px: 20.0,
            blur_px: 0.8,
            noise: 0.02,
            jitter_um: 2.0,
            power: None,
            dose_slope: 0.0,
            bright: false,
            turn_deg: 0.0,
            mirrored: false,
            exposure: 1.0,
            gamma: 1.0,
        }
    }

    /// The patent's rectangle at 5 m/s.
    pub fn rectangle() -> Self {
        Self { method: Method::Rectangle, speeds_mm_s: &[5e3], ..Self::comb() }
    }

    /// The machine that marks it.
    pub fn machine(&self) -> Machine {
        let mut machine = machines::find("S10").unwrap();
        machine.laser.spot_diameter_mm = self.spot_um * 1e-3;
        machine
    }

    /// The pattern.
    pub fn pattern(&self, machine: &Machine) -> Pattern {
        let options = DelayOptions {
            axis: self.axis,
            speeds_mm_s: self.speeds_mm_s.to_vec(),
            ..DelayOptions::usual(self.method, machine)
        };
        sheet(&options, machine).unwrap().pattern
    }

    /// The picture that the twin's camera takes of the pattern.
    pub fn picture(&self, machine: &Machine, pattern: &Pattern, seed: u64) -> PictureRead {
        let mut options = PhotographOptions::usual(machine, seed);
        // A preset moves the drawn ends: the twin burns nominal lines, so light is later by it.
        let set = pattern.laser.unwrap();
        let own = ftheta::pattern::sheet::delays(&machine.laser);
        let preset_us = [set.on_us - own.on_us, set.off_us - own.off_us];
        let late_us = [0, 1].map(|edge| self.late_us[edge] + preset_us[edge]);
        options.burn.late_ns = late_us.map(|us| (us * 1e3).round() as i64);
        options.burn.jitter_mm = self.jitter_um * 1e-3;
        options.burn.power = self.power;
        options.burn.dose_slope = self.dose_slope;
        options.camera.pixel_mm = Some(self.um_per_px * 1e-3);
        options.camera.turn_deg = self.turn_deg;
        options.camera.mirrored = self.mirrored;
        options.sensor.blur_px = self.blur_px;
        options.sensor.noise = self.noise;
        options.sensor.exposure = self.exposure;
        options.sensor.gamma = self.gamma;
        options.bright = self.bright;
        let taken = photograph(pattern, &[], machine, &options, &mut |_| {}).unwrap();
        PictureRead { picture: taken.picture, saturated_ratio: 0.0, bits: 8, notes: Vec::new() }
    }

    /// What the picture of a seed says.
    pub fn measure(&self, seed: u64) -> Result<DelayCalibration, DelayError> {
        let machine = self.machine();
        let pattern = self.pattern(&machine);
        let picture = self.picture(&machine, &pattern, seed);
        calibrate_delay(&picture, &pattern, &machine, None)
    }

    /// How far that is off.
    pub fn errors(&self, seed: u64) -> Result<Errors, DelayError> {
        let found = self.measure(seed)?;
        // Settings, less what they should be: presets are in neither.
        let own = ftheta::pattern::sheet::delays(&self.machine().laser);
        let on_us = own.on_us - self.late_us[0] - found.settings.on_us;
        let off_us = own.off_us - self.late_us[1] - found.settings.off_us;
        let sd_us = found.delays.sd_s[0] * 1e6;
        Ok(Errors { on_us, off_us, mean_us: 0.5 * (on_us + off_us), sd_us })
    }
}
