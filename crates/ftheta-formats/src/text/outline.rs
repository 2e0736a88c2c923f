//! Letters of an OpenType font, as outlines.

use super::{Letter, Lettering};
use kurbo::{Affine, BezPath};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};
use std::borrow::Cow;
use std::sync::LazyLock;

/// Name of the bundled font.
pub const BUNDLED_FAMILY: &str = "B612";

const REGULAR_FILE: &[u8] = include_bytes!("../../assets/B612-Regular.otf");
const BOLD_FILE: &[u8] = include_bytes!("../../assets/B612-Bold.otf");

static REGULAR: LazyLock<Option<Typeface>> =
    LazyLock::new(|| Typeface::new(REGULAR_FILE.into(), 0));
static BOLD: LazyLock<Option<Typeface>> = LazyLock::new(|| Typeface::new(BOLD_FILE.into(), 0));

/// A font file that letters are taken from.
pub struct Typeface {
    data: Cow<'static, [u8]>,
    face_index: u32,
    units_per_em: f64,
}

impl Typeface {
    /// A font from the bytes of an OpenType file; `None` if it is none.
    ///
    /// * `face_index`: which font of a collection, else 0
    pub fn new(data: Cow<'static, [u8]>, face_index: u32) -> Option<Self> {
        let units_per_em = FontRef::from_index(&data, face_index)
            .ok()?
            .metrics(Size::unscaled(), LocationRef::default())
            .units_per_em;
        (units_per_em != 0).then(|| Self {
            data,
            face_index,
            units_per_em: f64::from(units_per_em),
        })
    }

    /// The bundled font.
    ///
    /// * `weight`: from 600 on it is the bold one
    pub fn bundled(weight: u16) -> &'static Self {
        let typeface = if weight < 600 { &REGULAR } else { &BOLD };
        typeface.as_ref().expect("the bundled font was read by the tests")
    }

    /// Sets a line of text.
    ///
    /// * returns nothing for characters that the font lacks; they are in [`Lettering::missing`]
    ///
    /// # Limits
    /// Letters are put side by side as wide as the font says: no kerning (the bundled font has
    /// none), no ligatures, and no script that joins or reorders letters.
    pub fn set(&self, text: &str) -> Lettering {
        let mut lettering = Lettering::default();
        let Ok(font) = FontRef::from_index(&self.data, self.face_index) else {
            return lettering;
        };
        let em_per_unit = 1.0 / self.units_per_em;
        let glyphs = font.charmap();
        let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
        for (text_index, character) in text.char_indices() {
            // Fonts without a no-break space still have the other one.
            let plain = if character.is_whitespace() { ' ' } else { character };
            let Some(glyph) = glyphs.map(character).or_else(|| glyphs.map(plain)) else {
                lettering.missing.push(character);
                continue;
            };
            let advance_units = metrics.advance_width(glyph).unwrap_or(0.0);
            lettering.letters.push(Letter {
                text_index,
                path: Affine::scale(em_per_unit) * outline(&font, glyph),
                advance_em: f64::from(advance_units) * em_per_unit,
            });
        }
        lettering
    }
}

/// A glyph's curves in font units; empty if the font has none for it.
fn outline(font: &FontRef<'_>, glyph: GlyphId) -> BezPath {
    let mut pen = Pen(BezPath::new());
    let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
    if let Some(outline) = font.outline_glyphs().get(glyph) {
        // A damaged glyph is drawn as far as it goes.
        let _ = outline.draw(settings, &mut pen);
    }
    pen.0
}

struct Pen(BezPath);

fn at(x: f32, y: f32) -> (f64, f64) {
    (f64::from(x), f64::from(y))
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(at(x, y));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(at(x, y));
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        self.0.quad_to(at(cx0, cy0), at(x, y));
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        self.0.curve_to(at(cx0, cy0), at(cx1, cy1), at(x, y));
    }

    fn close(&mut self) {
        self.0.close_path();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kurbo::Shape;

    #[test]
    fn both_bundled_fonts_set_latin() {
        for weight in [400, 700] {
            let lettering = Typeface::bundled(weight).set("Hé µΩ°");
            assert_eq!(lettering.letters.len(), 6);
            assert_eq!(lettering.missing, []);
            let capital = lettering.letters[0].path.bounding_box();
            assert!((0.75..0.77).contains(&capital.y1), "{capital:?}");
        }
    }
}
