//! Goes through the elements in drawing order and hands over what is marked.

use super::declared::{Declared, Property};
use super::drawing::{Drawing, Node, plain_attribute, tag_of};
use super::error::SvgError;
use super::geometry::{self, Lengths, Scale};
use super::layer;
use super::marking::{Marking, ScopeIndex};
use super::page::Page;
use super::style::{Style, is_transparent};
use super::tally::Tally;
use super::warnings::Warnings;
use super::{Limits, SvgOptions, emit, text};
use crate::text::system::SystemFonts;
use ftheta_model::recipe::Recipe;
use kurbo::Affine;
use roxmltree::NodeId;
use std::str::FromStr;

/// What an element gets from those around it.
#[derive(Clone)]
pub struct Context<'a> {
    /// From the element's user units to field mm.
    pub field_from_user: Affine,
    /// Size of the nearest viewport, user units.
    pub viewport: [f64; 2],
    /// Inherited properties.
    pub style: Style<'a>,
    /// Something around it has opacity 0.
    pub transparent: bool,
    /// The layer it is on.
    pub scope: ScopeIndex,
    depth: usize,
}

impl Context<'_> {
    /// Greatest scale of the user units, mm; never zero.
    pub fn mm_per_unit(&self) -> f64 {
        // The greatest singular value: a matrix is a similarity plus a mirrored similarity.
        let [a, b, c, d, ..] = self.field_from_user.as_coeffs();
        let scale = 0.5 * ((a + d).hypot(b - c) + (a - d).hypot(b + c));
        if scale.is_normal() { scale } else { 1.0 }
    }
}

/// Reads elements into a [`Marking`].
pub struct Reader<'a, 'r> {
    /// The parsed file.
    pub drawing: &'a Drawing<'a>,
    /// What the user sets.
    pub recipe: &'r Recipe,
    /// Limits of time and memory.
    pub limits: Limits,
    /// Shapes so far.
    pub marking: Marking<'r>,
    /// Warnings so far.
    pub warnings: Warnings,
    /// Counts of what was drawn and what was not.
    pub tally: Tally,
    /// Fonts of the computer, if they may be used.
    pub system_fonts: Option<SystemFonts>,
    /// The `use` elements that are being expanded.
    pub uses: Vec<NodeId>,
}

impl<'a, 'r> Reader<'a, 'r> {
    /// Nothing read yet.
    pub fn new(drawing: &'a Drawing<'a>, recipe: &'r Recipe, options: &SvgOptions) -> Self {
        Self {
            drawing,
            recipe,
            limits: options.limits,
            marking: Marking::new(recipe),
            warnings: Warnings::default(),
            tally: Tally::default(),
            system_fonts: options.system_fonts.then(SystemFonts::default),
            uses: Vec::new(),
        }
    }

