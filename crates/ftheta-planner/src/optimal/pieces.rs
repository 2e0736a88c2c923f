//! The stretches of a mark between its turns, as fast as driver and coils stand them.

use super::marking::Marking;
use super::path::Path;
use super::relief::Relief;
use super::speed::{SpeedLimits, profile, time_at_s};
use super::turn::Turn;
use super::weave::{Laid, Stretch};
use crate::PlanError;
use ftheta_model::plan::Knot;
use kurbo::Point;
use std::borrow::Cow;

/// A stretch between two turns.
pub(super) struct Piece<'a> {
    pub(super) stretch: Stretch<'a>,
    pub(super) laid: Laid,
    /// Its speed as a part of what was asked for.
    pub(super) part: f64,
    /// Places of the beam at every tick, where they are known already.
    pub(super) places: Option<Vec<Point>>,
}

/// What a piece is made from.
struct Asked<'t> {
    /// The turns before and after it.
    turns: [Option<&'t Turn>; 2],
    limits: &'t SpeedLimits,
    place: &'t str,
}

impl Marking<'_> {
    /// The stretches between turns.
    ///
    /// # Errors
    /// If one takes too many ticks, or the optics do not reach it.
    pub(super) fn pieces<'p>(
        &mut self,
        path: &'p Path,
        turns: &[Turn],
        limits: &SpeedLimits,
        place: &str,
    ) -> Result<Vec<Piece<'p>>, PlanError> {
        let mut pieces = Vec::with_capacity(turns.len() + 1);
        let last_vertex = path.vertices.len() - 1;
        for index in 0..=turns.len() {
            let before = index.checked_sub(1).map(|before| &turns[before]);
            let after = turns.get(index);
            let from = before.map_or(0, |turn| turn.vertex);
            let to = after.map_or(last_vertex, |turn| turn.vertex);
            let path = match turns.is_empty() {
                true => Cow::Borrowed(path),
                false => Cow::Owned(path.part(from, to)),
            };
            pieces.push(self.piece(path, &Asked { turns: [before, after], limits, place })?);
        }
        Ok(pieces)
    }

    /// A stretch of a path; slower where driver or coils would not stand it.
    fn piece<'p>(
        &mut self,
        mut path: Cow<'p, Path>,
        asked: &Asked<'_>,
    ) -> Result<Piece<'p>, PlanError> {
        let mut relief = Relief::default();
        loop {
            let (stretch, part, calm) = self.stretch(path, asked, &relief)?;
            let tables = self.weave.tables();
            let laid = self.weave.lay(&stretch)?;
            if calm {
                return Ok(Piece { stretch, laid, part, places: None });
            }
            let places = self.weave.places_around(&laid);
            let strains = self.weave.strains(&places, laid.n_ticks());
            if strains.is_empty() || !relief.add(&strains, &stretch, &self.weave) {
                let places = Some(self.weave.without_taps(places));
                return Ok(Piece { stretch, laid, part, places });
            }
            self.weave.take_back(tables);
            path = stretch.path;
        }
    }

    /// The stretch of a path with its speeds, its speed as a part of what was asked for, and
    /// whether it is so calm that nothing is strained.
    fn stretch<'p>(
        &self,
        path: Cow<'p, Path>,
        asked: &Asked<'_>,
        relief: &Relief,
    ) -> Result<(Stretch<'p>, f64, bool), PlanError> {
        let [before, after] = asked.turns;
        let (knots, calm) = profile(&path, asked.limits, self.weave.smoothing, relief);
        let whole_s = time_at_s(&knots, path.length_mm());
        let starts_s = before.map_or(-self.run_s[0], |turn| turn.runs_s()[1]);
        let ends_s = after.map_or(0.0, |turn| turn.runs_s()[0]);
        let period_s = self.weave.period_s();
        let left_s = whole_s - starts_s - ends_s;
        let (n_ticks, factor) = match after {
            None => {
                let n_ticks = ((left_s + self.run_s[1]) / period_s - 1e-6).ceil().max(1.0);
                (n_ticks, 1.0)
            }
            Some(_) => {
                let n_ticks = (left_s / period_s - 1e-6).ceil().max(1.0);
                let all_s = n_ticks * period_s + starts_s + ends_s;
                (n_ticks, all_s / whole_s)
            }
        };
        let slower = |knot: Knot| Knot {
            time_s: knot.time_s * factor - starts_s,
            speed_mm_s: knot.speed_mm_s / factor,
            ..knot
        };
        let knots = knots.into_iter().map(slower).collect();
        let limit = u32::MAX;
        if n_ticks > f64::from(limit) {
            let place = asked.place.into();
            return Err(PlanError::TooLong { place, value: n_ticks, limit });
        }
        Ok((Stretch { path, knots, n_ticks: n_ticks as u32 }, factor.recip(), calm))
    }
}
