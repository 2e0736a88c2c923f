//! Properties as an element states them: attributes, rules and `style`, the strongest of each.

use super::css::StyleSheets;
use super::drawing::{Node, plain_attribute};
use simplecss::Declaration;
use svgtypes::Paint;

macro_rules! properties {
    ($($variant:ident = $name:literal,)*) => {
        /// A property that this reader knows.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Property {
            $(#[doc = $name] $variant,)*
        }

        const N_PROPERTIES: usize = [$($name),*].len();

        fn property_of(name: &str) -> Option<Property> {
            match name {
                $($name => Some(Property::$variant),)*
                _ => None,
            }
        }
    };
}

properties! {
    BaselineShift = "baseline-shift",
    ClipPath = "clip-path",
    Color = "color",
    Display = "display",
    DominantBaseline = "dominant-baseline",
    Fill = "fill",
    FillOpacity = "fill-opacity",
    FillRule = "fill-rule",
    Filter = "filter",
    Font = "font",
    FontFamily = "font-family",
    FontSize = "font-size",
    FontStyle = "font-style",
    FontWeight = "font-weight",
    LetterSpacing = "letter-spacing",
    Marker = "marker",
    MarkerEnd = "marker-end",
    MarkerMid = "marker-mid",
    MarkerStart = "marker-start",
    Mask = "mask",
    Opacity = "opacity",
    StopColor = "stop-color",
    Stroke = "stroke",
    StrokeDasharray = "stroke-dasharray",
    StrokeDashoffset = "stroke-dashoffset",
    StrokeOpacity = "stroke-opacity",
    StrokeWidth = "stroke-width",
    TextAnchor = "text-anchor",
    TextDecoration = "text-decoration",
    Transform = "transform",
    TransformOrigin = "transform-origin",
    Visibility = "visibility",
    WordSpacing = "word-spacing",
    WritingMode = "writing-mode",
}

/// The strongest value of each property on one element.
pub struct Declared<'a> {
    values: [Option<&'a str>; N_PROPERTIES],
    important: [bool; N_PROPERTIES],
    /// The first paint that is none.
    bad_paint: Option<(&'static str, &'a str)>,
}

impl<'a> Declared<'a> {
    /// Gathers what applies to `node`, without what it inherits.
    pub fn of(node: Node<'a>, style_sheets: &StyleSheets<'a>) -> Self {
        let mut declared = Self {
            values: [None; N_PROPERTIES],
            important: [false; N_PROPERTIES],
            bad_paint: None,
        };
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            declared.set(attribute.name(), attribute.value(), false);
        }
        style_sheets.declare(node, |declaration| {
            declared.set(declaration.name, declaration.value, declaration.important);
        });
        if let Some(style) = plain_attribute(node, "style") {
            for declaration in inline(style) {
                declared.set(declaration.name, declaration.value, declaration.important);
            }
        }
        declared
    }

    /// The value of a property; `None` also for `inherit`.
    pub fn get(&self, property: Property) -> Option<&'a str> {
        self.values[property as usize].filter(|value| *value != "inherit")
    }

    /// Whether a property asks for something other than what it is without being stated.
    pub fn asks(&self, property: Property) -> bool {
        let nothing = ["none", "auto", "normal", "baseline", "alphabetic", "0", "0%"];
        let horizontal = ["lr", "lr-tb", "horizontal-tb"];
        self.get(property)
            .is_some_and(|value| !nothing.contains(&value) && !horizontal.contains(&value))
    }

    /// What was stated but has no meaning.
    pub fn fault(&self) -> Option<String> {
        let (name, value) = self.bad_paint?;
        Some(format!("{name}=\"{value}\" is no paint, ignored"))
    }

    fn set(&mut self, name: &str, value: &'a str, important: bool) {
        let Some(property) = property_of(name) else {
            return;
        };
        let value = value.trim();
        let paint_name = match property {
            Property::Fill => Some("fill"),
            Property::Stroke => Some("stroke"),
            _ => None,
        };
        if let Some(paint_name) = paint_name.filter(|_| Paint::from_str(value).is_err()) {
            self.bad_paint.get_or_insert((paint_name, value));
            return;
        }
        let index = property as usize;
        if important || !self.important[index] {
            self.values[index] = Some(value);
            self.important[index] = important;
        }
    }
}

/// The declarations of a `style` attribute.
///
/// simplecss would end them at the first `/`, as in `font: 4px/1 sans-serif`.
fn inline(style: &str) -> impl Iterator<Item = Declaration<'_>> {
    let mut quote = None;
    let mut depth = 0_usize;
    let ends = move |character: char| {
        match (quote, character) {
            (Some(open), _) if open == character => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(character),
            (None, '(') => depth += 1,
            (None, ')') => depth = depth.saturating_sub(1),
            _ => {}
        }
        character == ';' && quote.is_none() && depth == 0
    };
    style.split(ends).filter_map(|declaration| {
        let (name, value) = declaration.split_once(':')?;
        let plain = value.trim_end().strip_suffix("!important");
        Some(Declaration {
            name: without_comment(name),
            value: plain.unwrap_or(value),
            important: plain.is_some(),
        })
    })
}

/// A name without the comment that may stand before it.
fn without_comment(name: &str) -> &str {
    name.rsplit("*/").next().unwrap_or(name).trim()
}
