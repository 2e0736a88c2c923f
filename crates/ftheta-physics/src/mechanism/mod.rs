//! A rotor, shaft, mount and mirror as finite elements: modes, their reduction to an axis, motion.
//!
//! The shaft lies along z from the rotor's rear end, the mirror's plane holds z and x. Rotation
//! about z is free: it is the kinematic degree of freedom of any size, [`spin`], and the elastic
//! displacements are measured in the frame that turns with it.

mod assembly;
mod beam;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop at once")]
mod closed_forms;
mod error;
mod mesh;
mod mirror;
mod modes;
mod outline;
mod plate;
mod reduction;
mod rotation;
mod samples;
mod solve;
pub mod spin;

pub use assembly::Model;
pub use error::MechanismError;
pub use modes::{ModeKind, ModeShape, Modes};
pub use outline::{ellipse, octagon, rectangle};
pub use reduction::{Coil, TwoInertias};
pub use rotation::Rotation;

use error::{value, within};

/// An elastic, isotropic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
}

impl Material {
    /// Shear modulus, Pa.
    pub fn shear_pa(&self) -> f64 {
        self.young_pa / (2.0 * (1.0 + self.poisson))
    }
}

/// What a stretch of the shaft is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The magnet or coil: the motor's torque acts on it, evenly along its length.
    Rotor,
    /// Shaft.
    Shaft,
    /// The mirror's mount.
    Mount,
}

/// A round stretch of the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// What it is.
    pub part: Part,
    /// Length, m.
    pub length_m: f64,
    /// Outer diameter, m.
    pub diameter_m: f64,
    /// Inner diameter, m; 0 is solid.
    pub bore_m: f64,
    /// What it is made of.
    pub material: Material,
}

/// A bearing: springs to the ground that let the shaft turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearing {
    /// Distance from the shaft's rear end, m.
    pub position_m: f64,
    /// Stiffness across the shaft, the same in x and y, N/m.
    pub radial_n_m: f64,
    /// Stiffness along the shaft, N/m.
    pub axial_n_m: f64,
}

/// Width of the mirror at a distance from its foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Distance from the mirror's foot, along the shaft, m.
    pub along_m: f64,
    /// Width there, half of it on either side of the shaft, m.
    pub width_m: f64,
}

/// A flat mirror, glued with its foot to the end of the shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Outline: straight between stations, from the foot at 0 on.
    pub stations: Vec<Station>,
    /// Thickness, m.
    pub thickness_m: f64,
    /// How far from the foot the mirror is held by the mount, m.
    pub bond_m: f64,
    /// Distance of its middle plane from the shaft's axis, m.
    pub offset_m: f64,
    /// What it is made of.
    pub material: Material,
}

/// The moving parts of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// The shaft from its rear end to the mirror's foot.
    pub segments: Vec<Segment>,
    /// What it runs in.
    pub bearings: Vec<Bearing>,
    /// What it turns.
    pub mirror: Mirror,
    /// Damping ratio of every mode.
    pub damping_ratio: f64,
    /// Greatest length of an element, m.
    pub element_m: f64,
}

/// Most elements of a mesh.
pub const ELEMENTS_MAX: usize = 4000;

impl Mechanism {
    /// Length of the shaft, m.
    pub fn shaft_m(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length_m).sum()
    }

    /// Refuses what cannot be built.
    ///
    /// # Errors
    /// The first value that cannot be, with its place and what is allowed.
    pub fn check(&self) -> Result<(), MechanismError> {
        within("element_m", self.element_m, 0.0, f64::INFINITY)?;
        if !(0.0..1.0).contains(&self.damping_ratio) {
            return Err(value("damping_ratio", self.damping_ratio, "0 to 1"));
        }
        for (index, segment) in self.segments.iter().enumerate() {
            let place = |name: &str| format!("segment {index} {name}");
            within(place("length_m"), segment.length_m, 0.0, f64::INFINITY)?;
            within(place("diameter_m"), segment.diameter_m, 0.0, f64::INFINITY)?;
            if !(0.0..segment.diameter_m).contains(&segment.bore_m) {
                let limit = format!("0 to the diameter {}", segment.diameter_m);
                return Err(value(place("bore_m"), segment.bore_m, limit));
            }
            check_material(&place("material"), &segment.material)?;
        }
        if !self.segments.iter().any(|segment| segment.part == Part::Rotor) {
            return Err(value("number of rotor segments", 0.0, "1 and more"));
        }
        let shaft_m = self.shaft_m();
        for (index, bearing) in self.bearings.iter().enumerate() {
            let place = |name: &str| format!("bearing {index} {name}");
            if !(0.0..=shaft_m).contains(&bearing.position_m) {
                let limit = format!("the shaft, 0 to {shaft_m}");
                return Err(value(place("position_m"), bearing.position_m, limit));
            }
            for (name, stiffness) in
                [("radial_n_m", bearing.radial_n_m), ("axial_n_m", bearing.axial_n_m)]
            {
                if !(0.0..f64::INFINITY).contains(&stiffness) {
                    return Err(value(place(name), stiffness, "0 and more"));
                }
            }
        }
        self.mirror.check()
    }
}

impl Mirror {
    /// Length along the shaft, m; 0 without stations.
    pub fn height_m(&self) -> f64 {
        self.stations.last().map_or(0.0, |station| station.along_m)
    }

    /// Greatest width, m; 0 without stations.
    pub fn width_m(&self) -> f64 {
        self.stations.iter().map(|station| station.width_m).fold(0.0, f64::max)
    }

    fn check(&self) -> Result<(), MechanismError> {
        let n_stations = self.stations.len();
        if n_stations < 2 {
            return Err(value("number of mirror stations", n_stations as f64, "2 and more"));
        }
        if self.stations[0].along_m != 0.0 {
            return Err(value("mirror station 0 along_m", self.stations[0].along_m, "0, the foot"));
        }
        for (index, station) in self.stations.iter().enumerate() {
            let place = |name: &str| format!("mirror station {index} {name}");
            within(place("width_m"), station.width_m, 0.0, f64::INFINITY)?;
            if index > 0 {
                let before = self.stations[index - 1].along_m;
                within(place("along_m"), station.along_m, before, f64::INFINITY)?;
            }
        }
        within("mirror thickness_m", self.thickness_m, 0.0, f64::INFINITY)?;
        if !self.offset_m.is_finite() {
            return Err(value("mirror offset_m", self.offset_m, "finite numbers"));
        }
        within("mirror bond_m", self.bond_m, 0.0, self.height_m())?;
        check_material("mirror material", &self.material)
    }
}

fn check_material(place: &str, material: &Material) -> Result<(), MechanismError> {
    within(format!("{place} young_pa"), material.young_pa, 0.0, f64::INFINITY)?;
    within(format!("{place} poisson"), material.poisson, -1.0, 0.5)?;
    within(format!("{place} density_kg_m3"), material.density_kg_m3, 0.0, f64::INFINITY)
}
