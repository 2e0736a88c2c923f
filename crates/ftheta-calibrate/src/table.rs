//! A correction table from a calibrated head.

use crate::calibrate::Calibration;
use crate::error::CalibrateError;
use ftheta_model::machine::Machine;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::correction::{About, CorrectionTable};
use ftheta_physics::grid_map::{GridMap, Interpolation};
use ftheta_physics::optics::field_from_angles;

/// How a table is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Nodes along a side.
    pub n_nodes: usize,
    /// How it is to be read.
    pub interpolation: Interpolation,
}

impl Default for Grid {
    /// 65 × 65 nodes, Catmull-Rom.
    fn default() -> Self {
        Self { n_nodes: 65, interpolation: Interpolation::CatmullRom }
    }
}

/// Where the optics reach nothing, the correction of a place this much nearer to the centre holds.
const SHRINK: f64 = 0.95;
/// How often a place is moved nearer.
const N_SHRINKS: usize = 20;

impl Calibration {
    /// The table for a machine, over all angles its mirrors have.
    ///
    /// # Errors
    /// If the head reaches no place near a node, or the table folds over.
    pub fn table(&self, machine: &Machine, grid: Grid) -> Result<CorrectionTable, CalibrateError> {
        let half_rad = machine.scanner.angle_max_rad;
        let mut unreached = FieldPoint::default();
        let map = GridMap::tabled(half_rad, grid.interpolation, grid.n_nodes, |x_rad, y_rad| {
            let corrected = self.corrected(machine, [x_rad, y_rad]);
            if corrected.is_none() {
                let angles = MirrorAngles::new(x_rad, y_rad);
                unreached = field_from_angles(&machine.optics, angles);
            }
            corrected
        });
        let FieldPoint { x_mm, y_mm } = unreached;
        let angles = map.ok_or(CalibrateError::Unreachable { x_mm, y_mm })?;
        let about = About::of(machine, self.model.name(), self.n_rounds);
        Ok(CorrectionTable::flat(about, angles)?)
    }

    /// Corrected from nominal angles; beyond what the optics reach, as a nearer place is.
    fn corrected(&self, machine: &Machine, nominal: [f64; 2]) -> Option<[f64; 2]> {
        let mut near = nominal;
        for _ in 0..N_SHRINKS {
            let angles = MirrorAngles::new(near[0], near[1]);
            let target = field_from_angles(&machine.optics, angles);
            let finite = target.x_mm.is_finite() && target.y_mm.is_finite();
            if let Some(found) = finite.then(|| self.command(target, angles)).flatten() {
                let rest = MirrorAngles::new(nominal[0] - near[0], nominal[1] - near[1]);
                let rest = self.turned(rest);
                return Some([found.x_rad + rest.x_rad, found.y_rad + rest.y_rad]);
            }
            near = near.map(|rad| rad * SHRINK);
        }
        None
    }
}
