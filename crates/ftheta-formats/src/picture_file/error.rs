//! Why a file gives no picture.

use thiserror::Error;

/// Why a file gives no picture.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureFileError {
    /// Something else than a picture, or a kind of picture that is not read.
    #[error("this is {found}, expected a PNG, JPEG or TIFF picture")]
    NotPicture {
        /// What the first bytes look like.
        found: String,
    },
    /// More pixels than are read.
    #[error(
        "{width} x {height} are {megapixels} megapixels, more than the limit of {limit}; \
         scale the picture down, or cut out the part with the marks"
    )]
    TooLarge {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// All of them.
        megapixels: usize,
        /// Greatest number of megapixels.
        limit: usize,
    },
    /// A picture that is whole and that is not read all the same.
    #[error("this {kind} picture is {found}; save it as {expected}")]
    Unsupported {
        /// `PNG`, `JPEG` or `TIFF`.
        kind: &'static str,
        /// What is special about it.
        found: String,
        /// What can be read.
        expected: &'static str,
    },
    /// A file that ends before its picture does.
    #[error("this {kind} picture ends too early, after {n_bytes} bytes; copy it once more")]
    Truncated {
        /// `PNG`, `JPEG` or `TIFF`.
        kind: &'static str,
        /// Length of the file.
        n_bytes: usize,
    },
    /// A file whose content cannot be right.
    #[error("this {kind} picture is damaged ({message}); copy it once more, or save it anew")]
    Damaged {
        /// `PNG`, `JPEG` or `TIFF`.
        kind: &'static str,
        /// What its decoder says.
        message: String,
    },
}

impl PictureFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let (place, value, limit) = match self {
            Self::NotPicture { found } => ("first bytes", found.clone(), "PNG, JPEG or TIFF"),
            Self::TooLarge { megapixels, limit, .. } => {
                let limit = format!("{limit} megapixels");
                return ("size".into(), format!("{megapixels} megapixels"), limit);
            }
            Self::Unsupported { found, expected, .. } => ("header", found.clone(), *expected),
            Self::Truncated { n_bytes, .. } => {
                ("end of file", format!("{n_bytes} bytes"), "a whole picture")
            }
            Self::Damaged { message, .. } => ("content", message.clone(), "a whole picture"),
        };
        (place.into(), value, limit.into())
    }
}
