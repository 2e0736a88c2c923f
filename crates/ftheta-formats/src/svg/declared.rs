//! Properties as an element states them: attributes, rules and `style`, the strongest of each.

use super::css::StyleSheets;
use super::drawing::{Node, plain_attribute};
use simplecss::DeclarationTokenizer;

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
    ClipPath = "clip-path",
    Color = "color",
    Display = "display",
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
    Transform = "transform",
    Visibility = "visibility",
    WordSpacing = "word-spacing",
}

/// The strongest value of each property on one element.
pub struct Declared<'a> {
    values: [Option<&'a str>; N_PROPERTIES],
    important: [bool; N_PROPERTIES],
}

impl<'a> Declared<'a> {
    /// Gathers what applies to `node`, without what it inherits.
    pub fn of(node: Node<'a>, style_sheets: &StyleSheets<'a>) -> Self {
        let mut declared = Self {
            values: [None; N_PROPERTIES],
            important: [false; N_PROPERTIES],
        };
        for attribute in node
            .attributes()
            .filter(|attribute| attribute.namespace().is_none())
        {
            declared.set(attribute.name(), attribute.value(), false);
        }
        style_sheets.declare(node, |declaration| {
            declared.set(declaration.name, declaration.value, declaration.important);
        });
        if let Some(style) = plain_attribute(node, "style") {
            for declaration in DeclarationTokenizer::from(style) {
                declared.set(declaration.name, declaration.value, declaration.important);
            }
        }
        declared
    }

    /// The value of a property; `None` also for `inherit`.
    pub fn get(&self, property: Property) -> Option<&'a str> {
        self.values[property as usize].filter(|value| *value != "inherit")
    }

    /// Whether a property refers to something: neither absent nor `none`.
    pub fn refers(&self, property: Property) -> bool {
        self.get(property).is_some_and(|value| value != "none")
    }

    fn set(&mut self, name: &str, value: &'a str, important: bool) {
        let Some(property) = property_of(name) else {
            return;
        };
        let index = property as usize;
        if important || !self.important[index] {
            self.values[index] = Some(value.trim());
            self.important[index] = important;
        }
    }
}
