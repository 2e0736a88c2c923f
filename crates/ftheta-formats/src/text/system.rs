//! Fonts of the computer, found by name.

use super::outline::Typeface;
use fontdb::{Database, Family, ID, Query, Stretch, Style, Weight};
use std::collections::HashMap;
use std::rc::Rc;
use svgtypes::FontFamily;

/// Fonts in the computer's usual folders, looked through when the first one is asked for.
#[derive(Default)]
pub struct SystemFonts {
    database: Option<Database>,
    typefaces: HashMap<ID, Option<Rc<Typeface>>>,
}

/// A font that was found.
pub struct Found {
    /// The font.
    pub typeface: Rc<Typeface>,
    /// Its name.
    pub family: String,
    /// Whether its letters slant.
    pub italic: bool,
}

impl SystemFonts {
    /// The first font of a CSS list that is there; `None` if none is.
    ///
    /// * `weight`: 100 to 900, the nearest is taken
    pub fn find(&mut self, families: &str, weight: u16, italic: bool) -> Option<Found> {
        let database = self.database.get_or_insert_with(|| {
            let mut database = Database::new();
            database.load_system_fonts();
            database
        });
        let named = svgtypes::parse_font_families(families).ok()?;
        let families: Vec<Family<'_>> = named.iter().map(family).collect();
        let id = database.query(&Query {
            families: &families,
            weight: Weight(weight),
            stretch: Stretch::Normal,
            style: if italic { Style::Italic } else { Style::Normal },
        })?;
        let face = database.face(id)?;
        let typeface = self.typefaces.entry(id).or_insert_with(|| {
            let read = |data: &[u8], index| Typeface::new(data.to_vec().into(), index);
            database.with_face_data(id, read)?.map(Rc::new)
        });
        Some(Found {
            typeface: typeface.clone()?,
            family: face.families.first()?.0.clone(),
            italic: face.style != Style::Normal,
        })
    }
}

fn family(family: &FontFamily) -> Family<'_> {
    match family {
        FontFamily::Serif => Family::Serif,
        FontFamily::SansSerif => Family::SansSerif,
        FontFamily::Cursive => Family::Cursive,
        FontFamily::Fantasy => Family::Fantasy,
        FontFamily::Monospace => Family::Monospace,
        FontFamily::Named(name) => Family::Name(name),
    }
}
