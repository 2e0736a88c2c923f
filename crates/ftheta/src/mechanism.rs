//! A mechanism file analysed: its modes, and the machine that it makes of another.

use crate::output::write_file;
use crate::{Error, import, machines};
use ftheta_formats::machine::{read, to_toml};
use ftheta_formats::motion_law::MotionLaw;
use ftheta_formats::{mechanism, motion_law};
use ftheta_physics::mechanism::spin::{Driven, MotionSample, Spin};
use ftheta_physics::mechanism::{MechanismError, Model, Modes, TwoInertias};
use std::fmt::Write;
use std::path::Path;

/// Modes that are computed.
pub const N_MODES: usize = 12;

/// What follows from a mechanism.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The finite elements.
    pub model: Model,
    /// Their lowest modes.
    pub modes: Modes,
    /// The axis of two inertias that a machine file can state.
    pub two_inertias: TwoInertias,
}

/// Reads a mechanism file and finds its modes.
///
/// # Errors
/// If the file cannot be read or is at fault, the modes do not converge, or none of them turns
/// rotor and mirror against each other.
pub fn analyse(path: &Path) -> Result<Analysis, Error> {
    let mechanism = mechanism::read(&path.display().to_string(), &import::text(path)?)?;
    let model = Model::new(&mechanism)?;
    let modes = model.modes(N_MODES)?;
    let two_inertias =
        modes.two_inertias().ok_or(MechanismError::NoTorsion { n_modes: modes.shapes.len() })?;
    Ok(Analysis { model, modes, two_inertias })
}

/// Writes the machine file of a machine (preset or file) with a mechanism's inertias, torsional
/// mode and damping; its name is that of the file.
///
/// # Errors
/// If there is no such machine, the mechanism is outside what a machine file can state, or the file
/// cannot be written.
pub fn write_machine(machine: &str, analysis: &Analysis, path: &Path) -> Result<(), Error> {
    let mut machine = machines::find(machine)?;
    machine.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    machine.scanner.rotor_inertia_kg_m2 = analysis.two_inertias.rotor_kg_m2;
    machine.scanner.mirror_inertia_kg_m2 = analysis.two_inertias.mirror_kg_m2;
    machine.scanner.torsional_mode_hz = analysis.two_inertias.frequency_hz;
    machine.scanner.damping_ratio = analysis.modes.damping_ratio;
    let text = to_toml(&machine);
    // What is written must be readable.
    read(&path.display().to_string(), &text)?;
    write_file(path, text.as_bytes())
}

/// What a mirror does while the rotor follows a law.
#[derive(Clone, Debug)]
pub struct Response {
    /// The law.
    pub law: MotionLaw,
    /// One sample for each of the law's.
    pub motion: Vec<MotionSample>,
}

/// Drives the rotor of a mechanism along a law in a file (`time_us,angle_deg`).
///
/// # Errors
/// If the law cannot be read or is at fault, or is too long for the mechanism's modes.
pub fn respond(analysis: &Analysis, law: &Path) -> Result<Response, Error> {
    let law = motion_law::read(&law.display().to_string(), &import::text(law)?)?;
    let motion = Spin::new(&analysis.modes).play(&law.times_s, Driven::Angle(&law.angles_rad))?;
    Ok(Response { law, motion })
}

impl Response {
    /// Angle of the mirror less that of the law at every sample, rad.
    pub fn errors_rad(&self) -> impl Iterator<Item = f64> {
        self.motion.iter().zip(&self.law.angles_rad).map(|(found, law)| found.mirror_rad - law)
    }

    /// Greatest torque that the law takes, N·m.
    pub fn torque_max_n_m(&self) -> f64 {
        self.motion.iter().fold(0.0, |peak, sample| peak.max(sample.torque_n_m.abs()))
    }

    /// Writes the response as text, a line per sample.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let mut text = String::from("time_us,rotor_deg,mirror_deg,tilt_deg,torque_mn_m\n");
        for (time_s, sample) in self.law.times_s.iter().zip(&self.motion) {
            let [rotor, mirror, tilt] =
                [sample.rotor_rad, sample.mirror_rad, sample.tilt_rad].map(f64::to_degrees);
            let torque = sample.torque_n_m * 1e3;
            let _ = writeln!(text, "{},{rotor},{mirror},{tilt},{torque}", time_s * 1e6);
        }
        write_file(path, text.as_bytes())
    }
}
