//! Places and angles as output words.

use ftheta_model::space::{DacCodes, FieldPoint};
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
}

impl<'a> Words<'a> {
    pub(super) fn new(plan: &'a Plan) -> Self {
        let optics = &plan.machine.optics;
        let table = MapTable::new(0.5 * optics.field_mm, EXACT_CELLS, |x, y| {
            let angles = angles_from_field(optics, FieldPoint::new(x, y))?;
            Some([angles.x_rad, angles.y_rad])
        });
        Self { plan, table, words_per_rad: 1.0 / plan.machine.output.word_step_rad() }
    }

    /// The same for another plan of the same machine.
    pub(super) fn for_plan<'b>(&self, plan: &'b Plan) -> Words<'b> {
        Words { plan, table: self.table.clone(), words_per_rad: self.words_per_rad }
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

    /// The word pair for angles, rad.
    #[inline]
    pub(super) fn rounded(&self, [x_rad, y_rad]: [f64; 2]) -> DacCodes {
        DacCodes {
            x: (x_rad * self.words_per_rad).round_ties_even() as i32,
            y: (y_rad * self.words_per_rad).round_ties_even() as i32,
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
