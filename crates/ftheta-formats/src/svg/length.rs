//! Lengths with units, in user units and in mm.

use std::str::FromStr;
use svgtypes::{Length, LengthUnit, NumberListParser};

/// mm per CSS pixel: 96 of them are an inch.
pub const PX_MM: f64 = 25.4 / 96.0;

/// What relative lengths refer to, in user units.
#[derive(Clone, Copy, Debug)]
pub struct LengthBase {
    /// Size of the font.
    pub font_size: f64,
    /// Width and height of the nearest viewport.
    pub viewport: [f64; 2],
}

/// What a percentage is a part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The viewport's width.
    X,
    /// The viewport's height.
    Y,
    /// The viewport's diagonal over √2.
    Any,
}

impl LengthBase {
    /// A parsed length in user units.
    pub fn user_units(&self, length: Length, direction: Direction) -> f64 {
        let [width, height] = self.viewport;
        let whole = match direction {
            Direction::X => width,
            Direction::Y => height,
            Direction::Any => (0.5 * (width * width + height * height)).sqrt(),
        };
        match length.unit {
            LengthUnit::None | LengthUnit::Px => length.number,
            LengthUnit::Em => length.number * self.font_size,
            // The height of an x is half the font size in CSS where no font says otherwise.
            LengthUnit::Ex => length.number * 0.5 * self.font_size,
            LengthUnit::Percent => length.number * whole / 100.0,
            LengthUnit::In => length.number * 96.0,
            LengthUnit::Cm => length.number * 96.0 / 2.54,
            LengthUnit::Mm => length.number * 96.0 / 25.4,
            LengthUnit::Pt => length.number * 96.0 / 72.0,
            LengthUnit::Pc => length.number * 16.0,
        }
    }
}

/// A length whose unit is known, in mm; `None` for relative ones.
pub fn absolute_mm(length: Length) -> Option<f64> {
    match length.unit {
        LengthUnit::None | LengthUnit::Px => Some(length.number * 25.4 / 96.0),
        LengthUnit::In => Some(length.number * 25.4),
        LengthUnit::Cm => Some(length.number * 10.0),
        LengthUnit::Mm => Some(length.number),
        LengthUnit::Pt => Some(length.number * 25.4 / 72.0),
        LengthUnit::Pc => Some(length.number * 25.4 / 6.0),
        LengthUnit::Em | LengthUnit::Ex => Some(length.number * absolute_em_mm(length.unit)),
        LengthUnit::Percent => None,
    }
}

/// The size of the default font, 16 px, or half of it.
fn absolute_em_mm(unit: LengthUnit) -> f64 {
    if unit == LengthUnit::Em { 16.0 * PX_MM } else { 8.0 * PX_MM }
}

/// A length and whether its unit is one that SVG knows; `None` if it does not start with a number.
pub fn parse(text: &str) -> Option<(Length, bool)> {
    let text = text.trim();
    if let Ok(length) = Length::from_str(text) {
        return Some((length, true));
    }
    if let Some(length) = lower_case(text) {
        return Some((length, true));
    }
    let number = NumberListParser::from(text).next()?.ok()?;
    Some((Length::new_number(number), false))
}

/// Units are written in capitals by some programs.
fn lower_case(text: &str) -> Option<Length> {
    Length::from_str(&text.to_ascii_lowercase()).ok()
}
