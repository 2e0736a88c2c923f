//! Sets the characters of a text: fonts, positions, anchors.

use super::drawing::Node;
use super::emit;
use super::error::SvgError;
use super::paint::Paint;
use super::style::{Anchor, Style};
use super::text::{Character, Text};
use super::walk::Reader;
use crate::text::outline::{BUNDLED_FAMILY, Typeface};
use crate::text::{Lettering, hershey};
use ftheta_model::recipe::TextStyle;
use kurbo::{Affine, BezPath, Point, Vec2};
use std::rc::Rc;

/// Slant of italics, which the bundled font has no letters for: 12 degrees.
const ITALIC_SLANT: f64 = 0.212_556_561_67;
/// Characters that a warning names; the user sees what kind is missing.
const N_CHARACTERS_TOLD: usize = 20;

/// Marks all characters of a text; each run of one style is one shape.
///
/// # Errors
/// If there are too many curves.
pub fn mark<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    text: &Text<'a>,
) -> Result<(), SvgError> {
    let mut pen = Point::ORIGIN;
    let mut rest = text.characters.as_slice();
    while let Some(first) = rest.first() {
        let absolute =
            |character: &Character| character.place.x.is_some() || character.place.y.is_some();
        let n = 1 + rest[1..].iter().take_while(|next| !absolute(next)).count();
        let (chunk, after) = rest.split_at(n);
        rest = after;
        let start = Point::new(first.place.x.unwrap_or(pen.x), first.place.y.unwrap_or(pen.y));
        let runs = set_chunk(reader, node, text, (chunk, start));
        let end = runs.last().map_or(start, |run| run.end);
        let anchor = text.spans[first.span_index].1.style.text_anchor;
        let shift = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * (start.x - end.x),
            Anchor::End => start.x - end.x,
        };
        pen = end + Vec2::new(shift, 0.0);
        for run in runs {
            let path = Affine::translate((shift, 0.0)) * run.path;
            mark_run(reader, text, run.span_index, &path)?;
        }
    }
    Ok(())
}

/// Letters of one style, set.
struct Run {
    span_index: usize,
    /// Curves, user units, y down.
    path: BezPath,
    end: Point,
}

fn set_chunk<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    text: &Text<'a>,
    (chunk, start): (&[Character], Point),
) -> Vec<Run> {
    let mut pen = start;
    let mut runs = Vec::new();
    for characters in chunk.chunk_by(|a, b| a.span_index == b.span_index) {
        let span_index = characters[0].span_index;
        let style = &text.spans[span_index].1.style;
        let line: String = characters.iter().map(|character| character.letter).collect();
        let font = font_for(reader, style);
        let lettering = set_line(reader, node, &line, &font);
        let slant = font.slant;
        let size = style.font_size;
        let drop = style.line_em * size - style.baseline_shift;
        // Letters are drawn y up, the drawing is y down.
        let shape = Affine::new([size, 0.0, slant * size, -size, 0.0, 0.0]);
        let mut path = BezPath::new();
        let mut text_index = 0;
        let mut letters = lettering.letters.iter().peekable();
        for character in characters {
            pen += Vec2::new(character.place.dx, character.place.dy);
            text_index += character.letter.len_utf8();
            while let Some(letter) = letters.next_if(|letter| letter.text_index < text_index) {
                let place = Affine::translate((pen.x, pen.y + drop));
                path.extend(place * shape * &letter.path);
                pen.x += letter.advance_em * size;
            }
            pen.x += style.letter_spacing;
            if character.letter == ' ' {
                pen.x += style.word_spacing;
            }
        }
        runs.push(Run { span_index, path, end: pen });
    }
    runs
}

fn mark_run<'a>(
    reader: &mut Reader<'a, '_>,
    text: &Text<'a>,
    span_index: usize,
    path: &BezPath,
) -> Result<(), SvgError> {
    if path.is_empty() {
        return Ok(());
    }
    let (node, context) = &text.spans[span_index];
    if !is_single_stroke(reader, &context.style) {
        return emit::mark(reader, *node, path, true, context);
    }
    // Text is painted by its fill; a single stroke has no inside, so the fill's colour draws it.
    let mut context = context.clone();
    if context.style.visible_stroke() == Paint::None {
        context.style.stroke = context.style.visible_fill();
    }
    emit::mark(reader, *node, path, false, &context)
}

fn is_single_stroke(reader: &Reader<'_, '_>, style: &Style<'_>) -> bool {
    let family = style.font_family.trim_start_matches(['\'', '"', ' ']);
    let hershey = family.get(..7).is_some_and(|name| name.eq_ignore_ascii_case("hershey"));
    hershey || reader.recipe.text == TextStyle::SingleStroke
}

/// The font that a style gets.
struct Font {
    face: Face,
    name: String,
    /// How far letters lean to the right, per height.
    slant: f64,
}

enum Face {
    SingleStroke,
    Bundled(&'static Typeface),
    System(Rc<Typeface>),
}

fn font_for(reader: &mut Reader<'_, '_>, style: &Style<'_>) -> Font {
    if is_single_stroke(reader, style) {
        return Font { face: Face::SingleStroke, name: "Hershey Simplex".into(), slant: 0.0 };
    }
    let slant = if style.italic { ITALIC_SLANT } else { 0.0 };
    let fonts = reader.system_fonts.as_mut();
    let found =
        fonts.and_then(|fonts| fonts.find(style.font_family, style.font_weight, style.italic));
    if let Some(found) = found {
        let slant = if found.italic { 0.0 } else { slant };
        return Font { face: Face::System(found.typeface), name: found.family, slant };
    }
    warn_of_family(reader, style.font_family);
    let typeface = Typeface::bundled(style.font_weight);
    Font { face: Face::Bundled(typeface), name: BUNDLED_FAMILY.into(), slant }
}

/// Sets a line and tells what its font lacks.
fn set_line<'a>(reader: &mut Reader<'a, '_>, node: Node<'a>, line: &str, font: &Font) -> Lettering {
    let lettering = match &font.face {
        Face::SingleStroke => hershey::set(line),
        Face::Bundled(typeface) => typeface.set(line),
        Face::System(typeface) => typeface.set(line),
    };
    for (characters, fate) in
        [(&lettering.missing, "left out"), (&lettering.replaced, "spelt with others")]
    {
        if !characters.is_empty() {
            let mut names: Vec<char> = characters.clone();
            names.sort_unstable();
            names.dedup();
            names.truncate(N_CHARACTERS_TOLD);
            let names: String = names.into_iter().collect();
            let message = format!("no letter in {} for \"{names}\", {fate}", font.name);
            reader.warnings.add(reader.drawing.place(node), message);
        }
    }
    lettering
}

/// One warning for each font that is replaced.
fn warn_of_family(reader: &mut Reader<'_, '_>, families: &str) {
    let first = families.split(',').next().unwrap_or("");
    let family = first.trim().trim_matches(['\'', '"']);
    let generic = ["", "sans-serif", "serif", "monospace", "system-ui", "sans", BUNDLED_FAMILY];
    if !generic.contains(&family) {
        let message = format!("font \"{family}\" is replaced by the bundled {BUNDLED_FAMILY}");
        reader.warnings.add("<text>", message);
    }
}
