//! The matrices of a whole mechanism: stiffness, mass, and what turns and spins.

use super::mesh::Mesh;
use super::mirror::mirror_nodes;
use super::solve::{Entries, Row};
use super::{Mechanism, MechanismError, Part, beam};
use nalgebra::{DMatrix, DVector};

/// A mechanism as finite elements: free to turn about z, held by its bearings otherwise.
#[derive(Clone, Debug)]
pub struct Model {
    pub(super) n_freedoms: usize,
    pub(super) stiffness: Entries,
    pub(super) mass: Entries,
    /// Displacements of a rotation by 1 rad.
    pub(super) rotation: DVector<f64>,
    /// Weights of the freedoms in the rotor's angle; a torque of 1 N·m is this times one.
    pub(super) rotor_row: DVector<f64>,
    /// Weights in the mirror's angle about z: the inertia-weighted mean.
    pub(super) mirror_row: DVector<f64>,
    /// Weights in the mirror's angle about x, which also moves the beam.
    pub(super) tilt_row: DVector<f64>,
    /// Mass at the elements' Gauss points.
    pub(super) points: Vec<MassPoint>,
    /// Freedom and sign of the mirror image that a twist has, and where a freedom points.
    pub(super) images: Vec<(usize, f64, Direction)>,
    /// Inertias about z of rotor, shaft, mount and mirror, kg·m².
    pub(super) inertias_kg_m2: [f64; 4],
    pub(super) mirror_mass_kg: f64,
    pub(super) damping_ratio: f64,
}

/// Where a displacement or a rotation's deflection points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// Along x, in the mirror's plane.
    X,
    /// Along y, across the mirror's plane.
    Y,
    /// Along the shaft.
    Z,
}

/// A particle of the mechanism, for what rotation does to it.
#[derive(Clone, Debug)]
pub(super) struct MassPoint {
    pub(super) mass_kg: f64,
    /// Place across the shaft, m.
    pub(super) place_m: [f64; 2],
    /// Displacements along x and y.
    pub(super) displacement: [Row; 2],
    /// Slope of the mirror's deflection across the shaft.
    pub(super) slope: Row,
    /// Tension across the mirror per squared speed: stiffness against that slope, kg·m².
    pub(super) tension_kg_m2: f64,
}

impl Model {
    /// Meshes and assembles a mechanism.
    ///
    /// Beams are Timoshenko's, the mirror is a flat shell (plane stress and Mindlin bending) whose
    /// nodes within the bond follow the shaft's end rigidly.
    ///
    /// # Errors
    /// A value that cannot be, or too many elements.
    pub fn new(mechanism: &Mechanism) -> Result<Self, MechanismError> {
        let mesh = Mesh::new(mechanism)?;
        let nodes = mirror_nodes(mechanism, &mesh);
        let n_shaft = beam::NODE_FREEDOMS * mesh.shaft_m.len();
        let last = |row: &Row| row.iter().map(|entry| entry.0 + 1).max().unwrap_or(0);
        let n_freedoms =
            nodes.iter().flatten().flat_map(|node| node.freedoms.iter().map(last)).max();
        let n_freedoms = n_freedoms.unwrap_or(0).max(n_shaft);
        let mut model = Self {
            n_freedoms,
            stiffness: Entries::default(),
            mass: Entries::default(),
            rotation: DVector::zeros(n_freedoms),
            rotor_row: DVector::zeros(n_freedoms),
            mirror_row: DVector::zeros(n_freedoms),
            tilt_row: DVector::zeros(n_freedoms),
            points: Vec::new(),
            images: (0..n_freedoms).map(|freedom| (freedom, -1.0, Direction::Z)).collect(),
            inertias_kg_m2: [0.0; 4],
            mirror_mass_kg: 0.0,
            damping_ratio: mechanism.damping_ratio,
        };
        model.add_shaft(mechanism, &mesh);
        model.add_mirror(mechanism, &nodes, mesh.shaft_m.len());
        model.stiffness.compress();
        model.mass.compress();
        Ok(model)
    }

    /// Inertia about the shaft of everything, kg·m².
    pub fn inertia_kg_m2(&self) -> f64 {
        self.inertias_kg_m2.iter().sum()
    }

    /// Inertias about the shaft of rotor, shaft, mount and mirror, kg·m².
    pub fn inertias_kg_m2(&self) -> [f64; 4] {
        self.inertias_kg_m2
    }

    /// Mass of the mirror, kg.
    pub fn mirror_mass_kg(&self) -> f64 {
        self.mirror_mass_kg
    }

    /// Number of degrees of freedom.
    pub fn n_freedoms(&self) -> usize {
        self.n_freedoms
    }

    /// Full stiffness and mass matrices, SI, for checks on small models; `None` above 3000
    /// freedoms, where they would fill the memory.
    pub fn matrices(&self) -> Option<[DMatrix<f64>; 2]> {
        let entries = [&self.stiffness, &self.mass];
        (self.n_freedoms <= 3000).then(|| entries.map(|matrix| matrix.to_dense(self.n_freedoms)))
    }

    /// Weights of the freedoms in the angles of rotor and mirror about the shaft.
    pub fn angle_rows(&self) -> [&DVector<f64>; 2] {
        [&self.rotor_row, &self.mirror_row]
    }

    fn add_shaft(&mut self, mechanism: &Mechanism, mesh: &Mesh) {
        let of_part = |part| mechanism.segments.iter().filter(move |s| s.part == part);
        let rotor_m: f64 = of_part(Part::Rotor).map(|segment| segment.length_m).sum();
        for (node, pair) in mesh.shaft_m.windows(2).enumerate() {
            let segment = &mechanism.segments[mesh.segment_indices[node]];
            let length = pair[1] - pair[0];
            let first = beam::NODE_FREEDOMS * node;
            let freedoms: Vec<Row> = (first..first + 12).map(|i| vec![(i, 1.0)]).collect();
            let [stiffness, mass] = beam::element(segment, length);
            self.stiffness.add(&stiffness, &freedoms);
            self.mass.add(&mass, &freedoms);
            let turning = mass[(5, 5)] + mass[(5, 11)] + mass[(11, 5)] + mass[(11, 11)];
            self.inertias_kg_m2[segment.part as usize] += turning;
            if segment.part == Part::Rotor {
                self.rotor_row[first + 5] += 0.5 * length / rotor_m;
                self.rotor_row[first + 11] += 0.5 * length / rotor_m;
            }
            for (mass_kg, displacement) in beam::mass_points(segment, length, first) {
                self.points.push(MassPoint {
                    mass_kg,
                    place_m: [0.0; 2],
                    displacement,
                    slope: Row::new(),
                    tension_kg_m2: 0.0,
                });
            }
        }
        for node in 0..mesh.shaft_m.len() {
            let first = beam::NODE_FREEDOMS * node;
            self.rotation[first + 5] = 1.0;
            let directions = [Direction::X, Direction::Y, Direction::Z, Direction::Y, Direction::X];
            for (freedom, direction) in directions.into_iter().enumerate() {
                self.images[first + freedom].2 = direction;
            }
            // A twist is its own mirror image.
            self.images[first + 5].1 = 1.0;
        }
        for bearing in &mechanism.bearings {
            let first = beam::NODE_FREEDOMS * mesh.shaft_node(bearing.position_m);
            self.stiffness.push(first, first, bearing.radial_n_m);
            self.stiffness.push(first + 1, first + 1, bearing.radial_n_m);
            self.stiffness.push(first + 2, first + 2, bearing.axial_n_m);
        }
    }
}
