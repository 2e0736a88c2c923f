//! Places and angles as output words.

use ftheta_model::block::VoltageSample;
use ftheta_model::space::{DacCodes, FieldPoint};
use ftheta_physics::correction::CorrectionTable;
use ftheta_physics::map_table::MapTable;
use ftheta_physics::optics::angles_from_field;
use ftheta_physics::plan::Plan;
use kurbo::Point;

/// Cells around the centre of the table that are left to the exact inverse: keeps 1 nm there.
const EXACT_CELLS: f64 = 3.0;

/// Turns places into words.
#[derive(Clone)]
pub(super) struct Words<'a> {
    plan: &'a Plan,
    table: Option<MapTable>,
    pub(super) words_per_rad: f64,
    correction: Option<CorrectionTable>,
}

impl<'a> Words<'a> {
    pub(super) fn new(plan: &'a Plan) -> Self {
        let optics = &plan.machine.optics;
        let table = MapTable::new(0.5 * optics.field_mm, EXACT_CELLS, |x, y| {
            let angles = angles_from_field(optics, FieldPoint::new(x, y))?;
            Some([angles.x_rad, angles.y_rad])
        });
        let words_per_rad = 1.0 / plan.machine.output.word_step_rad();
        Self { plan, table, words_per_rad, correction: None }
    }

    /// The same for another plan of the same machine.
    pub(super) fn for_plan<'b>(&self, plan: &'b Plan) -> Words<'b> {
        Words {
            plan,
            table: self.table.clone(),
            words_per_rad: self.words_per_rad,
            correction: self.correction.clone(),
        }
    }

    /// Corrects all that is sent from here on.
    pub(super) fn correct_by(&mut self, table: CorrectionTable) {
        self.correction = Some(table.at_height(self.plan.machine.optics.plane_mm));
    }

    /// The word pair for a place.
    #[inline]
    pub(super) fn at(&self, place: Point) -> DacCodes {
        self.rounded(self.angles(place))
    }

    /// The mirror angles for a place, rad.
    #[inline]
    pub(super) fn angles(&self, place: Point) -> [f64; 2] {
        let tabled = self.table.as_ref().and_then(|table| table.value(place.x, place.y));
        tabled.unwrap_or_else(|| self.exact(place))
    }

    /// The word pair for angles, rad, as the real head needs them.
    #[inline]
    pub(super) fn rounded(&self, angles_rad: [f64; 2]) -> DacCodes {
        let round = |rad: f64| nearest(rad * self.words_per_rad) as i32;
        let [x, y] = match &self.correction {
            None => angles_rad.map(round),
            // A command that leads the mirror may be moved past the last word.
            Some(table) => {
                let limit = self.plan.machine.output.word_max();
                table.angles(angles_rad).map(|rad| round(rad).clamp(-limit, limit))
            }
        };
        DacCodes { x, y }
    }

    /// Planned states and voltages as the real head needs them: angles by the table, what changes
    /// them by its slopes.
    pub(super) fn correct_volts(&self, volts: &mut [[VoltageSample; 2]]) {
        let Some(table) = &self.correction else {
            return;
        };
        for pair in volts {
            let [x, y] = *pair;
            let angles_rad = [x.state[0], y.state[0]];
            let (corrected, slopes) = (table.angles(angles_rad), table.slopes(angles_rad));
            for (sample, (angle_rad, by)) in pair.iter_mut().zip(corrected.iter().zip(slopes)) {
                let blend = |of: &dyn Fn(&VoltageSample) -> f64| by[0] * of(&x) + by[1] * of(&y);
                sample.next_v = blend(&|sample| sample.next_v);
                sample.acting_v = blend(&|sample| sample.acting_v);
                sample.state = std::array::from_fn(|k| blend(&|sample| sample.state[k]));
                sample.state[0] = *angle_rad;
            }
        }
    }

    /// The exact inverse, for places that the table leaves out.
    #[cold]
    pub(super) fn exact(&self, place: Point) -> [f64; 2] {
        angles_from_field(&self.plan.machine.optics, place.into())
            .map(|angles| [angles.x_rad, angles.y_rad])
            .expect("the audit has reached every place of the plan")
    }
}

/// The nearest whole number, ties to even, for magnitudes below 2^51: what `round_ties_even` gives,
/// without the call that it is on processors before SSE 4.1.
#[inline]
fn nearest(value: f64) -> f64 {
    /// 1.5 · 2^52: sums with it have no room for fractions.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    (value + WHOLE) - WHOLE
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn words_are_rounded_as_the_standard_library_does() {
        let ties = (-9..=9).map(|n| 0.5 * f64::from(n));
        let others = (0..100_000).map(|n| 7.3e-3 * f64::from(n) * f64::from(1 - 2 * (n % 2)));
        for value in ties.chain(others).chain([524_287.499_999_999_9, -524_287.500_000_000_1]) {
            assert_eq!(nearest(value), value.round_ties_even(), "{value}");
        }
    }
}
