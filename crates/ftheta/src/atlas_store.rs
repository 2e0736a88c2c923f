//! Jump atlases, solved programs and tuned delays kept on disk between runs, one file of each for
//! each machine and setting.

use crate::Error;
use ftheta_formats::atlas_file::{self, AtlasLevel};
use ftheta_formats::cache_key::CacheKey;
use ftheta_formats::solved_file;
use ftheta_model::machine::Scanner;
use ftheta_model::warning::Warning;
use ftheta_planner::corner::Corners;
use ftheta_planner::jump::{ATLAS_VERSION, Atlas, AxisOptions, Level, Model, Transitions};
use ftheta_planner::solved::{SOLVED_VERSION, Solved};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The folder that they are kept in; without one they are made anew each time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AtlasStore {
    folder: Option<PathBuf>,
}

impl AtlasStore {
    /// The store in this folder, or in the platform's cache folder.
    pub fn new(folder: Option<PathBuf>) -> Self {
        let platform = || dirs::cache_dir().map(|cache| cache.join("ftheta"));
        Self { folder: folder.or_else(platform) }
    }

    /// No store: nothing is read or kept.
    pub fn none() -> Self {
        Self::default()
    }

    /// The atlas of a scanner as far as it has been built; a file that cannot be used is as good as
    /// none, with a warning.
    ///
    /// # Errors
    /// If a parameter of the scanner is out of range.
    pub fn load(
        &self,
        scanner: &Scanner,
        axis: AxisOptions,
        warnings: &mut Vec<Warning>,
    ) -> Result<Atlas, Error> {
        let mut levels: [Level; _] = Default::default();
        let key = key(scanner, axis);
        let kept = self.read(&key.file_name("atlas"), "atlas", warnings, |bytes| {
            atlas_file::read(bytes, key).map_err(|error| error.to_string())
        });
        levels.iter_mut().zip(kept.unwrap_or_default()).for_each(|(level, kept)| {
            let AtlasLevel { steps_rad, sequences_v } = kept;
            *level = Level { steps_rad, sequences_v };
        });
        Ok(Atlas::restore(scanner, axis, levels)?)
    }

    /// Gives transitions, and corners of the same, back what programs have solved for them before.
    pub(crate) fn restore(
        &self,
        transitions: &Transitions,
        corners: Option<&Corners>,
        warnings: &mut Vec<Warning>,
    ) {
        let solved = self.read_solved(solved_key(transitions.atlas()), warnings);
        transitions.restore(&solved);
        if let Some(corners) = corners {
            corners.restore(&solved);
        }
    }

    /// Keeps what programs have solved for transitions and corners, besides what is kept already.
    pub(crate) fn save_solved(
        &self,
        transitions: &Transitions,
        corners: Option<&Corners>,
        warnings: &mut Vec<Warning>,
    ) {
        if self.folder.is_none() {
            return;
        }
        let key = solved_key(transitions.atlas());
        // Read again, since another process may have kept more meanwhile; told of when it was read
        // first.
        let mut kept = self.read_solved(key, &mut Vec::new());
        let mut solved = transitions.solved();
        solved.extend(corners.into_iter().flat_map(Corners::solved));
        if solved.keys().all(|which| kept.contains_key(which)) {
            return;
        }
        solved.append(&mut kept);
        let bytes = solved_file::write(key, &solved);
        self.write(&key.file_name("solved"), "solved programs", warnings, &bytes);
    }

    fn read_solved(&self, key: CacheKey, warnings: &mut Vec<Warning>) -> Solved {
        let kept = self.read(&key.file_name("solved"), "solved programs", warnings, |bytes| {
            solved_file::read(bytes, key).map_err(|error| error.to_string())
        });
        kept.unwrap_or_default()
    }

    /// Keeps an atlas.
    ///
    /// A folder that cannot be written to costs time in the next run, nothing else: a warning.
    pub fn save(&self, atlas: &Atlas, warnings: &mut Vec<Warning>) {
        let key = key(atlas.scanner(), atlas.axis_options());
        let levels: Vec<AtlasLevel> = atlas
            .levels()
            .iter()
            .map(|Level { steps_rad, sequences_v }| AtlasLevel {
                steps_rad: steps_rad.clone(),
                sequences_v: sequences_v.clone(),
            })
            .collect();
        let bytes = atlas_file::write(key, &levels);
        self.write(&key.file_name("atlas"), "atlas", warnings, &bytes);
    }

    /// What a kept file holds; one that cannot be used is as good as none, with a warning.
    ///
    /// * `what` it is, for the warning
    /// * `parse` says why it cannot be used
    pub(crate) fn read<T>(
        &self,
        name: &str,
        what: &str,
        warnings: &mut Vec<Warning>,
        parse: impl FnOnce(&[u8]) -> Result<T, String>,
    ) -> Option<T> {
        let path = self.folder.as_ref()?.join(name);
        let found = match fs::read(&path) {
            Ok(bytes) => parse(&bytes),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
            Err(error) => Err(format!("cannot be read: {error}")),
        };
        let told = |why| format!("{}: {why}; what it held is made anew", path.display());
        found.map_err(|why| warnings.push(Warning::new(what, told(why)))).ok()
    }

    /// Keeps a file. It is written beside its place and renamed, so that a reader finds all of it
    /// or none, whoever writes at the same time; of two writers the last one stays.
    pub(crate) fn write(&self, name: &str, what: &str, warnings: &mut Vec<Warning>, bytes: &[u8]) {
        let Some(folder) = &self.folder else {
            return;
        };
        let path = folder.join(name);
        if let Err(error) = publish(folder, &path, bytes) {
            let message = format!("{}: cannot be kept: {error}", path.display());
            let warning = Warning::new(what, message);
            // Tried again and again in a long build, told once.
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
    }
}

fn publish(folder: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut file = NamedTempFile::new_in(folder)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// Everything that decides what programs give: what decides the atlas, and what corners have
/// besides.
fn solved_key(atlas: &Atlas) -> CacheKey {
    let (scanner, axis) = (atlas.scanner(), atlas.axis_options());
    let besides = [scanner.kt_uncertainty, scanner.speed_max_rad_s];
    let servo = scanner.servo;
    CacheKey::of(&format!("{SOLVED_VERSION} {besides:?} {servo:?} {}", key_text(scanner, axis)))
}

/// Everything that decides an atlas: numbers as their shortest text that reads back the same.
fn key(scanner: &Scanner, axis: AxisOptions) -> CacheKey {
    CacheKey::of(&key_text(scanner, axis))
}

fn key_text(scanner: &Scanner, axis: AxisOptions) -> String {
    let numbers = [
        scanner.rotor_inertia_kg_m2,
        scanner.mirror_inertia_kg_m2,
        scanner.torque_constant_n_m_a,
        scanner.resistance_ohm,
        scanner.inductance_h,
        scanner.torsional_mode_hz,
        scanner.damping_ratio,
        scanner.voltage_max_v,
        scanner.current_max_a,
        scanner.f1_uncertainty,
    ];
    // Only what is held by the servo depends on it and on the torque constant's uncertainty.
    let held = match axis.model {
        Model::Held { .. } => Some((scanner.servo, scanner.kt_uncertainty)),
        Model::Rigid | Model::Flexible | Model::Robust { .. } | Model::Closest { .. } => None,
    };
    format!("{ATLAS_VERSION} {numbers:?} {axis:?} {held:?}")
}
