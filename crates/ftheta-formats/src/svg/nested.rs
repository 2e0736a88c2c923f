//! Drawings inside the drawing: `<svg>`, `<symbol>` and `<use>`.

use super::drawing::{Node, href_of, plain_attribute, tag_of};
use super::error::SvgError;
use super::length::Direction;
use super::page::{view_box_map, view_box_of};
use super::walk::{Context, Reader};
use kurbo::{Affine, Vec2};
use std::str::FromStr;
use svgtypes::AspectRatio;

impl<'a> Reader<'a, '_> {
    /// An `<svg>` or `<symbol>`: `placed` states where it is put, `content` holds the children.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn inner_svg(
        &mut self,
        content: Node<'a>,
        placed: Node<'a>,
        mut context: Context<'a>,
        size: Option<[Option<f64>; 2]>,
    ) -> Result<(), SvgError> {
        let mut lengths = self.lengths(placed, &context);
        let [width, height] = size.unwrap_or_else(|| {
            let width = lengths.optional("width", Direction::X);
            [width, lengths.optional("height", Direction::Y)]
        });
        let corner = if size.is_some() {
            // The corner of a `use` is part of its own transform already.
            Vec2::ZERO
        } else {
            let x = lengths.get("x", Direction::X);
            Vec2::new(x, lengths.get("y", Direction::Y))
        };
        self.warn_of_fault(placed, lengths.fault);
        let size = [width.unwrap_or(context.viewport[0]), height.unwrap_or(context.viewport[1])];
        context.field_from_user *= Affine::translate(corner);
        let view_box = match view_box_of(content) {
            Ok(view_box) => view_box,
            Err(error) => {
                self.tally.n_dropped += 1;
                self.warnings.add(self.drawing.place(content), error.to_string());
                return Ok(());
            }
        };
        if !size.iter().all(|side| 0.0 < *side) {
            self.tally.n_dropped += 1;
            self.warnings.add(self.drawing.place(placed), "its size is not above 0, left out");
            return Ok(());
        }
        context.viewport = size;
        if let Some(view_box) = view_box {
            let aspect = plain_attribute(content, "preserveAspectRatio")
                .and_then(|text| AspectRatio::from_str(text).ok())
                .unwrap_or_default();
            context.field_from_user *= view_box_map(size, view_box, aspect);
            context.viewport = [view_box.w, view_box.h];
        }
        self.children(content, &context)
    }

    /// A `<use>`: draws what it refers to.
    ///
    /// # Errors
    /// If a limit is passed.
    pub fn expand(&mut self, node: Node<'a>, mut context: Context<'a>) -> Result<(), SvgError> {
        let href = href_of(node).unwrap_or("");
        let Some(target) = href.strip_prefix('#').and_then(|id| self.drawing.by_id(id)) else {
            self.tally.n_dropped += 1;
            let message = format!("refers to \"{href}\", which is not in this file, left out");
            self.warnings.add(self.drawing.place(node), message);
            return Ok(());
        };
        let around_itself = node.ancestors().any(|outer| outer == target);
        if around_itself || self.uses.contains(&node.id()) {
            self.tally.n_dropped += 1;
            let message = format!("refers to \"{href}\", which contains it, left out");
            self.warnings.add(self.drawing.place(node), message);
            return Ok(());
        }
        let mut lengths = self.lengths(node, &context);
        let corner = Vec2::new(lengths.get("x", Direction::X), lengths.get("y", Direction::Y));
        let width = lengths.optional("width", Direction::X);
        let height = lengths.optional("height", Direction::Y);
        self.warn_of_fault(node, lengths.fault);
        context.field_from_user *= Affine::translate(corner);
        self.uses.push(node.id());
        let result = self.used(target, context, [width, height]);
        self.uses.pop();
        result
    }

    fn used(
        &mut self,
        target: Node<'a>,
        mut context: Context<'a>,
        size: [Option<f64>; 2],
    ) -> Result<(), SvgError> {
        match tag_of(target) {
            Some("symbol") => {
                if self.enter(target, &mut context)? {
                    self.inner_svg(target, target, context, Some(size))?;
                }
                Ok(())
            }
            _ => self.element(target, &context),
        }
    }
}
