//! Why a picture gives no field.

use thiserror::Error;

/// Why a picture gives no field: no number rather than a wrong one, and what to do.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PictureError {
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
    /// A pattern without marks to measure.
    #[error(
        "a pattern of kind \"{kind}\" has no crosses or dots; give the .json that `ftheta pattern \
         grid` wrote"
    )]
    NoMarks {
        /// Kind of the pattern.
        kind: String,
    },
    /// Marks that are not in rows and columns.
    #[error("mark {id} of the pattern is not in line with its row and column, or there twice")]
    NotAGrid {
        /// The mark.
        id: String,
    },
    /// A picture of another size than the camera's.
    #[error(
        "the picture has {} x {} pixels, the camera file is of {} x {}: take it with the same camera \
         and settings", found[0], found[1], known[0], known[1]
    )]
    OtherSize {
        /// Width and height, px.
        found: [usize; 2],
        /// Those of the camera file.
        known: [usize; 2],
    },
    /// Too few signs of a sheet.
    #[error(
        "{n_found} of the sheet's {n_signs} printed signs are in the picture, the limit is {limit}: \
         take the whole sheet, sharp and evenly lit"
    )]
    FewSigns {
        /// Signs found.
        n_found: usize,
        /// Signs of the pattern.
        n_signs: usize,
        /// Fewest of them.
        limit: usize,
    },
    /// Signs that the pattern does not have.
    #[error(
        "sign {number} is in the picture and not in the pattern: is it the .json that was written \
         with this sheet?"
    )]
    StrangeSign {
        /// Its number.
        number: usize,
    },
    /// A sign that is there twice.
    #[error("sign {number} is in the picture twice: take one sheet alone")]
    SignTwice {
        /// Its number.
        number: usize,
    },
    /// Mirrored.
    #[error("the picture is mirrored: mirror it back, or photograph the marked side")]
    Mirrored,
    /// Signs that do not lie as the sheet's.
    #[error(
        "the sheet's signs are {rms_px:.2} px off where they should be, the limit is {limit_px:.2} \
         px: lay the sheet flat, and check that it is this sheet"
    )]
    Bent {
        /// What is left, px rms.
        rms_px: f64,
        /// Greatest, px rms.
        limit_px: f64,
    },
    /// No measure of length.
    #[error(
        "nothing in the picture says how large it is: print a sheet (`ftheta pattern grid \
         --fiducials`), or give a scanner's --um-per-px, or a camera file with a kept view"
    )]
    NoScale,
    /// A printed sheet whose size is not known.
    #[error(
        "printers are off by some tenths of a percent: measure the printed line along {axis} \
         ({nominal_mm:.1} mm) and give --sheet-{axis}-mm"
    )]
    SheetSize {
        /// The axis.
        axis: char,
        /// Length of the line in the drawing, mm.
        nominal_mm: f64,
    },
    /// A printed sheet that cannot have this size.
    #[error(
        "the printed line along {axis} is {nominal_mm:.1} mm in the drawing, so {measured_mm} mm is \
         off by more than {limit_percent} %: was it printed at 100 %?"
    )]
    WrongSheetSize {
        /// The axis.
        axis: char,
        /// Length of the line in the drawing, mm.
        nominal_mm: f64,
        /// What was measured, mm.
        measured_mm: f64,
        /// Greatest difference, percent.
        limit_percent: f64,
    },
    /// Marks that are not there.
    #[error(
        "{n_found} of the pattern's {n_marks} marks are in the picture, the limit is {limit}: is it \
         the whole pattern, in focus, and the right .json?"
    )]
    FewMarks {
        /// Marks found.
        n_found: usize,
        /// Marks of the pattern.
        n_marks: usize,
        /// Fewest of them.
        limit: usize,
    },
    /// A grid of another size.
    #[error(
        "the grid in the picture has {} columns and {} rows, the pattern's {} and {}: take all of it \
         and nothing else, and give its own .json", found[0], found[1], known[0], known[1]
    )]
    OtherGrid {
        /// Columns and rows in the picture.
        found: [usize; 2],
        /// Columns and rows of the pattern.
        known: [usize; 2],
    },
    /// Two grids.
    #[error(
        "{n_beside} marks beside the grid of {n_marks} form another one: take one pattern alone"
    )]
    TwoGrids {
        /// Marks of the first grid.
        n_marks: usize,
        /// Marks of the other.
        n_beside: usize,
    },
    /// Too coarse a picture.
    #[error(
        "marks are {size_px:.1} px across, the limit is {limit_px:.0} px: come nearer, or use a \
         finer picture"
    )]
    Coarse {
        /// Size of a mark, px.
        size_px: f64,
        /// Least size, px.
        limit_px: f64,
    },
    /// Out of focus.
    #[error(
        "the picture is too blurred: lines are {width_px:.1} px wide and marks {size_px:.0} px \
         across, the limit is {limit_px:.1} px; focus, hold still, or come nearer"
    )]
    Blurred {
        /// Width of a line, px.
        width_px: f64,
        /// Size of a mark, px.
        size_px: f64,
        /// Greatest width, px.
        limit_px: f64,
    },
    /// Brightness cut off at white.
    #[error(
        "{share:.0} % of the marks lie on white that is cut off, the limit is {limit:.0} %: expose \
         less, and avoid glare"
    )]
    Saturated {
        /// Share of the marks, percent.
        share: f64,
        /// Greatest share, percent.
        limit: f64,
    },
}

