//! A machine of usual size.

use ftheta_model::machine::{
    Axis, Drive, Laser, Lens, Losses, Machine, Optics, Output, Scanner, Sensor, Servo,
};

/// 24 V, 10 A, 1 000 rad/s, a spot of 30 µm.
pub fn machine() -> Machine {
    Machine {
        name: "test".into(),
        scanner: Scanner {
            rotor_inertia_kg_m2: 1e-8,
            mirror_inertia_kg_m2: 1e-8,
            torque_constant_n_m_a: 0.01,
            resistance_ohm: 1.0,
            inductance_h: 1e-4,
            torsional_mode_hz: 1e4,
            damping_ratio: 0.01,
            voltage_max_v: 24.0,
            current_max_a: 10.0,
            current_rms_a: 2.0,
            thermal_time_s: 1.0,
            angle_max_rad: 0.2,
            speed_max_rad_s: 1000.0,
            f1_uncertainty: 0.03,
            kt_uncertainty: 0.005,
            losses: Losses::default(),
            servo: Servo::StateFeedback { velocity_weight_s: 7e-5, lag_s: 1.6e-4 },
            sensor: Sensor::default(),
        },
        optics: Optics::new(Lens::FTheta { coefficients_mm: vec![160.0] }, Axis::Y, 120.0),
        laser: Laser {
            wavelength_nm: 1064.0,
            beam_quality_m2: 1.1,
            beam_diameter_mm: 10.0,
            spot_diameter_mm: 0.03,
            power_max_w: 20.0,
            on_latency_ns: 0,
            mirror_delay_ns: 0,
            off_latency_ns: 0,
            minimum_on_ns: 0,
            power_modulated: true,
            pulse_khz: None,
            pulses_triggered: false,
        },
        output: Output {
            period_ns: 10_000,
            word_bits: 20,
            word_range_rad: 0.218,
            drive: Drive::ServoKnown,
        },
    }
}
