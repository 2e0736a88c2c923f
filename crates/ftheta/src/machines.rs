//! Finds machines: presets by name, files by path.

use crate::{Error, import};
use ftheta_formats::machine;
use ftheta_model::machine::Machine;
use std::path::Path;

/// The machine of this name: a preset, or else a machine file.
///
/// # Errors
/// If it is neither, or the file is at fault.
pub fn find(name: &str) -> Result<Machine, Error> {
    let (file, text) = source(name)?;
    Ok(machine::read(&file, &text)?)
}

/// The machine over a work plane of another height above the nominal one, mm.
///
/// # Errors
/// If the head is not above it.
pub fn at_height(machine: Machine, z_mm: f64) -> Result<Machine, Error> {
    let limit_mm = machine.optics.height_limit_mm();
    let optics = machine.optics.at_height(z_mm).ok_or(Error::NoRoom { z_mm, limit_mm })?;
    Ok(Machine { optics, ..machine })
}

/// Where a machine comes from, and the text of its machine file.
///
/// # Errors
/// If the name is neither a preset nor a file that can be read.
pub fn source(name: &str) -> Result<(String, String), Error> {
    if let Some(text) = machine::preset_text(name) {
        return Ok((format!("preset {name}"), text));
    }
    let path = Path::new(name);
    let looks_like_file = path.extension().is_some() || name.contains(['/', '\\']);
    if !looks_like_file && !path.exists() {
        let presets = machine::PRESETS.join(", ");
        return Err(Error::NoMachine { name: name.into(), presets });
    }
    Ok((name.into(), import::text(path)?))
}
