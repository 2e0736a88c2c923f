//! How the twin's plant differs from the machine file.

use ftheta_physics::galvo::Galvo;

/// Errors of the plant that the planner does not know of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mismatch {
    /// Relative change of the torsional mode's frequency.
    pub f1: f64,
    /// Relative change of the torque constant.
    pub kt: f64,
    /// Damping ratio of the mode; `None` leaves the machine file's.
    pub zeta: Option<f64>,
    /// Light that appears, and goes, so much later than the machine file says, ns.
    pub late_ns: [i64; 2],
    /// Lag of the focusing lens beside the machine file's, ns.
    pub lens_late_ns: i64,
}

impl Mismatch {
    /// The plant as it is, from the plant as the machine file states it.
    pub fn apply(&self, nominal: &Galvo) -> Galvo {
        Galvo {
            omega: nominal.omega * (1.0 + self.f1),
            torque_constant: nominal.torque_constant * (1.0 + self.kt),
            damping_ratio: self.zeta.unwrap_or(nominal.damping_ratio),
            ..*nominal
        }
    }
}