    /// Reads the whole drawing onto `page`.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn read(&mut self, page: &Page) -> Result<(), SvgError> {
        let root = self.drawing.root();
        let mut context = Context {
            field_from_user: page.field_from_user,
            viewport: page.viewport,
            style: Style::default(),
            transparent: false,
            scope: self.marking.open(None, Vec::new()),
            depth: 0,
        };
        if self.enter(root, &mut context)? {
            self.children(root, &context)?;
        }
        if self.drawing.style_sheets.incomplete.get() {
            self.warnings.add("<style>", "too many rules to look at, some were ignored");
        }
        Ok(())
    }

    /// Reads the elements in a group.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn children(&mut self, node: Node<'a>, around: &Context<'a>) -> Result<(), SvgError> {
        for child in node.children().filter(Node::is_element) {
            self.element(child, around)?;
        }
        Ok(())
    }

    /// Reads an element and what is in it.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn element(&mut self, node: Node<'a>, around: &Context<'a>) -> Result<(), SvgError> {
        let Some(tag) = tag_of(node) else {
            return Ok(());
        };
        match tag {
            "defs" | "desc" | "metadata" | "style" | "symbol" | "title" | "view" | "namedview"
            | "linearGradient" | "radialGradient" | "pattern" | "clipPath" | "mask" | "marker"
            | "filter" | "font" | "cursor" | "color-profile" | "pgf" => return Ok(()),
            _ => {}
        }
        if let Some(reason) = ignored(tag) {
            self.tally.ignored(tag);
            self.warnings.add(self.drawing.place(node), reason);
            return Ok(());
        }
        let mut context = around.clone();
        if !self.enter(node, &mut context)? {
            return Ok(());
        }
        match tag {
            "g" | "a" => self.group(node, context),
            "svg" => self.inner_svg(node, node, context, None),
            "switch" => match node.children().find(|child| switch_takes(*child)) {
                Some(child) => self.element(child, &context),
                None => Ok(()),
            },
            "use" => self.expand(node, context),
            "text" => text::mark(self, node, &context),
            _ => self.shape(node, tag, &context),
        }
    }

    /// Applies what the element states to `context`; false if it is not displayed.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn enter(&mut self, node: Node<'a>, context: &mut Context<'a>) -> Result<bool, SvgError> {
        context.depth += 1;
        if self.limits.depth_max < context.depth {
            return Err(SvgError::TooDeep {
                place: self.drawing.place(node),
                limit: self.limits.depth_max,
            });
        }
        self.tally.n_elements += 1;
        if self.limits.n_elements_max < self.tally.n_elements {
            return Err(SvgError::TooMany {
                place: self.drawing.place(node),
                what: "elements, those repeated by <use> included",
                limit: self.limits.n_elements_max,
            });
        }
        let declared = Declared::of(node, &self.drawing.style_sheets);
        if declared.get(Property::Display) == Some("none") {
            self.tally.n_invisible += 1;
            return Ok(false);
        }
        if let Some(fault) = declared.fault() {
            self.warnings.add(self.drawing.place(node), fault);
        }
        self.warn_of_effects(node, &declared);
        context.style.apply(&declared, context.viewport, self.drawing);
        context.transparent |= is_transparent(&declared);
        if let Some(text) = declared.get(Property::Transform).filter(|text| *text != "none") {
            let Some(transform) = transform_of(text) else {
                self.tally.n_dropped += 1;
                let message = format!("transform=\"{text}\" cannot be used, left out");
                self.warnings.add(self.drawing.place(node), message);
                return Ok(false);
            };
            context.field_from_user *= transform;
        }
        Ok(true)
    }

    fn warn_of_effects(&mut self, node: Node<'a>, declared: &Declared<'a>) {
        let effects = [
            (Property::ClipPath, "clip-path is ignored, marked unclipped"),
            (Property::Mask, "mask is ignored, marked unmasked"),
            (Property::Filter, "filter is ignored"),
            (Property::Marker, "markers are ignored"),
            (Property::MarkerStart, "markers are ignored"),
            (Property::MarkerMid, "markers are ignored"),
            (Property::MarkerEnd, "markers are ignored"),
            (Property::TransformOrigin, "transform-origin is ignored"),
            (Property::TextDecoration, "text-decoration is ignored"),
            (Property::WritingMode, "writing-mode is ignored"),
        ];
        if let Some((_, message)) = effects.iter().find(|effect| declared.asks(effect.0)) {
            self.warnings.add(self.drawing.place(node), *message);
        }
    }

    fn group(&mut self, node: Node<'a>, mut context: Context<'a>) -> Result<(), SvgError> {
        if let Some(names) = layer::names_of(node, self.drawing) {
            context.scope = self.marking.open(Some(context.scope), names);
        }
        self.children(node, &context)
    }

    fn shape(&mut self, node: Node<'a>, tag: &str, context: &Context<'a>) -> Result<(), SvgError> {
        let scale = Scale {
            base: context.style.length_base(context.viewport),
            mm_per_unit: context.mm_per_unit(),
            n_elements_max: self.limits.n_path_elements_max - self.tally.n_path_elements,
        };
        let moves = |child: &Node<'a>| tag_of(*child).is_some_and(|tag| ignored(tag).is_some());
        if let Some(child) = node.children().find(moves) {
            let reason = format!("<{}> in it is ignored", child.tag_name().name());
            self.warnings.add(self.drawing.place(node), reason);
        }
        match geometry::of(node, tag, &scale) {
            Some(geometry) => emit::shape(self, node, geometry, context),
            None => {
                self.tally.n_dropped += 1;
                self.warnings.add(self.drawing.place(node), "unknown element, left out");
                Ok(())
            }
        }
    }

    /// Reads lengths of an element.
    pub fn lengths(&self, node: Node<'a>, context: &Context<'a>) -> Lengths<'a> {
        Lengths { node, base: context.style.length_base(context.viewport), fault: None }
    }

    /// Passes a fault of an element's attributes on as a warning.
    pub fn warn_of_fault(&mut self, node: Node<'a>, fault: Option<String>) {
        if let Some(fault) = fault {
            self.warnings.add(self.drawing.place(node), fault);
        }
    }
}

/// Why an element that could be seen is not marked.
fn ignored(tag: &str) -> Option<&'static str> {
    Some(match tag {
        "image" => "raster image, left out",
        "foreignObject" => "foreign content, left out",
        "script" => "script, not run",
        "animate" | "animateColor" | "animateMotion" | "animateTransform" | "set" => {
            "animation, left out"
        }
        "flowRoot" => "flowed text, left out; convert it to text in Inkscape",
        "video" | "audio" | "iframe" | "canvas" => "media, left out",
        _ => return None,
    })
}

/// Whether a child of `<switch>` is for a reader like this one.
fn switch_takes(child: Node<'_>) -> bool {
    let language_fits = plain_attribute(child, "systemLanguage")
        .is_none_or(|languages| languages.split(',').any(|name| name.trim().starts_with("en")));
    child.is_element()
        && tag_of(child).is_some_and(|tag| ignored(tag).is_none())
        && plain_attribute(child, "requiredExtensions").is_none_or(str::is_empty)
        && language_fits
}

/// A transform list as one map; `None` if it is wrong or flattens everything.
fn transform_of(text: &str) -> Option<Affine> {
    // CSS writes `deg` and `px` where attributes have plain numbers.
    let plain = text.replace("deg", "").replace("px", "");
    let matrix = svgtypes::Transform::from_str(&plain).ok()?;
    let svgtypes::Transform { a, b, c, d, e, f } = matrix;
    let transform = Affine::new([a, b, c, d, e, f]);
    let usable = transform.is_finite() && transform.determinant() != 0.0;
    usable.then_some(transform)
}
