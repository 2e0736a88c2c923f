//! The mirror as a flat shell: its nodes, matrices and particles, glued to the shaft's end.

use super::assembly::{Direction, MassPoint, Model};
use super::mesh::Mesh;
use super::solve::{Entries, Row};
use super::{Mechanism, beam, plate};
use nalgebra::DVector;

/// A node of the mirror: its five freedoms as combinations of the model's.
pub(super) struct MirrorNode {
    pub(super) freedoms: Vec<Row>,
    /// Place along and across the shaft, m.
    place_m: [f64; 2],
}

impl Model {
    /// Adds the mirror's elements, particles and mean angles.
    pub(super) fn add_mirror(
        &mut self,
        mechanism: &Mechanism,
        rows: &[Vec<MirrorNode>],
        n_shaft_nodes: usize,
    ) {
        let mirror = &mechanism.mirror;
        let mut mass_of_mirror = Entries::default();
        for pair in rows.windows(2) {
            for column in 1..pair[0].len() {
                let corners = [
                    &pair[0][column - 1],
                    &pair[1][column - 1],
                    &pair[1][column],
                    &pair[0][column],
                ];
                let places = corners.map(|node| node.place_m);
                let [stiffness, mass] =
                    plate::element(&places, mirror.thickness_m, &mirror.material);
                let freedoms: Vec<Row> =
                    corners.iter().flat_map(|node| node.freedoms.iter().cloned()).collect();
                self.stiffness.add(&stiffness, &freedoms);
                self.mass.add(&mass, &freedoms);
                mass_of_mirror.add(&mass, &freedoms);
                let half_widths = [0, 1].map(|row| {
                    let nodes: &[MirrorNode] = &pair[row];
                    nodes.iter().map(|node| node.place_m[1]).fold(0.0, f64::max)
                });
                self.add_mirror_points(mechanism, &places, &freedoms, half_widths);
            }
        }
        self.image_mirror(rows);
        self.add_mirror_rows(mechanism, rows, &mass_of_mirror, n_shaft_nodes);
    }

    /// Particles of an element of the mirror.
    ///
    /// The tension is that of a strip across the shaft with free ends: it holds exactly what pulls
    /// at it, so that a rotation of the whole costs nothing.
    fn add_mirror_points(
        &mut self,
        mechanism: &Mechanism,
        places: &[[f64; 2]; 4],
        freedoms: &[Row],
        half_widths: [f64; 2],
    ) {
        let mirror = &mechanism.mirror;
        let sum = |freedom: usize, weights: [f64; 4]| -> Row {
            weights
                .iter()
                .enumerate()
                .flat_map(|(corner, &weight)| {
                    let row = &freedoms[plate::NODE_FREEDOMS * corner + freedom];
                    row.iter().map(move |&(index, w)| (index, w * weight))
                })
                .collect()
        };
        for (s, t) in plate::gauss() {
            let shapes = plate::Shapes::new(places, s, t);
            let mass_kg = mirror.material.density_kg_m3 * mirror.thickness_m * shapes.area;
            let x = (0..4).map(|i| shapes.n[i] * places[i][1]).sum::<f64>();
            let half = 0.5 * ((1.0 - s) * half_widths[0] + (1.0 + s) * half_widths[1]);
            let arm2 = 0.5 * (half * half - x * x) + mirror.offset_m * mirror.offset_m;
            self.points.push(MassPoint {
                mass_kg,
                place_m: [x, mirror.offset_m],
                displacement: [sum(1, shapes.n), sum(2, shapes.n)],
                slope: sum(2, shapes.slope.map(|slope| slope[1])),
                tension_kg_m2: mass_kg * arm2,
            });
        }
    }

    /// Mirror images of free nodes about the shaft.
    fn image_mirror(&mut self, rows: &[Vec<MirrorNode>]) {
        let single = |row: &Row| (row.len() == 1).then(|| row[0].0);
        for nodes in rows {
            for (column, node) in nodes.iter().enumerate() {
                let image = &nodes[nodes.len() - 1 - column];
                let freedoms: Vec<_> = node.freedoms.iter().map(single).collect();
                let images: Vec<_> = image.freedoms.iter().map(single).collect();
                // Slaves have several entries and are judged with their master.
                if freedoms[..3].iter().any(Option::is_none) {
                    continue;
                }
                for (local, (direction, sign)) in [
                    (Direction::Z, 0.0),
                    (Direction::X, 0.0),
                    (Direction::Y, -1.0),
                    (Direction::Y, 1.0),
                    (Direction::Y, -1.0),
                ]
                .into_iter()
                .enumerate()
                {
                    if let (Some(freedom), Some(image)) = (freedoms[local], images[local]) {
                        self.images[freedom] = if sign == 0.0 {
                            (freedom, -1.0, direction)
                        } else {
                            (image, sign, direction)
                        };
                    }
                }
            }
        }
    }

