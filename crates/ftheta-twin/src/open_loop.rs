//! One axis driven by voltages alone: when has the mirror arrived for good?

use ftheta_model::machine::Scanner;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::lossy::LossyAxis;

/// What a sequence of voltages did to an axis at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// From the sequence's end until the mirror stays within the tolerance, s.
    pub settle_s: f64,
    /// Distance from the target and amplitude of the mode at the sequence's end, rad.
    pub residual_rad: f64,
    /// Greatest current, A.
    pub peak_current_a: f64,
    /// Integral of the squared current over the sequence, A²·s.
    pub heat_a2s: f64,
}

/// Time between two looks at the mirror, s.
const LOOK_S: f64 = 1e-6;

/// After this time a mirror that has not settled is given up, s.
const PATIENCE_S: f64 = 0.25;

/// Plays voltages, one per tick, on a plant at rest, and then none.
///
/// The mirror has arrived when `|x - target| + E` is within the tolerance for good, with E the
/// energy envelope of the torsional mode as a displacement of the mirror.
///
/// * returns `None` for the settling time's sake if the mirror is not there after 0.25 s
///
/// Source: patent application 201610547833.9 (R4, R5), `design/control.md` A.
pub fn arrival(
    plant: &Galvo,
    voltages_v: &[f64],
    tick_s: f64,
    target_rad: f64,
    tolerance_rad: f64,
) -> Option<Arrival> {
    let look_s = look_s(tick_s);
    let step = plant.step(look_s);
    let played = Played { voltages_v, tick_s, target_rad, tolerance_rad };
    settled(plant, &played, |state, voltage_v| step.a * state + step.b * voltage_v)
}

/// Voltages that are played, and where they should lead.
#[derive(Clone, Copy, Debug)]
pub struct Played<'a> {
    /// Voltages, V, one per tick.
    pub voltages_v: &'a [f64],
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Where the mirror should be at the end, rad.
    pub target_rad: f64,
    /// It has arrived within this, rad.
    pub tolerance_rad: f64,
}

/// Like [`arrival`], on a plant that has the scanner's losses.
pub fn arrival_with_losses(
    plant: &Galvo,
    scanner: &Scanner,
    played: &Played<'_>,
) -> Option<Arrival> {
    match LossyAxis::new(plant, scanner, look_s(played.tick_s)) {
        Some(lossy) => settled(plant, played, |state, voltage_v| lossy.advance(state, voltage_v)),
        None => {
            let Played { voltages_v, tick_s, target_rad, tolerance_rad } = *played;
            arrival(plant, voltages_v, tick_s, target_rad, tolerance_rad)
        }
    }
}

/// Time between two looks, a whole part of a tick, s.
fn look_s(tick_s: f64) -> f64 {
    tick_s / (tick_s / LOOK_S).round().max(1.0)
}

/// Plays voltages with `advance`, which moves the states on by one look.
fn settled(
    plant: &Galvo,
    played: &Played<'_>,
    advance: impl Fn(&State, f64) -> State,
) -> Option<Arrival> {
    let Played { voltages_v, tick_s, target_rad, tolerance_rad } = *played;
    let look_s = look_s(tick_s);
    let n_looks = (tick_s / look_s).round();
    let mut state = State::zeros();
    let (mut peak_current_a, mut heat_a2s) = (0.0_f64, 0.0);
    for &voltage_v in voltages_v {
        for _ in 0..n_looks as usize {
            let before_a = state[CURRENT];
            state = advance(&state, voltage_v);
            let after_a = state[CURRENT];
            peak_current_a = peak_current_a.max(after_a.abs());
            // Simpson's rule for a current that is all but straight within a look.
            let middle_a = 0.5 * (before_a + after_a);
            heat_a2s += look_s / 6.0
                * (before_a * before_a + 4.0 * middle_a * middle_a + after_a * after_a);
        }
    }
    let residual_rad = distance_rad(plant, &state, target_rad);
    let mut settled_at = 0;
    let n_patience = (PATIENCE_S / look_s) as usize;
    let mut distance = residual_rad;
    for look in 0..n_patience {
        if distance > tolerance_rad {
            settled_at = look + 1;
        }
        state = advance(&state, 0.0);
        distance = distance_rad(plant, &state, target_rad);
    }
    (distance <= tolerance_rad).then_some(Arrival {
        settle_s: settled_at as f64 * look_s,
        residual_rad,
        peak_current_a,
        heat_a2s,
    })
}

/// Distance of the rigid part from the target, and the envelope of the mode at the mirror, rad.
fn distance_rad(plant: &Galvo, state: &State, target_rad: f64) -> f64 {
    let amplitude = state[2].hypot(state[3] / plant.omega);
    (state[0] - target_rad).abs() + plant.rotor_inertia / plant.inertia() * amplitude
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: Galvo = Galvo {
        rotor_inertia: 1.25e-8,
        mirror_inertia: 3e-8,
        torque_constant: 0.00617,
        resistance: 2.79,
        inductance: 180e-6,
        omega: 32_672.563_597_333_847,
        damping_ratio: 0.01,
    };

    #[test]
    fn a_rest_of_no_length_has_arrived() {
        let arrival = arrival(&PLANT, &[], 1e-5, 0.0, 1e-6).unwrap();
        assert_eq!((arrival.settle_s, arrival.residual_rad), (0.0, 0.0));
    }

    #[test]
    fn a_kick_never_arrives_back() {
        // A single pulse leaves the axis coasting to another place.
        assert_eq!(arrival(&PLANT, &[20.0; 10], 1e-5, 0.0, 1e-6), None);
    }

    /// The reference's five arcs for 1 degree end at rest; cut into ticks of 0.1 µs they leave a
    /// drift that the short-circuited coil brakes within 0.2 mrad.
    #[test]
    fn bang_bang_arcs_have_arrived() {
        let arcs_us = [115.409, 56.318, 18.908, 112.648, 39.135];
        let mut voltages = Vec::new();
        for (index, arc_us) in arcs_us.into_iter().enumerate() {
            let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
            let n_ticks = (arc_us * 10.0_f64).round() as usize;
            voltages.extend(std::iter::repeat_n(24.0 * sign, n_ticks));
        }
        let found = arrival(&PLANT, &voltages, 1e-7, 1_f64.to_radians(), 2e-4).unwrap();
        assert!(found.settle_s < 1e-4, "{found:?}");
        assert!(found.peak_current_a < 8.0 && found.heat_a2s > 0.0, "{found:?}");
    }
}
