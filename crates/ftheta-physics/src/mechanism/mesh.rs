//! Where the nodes lie: along the shaft, and in the rows and columns of the mirror.

use super::{ELEMENTS_MAX, Mechanism, MechanismError, Mirror};

/// Nearer than this two places are one, m.
const SAME_M: f64 = 1e-9;

/// Nodes of a mechanism.
pub(super) struct Mesh {
    /// Distances of the shaft's nodes from its rear end, m.
    pub(super) shaft_m: Vec<f64>,
    /// Index of the segment between a node and the next.
    pub(super) segment_indices: Vec<usize>,
    /// Rows of the mirror: distance from its foot and width, m.
    pub(super) rows: Vec<(f64, f64)>,
    /// Elements across the mirror.
    pub(super) n_columns: usize,
}

impl Mesh {
    /// Elements no longer than the mechanism says, with nodes at every change of section, bearing,
    /// corner of the outline, and at the bond's edge.
    pub(super) fn new(mechanism: &Mechanism) -> Result<Self, MechanismError> {
        mechanism.check()?;
        // Counted before anything is laid out, so that a wrong unit does not fill the memory.
        let n_elements = mechanism.n_elements();
        if n_elements > ELEMENTS_MAX {
            return Err(MechanismError::TooManyElements { n_elements, limit: ELEMENTS_MAX });
        }
        let mirror = &mechanism.mirror;
        let ends_m = ends_m(mechanism);
        let [shaft_places, row_places] = places(mechanism);
        let n_columns = n_columns(mechanism);
        let shaft_m = divide(shaft_places, mechanism.element_m);
        let segment_indices = shaft_m
            .windows(2)
            .map(|pair| {
                let middle = 0.5 * (pair[0] + pair[1]);
                let before = ends_m.iter().filter(|&&end| end < middle).count();
                before.saturating_sub(1).min(mechanism.segments.len() - 1)
            })
            .collect();
        let rows = divide(row_places, mechanism.element_m)
            .into_iter()
            .map(|along_m| (along_m, width_m(mirror, along_m)))
            .collect();
        Ok(Self { shaft_m, segment_indices, rows, n_columns })
    }

    /// Index of the shaft's node at a place.
    pub(super) fn shaft_node(&self, place_m: f64) -> usize {
        let distance = |node: usize| (self.shaft_m[node] - place_m).abs();
        (0..self.shaft_m.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}

impl Mechanism {
    /// Number of elements that its mesh has; one that cannot be built may have any number.
    pub fn n_elements(&self) -> usize {
        let [shaft, rows] = places(self).map(|places| n_elements(&places, self.element_m));
        shaft.saturating_add(rows.saturating_mul(n_columns(self)))
    }
}

/// Distances of the segments' ends from the shaft's rear end, m.
fn ends_m(mechanism: &Mechanism) -> Vec<f64> {
    let mut ends_m = vec![0.0];
    for segment in &mechanism.segments {
        ends_m.push(ends_m[ends_m.len() - 1] + segment.length_m);
    }
    ends_m
}

/// Where nodes must lie: along the shaft, and along the mirror.
fn places(mechanism: &Mechanism) -> [Vec<f64>; 2] {
    let bearings = mechanism.bearings.iter().map(|bearing| bearing.position_m);
    let shaft = ends_m(mechanism).into_iter().chain(bearings).collect();
    let stations = mechanism.mirror.stations.iter().map(|station| station.along_m);
    [shaft, stations.chain([mechanism.mirror.bond_m]).collect()]
}

/// An even number, so that a line of nodes lies over the shaft.
fn n_columns(mechanism: &Mechanism) -> usize {
    let n_half = count(0.5 * mechanism.mirror.width_m(), mechanism.element_m).max(1);
    n_half.saturating_mul(2)
}

fn count(length_m: f64, element_m: f64) -> usize {
    // The cast saturates, and what is too much is refused.
    (length_m / element_m - 1e-6).ceil().max(0.0) as usize
}

/// Places in order, none twice.
fn distinct(places: &[f64]) -> Vec<f64> {
    let mut sorted = places.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup_by(|next, kept| *next - *kept < SAME_M);
    sorted
}

fn n_elements(places: &[f64], element_m: f64) -> usize {
    distinct(places)
        .windows(2)
        .map(|pair| count(pair[1] - pair[0], element_m).max(1))
        .fold(0, usize::saturating_add)
}

/// Equal elements between each place and the next.
fn divide(places: Vec<f64>, element_m: f64) -> Vec<f64> {
    let places = distinct(&places);
    let mut nodes: Vec<f64> = places.first().copied().into_iter().collect();
    for pair in places.windows(2) {
        let n = count(pair[1] - pair[0], element_m).max(1);
        nodes.extend((1..=n).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / n as f64));
    }
    nodes
}

/// Width of the mirror at a distance from its foot, m.
fn width_m(mirror: &Mirror, along_m: f64) -> f64 {
    let found = mirror.stations.windows(2).find(|pair| along_m <= pair[1].along_m + SAME_M);
    found.map_or(0.0, |pair| {
        let share = (along_m - pair[0].along_m) / (pair[1].along_m - pair[0].along_m);
        pair[0].width_m + share.clamp(0.0, 1.0) * (pair[1].width_m - pair[0].width_m)
    })
}
