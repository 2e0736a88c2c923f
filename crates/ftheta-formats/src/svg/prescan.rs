//! A quick pass over the markup that refuses what would take the XML parser too long.
//!
//! The parser compares every attribute of an element with every other, copies namespaces from
//! parent to child, and expands entities wherever they stand. Each is quadratic in the input.

use super::Limits;
use super::error::SvgError;

const N_ATTRIBUTES_MAX: usize = 256;
const N_NAMESPACES_MAX: usize = 1_000_000;
/// References that the parser follows inside one entity.
const N_NESTED_REFERENCES: usize = 255;

/// Checks depth, attributes per element, namespaces and entities.
///
/// # Errors
/// If one of them is beyond its limit.
pub fn check(text: &str, limits: &Limits) -> Result<(), SvgError> {
    let mut scan = Scan {
        bytes: text.as_bytes(),
        namespaces_in_scope: Vec::new(),
        n_namespaces: 0,
        entity_bytes_max: 0,
        entities_nested: false,
    };
    let mut at = 0;
    while let Some(found) = find(scan.bytes, at, b"<") {
        at = scan.markup(found)?;
        if limits.depth_max < scan.namespaces_in_scope.len() {
            return Err(SvgError::TooDeep {
                place: line_of(scan.bytes, found),
                limit: limits.depth_max,
            });
        }
    }
    scan.check_entities(limits)
}

struct Scan<'a> {
    bytes: &'a [u8],
    /// One entry per open element: namespaces declared on it and around it.
    namespaces_in_scope: Vec<usize>,
    n_namespaces: usize,
    entity_bytes_max: usize,
    entities_nested: bool,
}

impl Scan<'_> {
    /// Takes the markup that starts at `found`; returns where to go on.
    fn markup(&mut self, found: usize) -> Result<usize, SvgError> {
        let rest = &self.bytes[found + 1..];
        if rest.starts_with(b"!--") {
            Ok(after(self.bytes, found + 4, b"-->"))
        } else if rest.starts_with(b"![CDATA[") {
            Ok(after(self.bytes, found + 9, b"]]>"))
        } else if rest.starts_with(b"?") {
            Ok(after(self.bytes, found + 2, b"?>"))
        } else if rest.starts_with(b"/") {
            self.namespaces_in_scope.pop();
            Ok(found + 2)
        } else if rest.starts_with(b"!ENTITY") {
            let tag = Tag::at(self.bytes, found);
            let entity = &self.bytes[found..tag.end];
            self.entity_bytes_max = self.entity_bytes_max.max(entity.len());
            self.entities_nested |= entity.contains(&b'&');
            Ok(tag.end)
        } else if rest.starts_with(b"!") {
            // A document type: the entities in its brackets are markup of their own.
            Ok(found + 2)
        } else {
            self.element(found)
        }
    }

    fn element(&mut self, found: usize) -> Result<usize, SvgError> {
        let tag = Tag::at(self.bytes, found);
        let around = self.namespaces_in_scope.last().copied().unwrap_or(0);
        let in_scope = around + tag.n_namespaces;
        if tag.n_namespaces != 0 {
            self.n_namespaces += in_scope;
        }
        if !tag.self_closing {
            self.namespaces_in_scope.push(in_scope);
        }
        let (what, limit) = if N_ATTRIBUTES_MAX < tag.n_attributes {
            ("attributes on one element", N_ATTRIBUTES_MAX)
        } else if N_NAMESPACES_MAX < self.n_namespaces {
            ("namespaces", N_NAMESPACES_MAX)
        } else {
            return Ok(tag.end);
        };
        Err(SvgError::TooMany { place: line_of(self.bytes, found), what, limit })
    }

    fn check_entities(&self, limits: &Limits) -> Result<(), SvgError> {
        if self.entity_bytes_max == 0 {
            return Ok(());
        }
        let n_references = self.bytes.iter().filter(|&&byte| byte == b'&').count();
        let n_per_reference = if self.entities_nested { N_NESTED_REFERENCES } else { 1 };
        let n_bytes =
            n_references.saturating_mul(self.entity_bytes_max).saturating_mul(n_per_reference);
        if n_bytes <= limits.n_bytes_max {
            return Ok(());
        }
        Err(SvgError::TooMany {
            place: "<!ENTITY>".into(),
            what: "bytes of expanded entities",
            limit: limits.n_bytes_max,
        })
    }
}

/// What a start tag holds, counted without parsing it.
struct Tag {
    end: usize,
    n_attributes: usize,
    n_namespaces: usize,
    self_closing: bool,
}

impl Tag {
    fn at(bytes: &[u8], found: usize) -> Self {
        let mut tag =
            Self { end: bytes.len(), n_attributes: 0, n_namespaces: 0, self_closing: false };
        let mut quote = None;
        for (index, &byte) in bytes.iter().enumerate().skip(found) {
            match (quote, byte) {
                (Some(open), _) if open == byte => quote = None,
                (Some(_), _) => {}
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'=') => tag.n_attributes += 1,
                (None, b'x') if bytes[index..].starts_with(b"xmlns") => tag.n_namespaces += 1,
                (None, b'>') => {
                    tag.self_closing = bytes[index - 1] == b'/';
                    tag.end = index + 1;
                    break;
                }
                _ => {}
            }
        }
        tag
    }
}

fn find(bytes: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    let mut at = from;
    while at < bytes.len() {
        at += bytes[at..].iter().position(|byte| *byte == what[0])?;
        if bytes[at..].starts_with(what) {
            return Some(at);
        }
        at += 1;
    }
    None
}

fn after(bytes: &[u8], from: usize, what: &[u8]) -> usize {
    find(bytes, from.min(bytes.len()), what).map_or(bytes.len(), |found| found + what.len())
}

fn line_of(bytes: &[u8], at: usize) -> String {
    let n_breaks = bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
    format!("line {}", n_breaks + 1)
}
