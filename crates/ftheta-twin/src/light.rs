//! The laser: light follows the signal's edges after its own latency.

use ftheta_model::block::LaserEdge;
use ftheta_model::trace::Light;
use std::collections::VecDeque;

/// When light is emitted, from the edges seen so far.
#[derive(Clone, Debug)]
pub struct LaserState {
    on_latency_ns: i64,
    off_latency_ns: i64,
    /// Changes of light still to come, in order.
    changes: VecDeque<LaserEdge>,
    /// Power of the light now, W.
    power_w: f64,
    /// Light intervals begun so far.
    n_begun: usize,
    /// Start of the interval that is lit now, ns.
    on_ns: u64,
}

impl LaserState {
    pub fn new(on_latency_ns: i64, off_latency_ns: i64) -> Self {
        Self {
            on_latency_ns,
            off_latency_ns,
            changes: VecDeque::new(),
            power_w: 0.0,
            n_begun: 0,
            on_ns: 0,
        }
    }

    /// Takes a signal edge. An off edge whose light would end before it began leaves an interval
    /// of no length, as a source with a slow start does.
    pub fn take(&mut self, edge: LaserEdge) {
        let latency_ns = if edge.power_w > 0.0 { self.on_latency_ns } else { self.off_latency_ns };
        let time_ns = edge.time_ns.saturating_add_signed(latency_ns);
        let time_ns = self.changes.back().map_or(time_ns, |last| time_ns.max(last.time_ns));
        self.changes.push_back(LaserEdge { time_ns, ..edge });
    }

    /// Time of the next change, ns.
    #[inline]
    pub fn next_ns(&self) -> u64 {
        self.changes.front().map_or(u64::MAX, |change| change.time_ns)
    }

    /// Power of the light until the next change, W.
    #[inline]
    pub fn power_w(&self) -> f64 {
        self.power_w
    }

    /// Makes the next change; returns the interval that it ended.
    pub fn change(&mut self) -> Option<Light> {
        let change = self.changes.pop_front()?;
        let ended = self.cut(change.time_ns);
        if self.power_w == 0.0 && change.power_w > 0.0 {
            self.n_begun += 1;
        }
        self.power_w = change.power_w;
        self.on_ns = change.time_ns;
        ended
    }

    /// The part of the interval lit at `now_ns` that lies before it; the rest goes on under the
    /// same index.
    pub fn cut(&mut self, now_ns: u64) -> Option<Light> {
        if self.power_w == 0.0 {
            return None;
        }
        let on_ns = std::mem::replace(&mut self.on_ns, now_ns);
        Some(Light { index: self.n_begun - 1, on_ns, off_ns: now_ns, power_w: self.power_w })
    }
}
