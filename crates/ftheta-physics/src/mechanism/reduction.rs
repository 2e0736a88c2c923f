//! From modes of a mechanism to the axis that planner and twin reckon with.

use super::modes::{ModeKind, ModeShape, Modes};
use crate::modal::{ModalAxis, Mode};
use std::f64::consts::TAU;

/// The motor's electrical side, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// Torque constant, N·m/A, and back-EMF constant, V·s/rad.
    pub torque_constant: f64,
    /// Resistance, ohm.
    pub resistance: f64,
    /// Inductance, H.
    pub inductance: f64,
}

/// The two inertias on a spring that move like the rigid body and one mode of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoInertias {
    /// On the motor's side, kg·m².
    pub rotor_kg_m2: f64,
    /// On the mirror's side, kg·m².
    pub mirror_kg_m2: f64,
    /// Frequency of the mode, Hz.
    pub frequency_hz: f64,
}

impl Modes {
    /// How strongly the motor moves the mirror through a mode, against the rigid body: the product
    /// of both participations times the inertia. Two inertias on a spring have -1.
    pub fn drive(&self, shape: &ModeShape) -> f64 {
        shape.rotor * shape.mirror * self.inertia_kg_m2
    }

    /// The axis with the modes whose `drive` is at least `drive_min`, slowest first.
    pub fn axis(&self, coil: &Coil, drive_min: f64) -> ModalAxis {
        let kept = self.shapes.iter().filter(|shape| self.drive(shape).abs() >= drive_min);
        ModalAxis {
            inertia: self.inertia_kg_m2,
            torque_constant: coil.torque_constant,
            resistance: coil.resistance,
            inductance: coil.inductance,
            modes: kept
                .map(|shape| Mode {
                    omega: TAU * shape.frequency_hz,
                    damping_ratio: self.damping_ratio,
                    inertia: 1.0,
                    rotor: shape.rotor,
                    mirror: shape.mirror,
                })
                .collect(),
        }
    }

    /// Two inertias with the total inertia, the frequency and the ratio of angles of the first
    /// torsional mode that turns rotor and mirror against each other; `None` if there is none.
    pub fn two_inertias(&self) -> Option<TwoInertias> {
        let shape = self
            .shapes
            .iter()
            .find(|shape| shape.kind == ModeKind::Torsion && self.drive(shape) < -0.1)?;
        let (rotor, mirror) = (shape.rotor.abs(), shape.mirror.abs());
        // Without a torque from outside the angles are as the other side's inertias.
        Some(TwoInertias {
            rotor_kg_m2: self.inertia_kg_m2 * mirror / (rotor + mirror),
            mirror_kg_m2: self.inertia_kg_m2 * rotor / (rotor + mirror),
            frequency_hz: shape.frequency_hz,
        })
    }
}
