//! `ftheta calibrate camera`: a camera's lens from pictures of a printed sheet.

use crate::arguments::calibrate::CalibrateCamera;
use crate::json;
use crate::screen::say;
use ftheta::camera_calibration::calibrate_camera;
use ftheta::field_picture::Source;
use ftheta::formats::camera_file;
use ftheta::output::write_file;
use ftheta::{Error, import};
use serde_json::json;

/// Calibrates a camera.
pub fn run(arguments: &CalibrateCamera, as_json: bool) -> Result<(), Error> {
    let pattern = import::pattern(&arguments.pattern)?;
    let sources: Vec<Source> = arguments.image.iter().cloned().map(Source::File).collect();
    let sheet_mm = [arguments.sheet_x_mm, arguments.sheet_y_mm];
    let found = calibrate_camera(&sources, &pattern, sheet_mm)?;
    let mut camera = found.camera;
    camera.view = camera.view.filter(|_| arguments.keep_view);
    write_file(&arguments.out, camera_file::write(&camera).as_bytes())?;
    let (lens, out) = (&camera.lens, arguments.out.display().to_string());
    if as_json {
        json::print(&json!({
            "focal_px": lens.focal_px[0],
            "focal_sd_px": found.focal_sd * lens.focal_px[0],
            "centre_px": [lens.centre_px.x_px, lens.centre_px.y_px],
            "radial": lens.radial,
            "tangential": lens.tangential,
            "rms_px": found.rms_px,
            "signs": found.n_signs,
            "view": camera.view.is_some(),
            "files": {"camera": out},
        }));
        return Ok(());
    }
    let [focal_px, _] = lens.focal_px;
    say!("focal    {focal_px:.1} ± {:.1} px", found.focal_sd * focal_px);
    say!("centre   {:.1}, {:.1} px", lens.centre_px.x_px, lens.centre_px.y_px);
    let ([k1, k2, _], [p1, p2]) = (lens.radial, lens.tangential);
    say!("lens     k1 {k1:.5}, k2 {k2:.5}, p1 {p1:.6}, p2 {p2:.6}");
    let n_signs: usize = found.n_signs.iter().sum();
    say!("signs    {n_signs} in {} pictures, {:.3} px rms", found.n_signs.len(), found.rms_px);
    say!("camera   {out}");
    Ok(())
}
