//! Pictures of a marked grid, for `ftheta calibrate field`.

use crate::arguments::calibrate::PictureArguments;
use crate::screen::say;
use ftheta::calibrate::picture::PictureOptions;
use ftheta::field_picture::{self, FieldPicture, Source};
use ftheta::{Error, import};
use serde_json::{Value, json};

/// The pictures that the arguments name, measured; none if they name none.
pub fn measure(arguments: &PictureArguments) -> Result<Vec<FieldPicture>, Error> {
    let Some(path) = &arguments.pattern else { return Ok(Vec::new()) };
    let pattern = import::pattern(path)?;
    let camera = arguments.camera_file.as_deref().map(import::camera_file).transpose()?;
    let options = PictureOptions {
        sheet_mm: [arguments.sheet_x_mm, arguments.sheet_y_mm],
        lens: camera.as_ref().map(|camera| camera.lens),
        view: camera.as_ref().and_then(|camera| camera.view),
        size_px: camera.as_ref().and_then(|camera| camera.size_px),
        mm_per_px: arguments.um_per_px.map(|um| um * 1e-3),
        placement: arguments.placement.into(),
    };
    let files = arguments.image.iter().cloned().map(Source::File);
    let sources = files.chain(arguments.camera.iter().cloned().map(Source::Device));
    sources.map(|source| field_picture::measure(&source, &pattern, &options)).collect()
}

/// A picture for the JSON.
pub fn object(picture: &FieldPicture) -> Value {
    let seen = &picture.seen;
    let missing: Vec<&str> = seen
        .marks
        .iter()
        .filter(|mark| mark.measured_mm.is_none())
        .map(|mark| mark.id.as_str())
        .collect();
    let marks: Vec<Value> = seen
        .marks
        .iter()
        .filter_map(|mark| {
            let pixel = mark.pixel?;
            Some(json!({"id": mark.id, "x_px": pixel.x_px, "y_px": pixel.y_px}))
        })
        .collect();
    json!({
        "file": picture.path.display().to_string(),
        "um_per_px": seen.mm_per_px * 1e3,
        "bright": seen.bright,
        "signs": seen.signs.len(),
        "signs_left_out": seen.signs.iter().filter(|sign| !sign.kept).count(),
        "view_rms_px": seen.view_rms_px,
        "marks": marks,
        "missing": missing,
        "extra": seen.extra.len(),
    })
}

/// A picture for the screen.
pub fn print(picture: &FieldPicture) {
    let seen = &picture.seen;
    let n_found = seen.marks.iter().filter(|mark| mark.measured_mm.is_some()).count();
    say!(
        "picture  {}: {n_found} of {} marks at {:.1} µm/px, {} signs, {:.3} px rms",
        picture.path.display(),
        seen.marks.len(),
        seen.mm_per_px * 1e3,
        seen.signs.len(),
        seen.view_rms_px
    );
}
