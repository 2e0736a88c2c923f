//! Where a stretch asks more of driver and coils than they stand, and slower motion there.
//!
//! Limits on changes of velocity alone do not tell what several bends together, or bends and
//! braking, ask for. So the motion is looked at as it is after averaging, and made slower where it
//! is too much.

use super::speed::{Limit, averaged_mm};
use super::weave::{Stretch, Weave};

/// Most times that a stretch is made slower.
const N_ROUNDS: u32 = 40;
/// From this round on all acceleration is lowered, whatever strains.
const N_LOCAL_ROUNDS: u32 = 6;
/// By how much acceleration is lowered at a time.
const GENTLER: f64 = 0.85;
/// By how much a speed is lowered at most and at least at a time.
const SLOWER: [f64; 2] = [0.75, 0.97];
/// Part of the greatest speed of the stretch below which none is tried.
const SLOWEST: f64 = 1e-3;

/// A tick at which driver or coils are asked too much.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strain {
    pub(super) tick: usize,
    /// What is asked for over what they stand, above 1.
    pub(super) ratio: f64,
    /// Whether it is braking rather than bending.
    pub(super) along: bool,
}

/// What a stretch is made slower by.
#[derive(Clone, Debug)]
pub(super) struct Relief {
    /// Places with their greatest speeds.
    pub(super) slow: Vec<Limit>,
    /// Part of the greatest acceleration along the path.
    pub(super) acceleration_share: f64,
    n_rounds: u32,
}

impl Default for Relief {
    fn default() -> Self {
        Self { slow: Vec::new(), acceleration_share: 1.0, n_rounds: 0 }
    }
}

impl Relief {
    /// Whether nothing is made slower.
    pub(super) fn is_none(&self) -> bool {
        self.n_rounds == 0
    }

    /// Makes a stretch slower where it strains; `false` if that has been tried often enough.
    pub(super) fn add(
        &mut self,
        strains: &[Strain],
        stretch: &Stretch<'_>,
        weave: &Weave<'_>,
    ) -> bool {
        self.n_rounds += 1;
        if self.n_rounds > N_ROUNDS {
            return false;
        }
        let along = strains.iter().any(|strain| strain.along);
        if along || self.n_rounds > N_LOCAL_ROUNDS {
            self.acceleration_share *= GENTLER;
        }
        let period_s = weave.period_s();
        let at_mm = averaged_mm(&stretch.knots, weave.smoothing, stretch.n_ticks + 1, period_s);
        let fastest = stretch.knots.iter().fold(0.0_f64, |most, knot| most.max(knot.speed_mm_s));
        let length_mm = stretch.path.length_mm();
        for strain in strains.iter().filter(|strain| !strain.along) {
            let speed = (at_mm[strain.tick + 1] - at_mm[strain.tick]) / period_s;
            let slower = strain.ratio.recip().sqrt().clamp(SLOWER[0], SLOWER[1]);
            self.slow.push(Limit {
                at_mm: at_mm[strain.tick].clamp(0.0, length_mm),
                speed_mm_s: (speed * slower).max(SLOWEST * fastest),
                wait_s: 0.0,
            });
        }
        self.slow.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
        true
    }
}
