//! `ftheta convert`: a drawing as plain curves, or as the polylines that are marked; a correction
//! table as another kind of table.

use crate::arguments::Convert;
use crate::json;
use crate::screen::{note, say};
use ftheta::formats::cor_file::CorVersion;
use ftheta::formats::svg::SvgOptions;
use ftheta::tables::{self, TableKind};
use ftheta::{Error, convert, import, machines};
use serde_json::json;

/// Reads one file, writes another.
pub fn run(arguments: &Convert, as_json: bool) -> Result<(), Error> {
    if TableKind::of(&arguments.input).is_some() {
        return run_table(arguments, as_json);
    }
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

fn run_table(arguments: &Convert, as_json: bool) -> Result<(), Error> {
    let name = arguments.machine.as_deref();
    let needed = || Error::NeedsMachine { path: arguments.input.clone() };
    let machine = machines::find(name.ok_or_else(needed)?)?;
    let table = tables::read_any(&arguments.input, &machine)?;
    let version = if arguments.cor_1 { CorVersion::One } else { CorVersion::Two };
    tables::write(&table, &machine, &arguments.output, version)?;
    let file = arguments.output.display().to_string();
    if as_json {
        json::print(&json!({"machine": machine.name, "files": {"output": file}, "warnings": []}));
    } else {
        say!("correction table of {} in {file}", machine.name);
    }
    Ok(())
}
