//! The parsed file: its elements by id and by line, and its style sheets.

use super::Limits;
use super::css::StyleSheets;
use super::error::SvgError;
use super::prescan;
use roxmltree::{Document, NodeId, ParsingOptions};
use std::collections::HashMap;

/// An element, text or comment of the file.
pub type Node<'a> = roxmltree::Node<'a, 'a>;

const SVG_NAMESPACE: &str = "http://www.w3.org/2000/svg";
const INKSCAPE_NAMESPACE: &str = "http://www.inkscape.org/namespaces/inkscape";
const XLINK_NAMESPACE: &str = "http://www.w3.org/1999/xlink";
/// Bytes per entry of the line index: a full index of all line breaks could outgrow the file.
const LINE_BLOCK: usize = 4096;

/// A parsed SVG file.
pub struct Drawing<'a> {
    tree: &'a Document<'a>,
    ids: HashMap<&'a str, NodeId>,
    /// Line breaks before each block of [`LINE_BLOCK`] bytes.
    breaks_before: Vec<u32>,
    /// Rules of all `<style>` elements.
    pub style_sheets: StyleSheets<'a>,
    /// Whether any group is an Inkscape layer.
    pub inkscape_layers: bool,
}

/// Parses the markup.
///
/// # Errors
/// If it is not well-formed, or beyond a limit.
pub fn parse<'a>(text: &'a str, limits: &Limits) -> Result<Document<'a>, SvgError> {
    prescan::check(text, limits)?;
    let options = ParsingOptions {
        allow_dtd: true,
        nodes_limit: limits.n_nodes_max,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options).map_err(|error| match error {
        roxmltree::Error::NodesLimitReached => SvgError::TooMany {
            place: "<svg>".into(),
            what: "elements",
            limit: limits.n_nodes_max as usize,
        },
        roxmltree::Error::UnclosedRootNode | roxmltree::Error::UnexpectedEndOfStream => {
            SvgError::Truncated { line: text.lines().count() as u32 }
        }
        error => {
            let roxmltree::TextPos { row, col } = error.pos();
            let message = error.to_string();
            let position = format!(" at {row}:{col}");
            SvgError::Xml {
                line: row,
                column: col,
                message: message.strip_suffix(&position).unwrap_or(&message).into(),
            }
        }
    })
}

impl<'a> Drawing<'a> {
    /// Indexes a parsed file.
    pub fn new(tree: &'a Document<'a>) -> Self {
        let mut ids = HashMap::new();
        let mut style_sheets = StyleSheets::default();
        let mut inkscape_layers = false;
        for node in tree.descendants().filter(Node::is_element) {
            if let Some(id) = plain_attribute(node, "id") {
                ids.entry(id).or_insert_with(|| node.id());
            }
            if tag_of(node) == Some("style") {
                for text in node.children().filter_map(|child| child.text()) {
                    style_sheets.add(text);
                }
            }
            inkscape_layers |= is_inkscape_layer(node);
        }
        style_sheets.sort();
        let breaks = |block: &[u8]| block.iter().filter(|&&byte| byte == b'\n').count() as u32;
        let breaks_before = tree
            .input_text()
            .as_bytes()
            .chunks(LINE_BLOCK)
            .scan(0, |n_breaks, block| {
                let before = *n_breaks;
                *n_breaks += breaks(block);
                Some(before)
            })
            .collect();
        Self { tree, ids, breaks_before, style_sheets, inkscape_layers }
    }

    /// The outermost element.
    pub fn root(&self) -> Node<'a> {
        self.tree.root_element()
    }

    /// The element with an id.
    pub fn by_id(&self, id: &str) -> Option<Node<'a>> {
        self.tree.get_node(*self.ids.get(id)?)
    }

    /// An element's place for messages: `#id`, or `<tag> on line N`.
    pub fn place(&self, node: Node<'a>) -> String {
        if let Some(id) = plain_attribute(node, "id") {
            return format!("#{id}");
        }
        let position = node.range().start;
        let block = position / LINE_BLOCK;
        let rest = &self.tree.input_text().as_bytes()[block * LINE_BLOCK..position];
        let n_breaks = rest.iter().filter(|&&byte| byte == b'\n').count() as u32;
        let line = self.breaks_before.get(block).unwrap_or(&0) + n_breaks + 1;
        format!("<{}> on line {line}", node.tag_name().name())
    }
}

/// The tag of an SVG element; `None` for other namespaces. Files without any are taken as SVG.
pub fn tag_of<'a>(node: Node<'a>) -> Option<&'a str> {
    let name = node.tag_name();
    match name.namespace() {
        None | Some(SVG_NAMESPACE) => Some(name.name()),
        Some(_) => None,
    }
}

/// An attribute without a namespace.
pub fn plain_attribute<'a>(node: Node<'a>, name: &str) -> Option<&'a str> {
    node.attributes()
        .find(|attribute| attribute.namespace().is_none() && attribute.name() == name)
        .map(|attribute| attribute.value())
}

/// What `href` or `xlink:href` refers to.
pub fn href_of<'a>(node: Node<'a>) -> Option<&'a str> {
    plain_attribute(node, "href")
        .or_else(|| node.attribute((XLINK_NAMESPACE, "href")))
        .map(str::trim)
}

/// Whether a group is a layer to Inkscape.
pub fn is_inkscape_layer(node: Node<'_>) -> bool {
    node.attribute((INKSCAPE_NAMESPACE, "groupmode")) == Some("layer")
}

/// The name that Inkscape shows for an element.
pub fn inkscape_label<'a>(node: Node<'a>) -> Option<&'a str> {
    node.attribute((INKSCAPE_NAMESPACE, "label"))
}

/// The Inkscape version that wrote the file.
pub fn inkscape_version<'a>(node: Node<'a>) -> Option<&'a str> {
    node.attribute((INKSCAPE_NAMESPACE, "version"))
}
