//! Correction tables of others: grids of offsets from where a linear head would put the beam.
//!
//! A linear head turns its mirrors by place / (2·f1), f1 the first coefficient of the lens. An
//! offset is what the corrected angle, times 2·f1, is more than the place it is for.

use crate::field::{Unmapped, corrected};
use ftheta_formats::cor_file::{CorTable, N_SIDE, PITCH_UNITS};
use ftheta_formats::grid_csv::OffsetGrid;
use ftheta_model::machine::Machine;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::correction::{About, CorrectionError, CorrectionTable};
use ftheta_physics::grid_map::{GridMap, Interpolation};
use ftheta_physics::optics::{angles_from_field, field_from_angles, scale_mm_per_rad};
use thiserror::Error;

/// Nodes along a side of a table that is made from offsets.
const N_NODES: usize = 129;
/// Units over the side of a `.cor` table.
const SIDE_UNITS: f64 = PITCH_UNITS * (N_SIDE - 1) as f64;

/// Why a table cannot be exchanged.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ExchangeError {
    /// A node of the grid that the table says nothing of.
    #[error("row {row}, column {column} of the grid: {what}")]
    Node {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// What is wrong there.
        what: Unmapped,
    },
    /// A grid that is none.
    #[error("a grid of {n_nodes} nodes over ±{half_width_mm} mm cannot be used")]
    Grid {
        /// Nodes there are.
        n_nodes: usize,
        /// Half its width, mm.
        half_width_mm: f64,
    },
    /// A table of several planes for a file that has one.
    #[error("a table of {n_planes} planes does not fit into a file that has one; keep it as .txt")]
    Planes {
        /// Planes there are.
        n_planes: usize,
    },
    /// The mirrors' range leads beyond the optics.
    #[error("the optics do not reach what the mirrors' greatest angles ask for")]
    Optics,
    /// A table that cannot be used.
    #[error(transparent)]
    Table(#[from] CorrectionError),
}

impl ExchangeError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Node { row, column, what } => {
                let (value, limit) = what.fault();
                (format!("row {row}, column {column}"), value, limit)
            }
            Self::Grid { n_nodes, half_width_mm } => (
                "grid".into(),
                format!("{n_nodes} nodes over ±{half_width_mm} mm"),
                "2 nodes a side over more than 0 mm".into(),
            ),
            Self::Planes { n_planes } => {
                ("table".into(), format!("{n_planes} planes"), "1 plane".into())
            }
            Self::Optics => {
                ("optics".into(), "the mirrors' greatest angles".into(), "what they reach".into())
            }
            Self::Table(error) => error.fault(),
        }
    }
}

/// A table as offsets over a square of the field.
///
/// * `n_side`: nodes along each side, at least 2
/// * `half_width_mm`: from the centre to the outermost nodes
///
/// # Errors
/// If optics or table do not reach a node.
pub fn offsets(
    table: &CorrectionTable,
    machine: &Machine,
    n_side: usize,
    half_width_mm: f64,
) -> Result<OffsetGrid, ExchangeError> {
    let n_planes = table.planes().len();
    if n_planes > 1 {
        return Err(ExchangeError::Planes { n_planes });
    }
    let mm_per_rad = scale_mm_per_rad(&machine.optics);
    let mut grid = OffsetGrid { n_side, half_width_mm, offsets_mm: Vec::new() };
    for index in 0..n_side * n_side {
        let (row, column) = (index / n_side, index % n_side);
        let (x_mm, y_mm) = (grid.coordinate_mm(column), grid.coordinate_mm(row));
        let place_mm = FieldPoint::new(x_mm, y_mm);
        let nominal = angles_from_field(&machine.optics, place_mm);
        let angles = nominal
            .ok_or(Unmapped::Place { place_mm, z_mm: 0.0 })
            .and_then(|nominal| corrected(table, nominal, 0.0))
            .map_err(|what| ExchangeError::Node { row, column, what })?;
        let offset = [mm_per_rad * angles.x_rad - x_mm, mm_per_rad * angles.y_rad - y_mm];
        grid.offsets_mm.push(offset);
    }
    Ok(grid)
}

/// The table that offsets stand for, 129 × 129 nodes over the mirrors' range.
///
/// Between nodes the offsets are taken as smooth (Catmull-Rom); outside they go on straight.
///
/// # Errors
/// If the grid is none, or the table folds over.
pub fn table(grid: &OffsetGrid, machine: &Machine) -> Result<CorrectionTable, ExchangeError> {
    let half_mm = grid.half_width_mm;
    let unusable = ExchangeError::Grid { n_nodes: grid.offsets_mm.len(), half_width_mm: half_mm };
    let offsets = GridMap::new(half_mm, Interpolation::CatmullRom, &grid.offsets_mm);
    let offsets = offsets.ok_or(unusable)?;
    let mm_per_rad = scale_mm_per_rad(&machine.optics);
    let half_rad = machine.scanner.angle_max_rad;
    let angles = GridMap::tabled(half_rad, Interpolation::CatmullRom, N_NODES, |x_rad, y_rad| {
        let place = field_from_angles(&machine.optics, MirrorAngles::new(x_rad, y_rad));
        let place = [place.x_mm, place.y_mm];
        let inside = place.map(|value| value.clamp(-half_mm, half_mm));
        let (offset, slopes) = (offsets.value(inside), offsets.slopes(inside));
        let beyond = [0, 1].map(|axis| place[axis] - inside[axis]);
        let corrected = [0, 1].map(|axis| {
            let more = slopes[axis][0] * beyond[0] + slopes[axis][1] * beyond[1];
            (place[axis] + offset[axis] + more) / mm_per_rad
        });
        corrected.iter().all(|angle| angle.is_finite()).then_some(corrected)
    });
    let angles = angles.ok_or(ExchangeError::Optics)?;
    Ok(CorrectionTable::flat(About::of(machine, "imported", 0), angles)?)
}

/// Offsets in the units of a `.cor` table, over the machine's field.
///
/// # Errors
/// As [`offsets`].
///
/// # Accuracy
/// Whole units: half a unit of 1/65536 of the field.
pub fn cor(table: &CorrectionTable, machine: &Machine) -> Result<CorTable, ExchangeError> {
    let units_per_mm = SIDE_UNITS / machine.optics.field_mm;
    let grid = offsets(table, machine, N_SIDE, 0.5 * machine.optics.field_mm)?;
    // Saturates; what is too much is refused when it is written.
    let units = |offset_mm: f64| (units_per_mm * offset_mm).round() as i32;
    let offsets = grid.offsets_mm.iter().map(|pair| pair.map(units)).collect();
    Ok(CorTable { units_per_mm, offsets, image_index: 0 })
}

/// The offsets of a `.cor` table in mm.
pub fn grid_of_cor(cor: &CorTable) -> OffsetGrid {
    let mm = |units: i32| f64::from(units) / cor.units_per_mm;
    OffsetGrid {
        n_side: N_SIDE,
        half_width_mm: 0.5 * SIDE_UNITS / cor.units_per_mm,
        offsets_mm: cor.offsets.iter().map(|pair| pair.map(mm)).collect(),
    }
}
