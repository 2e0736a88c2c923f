//! `ftheta field`: places of the field as mirror angles, and back.

use crate::arguments::field::{Field, FieldAction, FieldMap};
use crate::json;
use crate::screen::say;
use ftheta::output::write_file;
use ftheta::{Error, field, machines, tables};
use serde_json::json;

/// Maps a list.
pub fn run(arguments: &Field, as_json: bool) -> Result<(), Error> {
    match &arguments.action {
        FieldAction::Map(map) => run_map(map, as_json),
    }
}

fn run_map(arguments: &FieldMap, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(&arguments.machine)?;
    let table = arguments.table.as_deref().map(|path| tables::read(path, &machine)).transpose()?;
    let mapped = field::map_file(&arguments.points, &machine, table.as_ref(), arguments.inverse)?;
    write_file(&arguments.out, field::csv(&mapped).as_bytes())?;
    let out = arguments.out.display().to_string();
    if as_json {
        json::print(&json!({
            "machine": machine.name,
            "points": mapped.len(),
            "corrected": table.is_some(),
            "files": {"out": out},
        }));
    } else {
        say!("{} places in {out}", mapped.len());
    }
    Ok(())
}
