//! The page: its size in mm, and the map from the drawing's units to the field.

use super::drawing::{Node, inkscape_version, plain_attribute};
use super::error::SvgError;
use super::length::{self, PX_MM};
use super::warnings::Warnings;
use kurbo::{Affine, Rect};
use std::str::FromStr;
use svgtypes::{Align, AspectRatio, ViewBox};

/// Size of the page and the map onto the field.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    /// Width and height, mm.
    pub size_mm: [f64; 2],
    /// From user units, y down, to field mm, y up, with the page's centre on the origin.
    pub field_from_user: Affine,
    /// What percentages refer to, user units.
    pub viewport: [f64; 2],
}

impl Page {
    /// The page that `<svg>` states; `None` if it states neither size nor viewBox.
    ///
    /// # Errors
    /// If a size is zero, negative or no number.
    pub fn of(root: Node<'_>, warnings: &mut Warnings) -> Result<Option<Self>, SvgError> {
        let view_box = view_box_of(root)?;
        let width_mm = side_mm(root, "width", warnings)?;
        let height_mm = side_mm(root, "height", warnings)?;
        let size_mm = match (width_mm, height_mm, view_box) {
            (Some(width), Some(height), _) => [width, height],
            (Some(width), None, Some(view)) => [width, width * view.h / view.w],
            (None, Some(height), Some(view)) => [height * view.w / view.h, height],
            (None, None, Some(view)) => [view.w * 25.4 / 96.0, view.h * 25.4 / 96.0],
            (_, _, None) => return Ok(None),
        };
        let view_box = view_box
            .unwrap_or_else(|| ViewBox::new(0.0, 0.0, size_mm[0] / PX_MM, size_mm[1] / PX_MM));
        let aspect = plain_attribute(root, "preserveAspectRatio")
            .and_then(|text| AspectRatio::from_str(text).ok())
            .unwrap_or_default();
        Ok(Some(Self::new(size_mm, view_box, aspect)))
    }

    /// The page around a content, for files that state none.
    ///
    /// * `content`: bounds of the content, user units
    pub fn around(content: Rect) -> Self {
        let view_box = ViewBox::new(
            content.x0,
            content.y0,
            content.width().max(f64::MIN_POSITIVE),
            content.height().max(f64::MIN_POSITIVE),
        );
        let size_mm = [content.width() * PX_MM, content.height() * PX_MM];
        let center = Affine::translate(-content.center().to_vec2());
        Self {
            field_from_user: Affine::scale_non_uniform(PX_MM, -PX_MM) * center,
            size_mm,
            viewport: [view_box.w, view_box.h],
        }
    }

    /// The user units of a file that states no page, y down, unscaled.
    pub fn bare() -> Self {
        Self { size_mm: [0.0, 0.0], field_from_user: Affine::IDENTITY, viewport: [100.0, 100.0] }
    }

    fn new(size_mm: [f64; 2], view_box: ViewBox, aspect: AspectRatio) -> Self {
        let page_from_user = view_box_map(size_mm, view_box, aspect);
        // Composed by hand: products of exact numbers stay exact, mm for mm.
        let [a, _, _, d, e, f] = page_from_user.as_coeffs();
        let [width_mm, height_mm] = size_mm;
        Self {
            size_mm,
            field_from_user: Affine::new([
                a,
                0.0,
                0.0,
                -d,
                e - 0.5 * width_mm,
                0.5 * height_mm - f,
            ]),
            viewport: [view_box.w, view_box.h],
        }
    }

    /// The same page with its longest side scaled to `side_mm`.
    ///
    /// # Errors
    /// If the size asked for is not above zero, or the page has none.
    pub fn fitted_to(self, side_mm: f64) -> Result<Self, SvgError> {
        let [width_mm, height_mm] = self.size_mm;
        let longest_mm = width_mm.max(height_mm);
        let factor = side_mm / longest_mm;
        if !(0.0 < factor && factor.is_finite()) {
            return Err(SvgError::Fit { value: side_mm });
        }
        let scaled = |length_mm: f64| side_mm * (length_mm / longest_mm);
        Ok(Self {
            size_mm: [scaled(width_mm), scaled(height_mm)],
            field_from_user: Affine::scale(factor) * self.field_from_user,
            viewport: self.viewport,
        })
    }
}

