//! Mechanism files: materials, shaft, bearings and mirror, TOML with units in the keys.

use crate::toml_table::{Section, TomlError, parse};
use ftheta_physics::mechanism::{
    Bearing, ELEMENTS_MAX, Material, Mechanism, Mirror, Part, Segment, Station, ellipse, octagon,
    rectangle,
};

const MM: f64 = 1e-3;

/// Materials that a file has declared, by name.
type Materials = [(String, Material)];

/// Reads a mechanism file.
///
/// * `file`: its name, for messages
///
/// # Errors
/// The first thing that is wrong, with line, value and limit. Unknown keys are errors.
pub fn read(file: &str, text: &str) -> Result<Mechanism, TomlError> {
    parse(file, text, |root| {
        let materials = root.sections("material", material)?;
        let segments = root.sections("segment", |section| segment(section, &materials))?;
        if !segments.iter().any(|segment| segment.part == Part::Rotor) {
            return Err(root.refuse("segment", "segments with one of part = \"rotor\""));
        }
        let shaft_m: f64 = segments.iter().map(|segment| segment.length_m).sum();
        let bearings = root.sections("bearing", |section| bearing(section, shaft_m))?;
        let mirror = root
            .section("mirror", |section| mirror(section, &materials))?
            .ok_or_else(|| root.missing("mirror"))?;
        let element_mm = root.number("element_mm", 1e-3..=100.0)?;
        let mechanism = Mechanism {
            segments,
            bearings,
            mirror,
            damping_ratio: root.number("damping_ratio", 1e-5..=0.5)?.unwrap_or(0.01),
            element_m: element_mm.unwrap_or(1.0) * MM,
        };
        let n_elements = mechanism.n_elements();
        if n_elements > ELEMENTS_MAX {
            let limit = format!(
                "what makes at most {ELEMENTS_MAX} elements, it would be {n_elements} of them"
            );
            let key = if element_mm.is_some() { "element_mm" } else { "mirror" };
            return Err(root.refuse(key, limit));
        }
        Ok(mechanism)
    })
}

fn material(section: &Section<'_>) -> Result<(String, Material), TomlError> {
    let name = section.text("name")?.ok_or_else(|| section.missing("name"))?.to_owned();
    let material = Material {
        young_pa: section.need("young_gpa", 1e-4..=2e3)? * 1e9,
        poisson: section.need("poisson", 0.0..=0.499)?,
        density_kg_m3: section.need("density_g_cm3", 0.01..=30.0)? * 1e3,
    };
    Ok((name, material))
}

/// The material that a section names.
fn named(section: &Section<'_>, materials: &Materials) -> Result<Material, TomlError> {
    let name = section.text("material")?.ok_or_else(|| section.missing("material"))?;
    if let Some((_, material)) = materials.iter().find(|(known, _)| known == name) {
        return Ok(*material);
    }
    let known: Vec<&str> = materials.iter().map(|(known, _)| known.as_str()).collect();
    Err(section.refuse("material", format!("the materials of the file: {}", known.join(", "))))
}

fn segment(section: &Section<'_>, materials: &Materials) -> Result<Segment, TomlError> {
    let parts = [("rotor", Part::Rotor), ("shaft", Part::Shaft), ("mount", Part::Mount)];
    let diameter_mm = section.need("diameter_mm", 0.01..=500.0)?;
    let bore_mm = section.number("bore_mm", 0.0..=500.0)?.unwrap_or(0.0);
    if bore_mm >= diameter_mm {
        return Err(section.refuse("bore_mm", format!("0 to the diameter {diameter_mm}")));
    }
    Ok(Segment {
        part: section.choice("part", &parts)?.unwrap_or(Part::Shaft),
        length_m: section.need("length_mm", 0.01..=1e3)? * MM,
        diameter_m: diameter_mm * MM,
        bore_m: bore_mm * MM,
        material: named(section, materials)?,
    })
}

