//! Counts of what was read, for limits and for saying why nothing came out.

/// What was drawn and what was not.
#[derive(Debug, Default)]
pub struct Tally {
    /// Elements entered, those repeated by `<use>` included.
    pub n_elements: usize,
    /// Path elements of all shapes.
    pub n_path_elements: usize,
    /// Elements left out because of a fault.
    pub n_dropped: usize,
    /// Elements that are hidden or have no paint.
    pub n_invisible: usize,
    n_images: usize,
    n_foreign: usize,
}

impl Tally {
    /// Counts an element of a kind that is never marked.
    pub fn ignored(&mut self, tag: &str) {
        if tag == "image" {
            self.n_images += 1;
        } else {
            self.n_foreign += 1;
        }
    }

    /// Why no shape came out, as far as known.
    pub fn reason(&self) -> String {
        let parts: Vec<String> = [
            (self.n_images, "raster images"),
            (self.n_invisible, "hidden or unpainted elements"),
            (self.n_dropped, "elements left out because of a fault"),
            (self.n_foreign, "elements of unsupported kinds"),
        ]
        .into_iter()
        .filter(|(count, _)| *count != 0)
        .map(|(count, what)| format!("{what} ({count})"))
        .collect();
        if parts.is_empty() {
            "the drawing holds no shapes".into()
        } else {
            format!("the drawing holds only {}", parts.join(" and "))
        }
    }
}
