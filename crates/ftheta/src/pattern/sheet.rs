//! A pattern as files: drawing, recipe, nominal places, and a table to fill in.

use super::fiducials::Printed;
use crate::output::Output;
use crate::{Error, convert, import};
use ftheta_formats::text::hershey;
use ftheta_formats::{pattern_file, points, print_file, svg_write};
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::{Laser, Machine};
use ftheta_model::pattern::{LaserDelays, Pattern};
use ftheta_model::recipe::Pen;
use ftheta_model::space::FieldPoint;
use kurbo::{Affine, BezPath, Point, Rect, Shape as _, Vec2};
use std::path::Path;

/// Height of a capital letter, em.
const CAPITAL_EM: f64 = 0.75;
/// Colour of all that is marked.
const COLOR: &str = "#000000";

/// How a sheet is marked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetProcess {
    /// Speed of the beam, mm/s.
    pub speed_mm_s: f64,
    /// Power, W.
    pub power_w: f64,
}

/// A pattern and how it is marked.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Where its features should be.
    pub pattern: Pattern,
    /// Features, labels and signs as a drawing whose page's centre is the field's.
    pub job: Job,
    /// Distance of the lines that fill areas, mm; `None` if there are none.
    pub hatch_spacing_mm: Option<f64>,
    /// Whether marks have to be made in the drawing's order and directions.
    pub keep_order: bool,
    /// Places to measure, each with its name.
    pub places: Vec<(String, FieldPoint)>,
    /// A sheet to be printed and laid below the plate.
    pub printed: Option<Printed>,
}

impl SheetProcess {
    /// 1 000 mm/s, and 10 W where the laser has that much.
    pub fn of(machine: &Machine) -> Self {
        let pen = Pen::default();
        Self {
            speed_mm_s: pen.mark_speed_mm_s,
            power_w: pen.power_w.min(machine.laser.power_max_w),
        }
    }
}

/// The settings that make up for the laser's latency, as `ftheta mark` plans with them.
pub fn delays(laser: &Laser) -> LaserDelays {
    // Later is positive, and an edge that is to be in time is sent early.
    let us = |latency_ns: i64| 0.0 - latency_ns as f64 * 1e-3;
    LaserDelays { on_us: us(laser.on_latency_ns), off_us: us(laser.off_latency_ns) }
}

impl Sheet {
    /// An empty drawing of this page.
    pub fn new_job(process: &SheetProcess, side_mm: f64) -> Job {
        let pen = Pen {
            name: COLOR.into(),
            mark_speed_mm_s: process.speed_mm_s,
            power_w: process.power_w,
            ..Pen::default()
        };
        Job { pens: vec![pen], layers: Vec::new(), page_mm: [side_mm; 2] }
    }

    /// Writes `OUT` (the drawing) and beside it `.json`, `.recipe.toml`, `.csv` if there are places
    /// to measure, `.sheet.pdf` and `.sheet.svg` if there is a sheet; returns kind and path of
    /// each.
    ///
    /// # Errors
    /// If a file cannot be written, `out` does not end in `.svg`, or the table beside it has been
    /// filled in by a user.
    pub fn write(&self, out: &Path) -> Result<Vec<(&'static str, String)>, Error> {
        convert::check_svg(out)?;
        let table = out.with_extension("csv");
        // An hour's work with a ruler must not be lost to a command that is run again.
        if table.is_file() && import::measured_points(&table, None).is_ok() {
            return Err(Error::Filled { path: table });
        }
        let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
        let mut output = Output::new(folder.unwrap_or(Path::new(".")))?;
        let mut files = vec![
            ("drawing", out.to_path_buf(), svg_write::to_svg(&self.job).into_bytes()),
            ("recipe", out.with_extension("recipe.toml"), self.recipe().into_bytes()),
            ("features", out.with_extension("json"), pattern_file::write(&self.pattern).into()),
        ];
        if !self.places.is_empty() {
            files.push(("points", table, self.table().into_bytes()));
        }
        if let Some(Printed { print, .. }) = &self.printed {
            files.push(("print", out.with_extension("sheet.pdf"), print_file::to_pdf(print)));
            let svg = print_file::to_svg(print).into_bytes();
            files.push(("print", out.with_extension("sheet.svg"), svg));
        }
        for (_, path, content) in &files {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            output.add(&name, |out| out.write_all(content))?;
        }
        output.publish()?;
        let written = files.into_iter();
        Ok(written.map(|(kind, path, _)| (kind, path.display().to_string())).collect())
    }

