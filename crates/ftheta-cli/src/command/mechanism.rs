//! `ftheta machine mechanism`: modes of a mechanism file.

use crate::arguments::Mechanism;
use crate::json;
use crate::screen::say;
use ftheta::Error;
use ftheta::mechanism::{Analysis, Response, analyse, respond, write_machine};
use serde_json::{Value, json};

/// 1 g·cm² in kg·m².
const G_CM2: f64 = 1e-7;

/// Analyses a mechanism, prints what it found, and writes the files that are asked for.
pub fn run(arguments: &Mechanism, as_json: bool) -> Result<(), Error> {
    let analysis = analyse(&arguments.file)?;
    let response = arguments.law.as_ref().map(|law| respond(&analysis, law)).transpose()?;
    if let Some(path) = &arguments.out {
        write_machine(&arguments.machine, &analysis, path)?;
    }
    if let (Some(response), Some(path)) = (&response, &arguments.response) {
        response.write(path)?;
    }
    if as_json {
        let mut object = summary(&analysis);
        object["files"] = [("machine", &arguments.out), ("response", &arguments.response)]
            .into_iter()
            .filter_map(|(key, path)| Some((key, path.as_ref()?.display().to_string())))
            .collect();
        if let Some(response) = &response {
            object["response"] = measures(response)
                .into_iter()
                .map(|(key, value)| (key.to_owned(), Value::from(value)))
                .collect();
        }
        json::print(&object);
        return Ok(());
    }
    print(&analysis);
    for (key, value) in response.iter().flat_map(measures) {
        say!("  {key:24} {value:.3}");
    }
    for path in [&arguments.out, &arguments.response].into_iter().flatten() {
        say!("written: {}", path.display());
    }
    Ok(())
}

/// What a response comes to.
fn measures(response: &Response) -> [(&'static str, f64); 3] {
    let greatest = response.errors_rad().fold(0.0_f64, |peak, error| peak.max(error.abs()));
    let last = response.errors_rad().last().unwrap_or(0.0);
    [
        ("mirror_error_max_urad", greatest * 1e6),
        ("mirror_error_end_urad", last * 1e6),
        ("torque_max_mn_m", response.torque_max_n_m() * 1e3),
    ]
}

fn summary(analysis: &Analysis) -> Value {
    let scale = analysis.modes.inertia_kg_m2.sqrt();
    let modes: Vec<Value> = analysis
        .modes
        .shapes
        .iter()
        .map(|shape| {
            json!({
                "frequency_hz": shape.frequency_hz,
                "kind": shape.kind.word(),
                "rotor": shape.rotor * scale,
                "mirror": shape.mirror * scale,
                "tilt": shape.tilt * scale,
                "drive": analysis.modes.drive(shape),
            })
        })
        .collect();
    let [rotor, shaft, mount, mirror] = analysis.model.inertias_kg_m2().map(|j| j / G_CM2);
    let two = &analysis.two_inertias;
    json!({
        "freedoms": analysis.model.n_freedoms(),
        "mirror_mass_g": analysis.model.mirror_mass_kg() * 1e3,
        "inertia_g_cm2": {"rotor": rotor, "shaft": shaft, "mount": mount, "mirror": mirror},
        "modes": modes,
        "two_inertias": {
            "rotor_inertia_g_cm2": two.rotor_kg_m2 / G_CM2,
            "mirror_inertia_g_cm2": two.mirror_kg_m2 / G_CM2,
            "torsional_mode_hz": two.frequency_hz,
        },
    })
}

fn print(analysis: &Analysis) {
    let [rotor, shaft, mount, mirror] = analysis.model.inertias_kg_m2().map(|j| j / G_CM2);
    say!("{} degrees of freedom, one of them the rotation", analysis.model.n_freedoms());
    say!(
        "inertia g·cm²: rotor {rotor:.4}, shaft {shaft:.4}, mount {mount:.4}, mirror {mirror:.4} \
         ({:.2} g)",
        analysis.model.mirror_mass_kg() * 1e3
    );
    say!(
        "{:>12}  {:9} {:>8} {:>8} {:>8} {:>8}",
        "mode Hz",
        "kind",
        "rotor",
        "mirror",
        "tilt",
        "drive"
    );
    let scale = analysis.modes.inertia_kg_m2.sqrt();
    for shape in &analysis.modes.shapes {
        say!(
            "{:>12.1}  {:9} {:>8.4} {:>8.4} {:>8.4} {:>8.4}",
            shape.frequency_hz,
            shape.kind.word(),
            shape.rotor * scale,
            shape.mirror * scale,
            shape.tilt * scale,
            analysis.modes.drive(shape)
        );
    }
    say!("angles at equal energy, the rotation of the whole is 1; drive = rotor times mirror");
    let two = &analysis.two_inertias;
    say!(
        "as two inertias: rotor {:.4} and mirror {:.4} g·cm², torsional mode {:.1} Hz",
        two.rotor_kg_m2 / G_CM2,
        two.mirror_kg_m2 / G_CM2,
        two.frequency_hz
    );
}
