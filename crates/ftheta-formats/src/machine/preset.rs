//! Machines that come with ftheta: three scanners, each with any of four lenses.

use super::read;
use crate::toml_table::TomlError;
use ftheta_model::machine::Machine;

const SCANNERS: [(&str, &str); 3] = [
    ("S10", include_str!("../../presets/S10.toml")),
    ("S14", include_str!("../../presets/S14.toml")),
    ("S25", include_str!("../../presets/S25.toml")),
];

const LENSES: [(&str, &str); 4] = [
    ("f160", include_str!("../../presets/f160.toml")),
    ("f163", include_str!("../../presets/f163.toml")),
    ("f255", include_str!("../../presets/f255.toml")),
    ("f420", include_str!("../../presets/f420.toml")),
];

const OUTPUT: &str = include_str!("../../presets/output.toml");

/// Names of all presets.
pub const PRESETS: [&str; 12] = [
    "S10-f160", "S10-f163", "S10-f255", "S10-f420", "S14-f160", "S14-f163", "S14-f255", "S14-f420",
    "S25-f160", "S25-f163", "S25-f255", "S25-f420",
];

/// The machine file of a preset, or `None` if there is no such preset.
///
/// The bare names `S10`, `S14` and `S25` stand for `S10-f163`, `S14-f255` and `S25-f420`.
pub fn preset_text(name: &str) -> Option<String> {
    let full = match name {
        "S10" => "S10-f163",
        "S14" => "S14-f255",
        "S25" => "S25-f420",
        other => other,
    };
    let (scanner, lens) = full.split_once('-')?;
    let find = |table: &[(&str, &'static str)], name: &str| {
        table.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    };
    let (scanner, lens) = (find(&SCANNERS, scanner)?, find(&LENSES, lens)?);
    Some(format!("name = \"{full}\"\n\n{scanner}\n{lens}\n{OUTPUT}"))
}

/// A preset machine, or `None` if there is no such preset.
///
/// # Errors
/// Never for the presets that are shipped; a test reads them all.
pub fn preset(name: &str) -> Option<Result<Machine, TomlError>> {
    preset_text(name).map(|text| read(name, &text))
}