    /// The recipe file that `ftheta mark` finds beside the drawing.
    fn recipe(&self) -> String {
        let mut text = String::from("# How the pattern is marked.\n");
        if self.keep_order {
            text.push_str("order = \"keep\" # directions matter\n");
        }
        for (index, pen) in self.job.pens.iter().enumerate() {
            let name = if index == 0 { "pattern" } else { &pen.name };
            text.push_str(&format!(
                "\n[[pen]]\nname = \"{name}\"\ncolor = \"{}\"\nmark_speed_mm_s = {}\n\
                 power_w = {}\n",
                pen.name, pen.mark_speed_mm_s, pen.power_w
            ));
            if let Some(spacing_mm) = self.hatch_spacing_mm {
                // Tenths of a micrometre are fine enough, and short to read.
                text.push_str(&format!(
                    "hatch_spacing_mm = {spacing_mm:.4} # dots are filled with lines this far apart\n"
                ));
            }
        }
        text
    }

    /// The table that the user fills in.
    fn table(&self) -> String {
        points::write(self.places.iter().map(|(name, place)| (name.as_str(), *place, 1, None)))
    }
}

/// A layer of curves that are marked as lines.
pub fn layer(name: &str, paths: impl IntoIterator<Item = (String, BezPath)>) -> Layer {
    let shape = |(source, path)| Shape { source, path, paint: Paint::Stroke, pen_index: 0 };
    Layer { name: name.into(), shapes: paths.into_iter().map(shape).collect() }
}

/// Text in single strokes, one em high, its bounds' lower left corner at the origin.
pub fn lettering(text: &str) -> BezPath {
    let (mut path, mut pen_em) = (BezPath::new(), 0.0);
    for letter in hershey::set(text).letters {
        path.extend(Affine::translate((pen_em, 0.0)) * letter.path);
        pen_em += letter.advance_em;
    }
    let bounds = path.bounding_box();
    Affine::translate(-Vec2::new(bounds.x0, bounds.y0)) * path
}

/// Width of a text in single strokes, em.
pub fn width_em(text: &str) -> f64 {
    lettering(text).bounding_box().width()
}

/// Signs that show where x and y lead: an arrow along each from one corner, with its letter.
///
/// * `bounds`: what they fill, field mm; its lower left corner is the arrows' common end
pub fn axes_sign(bounds: Rect) -> Vec<(String, BezPath)> {
    let length_mm = bounds.width().min(bounds.height());
    let em_mm = 0.3 * length_mm / CAPITAL_EM;
    let shaft_mm = length_mm - 1.3 * CAPITAL_EM * em_mm;
    let origin = Affine::translate((bounds.x0, bounds.y0));
    let arrow = |swap: bool| {
        // Along x, or with both coordinates swapped along y.
        let at = |x: f64, y: f64| if swap { Point::new(y, x) } else { Point::new(x, y) };
        let (tip, wing) = (at(shaft_mm, 0.0), 0.2 * shaft_mm);
        let mut path = BezPath::new();
        path.move_to(at(0.0, 0.0));
        path.line_to(tip);
        path.move_to(at(shaft_mm - wing, 0.6 * wing));
        path.line_to(tip);
        path.line_to(at(shaft_mm - wing, -0.6 * wing));
        origin * path
    };
    let letter = |name: &str, x: f64, y: f64| {
        origin * Affine::translate((x, y)) * Affine::scale(em_mm) * lettering(name)
    };
    let beyond_mm = shaft_mm + 0.3 * CAPITAL_EM * em_mm;
    vec![
        ("arrow x".into(), arrow(false)),
        ("arrow y".into(), arrow(true)),
        ("letter X".into(), letter("X", beyond_mm, 0.0)),
        ("letter Y".into(), letter("Y", 0.0, beyond_mm)),
    ]
}
