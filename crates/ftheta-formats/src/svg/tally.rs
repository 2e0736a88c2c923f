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
    /// Strokes that look like areas.
    pub n_wide_strokes: usize,
    /// The widest of them, mm.
    pub widest_stroke_mm: f64,
    /// Areas in the colour of paper.
    pub n_white_areas: usize,
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

    /// What may surprise in a job, one sentence each.
    pub fn surprises(&self) -> Vec<String> {
        let mut surprises = Vec::new();
        if self.n_wide_strokes != 0 {
            surprises.push(format!(
                "strokes up to {:.3} mm wide are marked along their centre line only ({})",
                self.widest_stroke_mm, self.n_wide_strokes
            ));
        }
        if self.n_white_areas != 0 {
            surprises.push(format!(
                "white areas are marked too; give them no fill to leave them bare ({})",
                self.n_white_areas
            ));
        }
        surprises
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
