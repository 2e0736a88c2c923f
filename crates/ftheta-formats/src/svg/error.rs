//! What can keep an SVG file from being read at all.

/// Why an SVG file cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SvgError {
    /// No bytes, or white space only.
    #[error("the file is empty")]
    Empty,
    /// More bytes than are taken, packed or unpacked.
    #[error("the file has more than {limit} bytes")]
    TooLarge {
        /// Bytes that were seen before reading stopped.
        n_bytes: usize,
        /// Greatest number of bytes.
        limit: usize,
    },
    /// A gzip stream that cannot be unpacked.
    #[error("the compressed file is damaged: {message}")]
    Compressed {
        /// What the decompressor says.
        message: String,
    },
    /// Bytes that are no text in a known encoding.
    #[error("byte {offset} is not text: neither UTF-8 nor UTF-16 with a byte order mark")]
    NotText {
        /// The first byte that does not fit.
        offset: usize,
    },
    /// Markup that breaks the rules of XML.
    #[error("line {line}, column {column}: {message}")]
    Xml {
        /// Line, from 1.
        line: u32,
        /// Column, from 1.
        column: u32,
        /// What the XML parser says.
        message: String,
    },
    /// Markup that stops before its elements are closed.
    #[error("line {line}: the file ends before <svg> is closed")]
    Truncated {
        /// The last line.
        line: u32,
    },
    /// The outermost element is something else.
    #[error("the outermost element is <{tag}>, not <svg>")]
    NotSvg {
        /// The element that was found.
        tag: String,
    },
    /// Elements inside elements beyond the limit.
    #[error("{place}: elements are nested deeper than {limit}")]
    TooDeep {
        /// The first element beyond the limit.
        place: String,
        /// Levels that are followed.
        limit: usize,
    },
    /// A part of the file that would take unreasonable memory or time.
    #[error("{place}: more than {limit} {what}")]
    TooMany {
        /// Where the limit was passed.
        place: String,
        /// What there is too much of.
        what: &'static str,
        /// Greatest number of it.
        limit: usize,
    },
    /// A page without a size in one direction.
    #[error("<svg>: {attribute}=\"{value}\" gives no page, its size must be above 0 and finite")]
    Page {
        /// The attribute that is wrong.
        attribute: &'static str,
        /// Its text.
        value: String,
    },
    /// A size to fit to that is not above zero.
    #[error("cannot fit the page to {value} mm, the size must be above 0 and finite")]
    Fit {
        /// The size asked for, mm.
        value: f64,
    },
    /// A file from which no shape comes.
    #[error("nothing to mark: {reason}")]
    NothingToMark {
        /// What the file holds instead, as far as known.
        reason: String,
    },
}

impl SvgError {
    /// Where it is, the value found there and the limit it breaks; empty where there is none.
    pub fn fault(&self) -> (String, String, String) {
        let above_zero = "above 0".to_owned();
        match self {
            Self::Empty => (String::new(), "0 bytes".into(), String::new()),
            Self::TooLarge { n_bytes, limit } => {
                (String::new(), format!("{n_bytes} bytes"), format!("{limit} bytes"))
            }
            Self::Compressed { message } => (String::new(), message.clone(), String::new()),
            Self::NotText { offset } => {
                (format!("byte {offset}"), String::new(), "UTF-8 or UTF-16".into())
            }
            Self::Xml { line, column, .. } => {
                (format!("line {line}, column {column}"), String::new(), String::new())
            }
            Self::Truncated { line } => (format!("line {line}"), String::new(), "</svg>".into()),
            Self::NotSvg { tag } => (String::new(), format!("<{tag}>"), "<svg>".into()),
            Self::TooDeep { place, limit } => {
                (place.clone(), String::new(), format!("{limit} levels"))
            }
            Self::TooMany { place, what, limit } => {
                (place.clone(), String::new(), format!("{limit} {what}"))
            }
            Self::Page { attribute, value } => {
                (format!("<svg> {attribute}"), value.clone(), above_zero)
            }
            Self::Fit { value } => (String::new(), format!("{value} mm"), above_zero),
            Self::NothingToMark { .. } => <(String, String, String)>::default(),
        }
    }
}
