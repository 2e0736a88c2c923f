//! Machine files: TOML with the unit in every key, and the presets.

mod preset;
mod write;

use crate::toml_table::{Section, TomlError, parse};
use ftheta_model::machine::{
    Axis, Drive, Focus, Laser, Lens, Losses, Machine, Optics, Output, Scanner, Sensor, Servo,
};
use ftheta_physics::focus::{field_travel_mm, spot_diameter_mm};
pub use preset::{PRESETS, preset, preset_text};
use std::f64::consts::PI;
pub use write::to_toml;

const G_CM2: f64 = 1e-7;

/// Reads a machine file.
///
/// * `file`: its name, for messages
///
/// # Errors
/// The first thing that is wrong, with line, value and limit. Unknown keys are errors.
pub fn read(file: &str, text: &str) -> Result<Machine, TomlError> {
    parse(file, text, |root| {
        let name = root.text("name")?.unwrap_or(file).to_owned();
        let output = root.section("output", output)?.unwrap_or(DEFAULT_OUTPUT);
        let scanner = root
            .section("scanner", |section| scanner(section, &output))?
            .ok_or_else(|| root.missing("scanner"))?;
        let optics = root.section("optics", optics)?.ok_or_else(|| root.missing("optics"))?;
        let laser = root
            .section("laser", |section| laser(section, &optics))?
            .ok_or_else(|| root.missing("laser"))?;
        Ok(Machine { name, scanner, optics, laser, output })
    })
}

/// Fastest triggered pulses, kHz: a hundred a tick of 10 µs.
const PULSE_KHZ_MAX: f64 = 1e4;
const DEFAULT_OUTPUT: Output = Output {
    period_ns: 10_000,
    word_bits: 20,
    word_range_rad: 12.5 * PI / 180.0,
    drive: Drive::ServoKnown,
};

fn scanner(section: &Section<'_>, output: &Output) -> Result<Scanner, TomlError> {
    let servo = section.section("servo", servo)?.ok_or_else(|| section.missing("servo"))?;
    let sensor = section.section("sensor", sensor)?.unwrap_or_default();
    let losses = losses(section)?;
    let scanner = Scanner {
        rotor_inertia_kg_m2: section.need("rotor_inertia_g_cm2", 1e-5..=1e4)? * G_CM2,
        mirror_inertia_kg_m2: section.need("mirror_inertia_g_cm2", 1e-5..=1e4)? * G_CM2,
        torque_constant_n_m_a: section.need("torque_constant_mn_m_a", 0.01..=1e4)? * 1e-3,
        resistance_ohm: section.need("coil_resistance_ohm", 0.01..=1e3)?,
        inductance_h: section.need("coil_inductance_uh", 0.1..=1e6)? * 1e-6,
        torsional_mode_hz: section.need("torsional_mode_hz", 50.0..=1e5)?,
        damping_ratio: section.need("damping_ratio", 1e-5..=0.5)?,
        voltage_max_v: section.need("voltage_max_v", 0.1..=1e3)?,
        current_max_a: section.need("current_max_a", 0.01..=1e3)?,
        current_rms_a: section.need("current_rms_a", 0.01..=1e3)?,
        thermal_time_s: section.number("thermal_time_s", 1e-3..=1e4)?.unwrap_or(1.0),
        angle_max_rad: section.number("angle_max_deg", 0.1..=45.0)?.unwrap_or(12.5).to_radians(),
        speed_max_rad_s: section.number("speed_max_rad_s", 0.1..=1e5)?.unwrap_or(1000.0),
        f1_uncertainty: section.number("f1_uncertainty", 0.0..=0.5)?.unwrap_or(0.03),
        kt_uncertainty: section.number("kt_uncertainty", 0.0..=0.5)?.unwrap_or(0.005),
        losses,
        servo,
        sensor,
    };
    let nyquist_hz = output.nyquist_hz();
    if scanner.torsional_mode_hz >= nyquist_hz {
        let limit = format!(
            "what a period of {} µs can steer, below {nyquist_hz} Hz",
            output.period_s() * 1e6
        );
        return Err(section.refuse("torsional_mode_hz", limit));
    }
    let torque_mn_m =
        scanner.torque_constant_n_m_a * (1.0 - losses.torque_falloff) * scanner.current_max_a * 1e3;
    if losses.friction_coulomb_n_m * 1e3 >= torque_mn_m {
        let limit = format!("what the peak torque overcomes, below {torque_mn_m:.3} mN·m");
        return Err(section.refuse("friction_coulomb_mn_m", limit));
    }
    Ok(scanner)
}