impl PictureError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let three = |place: &str, value: String, limit: String| (place.to_owned(), value, limit);
        match self {
            Self::NoContrast { contrast, limit, .. } => {
                three("contrast", format!("{contrast:.3}"), format!("{limit:.3}"))
            }
            Self::NoMarks { kind } => three("pattern kind", kind.clone(), "grid".into()),
            Self::NotAGrid { id } => three("pattern mark", id.clone(), "rows and columns".into()),
            Self::FewSigns { n_found, limit, .. } => {
                three("signs", n_found.to_string(), limit.to_string())
            }
            Self::OtherSize { found: [w, h], known: [width, height] } => {
                three("picture", format!("{w} x {h}"), format!("{width} x {height}"))
            }
            Self::StrangeSign { number } => {
                three("sign", number.to_string(), "those of the pattern".into())
            }
            Self::SignTwice { number } => three("sign", number.to_string(), "once".into()),
            Self::Mirrored => three("picture", "mirrored".into(), "not mirrored".into()),
            Self::Bent { rms_px, limit_px } => {
                three("signs, px", format!("{rms_px:.2}"), format!("{limit_px:.2}"))
            }
            Self::NoScale => three("scale", "unknown".into(), "a sheet, or --um-per-px".into()),
            Self::SheetSize { axis, nominal_mm } => {
                three(&format!("--sheet-{axis}-mm"), "missing".into(), format!("{nominal_mm:.1}"))
            }
            Self::WrongSheetSize { axis, nominal_mm, measured_mm, limit_percent } => three(
                &format!("--sheet-{axis}-mm"),
                measured_mm.to_string(),
                format!("{nominal_mm:.1} within {limit_percent} %"),
            ),
            Self::FewMarks { n_found, limit, .. } => {
                three("marks", n_found.to_string(), limit.to_string())
            }
            Self::OtherGrid { found: [c, r], known: [columns, rows] } => {
                three("grid", format!("{c} x {r}"), format!("{columns} x {rows}"))
            }
            Self::TwoGrids { n_beside, .. } => {
                three("marks beside the grid", n_beside.to_string(), "0".into())
            }
            Self::Coarse { size_px, limit_px } => {
                three("mark, px", format!("{size_px:.1}"), format!("{limit_px:.0}"))
            }
            Self::Blurred { width_px, limit_px, .. } => {
                three("line, px", format!("{width_px:.1}"), format!("{limit_px:.1}"))
            }
            Self::Saturated { share, limit } => {
                three("saturated, %", format!("{share:.0}"), format!("{limit:.0}"))
            }
        }
    }
}
