//! One axis driven by voltages alone: when has the mirror arrived for good?

use ftheta_model::machine::Scanner;
use ftheta_physics::envelope::distance_rad;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::lossy::LossyAxis;

/// What is played on an axis, and where it shall lead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive<'a> {
    /// Voltages, V.
    pub voltages_v: &'a [f64],
    /// For how long each is held, s.
    pub hold_s: f64,
    /// Voltage after them, V.
    pub rest_v: f64,
    /// When the mirror shall have arrived, s.
    pub plan_s: f64,
    /// Speed at the start, rad/s.
    pub from_rad_s: f64,
    /// Where the mirror shall be then, rad.
    pub target_rad: f64,
    /// How fast it shall go on, rad/s.
    pub to_rad_s: f64,
    /// The scanner whose losses the plant has, if any.
    pub scanner: Option<&'a Scanner>,
}

/// What a sequence of voltages did to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// From the plan's end until the mirror stays within the tolerance, s; `None` if it was not
    /// there after 0.25 s.
    pub settle_s: Option<f64>,
    /// Distance from the target and amplitude of the mode at the plan's end, rad.
    pub residual_rad: f64,
    /// Speed of the rigid part at the plan's end, rad/s.
    pub end_rad_s: f64,
    /// Greatest current, A.
    pub peak_current_a: f64,
    /// Integral of the squared current up to the plan's end, A²·s.
    pub heat_a2s: f64,
}

/// Time between two looks at the mirror, s.
const LOOK_S: f64 = 1e-6;

/// After this time a mirror that has not settled is given up, s.
const PATIENCE_S: f64 = 0.25;

/// Plays voltages on a plant without vibration.
///
/// The mirror has arrived when `|x - target| + E` is within the tolerance for good, with E the
/// energy envelope of the torsional mode as a displacement of the mirror. The target moves on at
/// the speed of the end.
///
/// Source: patent application 201610547833.9 (R4, R5), `design/control.md` A.
pub fn arrival(plant: &Galvo, drive: &Drive<'_>, tolerance_rad: f64) -> Arrival {
    let mut arrival = Arrival {
        settle_s: None,
        residual_rad: 0.0,
        end_rad_s: drive.from_rad_s,
        peak_current_a: 0.0,
        heat_a2s: 0.0,
    };
    let mut settled_s = drive.plan_s;
    let mut here = drive.distance_rad(plant, &drive.start(), drive.plan_s);
    if drive.plan_s <= 0.0 {
        arrival.residual_rad = here;
    }
    let mut before = (0.0, drive.start());
    play(plant, drive, drive.plan_s + PATIENCE_S, |time_s, state| {
        let (before_s, before_a) = (before.0, before.1[CURRENT]);
        let (look_s, after_a) = (time_s - before_s, state[CURRENT]);
        let before_end = time_s < drive.plan_s - 1e-3 * look_s;
        let end = !before_end && before_s < drive.plan_s - 1e-3 * look_s;
        if end || before_end {
            // Simpson's rule for a current that is all but straight within a look.
            let middle_a = 0.5 * (before_a + after_a);
            arrival.heat_a2s += look_s / 6.0
                * (before_a * before_a + 4.0 * middle_a * middle_a + after_a * after_a);
        }
        arrival.peak_current_a = arrival.peak_current_a.max(after_a.abs());
        here = drive.distance_rad(plant, state, time_s);
        if end {
            arrival.residual_rad = here;
            arrival.end_rad_s = state[1];
        }
        if here > tolerance_rad && !before_end {
            settled_s = time_s + look_s;
        }
        before = (time_s, *state);
    });
    if here <= tolerance_rad {
        arrival.settle_s = Some((settled_s - drive.plan_s).max(0.0));
    }
    arrival
}

