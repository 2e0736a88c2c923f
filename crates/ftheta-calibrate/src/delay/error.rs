//! Why a picture gives no delays.

use thiserror::Error;

/// Why a picture gives no delays: no number rather than a wrong one, and what to do.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DelayError {
    /// Nothing stands out.
    #[error(
        "nothing stands out in the picture: the contrast is {contrast:.3} of full scale, the limit \
         {limit:.3} with noise of {noise:.3}; light the marks from the side, or mark with more power"
    )]
    NoContrast {
        /// Contrast, of full scale.
        contrast: f64,
        /// Noise, of full scale.
        noise: f64,
        /// Least contrast.
        limit: f64,
    },
    /// Far too much stands out.
    #[error(
        "{n_pieces} pieces stand out in the picture, the limit is {limit}: is it a picture of the \
         pattern? Crop it to the pattern, or use smoother material"
    )]
    Clutter {
        /// Pieces found.
        n_pieces: usize,
        /// Most of them.
        limit: usize,
    },
    /// A pattern without lines to measure.
    #[error(
        "a pattern of kind \"{kind}\" has no lines whose ends could be measured; give the .json \
         that `ftheta pattern delay` wrote"
    )]
    NoLines {
        /// Kind of the pattern.
        kind: String,
    },
    /// Lines of the pattern that run another way.
    #[error("line {id} of the pattern is not parallel to the first one")]
    NotParallel {
        /// The line.
        id: String,
    },
    /// Lines of the pattern in the same place.
    #[error("lines {} and {} of the pattern lie on top of each other", ids[0], ids[1])]
    OnTop {
        /// The lines.
        ids: [String; 2],
    },
    /// Lines of the pattern that do not separate what is sought.
    #[error("{what}: {found}, at least {limit} are needed")]
    Pattern {
        /// What is missing.
        what: &'static str,
        /// What there is.
        found: usize,
        /// Least number.
        limit: usize,
    },
    /// Lines that are not in the picture.
    #[error(
        "{n_found} of the pattern's {n_lines} lines are in the picture ({n_strokes} strokes in \
         all), the limit is {limit}: is it the whole pattern, in focus, and the right .json?"
    )]
    LinesMissing {
        /// Rows that agree with the pattern.
        n_found: usize,
        /// Rows of the pattern.
        n_lines: usize,
        /// Strokes in the picture.
        n_strokes: usize,
        /// Fewest rows.
        limit: usize,
    },
    /// More lines than the pattern has.
    #[error(
        "{n_found} lines are in the picture, the pattern has {n_lines}: crop the picture to one \
         pattern, and give that pattern's .json"
    )]
    TooManyLines {
        /// Rows in the picture.
        n_found: usize,
        /// Rows of the pattern.
        n_lines: usize,
    },
    /// Lines that lie as the pattern's but do not begin or end as they should.
    #[error(
        "the picture's lines do not lie as the pattern's {n_lines} do, whichever way it is turned: \
         is it the right .json?"
    )]
    NotThePattern {
        /// Rows of the pattern.
        n_lines: usize,
    },
    /// Two ways to lay the pattern on the picture.
    #[error(
        "it cannot be told how the picture lies: one way leaves {first_px:.1} px, another \
         {second_px:.1} px, the limit is {limit_px:.1} px; take the whole pattern with its \
         reference lines"
    )]
    Orientation {
        /// What the best way leaves, px.
        first_px: f64,
        /// What the next one leaves, px.
        second_px: f64,
        /// Least of it, px.
        limit_px: f64,
    },
    /// References that are not in the picture, or others beside them.
    #[error(
        "{n_found} lines across the rows are in the picture, the pattern has {n_columns} reference \
         lines there: take the whole pattern with nothing else, and keep dirt and glare off them"
    )]
    References {
        /// Lines across the rows.
        n_found: usize,
        /// Those of the pattern.
        n_columns: usize,
    },
    /// Mirrored.
    #[error(
        "the picture is mirrored: its reference lines are on the wrong side; mirror it back, or \
         photograph the marked side"
    )]
    Mirrored,
    /// Out of focus.
    #[error(
        "the picture is too blurred: edges are {blur_px:.1} px soft and rows {pitch_px:.1} px \
         apart, the limit is {limit_px:.1} px; focus, hold still, or come nearer"
    )]
    Blurred {
        /// Softness of an edge, px.
        blur_px: f64,
        /// Distance of rows, px.
        pitch_px: f64,
        /// Greatest softness, px.
        limit_px: f64,
    },
    /// Brightness cut off at white.
    #[error(
        "{share:.0} % of the line ends lie on white that is cut off, the limit is {limit:.0} %: \
         expose less, and avoid glare"
    )]
    Saturated {
        /// Share of the ends, percent.
        share: f64,
        /// Greatest share, percent.
        limit: f64,
    },
    /// Too many ends that are of no use.
    #[error(
        "{n_rejected} of {n_ends} line ends are of no use, the limit is {limit}: most often because \
         {reason}"
    )]
    Rejected {
        /// Ends of no use.
        n_rejected: usize,
        /// Ends in all.
        n_ends: usize,
        /// Most of them.
        limit: usize,
        /// The commonest reason.
        reason: &'static str,
    },
    /// A view that cannot be fitted, or leaves too much.
    #[error(
        "the pattern's rows lie {rms_px:.2} px off where they should, the limit is {limit_px:.2} \
         px: lay the material flat, and take the picture square on"
    )]
    Bent {
        /// What is left, px rms.
        rms_px: f64,
        /// Greatest, px rms.
        limit_px: f64,
    },
    /// Delays that are not known well enough to be used.
    #[error(
        "the delays would be uncertain by {sd_us:.1} µs, the limit is {limit_us:.1} µs: come \
         nearer, light better, or mark more and faster lines"
    )]
    Uncertain {
        /// Standard deviation, µs.
        sd_us: f64,
        /// Greatest, µs.
        limit_us: f64,
    },
    /// Ends that no delays explain.
    #[error(
        "line ends lie {rms_um:.0} µm off where any delays would put them, the limit is \
         {limit_um:.0} µm: is it the right .json, and were the lines marked at its speeds?"
    )]
    Scattered {
        /// What is left, µm rms.
        rms_um: f64,
        /// Greatest, µm.
        limit_um: f64,
    },
    /// Gaps that do not show.
    #[error(
        "{n_free} of {n_ends} line ends stand free of the rectangle's sides, all have to: mark \
         again with light switched on later and off earlier (--preset-us), or faster"
    )]
    NoGap {
        /// Ends that stand free.
        n_free: usize,
        /// Ends of lines.
        n_ends: usize,
    },
    /// A rectangle without its sides.
    #[error(
        "{n_sides} lines across its rows were burned in the pattern, a rectangle has at least 2: \
         use --method comb, or the .json that `ftheta pattern delay --method rectangle` wrote"
    )]
    NoSides {
        /// References across the rows.
        n_sides: usize,
    },
}

