//! Writes a machine as the file that reads back as the same machine, bit for bit.

use super::G_CM2;
use ftheta_model::machine::{Axis, Drive, Lens, Machine, Servo};
use std::fmt::Write;

/// The machine file of a machine.
///
/// # Accuracy
/// Values are printed in the file's units so that reading them gives the same number again.
pub fn to_toml(machine: &Machine) -> String {
    let mut out = format!("name = {:?}\n", machine.name);
    scanner(machine, &mut out);
    optics(machine, &mut out);
    laser(machine, &mut out);
    let output = &machine.output;
    out.push_str("\n[output]\n");
    row(&mut out, "period_us", f64::from(output.period_ns) * 1e-3, |us| (us * 10.0).round() * 0.1);
    row(&mut out, "word_bits", f64::from(output.word_bits), |bits| bits);
    row(&mut out, "word_range_deg", output.word_range_rad.to_degrees(), f64::to_radians);
    let drive = match output.drive {
        Drive::ServoKnown => "servo-known",
        Drive::Voltage => "voltage",
        Drive::BlackBox => "black-box",
    };
    text(&mut out, "drive", drive);
    out
}

fn scanner(machine: &Machine, out: &mut String) {
    let scanner = &machine.scanner;
    out.push_str("\n[scanner]\n");
    scaled(out, "rotor_inertia_g_cm2", scanner.rotor_inertia_kg_m2, G_CM2);
    scaled(out, "mirror_inertia_g_cm2", scanner.mirror_inertia_kg_m2, G_CM2);
    scaled(out, "torque_constant_mn_m_a", scanner.torque_constant_n_m_a, 1e-3);
    scaled(out, "coil_resistance_ohm", scanner.resistance_ohm, 1.0);
    scaled(out, "coil_inductance_uh", scanner.inductance_h, 1e-6);
    scaled(out, "torsional_mode_hz", scanner.torsional_mode_hz, 1.0);
    scaled(out, "damping_ratio", scanner.damping_ratio, 1.0);
    scaled(out, "voltage_max_v", scanner.voltage_max_v, 1.0);
    scaled(out, "current_max_a", scanner.current_max_a, 1.0);
    scaled(out, "current_rms_a", scanner.current_rms_a, 1.0);
    scaled(out, "thermal_time_s", scanner.thermal_time_s, 1.0);
    angle(out, "angle_max_deg", scanner.angle_max_rad);
    scaled(out, "speed_max_rad_s", scanner.speed_max_rad_s, 1.0);
    scaled(out, "f1_uncertainty", scanner.f1_uncertainty, 1.0);
    scaled(out, "kt_uncertainty", scanner.kt_uncertainty, 1.0);
    let losses = &scanner.losses;
    scaled(out, "torque_falloff", losses.torque_falloff, 1.0);
    scaled(out, "friction_coulomb_mn_m", losses.friction_coulomb_n_m, 1e-3);
    scaled(out, "friction_viscous_un_m_s_rad", losses.friction_viscous_n_m_s_rad, 1e-6);
    out.push_str("\n[scanner.servo]\n");
    match scanner.servo {
        Servo::StateFeedback { velocity_weight_s, lag_s } => {
            text(out, "kind", "state-feedback");
            scaled(out, "velocity_weight_us", velocity_weight_s, 1e-6);
            scaled(out, "lag_us", lag_s, 1e-6);
        }
        Servo::Pid { bandwidth_hz, damping, integral_time_s, current_bandwidth_hz } => {
            text(out, "kind", "pid");
            scaled(out, "bandwidth_hz", bandwidth_hz, 1.0);
            scaled(out, "damping", damping, 1.0);
            if integral_time_s.is_finite() {
                scaled(out, "integral_time_us", integral_time_s, 1e-6);
            }
            scaled(out, "current_bandwidth_hz", current_bandwidth_hz, 1.0);
        }
    }
    out.push_str("\n[scanner.sensor]\n");
    scaled(out, "gain_error", scanner.sensor.gain_error, 1.0);
    scaled(out, "nonlinearity", scanner.sensor.nonlinearity, 1.0);
    scaled(out, "drift_urad_s", scanner.sensor.drift_rad_s, 1e-6);
    scaled(out, "noise_urad", scanner.sensor.noise_rad, 1e-6);
}

