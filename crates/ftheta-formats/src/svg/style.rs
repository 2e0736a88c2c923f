//! Computed style: what an element inherits, overridden by what it states.

use super::declared::{Declared, Property};
use super::drawing::Drawing;
use super::length::{self, Direction, LengthBase};
use super::paint::{Paint, color_rgb};
use ftheta_model::job::FillRule;
use std::rc::Rc;
use svgtypes::{FontShorthand, LengthListParser};

/// How far browsers raise and lower letters, in sizes of the text around them.
const SUPERSCRIPT_RISE: f64 = 0.34;
const SUBSCRIPT_DROP: f64 = 0.2;

/// Where a text is anchored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// At its start.
    Start,
    /// In its middle.
    Middle,
    /// At its end.
    End,
}

/// Inherited properties, in user units.
#[derive(Clone, Debug)]
pub struct Style<'a> {
    /// What `currentColor` means, RGB.
    pub color_rgb: [u8; 3],
    /// Paint of areas.
    pub fill: Paint<'a>,
    /// Which side is inside.
    pub fill_rule: FillRule,
    fill_opacity: f64,
    /// Paint of lines.
    pub stroke: Paint<'a>,
    stroke_opacity: f64,
    /// Lengths of dashes and gaps; empty for none.
    pub dashes: Rc<[f64]>,
    /// Where in the dashes a line starts.
    pub dash_offset: f64,
    /// Width of lines, 0 if not stated; they are marked along their centre whatever it is.
    pub stroke_width: f64,
    /// `visibility` is `visible`.
    pub visible: bool,
    /// Names of fonts, best first.
    pub font_family: &'a str,
    /// Font size.
    pub font_size: f64,
    /// Font weight, 100 to 900.
    pub font_weight: u16,
    /// Whether letters slant.
    pub italic: bool,
    /// Where text is anchored.
    pub text_anchor: Anchor,
    /// Which height of the letters is on the line, in font sizes above their feet.
    pub line_em: f64,
    /// How far letters stand above the line.
    pub baseline_shift: f64,
    /// Added after each letter.
    pub letter_spacing: f64,
    /// Added after each space.
    pub word_spacing: f64,
}

impl Default for Style<'_> {
    fn default() -> Self {
        Self {
            color_rgb: [0; 3],
            fill: Paint::Color([0; 3]),
            fill_rule: FillRule::NonZero,
            fill_opacity: 1.0,
            stroke: Paint::None,
            stroke_opacity: 1.0,
            dashes: Rc::from([]),
            dash_offset: 0.0,
            // Not the 1 that SVG has: a width that nobody chose is nothing to tell of.
            stroke_width: 0.0,
            visible: true,
            font_family: "",
            font_size: 16.0,
            font_weight: 400,
            italic: false,
            text_anchor: Anchor::Start,
            line_em: 0.0,
            baseline_shift: 0.0,
            letter_spacing: 0.0,
            word_spacing: 0.0,
        }
    }
}

impl<'a> Style<'a> {
    /// Takes over what an element states.
    pub fn apply(&mut self, declared: &Declared<'a>, viewport: [f64; 2], drawing: &Drawing<'a>) {
        self.apply_font(declared, viewport);
        if let Some(color) = declared.get(Property::Color).and_then(color_rgb) {
            self.color_rgb = color;
        }
        if let Some(text) = declared.get(Property::Fill) {
            self.fill = Paint::parse(text, self, drawing).unwrap_or(self.fill);
        }
        if let Some(text) = declared.get(Property::Stroke) {
            self.stroke = Paint::parse(text, self, drawing).unwrap_or(self.stroke);
        }
        match declared.get(Property::FillRule) {
            Some("evenodd") => self.fill_rule = FillRule::EvenOdd,
            Some("nonzero") => self.fill_rule = FillRule::NonZero,
            _ => {}
        }
        if let Some(opacity) = declared.get(Property::FillOpacity).and_then(parse_opacity) {
            self.fill_opacity = opacity;
        }
        if let Some(opacity) = declared.get(Property::StrokeOpacity).and_then(parse_opacity) {
            self.stroke_opacity = opacity;
        }
        if let Some(text) = declared.get(Property::Visibility) {
            self.visible = text == "visible";
        }
        let base = self.length_base(viewport);
        if let Some(text) = declared.get(Property::StrokeDasharray) {
            self.dashes = parse_dashes(text, &base);
        }
        if let Some(offset) = length_of(declared, Property::StrokeDashoffset, &base) {
            self.dash_offset = offset;
        }
        if let Some(width) = length_of(declared, Property::StrokeWidth, &base) {
            self.stroke_width = width;
        }
    }