fn losses(section: &Section<'_>) -> Result<Losses, TomlError> {
    let or_none = |key, range| Ok(section.number(key, range)?.unwrap_or(0.0));
    Ok(Losses {
        torque_falloff: or_none("torque_falloff", 0.0..=0.5)?,
        friction_coulomb_n_m: or_none("friction_coulomb_mn_m", 0.0..=1e4)? * 1e-3,
        friction_viscous_n_m_s_rad: or_none("friction_viscous_un_m_s_rad", 0.0..=1e4)? * 1e-6,
    })
}

fn servo(section: &Section<'_>) -> Result<Servo, TomlError> {
    let kinds = [("state-feedback", false), ("pid", true)];
    if !section.choice("kind", &kinds)?.ok_or_else(|| section.missing("kind"))? {
        return Ok(Servo::StateFeedback {
            velocity_weight_s: section.need("velocity_weight_us", 0.1..=1e5)? * 1e-6,
            lag_s: section.need("lag_us", 1.0..=1e5)? * 1e-6,
        });
    }
    let integral_time_s = section.number("integral_time_us", 1.0..=1e9)?;
    Ok(Servo::Pid {
        bandwidth_hz: section.need("bandwidth_hz", 1.0..=1e5)?,
        damping: section.number("damping", 0.1..=10.0)?.unwrap_or(0.9),
        integral_time_s: integral_time_s.map_or(f64::INFINITY, |us| us * 1e-6),
        current_bandwidth_hz: section.need("current_bandwidth_hz", 1.0..=1e6)?,
    })
}

fn sensor(section: &Section<'_>) -> Result<Sensor, TomlError> {
    Ok(Sensor {
        gain_error: section.number("gain_error", -0.5..=0.5)?.unwrap_or(0.0),
        nonlinearity: section.number("nonlinearity", -0.5..=0.5)?.unwrap_or(0.0),
        drift_rad_s: section.number("drift_urad_s", -1e4..=1e4)?.unwrap_or(0.0) * 1e-6,
        noise_rad: section.number("noise_urad", 0.0..=1e4)?.unwrap_or(0.0) * 1e-6,
    })
}

fn optics(section: &Section<'_>) -> Result<Optics, TomlError> {
    let kinds = [("f-theta", false), ("post-objective", true)];
    let lens = if section.choice("kind", &kinds)?.ok_or_else(|| section.missing("kind"))? {
        Lens::PostObjective {
            mirror_distance_mm: section.need("mirror_distance_mm", 0.0..=1e3)?,
            working_distance_mm: section.need("working_distance_mm", 1.0..=1e5)?,
        }
    } else {
        let coefficients_mm = section
            .numbers("coefficients_mm", -1e6..=1e6, 5)?
            .ok_or_else(|| section.missing("coefficients_mm"))?;
        if !(1.0..=1e5).contains(&coefficients_mm[0]) {
            return Err(section.refuse("coefficients_mm", "a first coefficient of 1 to 100000 mm"));
        }
        Lens::FTheta { coefficients_mm }
    };
    let axes = [("x", Axis::X), ("y", Axis::Y)];
    let first_mirror = section.choice("first_mirror", &axes)?.unwrap_or(Axis::X);
    let mut optics = Optics::new(lens, first_mirror, section.need("field_mm", 0.1..=1e4)?);
    optics.aperture_mm = section.number("aperture_mm", 0.1..=500.0)?;
    let plane_mm = section.number("plane_mm", -1e5..=1e5)?.unwrap_or(0.0);
    optics = optics
        .at_height(plane_mm)
        .ok_or_else(|| section.refuse("plane_mm", "less than working_distance_mm"))?;
    optics.focus = section.section("focus", |inner| focus(inner, &optics))?;
    if optics.focus.is_some() && matches!(optics.lens, Lens::FTheta { .. }) {
        return Err(section.refuse("kind", "\"post-objective\", the only kind with [optics.focus]"));
    }
    Ok(optics)
}

