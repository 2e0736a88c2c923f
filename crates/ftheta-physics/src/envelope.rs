//! When has a mirror that still rings arrived: the energy envelope of its vibration.
//!
//! From the states of a model (here), from a record of the mirror's place (`analyse`), or sample by
//! sample while it comes in (`Tracker`).

mod record;
mod tracker;

pub use record::{EnvelopeError, RecordedMode, RecordedResidual, analyse};
pub use tracker::Tracker;

use crate::galvo::{Galvo, State};

/// Envelope of the torsional mode as a displacement of the mirror, rad: the square root of its
/// energy, which falls evenly while the displacement itself swings.
///
/// # Accuracy
/// Ripples by the damping ratio. Source: patent application 201610547833.9 (R5).
pub fn mode_rad(galvo: &Galvo, state: &State) -> f64 {
    galvo.rotor_inertia / galvo.inertia() * state[2].hypot(state[3] / galvo.omega)
}

/// Distance from the target that the mirror keeps at most while it rings, rad: that of the rigid
/// part, and the envelope.
pub fn distance_rad(galvo: &Galvo, state: &State, target_rad: f64) -> f64 {
    (state[0] - target_rad).abs() + mode_rad(galvo, state)
}
