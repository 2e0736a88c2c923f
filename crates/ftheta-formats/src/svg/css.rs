//! Rules of `<style>` elements, found by what they select.

use super::drawing::{Node, plain_attribute};
use simplecss::{
    AttributeOperator, Declaration, PseudoClass, Rule, SelectorToken, SelectorTokenizer, StyleSheet,
};
use std::cell::Cell;
use std::collections::HashMap;

/// Selectors times declarations that are taken: the parser copies them for each other.
const N_DECLARATIONS_MAX: usize = 1_000_000;
/// Elements that selectors may look at, over the whole file.
const N_STEPS_MAX: u64 = 100_000_000;

/// All rules of a file, in the order in which they apply.
#[derive(Default)]
pub struct StyleSheets<'a> {
    rules: Vec<Rule<'a>>,
    /// Rules by the id, class or tag that the selected element must have.
    by_key: HashMap<String, Vec<usize>>,
    unkeyed: Vec<usize>,
    n_declarations: usize,
    n_steps: Cell<u64>,
    /// Whether rules were left out because there are too many of them.
    pub incomplete: Cell<bool>,
}

impl<'a> StyleSheets<'a> {
    /// Takes the text of a `<style>` element.
    pub fn add(&mut self, text: &'a str) {
        self.n_declarations = self.n_declarations.saturating_add(n_declarations(text));
        if N_DECLARATIONS_MAX < self.n_declarations {
            self.incomplete.set(true);
            return;
        }
        self.rules.extend(StyleSheet::parse(text).rules);
    }

    /// Brings the rules into order; call once after the last [`StyleSheets::add`].
    pub fn sort(&mut self) {
        self.rules.sort_by_cached_key(|rule| rule.selector.specificity());
        for (index, rule) in self.rules.iter().enumerate() {
            match key_of(&rule.selector.to_string()) {
                Some(key) => self.by_key.entry(key).or_default().push(index),
                None => self.unkeyed.push(index),
            }
        }
    }

    /// Calls `take` with each declaration for `node`, weakest first.
    pub fn declare(&self, node: Node<'a>, mut take: impl FnMut(&Declaration<'a>)) {
        if self.rules.is_empty() {
            return;
        }
        let mut found = self.unkeyed.clone();
        let mut look_up = |key: &str| found.extend(self.by_key.get(key).into_iter().flatten());
        look_up(node.tag_name().name());
        if let Some(id) = plain_attribute(node, "id") {
            look_up(&format!("#{id}"));
        }
        for class in plain_attribute(node, "class").unwrap_or("").split_ascii_whitespace() {
            look_up(&format!(".{class}"));
        }
        found.sort_unstable();
        found.dedup();
        let element = Element { node, n_steps: &self.n_steps };
        for rule in found.into_iter().map(|index| &self.rules[index]) {
            if rule.selector.matches(&element) {
                rule.declarations.iter().for_each(&mut take);
            }
        }
        if N_STEPS_MAX < self.n_steps.get() {
            self.incomplete.set(true);
        }
    }
}

/// An upper bound of the declarations that the parser makes of `text`.
fn n_declarations(text: &str) -> usize {
    text.split('}')
        .map(|block| {
            let n_selectors = block.matches(',').count() + 1;
            n_selectors.saturating_mul(block.matches(';').count() + 1)
        })
        .fold(0, usize::saturating_add)
}

/// The id, class or tag in the last part of a selector, the one about the element itself.
fn key_of(selector: &str) -> Option<String> {
    let mut key: Option<String> = None;
    let stronger = |key: &Option<String>| key.as_ref().is_none_or(|key| !key.starts_with('#'));
    for token in SelectorTokenizer::from(selector) {
        match token.ok()? {
            SelectorToken::DescendantCombinator
            | SelectorToken::ChildCombinator
            | SelectorToken::AdjacentCombinator => key = None,
            SelectorToken::TypeSelector(tag) if key.is_none() => key = Some(tag.to_owned()),
            // The parser prints `#a` and `.a` as attribute selectors.
            SelectorToken::AttributeSelector("id", AttributeOperator::Matches(id)) => {
                key = Some(format!("#{id}"));
            }
            SelectorToken::AttributeSelector("class", AttributeOperator::Contains(class))
                if stronger(&key) =>
            {
                key = Some(format!(".{class}"));
            }
            _ => {}
        }
    }
    key
}

struct Element<'a, 's> {
    node: Node<'a>,
    n_steps: &'s Cell<u64>,
}

impl Element<'_, '_> {
    /// Counts a step; false once there were too many, which ends every search.
    fn step(&self) -> bool {
        self.n_steps.set(self.n_steps.get() + 1);
        self.n_steps.get() <= N_STEPS_MAX
    }
}

impl simplecss::Element for Element<'_, '_> {
    fn parent_element(&self) -> Option<Self> {
        let node = self.node.parent_element().filter(|_| self.step())?;
        Some(Self { node, ..*self })
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        let node = self.node.prev_sibling_element().filter(|_| self.step())?;
        Some(Self { node, ..*self })
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.step() && self.node.tag_name().name() == name
    }

    fn attribute_matches(&self, local_name: &str, operator: AttributeOperator<'_>) -> bool {
        self.step()
            && plain_attribute(self.node, local_name).is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, class: PseudoClass<'_>) -> bool {
        self.step()
            && class == PseudoClass::FirstChild
            && self.node.prev_sibling_element().is_none()
    }
}
