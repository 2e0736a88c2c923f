//! `ftheta convert`: a drawing as plain curves, or as the polylines that are marked.

use crate::arguments::Convert;
use crate::json;
use crate::screen::{note, say};
use ftheta::formats::svg::SvgOptions;
use ftheta::{Error, convert, import};
use serde_json::json;

/// Reads one file, writes another.
pub fn run(arguments: &Convert, as_json: bool) -> Result<(), Error> {
    let (recipe, _) = import::recipe_for(&arguments.input, arguments.recipe.as_deref())?;
    let options = SvgOptions { fit_mm: arguments.fit, ..SvgOptions::default() };
    let drawing = import::drawing(&arguments.input, &recipe, &options)?;
    let n_shapes = drawing.value.shapes().count();
    convert::write(&drawing.value, &recipe, &arguments.output)?;
    let warnings: Vec<String> = drawing.warnings.iter().map(ToString::to_string).collect();
    let file = arguments.output.display().to_string();
    if as_json {
        json::print(&json!({"shapes": n_shapes, "files": {"output": file}, "warnings": warnings}));
        return Ok(());
    }
    warnings.iter().for_each(|warning| note!("warning: {warning}"));
    say!("{n_shapes} shapes in {file}");
    Ok(())
}
