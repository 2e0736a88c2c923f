//! Why a job cannot be laid out.

/// What is wrong with a job or an option, where, and against which limit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayError {
    /// A mark leaves the square field.
    #[error("{place}: reaches ({x_mm:.3}, {y_mm:.3}) mm, outside the field of ±{half_field_mm} mm")]
    OutsideField {
        /// The element.
        place: String,
        /// A point outside, mm.
        x_mm: f64,
        /// The same point, mm.
        y_mm: f64,
        /// Half the side of the field, mm.
        half_field_mm: f64,
    },
    /// More marks than memory is meant for.
    #[error("{place}: brings the job to {n_marks} marks, more than {n_marks_max}")]
    TooManyMarks {
        /// The element that passed the limit.
        place: String,
        /// Marks up to and with that element, at least.
        n_marks: u64,
        /// Most marks that are laid.
        n_marks_max: u64,
    },
    /// A shape's pen does not exist.
    #[error("{place}: uses pen {pen_index} of {n_pens}")]
    PenMissing {
        /// The element.
        place: String,
        /// Its pen.
        pen_index: usize,
        /// Number of pens there are.
        n_pens: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("{place}: has a coordinate that is not a finite number")]
    NotFinite {
        /// The element.
        place: String,
    },
    /// A length that must be positive is not.
    #[error("{place}: {value_mm} mm is below {limit_mm} mm")]
    TooSmall {
        /// The setting.
        place: String,
        /// Its value, mm.
        value_mm: f64,
        /// Its least value, mm.
        limit_mm: f64,
    },
}

impl LayError {
    /// Where it is wrong, the value, and the limit; empty where there is none.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::OutsideField { place, x_mm, y_mm, half_field_mm } => (
                place.clone(),
                format!("({x_mm:.3}, {y_mm:.3}) mm"),
                format!("±{half_field_mm} mm"),
            ),
            Self::TooManyMarks { place, n_marks, n_marks_max } => {
                (place.clone(), n_marks.to_string(), n_marks_max.to_string())
            }
            Self::PenMissing { place, pen_index, n_pens } => {
                (place.clone(), pen_index.to_string(), n_pens.to_string())
            }
            Self::NotFinite { place } => (place.clone(), "not finite".into(), String::new()),
            Self::TooSmall { place, value_mm, limit_mm } => {
                (place.clone(), format!("{value_mm} mm"), format!("{limit_mm} mm"))
            }
        }
    }
}