fn bearing(section: &Section<'_>, shaft_m: f64) -> Result<Bearing, TomlError> {
    let position_m = section.need("position_mm", 0.0..=1e6)? * MM;
    if position_m > shaft_m * (1.0 + 1e-9) {
        return Err(section.refuse("position_mm", format!("the shaft, 0 to {:.3}", shaft_m / MM)));
    }
    Ok(Bearing {
        position_m: position_m.min(shaft_m),
        radial_n_m: section.need("radial_stiffness_n_um", 0.0..=1e4)? * 1e6,
        axial_n_m: section.number("axial_stiffness_n_um", 0.0..=1e4)?.unwrap_or(0.0) * 1e6,
    })
}

fn mirror(section: &Section<'_>, materials: &Materials) -> Result<Mirror, TomlError> {
    let stations = stations(section)?;
    let height_mm = stations.last().map_or(0.0, |station| station.along_m) / MM;
    let bond_mm = section.need("bond_mm", 1e-3..=1e3)?;
    if bond_mm >= height_mm {
        return Err(section.refuse("bond_mm", format!("less than the height {height_mm}")));
    }
    Ok(Mirror {
        stations,
        thickness_m: section.need("thickness_mm", 0.01..=100.0)? * MM,
        bond_m: bond_mm * MM,
        offset_m: section.number("offset_mm", -100.0..=100.0)?.unwrap_or(0.0) * MM,
        material: named(section, materials)?,
    })
}

#[derive(Clone, Copy)]
enum Outline {
    Rectangle,
    Octagon,
    Ellipse,
    Stations,
}

fn stations(section: &Section<'_>) -> Result<Vec<Station>, TomlError> {
    let kinds = [
        ("rectangle", Outline::Rectangle),
        ("octagon", Outline::Octagon),
        ("ellipse", Outline::Ellipse),
        ("stations", Outline::Stations),
    ];
    let outline = section.choice("outline", &kinds)?.ok_or_else(|| section.missing("outline"))?;
    if let Outline::Stations = outline {
        return free_stations(section);
    }
    let width_mm = section.need("width_mm", 0.1..=500.0)?;
    let height_mm = section.need("height_mm", 0.1..=500.0)?;
    let (width_m, height_m) = (width_mm * MM, height_mm * MM);
    match outline {
        Outline::Octagon => {
            let corner_mm = section.need("corner_mm", 1e-3..=500.0)?;
            let limit_mm = 0.5 * width_mm.min(height_mm);
            if corner_mm >= limit_mm {
                let limit = format!("less than half of width and height, {limit_mm}");
                return Err(section.refuse("corner_mm", limit));
            }
            Ok(octagon(width_m, height_m, corner_mm * MM))
        }
        Outline::Ellipse => {
            let foot_mm = section.need("foot_mm", 0.1..=500.0)?;
            if foot_mm > 0.9 * width_mm {
                let limit = format!("at most 0.9 of the width, {}", 0.9 * width_mm);
                return Err(section.refuse("foot_mm", limit));
            }
            Ok(ellipse(width_m, height_m, foot_mm * MM))
        }
        Outline::Rectangle | Outline::Stations => Ok(rectangle(width_m, height_m)),
    }
}

/// Widths at distances from the foot, as the file lists them.
fn free_stations(section: &Section<'_>) -> Result<Vec<Station>, TomlError> {
    const N_MAX: usize = 200;
    let need = |key: &'static str, range| {
        section.numbers(key, range, N_MAX)?.ok_or_else(|| section.missing(key))
    };
    let along_mm = need("along_mm", 0.0..=500.0)?;
    let widths_mm = need("widths_mm", 0.1..=500.0)?;
    let rises = along_mm.windows(2).all(|pair| pair[1] > pair[0] + 1e-3);
    if along_mm.len() < 2 || along_mm[0] != 0.0 || !rises {
        return Err(section.refuse("along_mm", "two and more distances, rising from 0"));
    }
    if widths_mm.len() != along_mm.len() {
        return Err(section.refuse("widths_mm", format!("{} numbers", along_mm.len())));
    }
    let stations = along_mm.iter().zip(&widths_mm);
    Ok(stations
        .map(|(&along, &width)| Station { along_m: along * MM, width_m: width * MM })
        .collect())
}
