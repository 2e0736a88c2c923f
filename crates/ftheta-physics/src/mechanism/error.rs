//! What is wrong with a mechanism or with what drives it.

use thiserror::Error;

/// Why a mechanism cannot be computed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MechanismError {
    /// A value that cannot be.
    #[error("{place} = {value} is outside {limit}")]
    Value {
        /// Part and quantity, SI unit last.
        place: String,
        /// Its value.
        value: f64,
        /// What is allowed.
        limit: String,
    },
    /// The mesh is too fine.
    #[error("{n_elements} elements are more than the limit of {limit}")]
    TooManyElements {
        /// Number of elements.
        n_elements: usize,
        /// Greatest number.
        limit: usize,
    },
    /// The bearings leave more than the rotation free.
    #[error(
        "bearings hold too little: besides its rotation the shaft moves at {frequency_hz:.3} Hz, \
         limit {limit_hz} Hz"
    )]
    NotHeld {
        /// Frequency of the motion, Hz.
        frequency_hz: f64,
        /// Least frequency, Hz.
        limit_hz: f64,
    },
    /// The parts differ too much in stiffness for the arithmetic.
    #[error("stiffnesses differ too much: {ratio:.1e} between freedoms, limit about {limit:.0e}")]
    Stiffness {
        /// Greatest by least stiffness on the diagonal.
        ratio: f64,
        /// What double precision carries.
        limit: f64,
    },
    /// The modes were not found.
    #[error("modes do not converge: change {change:.1e} after {n_iterations} iterations")]
    NotConverged {
        /// Greatest relative change of a squared frequency in the last iteration.
        change: f64,
        /// Iterations.
        n_iterations: usize,
    },
    /// No mode is the twist of a shaft between rotor and mirror.
    #[error("none of the {n_modes} lowest modes turns rotor and mirror against each other")]
    NoTorsion {
        /// Number of modes.
        n_modes: usize,
    },
    /// Samples that are no motion.
    #[error("sample {index}: {what}")]
    Samples {
        /// Index of the sample.
        index: usize,
        /// What is wrong with it.
        what: &'static str,
    },
}

impl MechanismError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Value { place, value, limit } => {
                (place.clone(), value.to_string(), limit.clone())
            }
            Self::TooManyElements { n_elements, limit } => {
                ("elements".into(), n_elements.to_string(), limit.to_string())
            }
            Self::NotHeld { frequency_hz, limit_hz } => {
                ("bearings".into(), format!("{frequency_hz:.3} Hz"), format!("{limit_hz} Hz"))
            }
            Self::Stiffness { ratio, limit } => {
                ("stiffness".into(), format!("{ratio:.1e}"), format!("{limit:.0e}"))
            }
            Self::NotConverged { change, n_iterations } => {
                ("modes".into(), format!("{change:.1e}"), format!("{n_iterations} iterations"))
            }
            Self::NoTorsion { n_modes } => (
                "modes".into(),
                format!("no torsion in {n_modes}"),
                "1 torsional mode and more".into(),
            ),
            Self::Samples { index, what } => {
                (format!("sample {index}"), (*what).into(), String::new())
            }
        }
    }
}

/// Refuses a number that does not lie between two others.
pub(super) fn within(
    place: impl Into<String>,
    number: f64,
    above: f64,
    below: f64,
) -> Result<(), MechanismError> {
    if number > above && number < below {
        return Ok(());
    }
    let limit = if below.is_finite() {
        format!("above {above} and below {below}")
    } else {
        format!("above {above}")
    };
    Err(value(place, number, limit))
}

/// A value that cannot be.
pub(super) fn value(
    place: impl Into<String>,
    value: f64,
    limit: impl Into<String>,
) -> MechanismError {
    MechanismError::Value { place: place.into(), value, limit: limit.into() }
}
