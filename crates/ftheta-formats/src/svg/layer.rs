//! Which groups are layers, and what they are called.

use super::drawing::{Drawing, Node, inkscape_label, is_inkscape_layer, plain_attribute, tag_of};

/// The names of a group that is a layer, the one to show first; `None` for other groups.
///
/// Inkscape marks layers. Other programs write each as a group with an id below `<svg>`.
pub fn names_of<'a>(node: Node<'a>, drawing: &Drawing<'a>) -> Option<Vec<String>> {
    let id = plain_attribute(node, "id");
    let label = if drawing.inkscape_layers {
        is_inkscape_layer(node).then(|| inkscape_label(node).or(id).unwrap_or_default())?
    } else {
        let stated = plain_attribute(node, "data-name").or(id);
        stated.filter(|_| is_top_level(node, drawing))?
    };
    let mut names = vec![decoded(label)];
    names.extend(id.map(str::to_owned).filter(|id| *id != names[0]));
    Some(names)
}

/// Whether only groups without a name are around a group; Illustrator puts one into a switch.
fn is_top_level<'a>(node: Node<'a>, drawing: &Drawing<'a>) -> bool {
    let unnamed = |outer: &Node<'a>| {
        matches!(tag_of(*outer), Some("g" | "switch")) && plain_attribute(*outer, "id").is_none()
    };
    let first_other = node.ancestors().skip(1).find(|outer| !unnamed(outer));
    first_other == Some(drawing.root())
}

/// A name in which Illustrator and CorelDRAW wrote characters as `_x20_` or `_x0020_`.
fn decoded(id: &str) -> String {
    let mut name = String::new();
    let mut rest = id;
    while let Some((before, code)) = rest.split_once("_x") {
        let end = code.find('_').filter(|end| (1..=6).contains(end));
        let letter =
            end.and_then(|end| u32::from_str_radix(&code[..end], 16).ok()).and_then(char::from_u32);
        name.push_str(before);
        match (letter, end) {
            (Some(letter), Some(end)) => {
                name.push(letter);
                rest = &code[end + 1..];
            }
            _ => {
                name.push_str("_x");
                rest = code;
            }
        }
    }
    name.push_str(rest);
    name
}