impl DelayError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (&'static str, String, String) {
        match self {
            Self::NoContrast { contrast, limit, .. } => {
                ("contrast", format!("{contrast:.3}"), format!("{limit:.3}"))
            }
            Self::Clutter { n_pieces, limit } => {
                ("pieces", n_pieces.to_string(), limit.to_string())
            }
            Self::NoLines { kind } => ("pattern kind", kind.clone(), "lines".into()),
            Self::NotParallel { id } => ("pattern line", id.clone(), "parallel".into()),
            Self::OnTop { ids } => ("pattern lines", ids.join(", "), "apart".into()),
            Self::Pattern { what, found, limit } => (*what, found.to_string(), limit.to_string()),
            Self::LinesMissing { n_found, limit, .. } => {
                ("lines", n_found.to_string(), limit.to_string())
            }
            Self::TooManyLines { n_found, n_lines } => {
                ("lines", n_found.to_string(), n_lines.to_string())
            }
            Self::NotThePattern { n_lines } => {
                ("lines", "elsewhere".into(), format!("the pattern's {n_lines}"))
            }
            Self::Orientation { second_px, limit_px, .. } => {
                ("orientation, px", format!("{second_px:.1}"), format!("{limit_px:.1}"))
            }
            Self::References { n_found, n_columns } => {
                ("reference lines", n_found.to_string(), n_columns.to_string())
            }
            Self::Mirrored => ("picture", "mirrored".into(), "not mirrored".into()),
            Self::Blurred { blur_px, limit_px, .. } => {
                ("blur, px", format!("{blur_px:.1}"), format!("{limit_px:.1}"))
            }
            Self::Saturated { share, limit } => {
                ("saturated, %", format!("{share:.0}"), format!("{limit:.0}"))
            }
            Self::Rejected { n_rejected, limit, .. } => {
                ("rejected ends", n_rejected.to_string(), limit.to_string())
            }
            Self::Bent { rms_px, limit_px } => {
                ("rows, px", format!("{rms_px:.2}"), format!("{limit_px:.2}"))
            }
            Self::Uncertain { sd_us, limit_us } => {
                ("deviation, µs", format!("{sd_us:.1}"), format!("{limit_us:.1}"))
            }
            Self::Scattered { rms_um, limit_um } => {
                ("line ends, µm", format!("{rms_um:.0}"), format!("{limit_um:.0}"))
            }
            Self::NoGap { n_free, n_ends } => ("free ends", n_free.to_string(), n_ends.to_string()),
            Self::NoSides { n_sides } => ("pattern sides", n_sides.to_string(), "2".into()),
        }
    }
}
