//! The envelope sample by sample, in real time: an observer of known modes.

use nalgebra::Complex;

/// One mode under observation.
#[derive(Clone, Copy, Debug)]
struct Observed {
    /// What one period does to the mode.
    turn: Complex<f64>,
    /// The mode as a rotating amplitude, rad; its real part is the displacement.
    amplitude: Complex<f64>,
}

/// Follows the envelope of known modes while samples of the distance from the target come in.
///
/// Every mode turns and decays by itself; what the sum of all misses of a sample corrects each.
#[derive(Clone, Debug)]
pub struct Tracker {
    modes: Vec<Observed>,
    gain: f64,
}

impl Tracker {
    /// A tracker of modes, each an angular frequency, rad/s, and a decay, 1/s.
    ///
    /// * `bandwidth_per_s` how fast it believes the samples: it has found a vibration after three
    ///   times the inverse, and lets noise through in proportion to the square root; best below
    ///   a tenth of the distance between two modes
    /// * `period_s` of the samples
    pub fn new(modes: &[(f64, f64)], bandwidth_per_s: f64, period_s: f64) -> Self {
        let observed = modes.iter().map(|&(omega_rad_s, decay_per_s)| Observed {
            turn: Complex::from_polar((-decay_per_s * period_s).exp(), omega_rad_s * period_s),
            amplitude: Complex::default(),
        });
        // Half of what a real correction adds is along the amplitude, on average.
        Self { modes: observed.collect(), gain: (2.0 * bandwidth_per_s * period_s).min(1.0) }
    }

    /// Takes the next distance, rad, and returns the sum of the envelopes, rad.
    pub fn push(&mut self, distance_rad: f64) -> f64 {
        let mut missed = distance_rad;
        for mode in &mut self.modes {
            mode.amplitude *= mode.turn;
            missed -= mode.amplitude.re;
        }
        let correction = self.gain * missed;
        let mut envelope = 0.0;
        for mode in &mut self.modes {
            mode.amplitude.re += correction;
            envelope += mode.amplitude.norm_sqr().sqrt();
        }
        envelope
    }
}
