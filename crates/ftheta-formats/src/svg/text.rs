//! `<text>`: characters in order, each with its style and the position that is asked for.

use super::drawing::{Node, plain_attribute, tag_of};
use super::error::SvgError;
use super::length::{self, Direction};
use super::typeset;
use super::walk::{Context, Reader};
use svgtypes::LengthListParser;

const XML_NAMESPACE: &str = "http://www.w3.org/XML/1998/namespace";
/// Characters of one `<text>` that are set; more than a page of any drawing holds.
const N_CHARACTERS_MAX: usize = 100_000;

/// A character of a text.
#[derive(Clone, Debug)]
pub struct Character {
    /// The character, white space already collapsed.
    pub letter: char,
    /// Index of its style in [`Text::spans`].
    pub span_index: usize,
    /// Where it is put and by how much it is moved, user units.
    pub place: Placing,
}

/// Positions asked for a character, user units.
#[derive(Clone, Copy, Debug, Default)]
pub struct Placing {
    /// Absolute x.
    pub x: Option<f64>,
    /// Absolute y.
    pub y: Option<f64>,
    /// Moved to the right.
    pub dx: f64,
    /// Moved down.
    pub dy: f64,
}

/// A `<text>` element, read.
pub struct Text<'a> {
    /// Its characters.
    pub characters: Vec<Character>,
    /// Styles of its parts, and the element of each.
    pub spans: Vec<(Node<'a>, Context<'a>)>,
    /// Elements with position lists around the current character, outermost first.
    placers: Vec<Placer>,
}

/// Position lists of an element and how many of its characters there were so far.
struct Placer {
    x: Vec<f64>,
    y: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    n_characters: usize,
}

/// Marks a `<text>` element.
///
/// # Errors
/// If there are too many curves or levels.
pub fn mark<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    context: &Context<'a>,
) -> Result<(), SvgError> {
    let mut text = Text { characters: Vec::new(), spans: Vec::new(), placers: Vec::new() };
    span(reader, node, context, &mut text)?;
    if text.characters.len() == N_CHARACTERS_MAX {
        return Err(SvgError::TooMany {
            place: reader.drawing.place(node),
            what: "characters in one text",
            limit: N_CHARACTERS_MAX,
        });
    }
    if text.characters.last().is_some_and(|last| last.letter == ' ') && !preserves_space(node) {
        text.characters.pop();
    }
    typeset::mark(reader, node, &text)
}

fn span<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    context: &Context<'a>,
    text: &mut Text<'a>,
) -> Result<(), SvgError> {
    let unsupported = ["rotate", "textLength"];
    let found = unsupported.iter().find(|name| plain_attribute(node, name).is_some());
    if let Some(name) = found {
        let message = format!("{name} is ignored");
        reader.warnings.add(reader.drawing.place(node), message);
    }
    let span_index = text.spans.len();
    text.spans.push((node, context.clone()));
    text.placers.push(Placer {
        x: lengths(reader, node, context, ("x", Direction::X)),
        y: lengths(reader, node, context, ("y", Direction::Y)),
        dx: lengths(reader, node, context, ("dx", Direction::X)),
        dy: lengths(reader, node, context, ("dy", Direction::Y)),
        n_characters: 0,
    });
    let preserve = preserves_space(node);
    for child in node.children() {
        if child.is_text() {
            text.add(child.text().unwrap_or(""), span_index, preserve);
            continue;
        }
        match tag_of(child) {
            Some("tspan" | "a") => {
                let mut inner = context.clone();
                if reader.enter(child, &mut inner)? {
                    span(reader, child, &inner, text)?;
                }
            }
            Some("title" | "desc" | "metadata") | None => {}
            Some(tag) => {
                reader.tally.n_dropped += 1;
                let message = match tag {
                    "textPath" => "text on a path, left out",
                    _ => "not text, left out",
                };
                reader.warnings.add(reader.drawing.place(child), message);
            }
        }
    }
    text.placers.pop();
    Ok(())
}

impl Text<'_> {
    /// Adds characters; white space becomes single spaces unless it is preserved.
    fn add(&mut self, characters: &str, span_index: usize, preserve: bool) {
        for character in characters.chars() {
            let space = matches!(character, ' ' | '\t' | '\n' | '\r');
            let letter = if space { ' ' } else { character };
            let after_space = self.characters.last().is_none_or(|last| last.letter == ' ');
            if (space && !preserve && after_space) || self.characters.len() == N_CHARACTERS_MAX {
                continue;
            }
            let mut place = Placing::default();
            for placer in &mut self.placers {
                placer.place_next(&mut place);
            }
            self.characters.push(Character { letter, span_index, place });
        }
    }
}

impl Placer {
    /// Overrides what elements further out ask for the next character.
    fn place_next(&mut self, place: &mut Placing) {
        let index = self.n_characters;
        self.n_characters += 1;
        place.x = self.x.get(index).copied().or(place.x);
        place.y = self.y.get(index).copied().or(place.y);
        place.dx = self.dx.get(index).copied().unwrap_or(place.dx);
        place.dy = self.dy.get(index).copied().unwrap_or(place.dy);
    }
}

/// A list of lengths in user units, up to the first that is wrong.
fn lengths<'a>(
    reader: &mut Reader<'a, '_>,
    node: Node<'a>,
    context: &Context<'a>,
    (name, direction): (&str, Direction),
) -> Vec<f64> {
    let base = context.style.length_base(context.viewport);
    let Some(text) = plain_attribute(node, name) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for item in LengthListParser::from(text) {
        match item {
            Ok(length) => found.push(base.user_units(length, direction)),
            Err(_) => {
                // A single length may still have a unit that is only written in capitals.
                found.extend(length::parse(text).map(|(one, _)| base.user_units(one, direction)));
                let message = format!("{name}=\"{text}\" cannot be read to its end");
                reader.warnings.add(reader.drawing.place(node), message);
                break;
            }
        }
    }
    found
}

fn preserves_space(node: Node<'_>) -> bool {
    let stated = node.ancestors().find_map(|element| element.attribute((XML_NAMESPACE, "space")));
    let style = plain_attribute(node, "style").unwrap_or("");
    stated == Some("preserve") || style.contains("white-space:pre")
}
