//! Where the beam was in light, collected from a trace.

use ftheta_model::space::FieldPoint;
use ftheta_model::trace::Trace;
use kurbo::Point;

/// Places of the beam in light, one a step of the trace.
#[derive(Debug, Default)]
pub(crate) struct Lit {
    /// Which interval of light, and the place, field mm.
    pub(crate) places: Vec<(usize, Point)>,
    /// Time between neighbouring places, s.
    pub(crate) step_s: f64,
    /// Index of the first point that has not been seen.
    next_index: u64,
}

impl Lit {
    /// Takes the stretch that follows on.
    pub(crate) fn add(&mut self, trace: &Trace) {
        self.step_s = trace.step_ns as f64 * 1e-9;
        for light in &trace.light {
            // The first point of a stretch was the last of the stretch before.
            let first = light.on_ns.div_ceil(trace.step_ns).max(self.next_index);
            let end = light.off_ns / trace.step_ns + 1;
            for index in first..end {
                let here = index.checked_sub(trace.first_index).map(|here| here as usize);
                if let Some(point) = here.and_then(|here| trace.points.get(here)) {
                    let place = FieldPoint::from(*point);
                    self.places.push((light.index, place.into()));
                }
            }
            self.next_index = self.next_index.max(end);
        }
    }
}
