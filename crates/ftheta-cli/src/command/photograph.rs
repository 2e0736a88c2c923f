//! `ftheta twin photograph`: a calibration from pictures, rehearsed.

use crate::arguments::photograph::{HeadName, TwinPhotograph};
use crate::json;
use crate::progress::Progress;
use crate::screen::say;
use ftheta::model::machine::Machine;
use ftheta::output::{PictureFormat, write_file, write_picture};
use ftheta::photograph::truth::{TruePlace, Truth};
use ftheta::photograph::{BurnOptions, Photograph, PhotographOptions, TEXTURE, photograph};
use ftheta::twin::hidden_head::hidden_head;
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::photograph::{CameraOptions, Sensor};
use ftheta::{Error, import, machines, tables};
use serde_json::{Value, json};

/// Takes a photograph.
pub fn run(arguments: &TwinPhotograph, as_json: bool) -> Result<(), Error> {
    let mut progress = Progress::new("plan");
    let format = PictureFormat::of(&arguments.out, arguments.quality)?;
    let machine = machines::find(&arguments.machine)?;
    let pattern = import::pattern(&arguments.pattern)?;
    let labels = import::labels_beside(&arguments.pattern)?;
    let options = options(arguments, &machine)?;
    let photograph = photograph(&pattern, &labels, &machine, &options, &mut |stage| {
        progress.observe(stage);
    })?;
    write_picture(&photograph.picture, &arguments.out, format)?;
    let mut files = vec![("picture", arguments.out.display().to_string())];
    if let Some(path) = &arguments.truth {
        write_file(path, truth(&photograph.truth).to_string().as_bytes())?;
        files.push(("truth", path.display().to_string()));
    }
    progress.finish();
    let Photograph { picture, caliper_mm: [x_mm, y_mm], pixel_mm, .. } = &photograph;
    if as_json {
        json::print(&json!({
            "machine": machine.name,
            "seed": arguments.seed,
            "um_per_px": pixel_mm * 1e3,
            "width_px": picture.width(),
            "height_px": picture.height(),
            "laser": {"on_us": arguments.laser_on_us, "off_us": arguments.laser_off_us},
            "sheet": {"x_mm": x_mm, "y_mm": y_mm},
            "files": json::files(&files),
        }));
        return Ok(());
    }
    let (width, height) = (picture.width(), picture.height());
    say!("{width} x {height} pixels of {:.1} µm", pixel_mm * 1e3);
    for (axis, length_mm) in [("x", x_mm), ("y", y_mm)] {
        if let Some(length_mm) = length_mm {
            say!("the printed line along {axis} measures {length_mm:.2} mm");
        }
    }
    for (kind, path) in files {
        say!("{kind:8} {path}");
    }
    Ok(())
}

fn options(arguments: &TwinPhotograph, machine: &Machine) -> Result<PhotographOptions, Error> {
    let true_machine = match &arguments.built_as {
        Some(name) => machines::find(name)?,
        None => machine.clone(),
    };
    let table = arguments.table.as_deref().map(|path| tables::usable(path, machine)).transpose()?;
    let seed = arguments.seed;
    let head = match arguments.head {
        HeadName::Hidden => Some(hidden_head(&true_machine.optics, seed)),
        HeadName::None => None,
    };
    let ns = |us: f64| (us * 1e3).round() as i64;
    let [x_mm, y_mm] = arguments.sheet_mm;
    Ok(PhotographOptions {
        burn: BurnOptions {
            true_machine,
            head,
            table,
            mismatch: Mismatch::default(),
            late_ns: [ns(arguments.laser_on_us), ns(arguments.laser_off_us)],
            dose: arguments.dose,
            power: arguments.power.map(Into::into),
            dose_slope: arguments.dose_slope * 1e-2,
            jitter_mm: arguments.jitter_um * 1e-3,
            spot_diameter_mm: arguments.spot_um.map(|um| um * 1e-3),
            overburn: arguments.overburn,
            missing: arguments.missing * 1e-2,
        },
        camera: CameraOptions {
            pixel_mm: arguments.um_per_px.map(|um| um * 1e-3),
            megapixels: arguments.megapixels,
            tilt_deg: arguments.tilt_deg,
            turn_deg: arguments.turn_deg,
            mirrored: arguments.mirror,
            distortion: arguments.distortion,
            seed,
        },
        sensor: Sensor {
            blur_px: arguments.blur_px,
            noise: arguments.noise,
            exposure: arguments.exposure,
            unevenness: arguments.unevenness,
            glare: arguments.glare,
            n_dirt: arguments.dirt as usize,
            gamma: arguments.gamma,
            seed,
        },
        bright: arguments.bright,
        print_error: arguments.print_error.map(|error| error.map(|percent| percent * 1e-2)),
        print_noise_mm: arguments.print_noise_um * 1e-3,
        sheet_lies: [x_mm, y_mm, arguments.sheet_deg],
        texture: TEXTURE.map(|part| part * arguments.texture),
    })
}

fn truth(truth: &Truth) -> Value {
    let place = |place: &TruePlace| {
        json!({
            "x_mm": place.place_mm.x_mm, "y_mm": place.place_mm.y_mm,
            "x_px": place.pixel.x_px, "y_px": place.pixel.y_px,
        })
    };
    let with_id = |id: &String, mut value: Value| {
        value["id"] = json!(id);
        value
    };
    let centres: Vec<Value> = truth.centres.iter().map(|(id, at)| with_id(id, place(at))).collect();
    let ends = truth
        .ends
        .iter()
        .map(|(id, [from, to])| with_id(id, json!({"from": place(from), "to": place(to)})));
    let view = &truth.camera.view;
    let lens = &view.lens;
    let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
    let rows: Vec<Vec<f64>> =
        view.homography.row_iter().map(|row| row.iter().copied().collect()).collect();
    json!({
        "centres": centres,
        "ends": ends.collect::<Vec<_>>(),
        "print_scale": truth.print_scale,
        "camera": {
            "focal_px": lens.focal_px,
            "centre_px": [lens.centre_px.x_px, lens.centre_px.y_px],
            "distortion": [k1, k2, p1, p2, k3],
            "ray_from_plane": rows,
        },
    })
}