/// States of the plant at most a microsecond apart, with their times, until the end; the first
/// start is not among them.
pub fn play(plant: &Galvo, drive: &Drive<'_>, end_s: f64, mut look: impl FnMut(f64, &State)) {
    let n_looks = (drive.hold_s / LOOK_S - 1e-6).ceil().max(1.0) as usize;
    let look_s = drive.hold_s / n_looks as f64;
    let advance = advancing(plant, drive.scanner, look_s);
    let mut state = drive.start();
    for (index, &voltage_v) in drive.voltages_v.iter().enumerate() {
        for part in 1..=n_looks {
            state = advance(&state, voltage_v);
            look((index * n_looks + part) as f64 * look_s, &state);
        }
    }
    let played_s = (drive.voltages_v.len() * n_looks) as f64 * look_s;
    let advance = advancing(plant, drive.scanner, LOOK_S);
    let n_rest = ((end_s - played_s) / LOOK_S).ceil().max(0.0) as usize;
    for index in 1..=n_rest {
        state = advance(&state, drive.rest_v);
        look(played_s + index as f64 * LOOK_S, &state);
    }
}

/// What moves the states on by one look.
fn advancing(
    plant: &Galvo,
    scanner: Option<&Scanner>,
    look_s: f64,
) -> impl Fn(&State, f64) -> State {
    let lossy = scanner.and_then(|scanner| LossyAxis::new(plant, scanner, look_s));
    let step = plant.step(look_s);
    move |state, voltage_v| match &lossy {
        Some(lossy) => lossy.advance(state, voltage_v),
        None => step.a * state + step.b * voltage_v,
    }
}

impl Drive<'_> {
    fn start(&self) -> State {
        State::new(0.0, self.from_rad_s, 0.0, 0.0, 0.0)
    }

    /// Distance from the target at this time.
    fn distance_rad(&self, plant: &Galvo, state: &State, time_s: f64) -> f64 {
        let target_rad = self.target_rad + self.to_rad_s * (time_s - self.plan_s);
        distance_rad(plant, state, target_rad)
    }
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

    /// Voltages from rest to rest.
    fn drive(voltages_v: &[f64], hold_s: f64, target_rad: f64) -> Drive<'_> {
        Drive {
            voltages_v,
            hold_s,
            rest_v: 0.0,
            plan_s: voltages_v.len() as f64 * hold_s,
            from_rad_s: 0.0,
            target_rad,
            to_rad_s: 0.0,
            scanner: None,
        }
    }

    #[test]
    fn a_rest_of_no_length_has_arrived() {
        let arrival = arrival(&PLANT, &drive(&[], 1e-5, 0.0), 1e-6);
        assert_eq!((arrival.settle_s, arrival.residual_rad), (Some(0.0), 0.0));
    }

    #[test]
    fn a_kick_never_arrives_back() {
        // A single pulse leaves the axis coasting to another place.
        let arrival = arrival(&PLANT, &drive(&[20.0; 10], 1e-5, 0.0), 1e-6);
        assert_eq!(arrival.settle_s, None);
        assert!(arrival.end_rad_s > 1.0 && arrival.heat_a2s > 0.0);
    }

    #[test]
    fn coasting_at_speed_has_arrived() {
        let coasting = Drive {
            rest_v: PLANT.torque_constant * 10.0,
            plan_s: 1e-4,
            from_rad_s: 10.0,
            to_rad_s: 10.0,
            ..drive(&[PLANT.torque_constant * 10.0; 10], 1e-5, 1e-3)
        };
        let arrival = arrival(&PLANT, &coasting, 1e-6);
        assert_eq!(arrival.settle_s, Some(0.0));
        assert!((arrival.end_rad_s - 10.0).abs() < 1e-9);
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
        let found = arrival(&PLANT, &drive(&voltages, 1e-7, 1_f64.to_radians()), 2e-4);
        assert!(found.settle_s.unwrap() < 1e-4, "{found:?}");
        assert!(found.peak_current_a < 8.0 && found.heat_a2s > 0.0, "{found:?}");
    }
}