fn focus(section: &Section<'_>, optics: &Optics) -> Result<Focus, TomlError> {
    let focus = Focus {
        magnification: section.need("magnification", -1e3..=1e3)?,
        travel_mm: section.need("travel_mm", 1e-3..=1e3)?,
        speed_max_mm_s: section.need("speed_max_mm_s", 1e-2..=1e6)?,
        acceleration_max_mm_s2: section.need("acceleration_max_mm_s2", 1.0..=1e9)?,
        lag_s: section.number("lag_us", 0.0..=1e5)?.unwrap_or(0.0) * 1e-6,
        balanced: section.boolean("balanced")?.unwrap_or(true),
    };
    if focus.magnification.abs() < 1e-3 {
        return Err(section.refuse("magnification", "0.001 to 1000, either sign"));
    }
    let needed_mm = field_travel_mm(optics, &focus);
    if needed_mm > focus.travel_mm {
        let limit = format!(
            "what a field of {} mm needs at this magnification, {needed_mm:.3} mm or more",
            optics.field_mm
        );
        return Err(section.refuse("travel_mm", limit));
    }
    Ok(focus)
}

fn laser(section: &Section<'_>, optics: &Optics) -> Result<Laser, TomlError> {
    let wavelength_nm = section.need("wavelength_nm", 100.0..=20_000.0)?;
    let beam_quality_m2 = section.number("beam_quality_m2", 1.0..=100.0)?.unwrap_or(1.0);
    let beam_diameter_mm = section.need("beam_diameter_mm", 0.05..=200.0)?;
    let focal_mm = match &optics.lens {
        Lens::FTheta { coefficients_mm } => coefficients_mm[0],
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            mirror_distance_mm + working_distance_mm
        }
    };
    // The diffraction limit; a measured spot overrides it.
    let limit_mm = spot_diameter_mm(wavelength_nm, beam_quality_m2, focal_mm, beam_diameter_mm);
    let timing = |key| Ok(nanoseconds(section.number(key, -1e4..=1e4)?.unwrap_or(0.0)));
    let mirror_delay_ns = timing("mirror_delay_us")?;
    let spot_um = section.number("spot_diameter_um", 0.5..=1e4)?;
    let pulse_khz = section.number("pulse_khz", 0.001..=1e6)?;
    let pulses = [("free", false), ("triggered", true)];
    let pulses_triggered = section.choice("pulses", &pulses)?.unwrap_or(false);
    if pulses_triggered && pulse_khz.is_none_or(|khz| khz > PULSE_KHZ_MAX) {
        return Err(section.refuse("pulses", "free, without a pulse_khz of 10000 or less"));
    }
    Ok(Laser {
        wavelength_nm,
        beam_quality_m2,
        beam_diameter_mm,
        spot_diameter_mm: spot_um.map_or(limit_mm, |um| um * 1e-3),
        power_max_w: section.need("power_max_w", 1e-3..=1e5)?,
        on_latency_ns: timing("on_latency_us")? - mirror_delay_ns,
        off_latency_ns: timing("off_latency_us")? - mirror_delay_ns,
        mirror_delay_ns,
        minimum_on_ns: nanoseconds(section.number("minimum_on_us", 0.0..=1e5)?.unwrap_or(0.0)),
        power_modulated: section.boolean("power_modulated")?.unwrap_or(true),
        pulse_khz,
        pulses_triggered,
    })
}

fn output(section: &Section<'_>) -> Result<Output, TomlError> {
    let period_us = section.number("period_us", 1.0..=100.0)?.unwrap_or(10.0);
    let tenths = (period_us * 10.0).round();
    if (period_us * 10.0 - tenths).abs() > 1e-9 {
        return Err(section.refuse("period_us", "whole tenths of a microsecond"));
    }
    let drives = [
        ("servo-known", Drive::ServoKnown),
        ("voltage", Drive::Voltage),
        ("black-box", Drive::BlackBox),
    ];
    Ok(Output {
        period_ns: tenths as u32 * 100,
        word_bits: section.whole("word_bits", 8..=24)?.unwrap_or(DEFAULT_OUTPUT.word_bits),
        word_range_rad: section
            .number("word_range_deg", 0.1..=60.0)?
            .map_or(DEFAULT_OUTPUT.word_range_rad, f64::to_radians),
        drive: section.choice("drive", &drives)?.unwrap_or(DEFAULT_OUTPUT.drive),
    })
}

fn nanoseconds(microseconds: f64) -> i64 {
    (microseconds * 1e3).round() as i64
}
