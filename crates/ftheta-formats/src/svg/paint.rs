//! Paint of areas and lines as one colour.

use super::declared::{Declared, Property};
use super::drawing::{Drawing, Node, href_of, tag_of};
use super::style::Style;
use std::str::FromStr;
use svgtypes::{Color, PaintFallback};

/// Gradients that refer to each other are followed this far.
const N_GRADIENT_LINKS_MAX: usize = 32;

/// What an area or a line is painted with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint<'a> {
    /// Nothing: it is not marked.
    None,
    /// A colour, RGB.
    Color([u8; 3]),
    /// A gradient or pattern, taken as one colour.
    Server {
        /// Its first colour, RGB.
        color_rgb: [u8; 3],
        /// Its id.
        id: &'a str,
    },
    /// A reference that leads nowhere.
    Missing(&'a str),
}

impl<'a> Paint<'a> {
    /// Reads a value of `fill` or `stroke`; `None` if it is none or `inherit`.
    ///
    /// * `style`: gives what `currentColor` and the context's paints mean
    pub fn parse(text: &'a str, style: &Style<'a>, drawing: &Drawing<'a>) -> Option<Self> {
        Some(match svgtypes::Paint::from_str(text).ok()? {
            svgtypes::Paint::None => Self::None,
            svgtypes::Paint::Inherit => return None,
            svgtypes::Paint::CurrentColor => Self::Color(style.color_rgb),
            svgtypes::Paint::Color(color) => Self::visible(color),
            svgtypes::Paint::FuncIRI(id, fallback) => match (drawing.by_id(id), fallback) {
                (Some(server), _) => Self::Server {
                    color_rgb: first_stop(server, drawing).unwrap_or(style.color_rgb),
                    id,
                },
                (None, Some(PaintFallback::Color(color))) => Self::visible(color),
                (None, Some(PaintFallback::CurrentColor)) => Self::Color(style.color_rgb),
                (None, Some(PaintFallback::None)) => Self::None,
                (None, None) => Self::Missing(id),
            },
            svgtypes::Paint::ContextFill => style.fill,
            svgtypes::Paint::ContextStroke => style.stroke,
        })
    }

    fn visible(color: Color) -> Self {
        if color.alpha == 0 { Self::None } else { Self::Color(rgb(color)) }
    }
}

/// A colour by its CSS text.
pub fn color_rgb(text: &str) -> Option<[u8; 3]> {
    Color::from_str(text).ok().map(rgb)
}

fn rgb(color: Color) -> [u8; 3] {
    [color.red, color.green, color.blue]
}

/// The first colour of a gradient, which may have its stops from another one.
fn first_stop<'a>(server: Node<'a>, drawing: &Drawing<'a>) -> Option<[u8; 3]> {
    let mut server = server;
    for _ in 0..N_GRADIENT_LINKS_MAX {
        let stop = server.children().find(|child| tag_of(*child) == Some("stop"));
        if let Some(stop) = stop {
            let declared = Declared::of(stop, &drawing.style_sheets);
            let color = declared.get(Property::StopColor).and_then(color_rgb);
            return Some(color.unwrap_or([0; 3]));
        }
        server = drawing.by_id(href_of(server)?.strip_prefix('#')?)?;
    }
    None
}
