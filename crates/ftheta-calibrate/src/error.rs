//! What keeps marks from becoming a table.

use thiserror::Error;

/// Why marks give no calibration.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Too few marks.
    #[error("{n_marks} marks are too few: {model} needs at least {limit}")]
    TooFew {
        /// Marks at hand.
        n_marks: usize,
        /// Name of the model.
        model: &'static str,
        /// Fewest marks.
        limit: usize,
    },
    /// All on one line.
    #[error(
        "the targets lie on a line: they spread {across_mm:.3} mm across it and {along_mm:.1} mm \
         along it, the limit is a fiftieth"
    )]
    Collinear {
        /// Root mean square across the line, mm.
        across_mm: f64,
        /// Root mean square along it, mm.
        along_mm: f64,
    },
    /// Marks of a drift that lie too near to each other.
    #[error(
        "the marks spread {spread_rad:.4} rad of the mirror along an axis, the limit is {limit_rad} \
         rad: take marks near the field's corners"
    )]
    Narrow {
        /// Root mean square along the axis, mechanical rad.
        spread_rad: f64,
        /// Least spread, rad.
        limit_rad: f64,
    },
    /// Numbers of another unit, most likely.
    #[error(
        "the measured field is {ratio:.4} times as large as the targets ({suspicion}): give both in \
         mm"
    )]
    Unit {
        /// Measured by target.
        ratio: f64,
        /// What it looks like.
        suspicion: &'static str,
    },
    /// Measured by target far from one, without a guess why.
    #[error(
        "the measured field is {ratio:.3} times as large as the targets, the limit is 0.5 to 2; is \
         the focal length in the machine file ({focal_mm} mm) right?"
    )]
    Size {
        /// Measured by target.
        ratio: f64,
        /// First coefficient of the lens, or working distance, mm.
        focal_mm: f64,
    },
    /// Columns exchanged, most likely.
    #[error(
        "the measured places lie on a regular grid ({n_measured} different x for {n_marks} marks) \
         and the targets do not ({n_targets}): are the columns of targets and measured exchanged?"
    )]
    Exchanged {
        /// Marks.
        n_marks: usize,
        /// Different x among the targets.
        n_targets: usize,
        /// Different x among the measured.
        n_measured: usize,
    },
    /// The axes cannot be told.
    #[error(
        "the measured places do not follow the targets: the best of the eight ways to swap and \
         mirror the axes leaves {rms_mm:.1} mm, the field is {field_mm:.0} mm wide"
    )]
    Unrelated {
        /// What an affine map leaves, mm rms.
        rms_mm: f64,
        /// Width of the targets, mm.
        field_mm: f64,
    },
    /// A fit that cannot be solved.
    #[error("{model} cannot be fitted to these {n_marks} marks: the equations have no solution")]
    Singular {
        /// Name of the model.
        model: &'static str,
        /// Marks used.
        n_marks: usize,
    },
    /// A target that nominal optics or the table marked through do not reach.
    #[error(
        "line {line}: the machine does not reach the target ({x_mm}, {y_mm}) mm; is it the right machine?"
    )]
    Target {
        /// Line of the file.
        line: u32,
        /// The target, mm.
        x_mm: f64,
        /// The target, mm.
        y_mm: f64,
    },
    /// The model has no angles for a place of the table.
    #[error(
        "the calibrated head reaches no place near x {x_mm:.1} mm, y {y_mm:.1} mm, so no table can \
         be made; look for wrong rows near it"
    )]
    Unreachable {
        /// The place, mm.
        x_mm: f64,
        /// The place, mm.
        y_mm: f64,
    },
    /// A plane that lies in the head or behind it.
    #[error("there is no room for a plane at a height of {z_mm} mm below the head")]
    Room {
        /// Its height above the nominal work plane, mm.
        z_mm: f64,
    },
    /// A plane for a table that has drifted since.
    #[error(
        "the table has a drift, which would be laid over the new plane too: add planes to the \
         table as it was made, and follow the drift again after it"
    )]
    Drifted,
    /// The table made is not usable.
    #[error("{0}")]
    Table(#[from] ftheta_physics::correction::CorrectionError),
}

impl CalibrateError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let (place, value, limit) = match *self {
            Self::TooFew { n_marks, model, limit } => {
                ("points", format!("{n_marks} marks"), format!("{limit} marks for {model}"))
            }
            Self::Collinear { across_mm, along_mm } => (
                "points: targets",
                format!("{across_mm:.3} mm across, {along_mm:.1} mm along"),
                "a fiftieth".into(),
            ),
            Self::Narrow { spread_rad, limit_rad } => {
                ("points", format!("{spread_rad:.4} rad"), format!("{limit_rad} rad"))
            }
            Self::Unit { ratio, .. } | Self::Size { ratio, .. } => {
                ("points: measured by targets", format!("{ratio:.4}"), "0.5 to 2".into())
            }
            Self::Exchanged { n_targets, n_measured, .. } => (
                "points: columns",
                format!("{n_targets} different x of targets"),
                format!("{n_measured}, as of the measured"),
            ),
            Self::Unrelated { rms_mm, field_mm } => (
                "points",
                format!("{rms_mm:.1} mm rms left"),
                format!("a small part of {field_mm:.0} mm"),
            ),
            Self::Singular { model, n_marks } => {
                ("points", format!("{n_marks} marks"), format!("what {model} can be fitted to"))
            }
            Self::Target { line, x_mm, y_mm } => {
                let place = format!("line {line}");
                return (place, format!("({x_mm}, {y_mm}) mm"), "the machine's reach".into());
            }
            Self::Unreachable { x_mm, y_mm } => (
                "table",
                format!("({x_mm:.1}, {y_mm:.1}) mm"),
                "the calibrated head's reach".into(),
            ),
            Self::Room { z_mm } => ("--z-mm", format!("{z_mm} mm"), "below the head".into()),
            Self::Drifted => ("--onto", "a table with a drift".into(), "none".into()),
            Self::Table(ref error) => return error.fault(),
        };
        (place.to_owned(), value, limit)
    }
}
