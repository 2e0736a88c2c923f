//! Everything that can go wrong between a file and a marked field.

use crate::camera::CameraError;
use crate::camera_calibration::CameraCalibrationError;
use crate::exchange::ExchangeError;
use crate::field::FieldError;
use crate::pattern::error::PatternError;
use crate::photograph::PhotographError;
use ftheta_calibrate::delay::error::DelayError;
use ftheta_calibrate::error::CalibrateError;
use ftheta_calibrate::picture::error::PictureError;
use ftheta_formats::camera_file::CameraFileError;
use ftheta_formats::cor_file::CorFileError;
use ftheta_formats::correction_file::CorrectionFileError;
use ftheta_formats::motion_law::MotionLawError;
use ftheta_formats::pattern_file::PatternFileError;
use ftheta_formats::picture_file::PictureFileError;
use ftheta_formats::plan_file::PlanFileError;
use ftheta_formats::svg::error::SvgError;
use ftheta_formats::text_table::error::TableError;
use ftheta_formats::toml_table::TomlError;
use ftheta_physics::audit::AuditError;
use ftheta_physics::mechanism::MechanismError;
use ftheta_physics::servo::ServoError;
use ftheta_planner::PlanError;
use ftheta_planner::jump::JumpError;
use ftheta_toolpath::error::LayError;
use ftheta_twin::twin::TwinError;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Everything that can go wrong between a file and a marked field.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be read or written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// A file is larger than is read.
    #[error("{path}: {n_bytes} bytes are more than the limit of {limit} bytes", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        n_bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// No reader for a kind of file.
    #[error("{path}: unknown kind of file, expected {expected}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What can be read.
        expected: &'static str,
    },
    /// Neither a preset nor a file.
    #[error("machine \"{name}\" is neither a preset nor a file; presets are {presets}")]
    NoMachine {
        /// What was asked for.
        name: String,
        /// What there is.
        presets: String,
    },
    /// A table without the machine that it is for.
    #[error(
        "a work plane at a height of {z_mm} mm leaves no room below the head, the limit is below {limit_mm} mm"
    )]
    NoRoom {
        /// Height above the nominal work plane, mm.
        z_mm: f64,
        /// Where the head is, mm.
        limit_mm: f64,
    },
    /// A table without the machine that it is for.
    #[error("{path}: a correction table is for one machine, name it with --machine", path = path.display())]
    NeedsMachine {
        /// The table.
        path: PathBuf,
    },
    /// A table that a user has filled in and that would be written over.
    #[error("{path}: has measured places in it; move it away, or choose another name", path = path.display())]
    Filled {
        /// The table.
        path: PathBuf,
    },
    /// A drawing is at fault.
    #[error("{path}: {source}", path = path.display())]
    Svg {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: SvgError,
    },
    /// A machine or recipe file is at fault.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A table of points or places is at fault.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A correction file is at fault, or for another machine.
    #[error("{path}: {source}", path = path.display())]
    CorrectionFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CorrectionFileError,
    },
    /// A `.cor` file is at fault.
    #[error("{path}: {source}", path = path.display())]
    CorFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CorFileError,
    },
    /// A correction table cannot be taken from or put into another kind of file.
    #[error("{path}: {source}", path = path.display())]
    Exchange {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ExchangeError,
    },
    /// A place of a list has no angles, or angles no place.
    #[error("{path}: {source}", path = path.display())]
    Field {
        /// The list.
        path: PathBuf,
        /// What is wrong.
        source: FieldError,
    },
    /// A pattern cannot be made.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// A picture gives no delays.
    #[error("{path}: {source}", path = path.display())]
    Delay {
        /// The picture.
        path: PathBuf,
        /// What is wrong.
        source: DelayError,
    },
    /// A camera file is at fault.
    #[error("{path}: {source}", path = path.display())]
    CameraFile {
        /// The file.
        path: PathBuf,
        /// What is wrong in it.
        source: CameraFileError,
    },
    /// Pictures give no camera.
    #[error(transparent)]
    CameraCalibration(#[from] CameraCalibrationError),
    /// A picture gives no field.
    #[error("{path}: {source}", path = path.display())]
    Picture {
        /// The picture.
        path: PathBuf,
        /// What is wrong.
        source: PictureError,
    },
    /// Measured marks give no calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// The same of marks from a file.
    #[error("{path}: {source}", path = path.display())]
    Points {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CalibrateError,
    },
    /// Commands of a controller in a table of points.
    #[error("{path}: it holds commands of a controller, say how many of its units are a millimetre with --units-per-mm", path = path.display())]
    Units {
        /// The table.
        path: PathBuf,
    },
    /// A pattern without anything to be measured.
    #[error("{path}: no cross, dot or crossing of lines is in it", path = path.display())]
    NoSights {
        /// The pattern.
        path: PathBuf,
    },
    /// A pattern file is at fault.
    #[error("{path}: {source}", path = path.display())]
    PatternFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PatternFileError,
    },
    /// A file gives no picture.
    #[error("{path}: {source}", path = path.display())]
    PictureFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PictureFileError,
    },
    /// A camera gives no picture.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A photograph cannot be rehearsed.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// A plan file is at fault.
    #[error("{path}: {source}", path = path.display())]
    PlanFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: PlanFileError,
    },
    /// A plan file does not hold what its id stands for.
    #[error("{path}: its content has the id {found}, the file says {claimed}", path = path.display())]
    PlanId {
        /// The file.
        path: PathBuf,
        /// Hash of the content.
        found: String,
        /// Id in the file.
        claimed: String,
    },
    /// The job does not fit the field, or cannot be laid.
    #[error(transparent)]
    Lay(#[from] LayError),
    /// The toolpath cannot be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A jump cannot be planned.
    #[error(transparent)]
    Jump(#[from] JumpError),
    /// A planner that this machine does not allow.
    #[error("planner {planner} is not possible on this machine: {why}")]
    NoPlanner {
        /// What was asked for.
        planner: &'static str,
        /// Why not.
        why: &'static str,
    },
    /// The plan is refused.
    #[error(transparent)]
    Audit(#[from] AuditError),
    /// A motion law is at fault.
    #[error(transparent)]
    MotionLaw(#[from] MotionLawError),
    /// A mechanism cannot be computed.
    #[error(transparent)]
    Mechanism(#[from] MechanismError),
    /// The machine's servo cannot be built.
    #[error(transparent)]
    Servo(#[from] ServoError),
    /// The twin does not go on.
    #[error(transparent)]
    Twin(#[from] TwinError),
}

/// An error in parts, for programs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fault {
    /// One sentence.
    pub message: String,
    /// File, line, element, mark or key.
    pub place: String,
    /// What was found there.
    pub value: String,
    /// What is allowed.
    pub limit: String,
}

impl Error {
    /// The same with the file that the marks come from.
    #[must_use]
    pub fn of_points(self, path: Option<&Path>) -> Self {
        match (self, path) {
            (Self::Calibrate(source), Some(path)) => Self::Points { path: path.into(), source },
            (other, _) => other,
        }
    }

    /// The error in parts.
    pub fn fault(&self) -> Fault {
        let (place, value, limit) = match self {
            Self::Io { path, source, .. } => {
                (path.display().to_string(), source.to_string(), String::new())
            }
            Self::TooLarge { path, n_bytes, limit } => {
                (path.display().to_string(), format!("{n_bytes} bytes"), format!("{limit} bytes"))
            }
            Self::Format { path, expected } => {
                (path.display().to_string(), "unknown kind of file".into(), (*expected).into())
            }
            Self::NoMachine { name, presets } => {
                ("--machine".into(), name.clone(), presets.clone())
            }
            Self::NoRoom { z_mm, limit_mm } => {
                ("--z-mm".into(), format!("{z_mm} mm"), format!("below {limit_mm} mm"))
            }
            Self::NeedsMachine { path } => {
                (path.display().to_string(), "no --machine".into(), "a preset or a file".into())
            }
            Self::Filled { path } => {
                (path.display().to_string(), "measured places".into(), "none, or no file".into())
            }
            Self::Svg { path, source } => in_file(path, source.fault()),
            Self::Toml(error) => error.fault(),
            Self::Table(error) => error.fault(),
            Self::Pattern(error) => error.fault(),
            Self::CorrectionFile { path, source } => in_file(path, source.fault()),
            Self::CorFile { path, source } => in_file(path, source.fault()),
            Self::Exchange { path, source } => in_file(path, source.fault()),
            Self::Delay { path, source } => {
                let (place, value, limit) = source.fault();
                (format!("{}: {place}", path.display()), value, limit)
            }
            Self::CameraFile { path, source } => in_file(path, source.fault()),
            Self::CameraCalibration(error) => error.fault(),
            Self::Picture { path, source } => in_file(path, source.fault()),
            Self::Calibrate(error) => error.fault(),
            Self::Points { path, source } => in_file(path, source.fault()),
            Self::Units { path } => {
                (path.display().to_string(), "no --units-per-mm".into(), "above 0".into())
            }
            Self::NoSights { path } => {
                (path.display().to_string(), "0 places".into(), "at least one".into())
            }
            Self::Field { path, source } => in_file(path, source.fault()),
            Self::PatternFile { path, source } => in_file(path, source.fault()),
            Self::PictureFile { path, source } => in_file(path, source.fault()),
            Self::Camera(error) => error.fault(),
            Self::Photograph(error) => ("photograph".into(), error.to_string(), String::new()),
            Self::PlanFile { path, source } => in_file(path, source.fault()),
            Self::PlanId { path, found, claimed } => {
                (path.display().to_string(), found.clone(), claimed.clone())
            }
            Self::Lay(error) => error.fault(),
            Self::Plan(error) => error.fault(),
            Self::Jump(error) => error.fault(),
            Self::NoPlanner { planner, why } => {
                ("--planner".into(), (*planner).into(), (*why).into())
            }
            Self::Audit(error) => error.fault(),
            Self::MotionLaw(error) => error.fault(),
            Self::Mechanism(error) => error.fault(),
            Self::Servo(error) => error.fault(),
            Self::Twin(error) => ("twin".into(), error.to_string(), String::new()),
        };
        Fault { message: self.to_string(), place, value, limit }
    }
}

/// Place, value and limit of a fault in a file.
fn in_file(
    path: &Path,
    (place, value, limit): (String, String, String),
) -> (String, String, String) {
    let path = path.display();
    (if place.is_empty() { path.to_string() } else { format!("{path}: {place}") }, value, limit)
}