fn optics(machine: &Machine, out: &mut String) {
    out.push_str("\n[optics]\n");
    match &machine.optics.lens {
        Lens::FTheta { coefficients_mm } => {
            text(out, "kind", "f-theta");
            let _ = writeln!(out, "coefficients_mm = {coefficients_mm:?}");
        }
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            text(out, "kind", "post-objective");
            scaled(out, "mirror_distance_mm", *mirror_distance_mm, 1.0);
            scaled(out, "working_distance_mm", *working_distance_mm, 1.0);
        }
    }
    let first = match machine.optics.first_mirror {
        Axis::X => "x",
        Axis::Y => "y",
    };
    text(out, "first_mirror", first);
    scaled(out, "field_mm", machine.optics.field_mm, 1.0);
    if let Some(aperture_mm) = machine.optics.aperture_mm {
        scaled(out, "aperture_mm", aperture_mm, 1.0);
    }
    if machine.optics.plane_mm != 0.0 {
        scaled(out, "plane_mm", machine.optics.plane_mm, 1.0);
    }
    if let Some(focus) = &machine.optics.focus {
        out.push_str("\n[optics.focus]\n");
        scaled(out, "magnification", focus.magnification, 1.0);
        scaled(out, "travel_mm", focus.travel_mm, 1.0);
        scaled(out, "speed_max_mm_s", focus.speed_max_mm_s, 1.0);
        scaled(out, "acceleration_max_mm_s2", focus.acceleration_max_mm_s2, 1.0);
        scaled(out, "lag_us", focus.lag_s, 1e-6);
        let _ = writeln!(out, "balanced = {}", focus.balanced);
    }
}

fn laser(machine: &Machine, out: &mut String) {
    let laser = &machine.laser;
    out.push_str("\n[laser]\n");
    scaled(out, "wavelength_nm", laser.wavelength_nm, 1.0);
    scaled(out, "beam_quality_m2", laser.beam_quality_m2, 1.0);
    scaled(out, "beam_diameter_mm", laser.beam_diameter_mm, 1.0);
    scaled(out, "spot_diameter_um", laser.spot_diameter_mm, 1e-3);
    scaled(out, "power_max_w", laser.power_max_w, 1.0);
    for (key, time_ns) in [
        ("on_latency_us", laser.on_latency_ns + laser.mirror_delay_ns),
        ("off_latency_us", laser.off_latency_ns + laser.mirror_delay_ns),
        ("mirror_delay_us", laser.mirror_delay_ns),
        ("minimum_on_us", laser.minimum_on_ns),
    ] {
        row(out, key, time_ns as f64 * 1e-3, |us| (us * 1e3).round());
    }
    let _ = writeln!(out, "power_modulated = {}", laser.power_modulated);
    if let Some(pulse_khz) = laser.pulse_khz {
        scaled(out, "pulse_khz", pulse_khz, 1.0);
        text(out, "pulses", if laser.pulses_triggered { "triggered" } else { "free" });
    }
}

fn text(out: &mut String, key: &str, value: &str) {
    let _ = writeln!(out, "{key} = {value:?}");
}

/// A value in units of `unit`, so that the file's number times the unit is the value.
fn scaled(out: &mut String, key: &str, value: f64, unit: f64) {
    row(out, key, value / unit, |read| read * unit);
}

fn angle(out: &mut String, key: &str, value_rad: f64) {
    row(out, key, value_rad.to_degrees(), f64::to_radians);
}

/// Prints the shortest of the neighbouring numbers that reads back as `read(guess)` does.
fn row(out: &mut String, key: &str, guess: f64, read: impl Fn(f64) -> f64) {
    let wanted = read(guess);
    // Unit conversion costs a last digit: a number with fewer digits often reads the same.
    let short = (0..17)
        .filter_map(|digits| format!("{guess:.digits$e}").parse::<f64>().ok())
        .find(|&candidate| read(candidate) == wanted);
    let _ = writeln!(out, "{key} = {:?}", short.unwrap_or(guess));
}