    fn apply_font(&mut self, declared: &Declared<'a>, viewport: [f64; 2]) {
        if let Some(name) = declared.get(Property::DominantBaseline) {
            self.line_em = line_em(name);
        }
        // It is measured in the size of the text around it, and adds up.
        self.baseline_shift += match declared.get(Property::BaselineShift) {
            Some("super") => SUPERSCRIPT_RISE * self.font_size,
            Some("sub") => -SUBSCRIPT_DROP * self.font_size,
            Some(shift) => self.parse_font_size(shift, viewport).unwrap_or(0.0),
            None => 0.0,
        };
        let shorthand =
            declared.get(Property::Font).and_then(|text| FontShorthand::from_str(text).ok());
        let size =
            declared.get(Property::FontSize).or(shorthand.as_ref().map(|font| font.font_size));
        if let Some(size) = size.and_then(|text| self.parse_font_size(text, viewport)) {
            self.font_size = size;
        }
        let family =
            declared.get(Property::FontFamily).or(shorthand.as_ref().map(|font| font.font_family));
        self.font_family = family.unwrap_or(self.font_family);
        let weight = declared
            .get(Property::FontWeight)
            .or(shorthand.as_ref().and_then(|font| font.font_weight));
        self.font_weight = match weight {
            Some("normal") => 400,
            Some("bold" | "bolder") => 700,
            Some("lighter") => 300,
            Some(number) => number.parse().unwrap_or(self.font_weight),
            None => self.font_weight,
        };
        let slant = declared
            .get(Property::FontStyle)
            .or(shorthand.as_ref().and_then(|font| font.font_style));
        self.italic = slant.map_or(self.italic, |slant| slant != "normal");
        match declared.get(Property::TextAnchor) {
            Some("start") => self.text_anchor = Anchor::Start,
            Some("middle") => self.text_anchor = Anchor::Middle,
            Some("end") => self.text_anchor = Anchor::End,
            _ => {}
        }
        let base = self.length_base(viewport);
        for (property, spacing) in [
            (Property::LetterSpacing, &mut self.letter_spacing),
            (Property::WordSpacing, &mut self.word_spacing),
        ] {
            *spacing = match declared.get(property) {
                Some("normal") => 0.0,
                _ => length_of(declared, property, &base).unwrap_or(*spacing),
            };
        }
    }

    /// What relative lengths refer to.
    pub fn length_base(&self, viewport: [f64; 2]) -> LengthBase {
        LengthBase { font_size: self.font_size, viewport }
    }

    /// Paint of areas, `Paint::None` where it cannot be seen.
    pub fn visible_fill(&self) -> Paint<'a> {
        if self.visible && self.fill_opacity != 0.0 { self.fill } else { Paint::None }
    }

    /// Paint of lines, `Paint::None` where it cannot be seen.
    pub fn visible_stroke(&self) -> Paint<'a> {
        if self.visible && self.stroke_opacity != 0.0 { self.stroke } else { Paint::None }
    }

    fn parse_font_size(&self, text: &str, viewport: [f64; 2]) -> Option<f64> {
        // The named sizes of CSS 2.1 for a medium of 16 px.
        let named = match text {
            "xx-small" => 9.0,
            "x-small" => 10.0,
            "small" => 13.0,
            "medium" => 16.0,
            "large" => 18.0,
            "x-large" => 24.0,
            "xx-large" => 32.0,
            "smaller" => self.font_size / 1.2,
            "larger" => self.font_size * 1.2,
            _ => {
                let mut base = self.length_base(viewport);
                // A percentage of a font size is one of the size around it.
                base.viewport = [self.font_size; 2];
                let (length, _) = length::parse(text)?;
                return Some(base.user_units(length, Direction::X));
            }
        };
        Some(named)
    }
}

/// Whether a value of `opacity` makes everything invisible.
pub fn is_transparent(declared: &Declared<'_>) -> bool {
    declared.get(Property::Opacity).and_then(parse_opacity) == Some(0.0)
}

fn length_of(declared: &Declared<'_>, property: Property, base: &LengthBase) -> Option<f64> {
    let (length, _) = length::parse(declared.get(property)?)?;
    Some(base.user_units(length, Direction::Any))
}

/// Dashes as SVG wants them: none if one is negative or all are zero.
fn parse_dashes(text: &str, base: &LengthBase) -> Rc<[f64]> {
    let dashes: Result<Vec<f64>, _> = LengthListParser::from(text)
        .map(|length| length.map(|length| base.user_units(length, Direction::Any)))
        .collect();
    match dashes {
        Ok(dashes)
            if dashes.iter().all(|&dash| 0.0 <= dash) && dashes.iter().sum::<f64>() > 0.0 =>
        {
            dashes.into()
        }
        _ => Rc::from([]),
    }
}

/// An opacity, held between 0 and 1.
fn parse_opacity(text: &str) -> Option<f64> {
    let opacity = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().ok()? / 100.0,
        None => text.parse::<f64>().ok()?,
    };
    (!opacity.is_nan()).then(|| opacity.clamp(0.0, 1.0))
}

/// The height that a value of `dominant-baseline` means, in font sizes above the letters' feet.
///
/// Half of x, half of the line, the capitals, the top and the bottom of the bundled font.
fn line_em(name: &str) -> f64 {
    match name {
        "middle" => 0.275,
        "central" | "mathematical" => 0.36,
        "hanging" => 0.75,
        "text-before-edge" | "text-top" => 0.965,
        "text-after-edge" | "text-bottom" | "ideographic" => -0.25,
        _ => 0.0,
    }
}