    /// Rotation vector of the free nodes, and the mirror's mean angles.
    fn add_mirror_rows(
        &mut self,
        mechanism: &Mechanism,
        rows: &[Vec<MirrorNode>],
        mass: &Entries,
        n_shaft_nodes: usize,
    ) {
        let mut tilt = DVector::zeros(self.n_freedoms);
        let mut along = DVector::zeros(self.n_freedoms);
        let end = beam::NODE_FREEDOMS * (n_shaft_nodes - 1);
        let shaft_m = mechanism.shaft_m();
        // The shaft's end stands for the bonded nodes.
        (tilt[end + 1], tilt[end + 3], along[end + 1]) = (-shaft_m, 1.0, 1.0);
        for node in rows.iter().flatten() {
            if node.freedoms.iter().any(|row| row.len() != 1) {
                continue;
            }
            let freedom = |local: usize| node.freedoms[local][0].0;
            self.rotation[freedom(1)] = -mechanism.mirror.offset_m;
            self.rotation[freedom(2)] = node.place_m[1];
            self.rotation[freedom(3)] = 1.0;
            tilt[freedom(0)] = mechanism.mirror.offset_m;
            tilt[freedom(2)] = -node.place_m[0];
            tilt[freedom(4)] = 1.0;
            along[freedom(2)] = 1.0;
        }
        let turned = mass.times_vector(&self.rotation);
        self.inertias_kg_m2[3] = self.rotation.dot(&turned);
        self.mirror_row = turned / self.inertias_kg_m2[3];
        let pushed = mass.times_vector(&along);
        self.mirror_mass_kg = along.dot(&pushed);
        // About the mirror's own centre of mass, so that a shift is no tilt.
        let centre = -tilt.dot(&pushed) / self.mirror_mass_kg;
        let tilt = tilt + along * centre;
        let tilted = mass.times_vector(&tilt);
        self.tilt_row = &tilted / tilt.dot(&tilted);
    }
}

/// Nodes of the mirror in rows; those within the bond follow the shaft's end.
pub(super) fn mirror_nodes(mechanism: &Mechanism, mesh: &Mesh) -> Vec<Vec<MirrorNode>> {
    let mirror = &mechanism.mirror;
    let n_shaft = mesh.shaft_m.len();
    let end = beam::NODE_FREEDOMS * (n_shaft - 1);
    let mut next = beam::NODE_FREEDOMS * n_shaft;
    let shaft_m = mechanism.shaft_m();
    let mut node = |along_m: f64, x: f64| {
        let place_m = [shaft_m + along_m, x];
        if along_m <= mirror.bond_m * (1.0 + 1e-9) {
            return MirrorNode { freedoms: bonded(end, x, mirror.offset_m, along_m), place_m };
        }
        let freedoms = (next..next + plate::NODE_FREEDOMS).map(|i| vec![(i, 1.0)]).collect();
        next += plate::NODE_FREEDOMS;
        MirrorNode { freedoms, place_m }
    };
    mesh.rows
        .iter()
        .map(|&(along_m, width_m)| {
            (0..=mesh.n_columns)
                .map(|column| {
                    node(along_m, width_m * (column as f64 / mesh.n_columns as f64 - 0.5))
                })
                .collect()
        })
        .collect()
}

/// A node's freedoms as those of a rigid body with the freedoms from `first` on, at arm (x, y, z).
fn bonded(first: usize, x: f64, y: f64, z: f64) -> Vec<Row> {
    let [ux, uy, uz, tx, ty, tz] = [0, 1, 2, 3, 4, 5].map(|i| first + i);
    vec![
        vec![(uz, 1.0), (tx, y), (ty, -x)],
        vec![(ux, 1.0), (ty, z), (tz, -y)],
        vec![(uy, 1.0), (tz, x), (tx, -z)],
        vec![(tz, 1.0)],
        vec![(tx, 1.0)],
    ]
}
