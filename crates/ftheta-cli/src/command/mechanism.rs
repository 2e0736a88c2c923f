//! `ftheta machine mechanism`: modes of a mechanism file.

use crate::json;
use crate::screen::say;
use ftheta::Error;
use ftheta::mechanism::{Analysis, analyse, write_machine};
use serde_json::{Value, json};
use std::path::Path;

/// 1 g·cm² in kg·m².
const G_CM2: f64 = 1e-7;

/// Analyses a mechanism, prints what it found, and writes a machine file if asked to.
pub fn run(file: &Path, machine: &str, out: Option<&Path>, as_json: bool) -> Result<(), Error> {
    let analysis = analyse(file)?;
    if let Some(path) = out {
        write_machine(machine, &analysis, path)?;
    }
    if as_json {
        let mut object = summary(&analysis);
        object["files"] =
            out.map_or(json!({}), |path| json!({"machine": path.display().to_string()}));
        json::print(&object);
    } else {
        print(&analysis);
        if let Some(path) = out {
            say!("machine file: {}", path.display());
        }
    }
    Ok(())
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