/// The map of a viewBox into a viewport of `size` at the origin.
pub fn view_box_map(size: [f64; 2], view_box: ViewBox, aspect: AspectRatio) -> Affine {
    let mut scale = [size[0] / view_box.w, size[1] / view_box.h];
    if aspect.align != Align::None {
        let uniform = if aspect.slice { scale[0].max(scale[1]) } else { scale[0].min(scale[1]) };
        scale = [uniform, uniform];
    }
    let (part_x, part_y) = match aspect.align {
        Align::None | Align::XMinYMin => (0.0, 0.0),
        Align::XMidYMin => (0.5, 0.0),
        Align::XMaxYMin => (1.0, 0.0),
        Align::XMinYMid => (0.0, 0.5),
        Align::XMidYMid => (0.5, 0.5),
        Align::XMaxYMid => (1.0, 0.5),
        Align::XMinYMax => (0.0, 1.0),
        Align::XMidYMax => (0.5, 1.0),
        Align::XMaxYMax => (1.0, 1.0),
    };
    let left = part_x * (size[0] - view_box.w * scale[0]);
    let top = part_y * (size[1] - view_box.h * scale[1]);
    Affine::new([
        scale[0],
        0.0,
        0.0,
        scale[1],
        left - view_box.x * scale[0],
        top - view_box.y * scale[1],
    ])
}

/// The viewBox of an element, if it has one.
///
/// # Errors
/// If its width or height is zero or negative, or it is not four numbers.
pub fn view_box_of(node: Node<'_>) -> Result<Option<ViewBox>, SvgError> {
    let Some(text) = plain_attribute(node, "viewBox") else {
        return Ok(None);
    };
    ViewBox::from_str(text)
        .map(Some)
        .map_err(|_| SvgError::Page { attribute: "viewBox", value: text.into() })
}

fn side_mm(
    root: Node<'_>,
    attribute: &'static str,
    warnings: &mut Warnings,
) -> Result<Option<f64>, SvgError> {
    let Some(text) = plain_attribute(root, attribute) else {
        return Ok(None);
    };
    if text.trim() == "auto" {
        return Ok(None);
    }
    let wrong = || SvgError::Page { attribute, value: text.into() };
    let (length, unit_known) = length::parse(text).ok_or_else(wrong)?;
    if !unit_known {
        warnings.add("<svg>", format!("unknown unit in {attribute}=\"{text}\", taken as px"));
    }
    match length::absolute_mm(length) {
        Some(side_mm) if 0.0 < side_mm && side_mm.is_finite() => Ok(Some(side_mm)),
        Some(_) => Err(wrong()),
        None => Ok(None),
    }
}

/// Warns if the program that wrote the file counts pixels per inch in another way than SVG does.
pub fn warn_of_dpi(root: Node<'_>, size_mm: [f64; 2], warnings: &mut Warnings) {
    let in_pixels = ["width", "height"].iter().any(|side| {
        plain_attribute(root, side).is_none_or(|text| {
            text.trim_end().ends_with(|last: char| last.is_ascii_digit()) || text.ends_with("px")
        })
    });
    let from_illustrator = root
        .document()
        .root()
        .children()
        .filter(Node::is_comment)
        .any(|comment| comment.text().unwrap_or("").contains("Adobe Illustrator"));
    let from_old_inkscape = inkscape_version(root)
        .and_then(|version| version.strip_prefix("0."))
        .and_then(|version| version.get(..2)?.parse::<u32>().ok())
        .is_some_and(|minor| minor < 92);
    let (program, dpi) = if from_illustrator {
        ("Adobe Illustrator", 72)
    } else if from_old_inkscape {
        ("Inkscape before 0.92", 90)
    } else {
        return;
    };
    if in_pixels {
        let [width, height] = size_mm;
        warnings.add(
            "<svg>",
            format!(
                "sized in px and written by {program}, which counts {dpi} to the inch; read with \
                 96 as SVG says, so the page is {width:.3} x {height:.3} mm"
            ),
        );
    }
}
