//! SVG drawings as jobs: in mm, with curves, hairlines and layers as they were drawn.
//!
//! Every stroke is marked along its centre line, whatever its width; areas are left to the pen's
//! hatch. What cannot be marked is a warning that names the element.

pub mod error;

mod arc;
mod css;
mod dash;
mod declared;
mod decode;
mod drawing;
mod emit;
mod geometry;
mod layer;
mod length;
mod marking;
mod nested;
mod page;
mod paint;
mod path_data;
mod prescan;
mod style;
mod tally;
mod text;
mod typeset;
mod walk;
mod warnings;

use drawing::{Drawing, tag_of};
use error::SvgError;
use ftheta_model::job::Job;
use ftheta_model::recipe::Recipe;
use ftheta_model::warning::Imported;
use kurbo::{Rect, Shape as _};
use page::Page;
use walk::Reader;

/// How a drawing is read.
#[derive(Clone, Debug, Default)]
pub struct SvgOptions {
    /// Look for fonts on this computer; otherwise every font is the bundled one, so that a drawing
    /// gives the same job everywhere.
    pub system_fonts: bool,
    /// Scale the page so that its longest side is this long, mm.
    pub fit_mm: Option<f64>,
    /// Limits of time and memory.
    pub limits: Limits,
}

/// Limits of what is read, so that no file takes unreasonable time or memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of the file, unpacked.
    pub n_bytes_max: usize,
    /// Elements, texts and comments of the file.
    pub n_nodes_max: u32,
    /// Elements that are drawn, those repeated by `<use>` included.
    pub n_elements_max: usize,
    /// Path elements of all shapes.
    pub n_path_elements_max: usize,
    /// Elements inside elements.
    pub depth_max: usize,
}

impl Default for Limits {
    /// 256 MiB, 8 million nodes, 5 million drawn elements, 20 million path elements, 256 levels.
    fn default() -> Self {
        Self {
            n_bytes_max: 256 << 20,
            n_nodes_max: 8_000_000,
            n_elements_max: 5_000_000,
            n_path_elements_max: 20_000_000,
            depth_max: 256,
        }
    }
}

/// Reads an SVG or SVGZ file as a job in field mm.
///
/// * `bytes`: the file
/// * `recipe`: gives each shape its pen, and the style of text
/// * returns shapes in the order of the drawing, the page's centre on the field's centre
///
/// # Errors
/// If the file is damaged, beyond a limit, or has nothing that can be marked.
///
/// # Limits
/// Clips, masks, filters, markers, images and text on a path are left out, each with a warning.
/// Dashes of a closed line start where kurbo starts them. Text has no kerning and no scripts that
/// join letters. A pixel is 1/96 in whatever program wrote the file.
///
/// # Accuracy
/// Lines and Bézier curves are kept as they are, in f64; arcs become cubics within 1e-6 mm.
pub fn read(
    bytes: &[u8],
    recipe: &Recipe,
    options: &SvgOptions,
) -> Result<Imported<Job>, SvgError> {
    let text = decode::text(bytes, &options.limits)?;
    let tree = drawing::parse(&text, &options.limits)?;
    let drawing = Drawing::new(&tree);
    let root = drawing.root();
    if tag_of(root) != Some("svg") {
        return Err(SvgError::NotSvg { tag: root.tag_name().name().into() });
    }
    let mut reader = Reader::new(&drawing, recipe, options);
    let page = match Page::of(root, &mut reader.warnings)? {
        Some(page) => page,
        None => {
            let content = content_bounds(&drawing, recipe, options)?;
            let message = "states no size, so its content in px is taken as the page";
            reader.warnings.add("<svg>", message);
            Page::around(content)
        }
    };
    let page = match options.fit_mm {
        Some(side_mm) => page.fitted_to(side_mm)?,
        None => {
            page::warn_of_dpi(root, page.size_mm, &mut reader.warnings);
            page
        }
    };
    reader.read(&page)?;
    for surprise in reader.tally.surprises() {
        reader.warnings.add("<svg>", surprise);
    }
    if reader.marking.is_empty() {
        let mut reason = reader.tally.reason();
        let faults = reader.tally.n_dropped > 0;
        if let Some(warning) = reader.warnings.into_vec().first().filter(|_| faults) {
            reason.push_str(&format!("; {warning}"));
        }
        return Err(SvgError::NothingToMark { reason });
    }
    Ok(Imported {
        value: reader.marking.into_job(page.size_mm),
        warnings: reader.warnings.into_vec(),
    })
}

/// Bounds of all that is marked, in user units, for files that state no page.
fn content_bounds(
    drawing: &Drawing<'_>,
    recipe: &Recipe,
    options: &SvgOptions,
) -> Result<Rect, SvgError> {
    let mut reader = Reader::new(drawing, recipe, options);
    reader.read(&Page::bare())?;
    let job = reader.marking.into_job([0.0, 0.0]);
    job.shapes()
        .map(|shape| shape.path.bounding_box())
        .reduce(|bounds, shape| bounds.union(shape))
        .ok_or_else(|| SvgError::NothingToMark { reason: reader.tally.reason() })
}
