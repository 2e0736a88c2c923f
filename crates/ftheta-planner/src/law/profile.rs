//! Acceleration that is linear between knots: what it asks of the drive and leaves in the mode.

use ftheta_physics::galvo::Galvo;
use nalgebra::Complex;

/// Acceleration of the whole axis over time, linear between knots, zero at both ends.
///
/// The S-laws are exactly that; quintic and cycloid are sampled finely.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile {
    /// Time, s, and acceleration, rad/s², of each knot, in order of time.
    knots: Vec<(f64, f64)>,
}

/// What a profile asks of the drive, and what it leaves behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Demand {
    /// Greatest voltage, V, but for what the mode's back-EMF adds between the places looked at.
    pub(super) voltage_v: f64,
    /// Greatest current, A.
    pub(super) current_a: f64,
    /// Envelope of the mirror's vibration at the end, rad.
    pub(super) residual_rad: f64,
}

impl Profile {
    pub(super) fn new(knots: Vec<(f64, f64)>) -> Self {
        Self { knots }
    }

    /// Two pulses of opposite sign that end at rest, each a rise, a hold and a fall, s.
    pub(super) fn pulses(durations_s: [f64; 6]) -> Self {
        let [rise, hold, fall, brake_rise, brake_hold, brake_fall] = durations_s;
        let speed = 0.5 * rise + hold + 0.5 * fall;
        let brake = -speed / (0.5 * brake_rise + brake_hold + 0.5 * brake_fall);
        let accelerations = [1.0, 1.0, 0.0, brake, brake, 0.0];
        let mut knots = vec![(0.0, 0.0)];
        let mut time_s = 0.0;
        for (duration_s, acceleration) in durations_s.into_iter().zip(accelerations) {
            time_s += duration_s;
            knots.push((time_s, acceleration));
        }
        Self { knots }
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.knots.last().map_or(0.0, |knot| knot.0)
    }

    /// Distance covered from rest, rad.
    fn distance_rad(&self) -> f64 {
        let (mut speed, mut distance) = (0.0, 0.0);
        for pair in self.knots.windows(2) {
            let ((from_s, from), (to_s, to)) = (pair[0], pair[1]);
            let time_s = to_s - from_s;
            distance += time_s * (speed + time_s * (2.0 * from + to) / 6.0);
            speed += 0.5 * time_s * (from + to);
        }
        distance
    }

    /// The same shape over this distance and time.
    pub(super) fn stretched(&self, step_rad: f64, time_s: f64) -> Self {
        let stretch = time_s / self.duration_s();
        let gain = step_rad / (self.distance_rad() * stretch * stretch);
        Self { knots: self.knots.iter().map(|&(t, a)| (t * stretch, a * gain)).collect() }
    }

    /// The same time, over this distance.
    pub(super) fn reaching(&self, step_rad: f64) -> Self {
        self.stretched(step_rad, self.duration_s())
    }

    /// The sum of delayed copies: amplitude and delay, s, of each.
    ///
    /// Source: N. Singer and W. Seering, "Preshaping command inputs to reduce system vibration",
    /// 1990.
    pub(super) fn shaped(&self, impulses: &[(f64, f64)]) -> Self {
        let mut times: Vec<f64> = impulses
            .iter()
            .flat_map(|&(_, delay)| self.knots.iter().map(move |knot| knot.0 + delay))
            .collect();
        times.sort_by(f64::total_cmp);
        let sum = |time_s: f64| {
            impulses.iter().map(|&(gain, delay)| gain * self.acceleration(time_s - delay)).sum()
        };
        Self { knots: times.into_iter().map(|time_s| (time_s, sum(time_s))).collect() }
    }

    /// Acceleration at a time, rad/s²; zero outside.
    pub(super) fn acceleration(&self, time_s: f64) -> f64 {
        let next = self.knots.partition_point(|knot| knot.0 <= time_s);
        if next == 0 || next == self.knots.len() {
            return 0.0;
        }
        let ((from_s, from), (to_s, to)) = (self.knots[next - 1], self.knots[next]);
        from + (to - from) * (time_s - from_s) / (to_s - from_s)
    }

    /// Voltage, current and residual on this axis.
    ///
    /// The mode of the mirror, driven by the acceleration alone, has a closed form: with its pole
    /// p, every change of slope s at time t adds `s exp(p (T - t)) / p²` to a complex amplitude.
    pub(super) fn demand(&self, galvo: &Galvo) -> Demand {
        let mode = Mode::new(galvo);
        let (kt, resistance) = (galvo.torque_constant, galvo.resistance);
        let amperes = galvo.inertia() / kt;
        let emf = kt * galvo.mirror_inertia / galvo.rotor_inertia;
        let (mut voltage_v, mut current_a) = (0.0_f64, 0.0_f64);
        let mut ringing = Complex::new(0.0, 0.0);
        let (mut speed, mut slope) = (0.0, 0.0);
        for pair in self.knots.windows(2) {
            let ((from_s, from), (to_s, to)) = (pair[0], pair[1]);
            let time_s = to_s - from_s;
            if time_s <= 0.0 {
                continue;
            }
            let next_slope = (to - from) / time_s;
            ringing += next_slope - slope;
            slope = next_slope;
            let voltage = |at_s: f64| {
                let speed = speed + at_s * (from + 0.5 * slope * at_s);
                let acceleration = from + slope * at_s;
                let state = Motion { acceleration, slope };
                amperes * (resistance * acceleration + galvo.inductance * slope)
                    + kt * speed
                    + emf * mode.swing(ringing * (mode.pole * at_s).exp(), state)[1]
            };
            // Inside, the voltage turns where back-EMF and resistance balance, or the mode swings.
            let turn_s = -(resistance * amperes * slope / kt + from) / slope;
            let inside = if galvo.omega * time_s > 1.0 { &INSIDE[..] } else { &[] };
            let places = inside.iter().map(|part| part * time_s).chain([0.0, time_s]);
            for at_s in places.chain((turn_s > 0.0 && turn_s < time_s).then_some(turn_s)) {
                voltage_v = voltage_v.max(voltage(at_s).abs());
            }
            current_a = current_a.max(amperes * to.abs());
            speed += 0.5 * time_s * (from + to);
            ringing *= (mode.pole * time_s).exp();
        }
        let [angle, angle_speed] = mode.swing(ringing, Motion { acceleration: 0.0, slope });
        Demand { voltage_v, current_a, residual_rad: angle.hypot(angle_speed / galvo.omega) }
    }
}

/// Where the voltage of long stretches is looked at, besides their ends.
const INSIDE: [f64; 3] = [0.25, 0.5, 0.75];

/// What drives the mode at a time.
struct Motion {
    acceleration: f64,
    slope: f64,
}

/// The torsional mode of an axis as a complex pole.
struct Mode {
    pole: Complex<f64>,
    omega_damped: f64,
}

impl Mode {
    fn new(galvo: &Galvo) -> Self {
        let damping = galvo.damping_ratio;
        let omega_damped = galvo.omega * (1.0 - damping * damping).max(0.0).sqrt();
        Self { pole: Complex::new(-damping * galvo.omega, omega_damped), omega_damped }
    }

    /// The mirror's displacement, rad, and its speed, rad/s.
    fn swing(&self, ringing: Complex<f64>, motion: Motion) -> [f64; 2] {
        let pole = self.pole;
        let amplitude = (ringing - motion.slope) / (pole * pole) - motion.acceleration / pole;
        [amplitude.im / self.omega_damped, (pole * amplitude).im / self.omega_damped]
    }
}
