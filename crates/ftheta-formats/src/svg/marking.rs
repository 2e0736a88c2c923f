//! Collects shapes into layers and gives each its pen.

use ftheta_model::job::{Job, Layer, Shape};
use ftheta_model::recipe::{Pen, Recipe};
use std::collections::HashMap;

/// A layer of the drawing and the layer around it.
struct Scope {
    around: Option<ScopeIndex>,
    names: Vec<String>,
    /// Index in the job, once a shape was put on it.
    layer_index: Option<usize>,
}

/// Refers to a layer of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScopeIndex(usize);

/// A job that grows shape by shape.
pub struct Marking<'r> {
    recipe: &'r Recipe,
    layers: Vec<Layer>,
    scopes: Vec<Scope>,
    extra_pens: Vec<Pen>,
    extra_pen_index: HashMap<[u8; 3], usize>,
}

impl<'r> Marking<'r> {
    /// No shapes yet.
    pub fn new(recipe: &'r Recipe) -> Self {
        Self {
            recipe,
            layers: Vec::new(),
            scopes: Vec::new(),
            extra_pens: Vec::new(),
            extra_pen_index: HashMap::new(),
        }
    }

    /// Opens a layer inside another.
    ///
    /// * `names`: the name to show first; a rule may mean any of them
    pub fn open(&mut self, around: Option<ScopeIndex>, names: Vec<String>) -> ScopeIndex {
        self.scopes.push(Scope { around, names, layer_index: None });
        ScopeIndex(self.scopes.len() - 1)
    }

    /// The pen for a colour on a layer.
    pub fn pen_index(&mut self, color_rgb: [u8; 3], scope: ScopeIndex) -> usize {
        let rules = &self.recipe.pens;
        let found = rules.iter().position(|rule| {
            rule.color_rgb.is_none_or(|color| color == color_rgb)
                && rule.layer.as_ref().is_none_or(|layer| self.is_on(scope, layer))
        });
        found.unwrap_or_else(|| {
            let next = rules.len() + self.extra_pens.len();
            *self.extra_pen_index.entry(color_rgb).or_insert_with(|| {
                let [red, green, blue] = color_rgb;
                self.extra_pens.push(Pen {
                    name: format!("#{red:02x}{green:02x}{blue:02x}"),
                    ..Pen::default()
                });
                next
            })
        })
    }

    /// Puts a shape on a layer.
    pub fn add(&mut self, scope: ScopeIndex, shape: Shape) {
        let layers = &mut self.layers;
        let scope = &mut self.scopes[scope.0];
        let layer_index = *scope.layer_index.get_or_insert_with(|| {
            layers.push(Layer {
                name: scope.names.first().cloned().unwrap_or_default(),
                shapes: Vec::new(),
            });
            layers.len() - 1
        });
        layers[layer_index].shapes.push(shape);
    }

    /// Whether there is no shape yet.
    pub fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// The job on a page.
    pub fn into_job(self, page_mm: [f64; 2]) -> Job {
        let recipe_pens = self.recipe.pens.iter().map(|rule| rule.pen.clone());
        Job { pens: recipe_pens.chain(self.extra_pens).collect(), layers: self.layers, page_mm }
    }

    fn is_on(&self, scope: ScopeIndex, layer: &str) -> bool {
        let mut next = Some(scope);
        while let Some(ScopeIndex(index)) = next {
            let scope = &self.scopes[index];
            let same = |name: &String| name.to_lowercase() == layer.to_lowercase();
            if scope.names.iter().any(same) {
                return true;
            }
            next = scope.around;
        }
        false
    }
}
