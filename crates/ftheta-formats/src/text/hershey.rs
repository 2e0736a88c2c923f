//! Hershey Roman Simplex: letters of single strokes, for engraving.

use super::{Letter, Lettering};
use kurbo::{BezPath, Point};
use std::sync::LazyLock;

/// Glyph units per font size: capitals, 21 units high, are as high as those of the bundled font.
const UNITS_PER_EM: f64 = 28.0;
/// The baseline's y in glyph units, y down.
const BASELINE: f64 = 9.0;
/// The character of the file's first glyph; the others follow as in ASCII.
const FIRST: char = ' ';

static SIMPLEX: LazyLock<Vec<Glyph>> =
    LazyLock::new(|| parse(include_str!("../../assets/hershey-simplex.jhf")));

struct Glyph {
    path: BezPath,
    advance_em: f64,
}

/// Sets a line of text in single strokes.
///
/// Letters with accents lose them, and some signs are spelt with others; both are in
/// [`Lettering::replaced`].
pub fn set(text: &str) -> Lettering {
    let mut lettering = Lettering::default();
    for (text_index, character) in text.char_indices() {
        let buffer = &mut [0; 4];
        let drawn = match glyph_of(character) {
            Some(_) => character.encode_utf8(buffer),
            None => match replacement(character) {
                Some(replacement) => {
                    if !character.is_whitespace() {
                        lettering.replaced.push(character);
                    }
                    replacement
                }
                None => {
                    lettering.missing.push(character);
                    continue;
                }
            },
        };
        for glyph in drawn.chars().filter_map(glyph_of) {
            lettering.letters.push(Letter {
                text_index,
                path: glyph.path.clone(),
                advance_em: glyph.advance_em,
            });
        }
    }
    lettering
}

fn glyph_of(character: char) -> Option<&'static Glyph> {
    // The file's last glyph, at 127, is a degree sign.
    let code = if character == '°' {
        127
    } else if character.is_ascii() && character != '\u{7f}' {
        u32::from(character)
    } else {
        return None;
    };
    SIMPLEX.get(code.checked_sub(u32::from(FIRST))? as usize)
}

/// What stands for a character that the font lacks.
fn replacement(character: char) -> Option<&'static str> {
    Some(match character {
        'À'..='Å' | 'Ā' | 'Ă' | 'Ą' => "A",
        'Æ' => "AE",
        'Ç' | 'Ć' | 'Č' => "C",
        'Ď' | 'Đ' | 'Ð' => "D",
        'È'..='Ë' | 'Ē' | 'Ę' | 'Ě' => "E",
        'Ğ' => "G",
        'Ì'..='Ï' | 'İ' => "I",
        'Ł' => "L",
        'Ñ' | 'Ń' | 'Ň' => "N",
        'Ò'..='Ö' | 'Ø' | 'Ő' => "O",
        'Œ' => "OE",
        'Ř' => "R",
        'Ś' | 'Ş' | 'Š' => "S",
        'Ť' => "T",
        'Ù'..='Ü' | 'Ů' | 'Ű' => "U",
        'Ý' | 'Ÿ' => "Y",
        'Ź' | 'Ż' | 'Ž' => "Z",
        'à'..='å' | 'ā' | 'ă' | 'ą' => "a",
        'æ' => "ae",
        'ç' | 'ć' | 'č' => "c",
        'ď' | 'đ' | 'ð' => "d",
        'è'..='ë' | 'ē' | 'ę' | 'ě' => "e",
        'ğ' => "g",
        'ì'..='ï' | 'ı' => "i",
        'ł' => "l",
        'ñ' | 'ń' | 'ň' => "n",
        'ò'..='ö' | 'ø' | 'ő' => "o",
        'œ' => "oe",
        'ř' => "r",
        'ß' => "ss",
        'ś' | 'ş' | 'š' => "s",
        'ť' => "t",
        'ù'..='ü' | 'ů' | 'ű' => "u",
        'ý' | 'ÿ' => "y",
        'ź' | 'ż' | 'ž' => "z",
        'µ' | 'μ' => "u",
        '×' => "x",
        '–' | '—' | '−' | '‐' => "-",
        '‘' | '’' | '′' => "'",
        '“' | '”' | '″' => "\"",
        '…' => "...",
        '·' => ".",
        '±' => "+-",
        '\u{a0}' | '\t' => " ",
        _ => return None,
    })
}

/// Reads James Hurt's format: five characters of number, three of the count of pairs, then pairs.
/// The first pair is the left and right edge; in the others, letters count from `R`, and ` R`
/// lifts the pen. Line breaks may stand anywhere.
fn parse(file: &str) -> Vec<Glyph> {
    let mut bytes = file.bytes().filter(|byte| !matches!(byte, b'\n' | b'\r'));
    let mut glyphs = Vec::new();
    loop {
        let header: Vec<u8> = bytes.by_ref().take(8).collect();
        let count = header.get(5..8).and_then(|digits| str::from_utf8(digits).ok());
        let Some(n_pairs) = count.and_then(|digits| digits.trim().parse::<usize>().ok()) else {
            return glyphs;
        };
        let letters: Vec<u8> = bytes.by_ref().take(2 * n_pairs).collect();
        glyphs.push(glyph(&letters));
    }
}

fn glyph(letters: &[u8]) -> Glyph {
    let offset = |letter: u8| f64::from(letter) - f64::from(b'R');
    let mut pairs = letters.chunks_exact(2);
    let (left, right) =
        pairs.next().map_or((0.0, 0.0), |edges| (offset(edges[0]), offset(edges[1])));
    let mut path = BezPath::new();
    let mut pen_down = false;
    for pair in pairs {
        if pair == b" R" {
            pen_down = false;
            continue;
        }
        let point = Point::new(
            (offset(pair[0]) - left) / UNITS_PER_EM,
            (BASELINE - offset(pair[1])) / UNITS_PER_EM,
        );
        if pen_down {
            path.line_to(point);
        } else {
            path.move_to(point);
        }
        pen_down = true;
    }
    Glyph { path, advance_em: (right - left) / UNITS_PER_EM }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kurbo::Shape;

    #[test]
    fn the_file_holds_ascii() {
        assert_eq!(SIMPLEX.len(), 96);
        let capital = set("H").letters[0].path.bounding_box();
        assert_eq!((capital.y0, capital.y1), (0.0, 0.75));
    }

    #[test]
    fn accents_are_dropped_and_told() {
        let lettering = set("é\u{a0}ж°");
        assert_eq!(lettering.letters.len(), 3);
        assert_eq!(lettering.replaced, ['é']);
        assert_eq!(lettering.missing, ['ж']);
    }
}
