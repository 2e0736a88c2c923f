//! A mechanism file analysed: its modes, and the machine that it makes of another.

use crate::output::write_file;
use crate::{Error, import, machines};
use ftheta_formats::machine::{read, to_toml};
use ftheta_formats::mechanism;
use ftheta_physics::mechanism::{MechanismError, Model, Modes, TwoInertias};
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
