//! Rehearsals: patterns marked and measured on the twin's own head.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::atlas_store::AtlasStore;
use ftheta::mark::{MarkOptions, mark};
use ftheta::model::machine::Machine;
use ftheta::model::pattern::{MarkStyle, Pattern};
use ftheta::model::plan::Planner;
use ftheta::model::recipe::Recipe;
use ftheta::pattern::grid::{self, GridOptions};
use ftheta::pattern::sheet::SheetProcess;
use ftheta::pattern::square;
use ftheta::physics::head::Tracer;
use ftheta::physics::optics::angles_from_field;
use ftheta::rehearsal::{MeasureOptions, measure};
use ftheta::twin::hidden_head::hidden_head;
use ftheta::{field_calibration, machines};

fn machine() -> Machine {
    machines::find("S14-f420").unwrap()
}

fn pattern(style: MarkStyle, n_side: u32) -> Pattern {
    let (machine, size_mm) = (machine(), None);
    let process = SheetProcess::of(&machine);
    let options = GridOptions { n_side, field_mm: 200.0, style, size_mm, process };
    grid::sheet(&options, &machine).unwrap().pattern
}

fn options(seed: u64, noise_mm: f64) -> MeasureOptions {
    MeasureOptions {
        true_optics: machine().optics,
        seed,
        noise_mm,
        table: None,
        round: 1,
        planner: Some(Planner::Classic),
        atlas_store: AtlasStore::none(),
    }
}

/// What is measured without noise is where the head's rays fall.
#[test]
fn measured_places_are_those_of_the_head() {
    let machine = machine();
    let head = Tracer::new(&hidden_head(&machine.optics, 3));
    let process = SheetProcess::of(&machine);
    let square = square::sheet(200.0, &process, &machine).unwrap().pattern;
    // Rings are measured whole, so that their place is that of their middle to a micrometre or two.
    for (pattern, limit_mm) in
        [(pattern(MarkStyle::Cross, 3), 2e-3), (pattern(MarkStyle::Dot, 3), 5e-3), (square, 10e-3)]
    {
        let points = measure(&pattern, &machine, &options(3, 0.0), &mut |_| {}).unwrap();
        assert_eq!(points.len(), 9);
        for (id, point) in points {
            let place = head.place(angles_from_field(&machine.optics, point.target_mm).unwrap());
            let off_mm =
                (point.measured_mm.x_mm - place.x_mm).hypot(point.measured_mm.y_mm - place.y_mm);
            assert!(off_mm < limit_mm, "{}: {id} is {off_mm} mm off", pattern.kind);
        }
    }
}

/// The whole way of a user: measure, calibrate, mark through the table. The same again is the same.
#[test]
fn a_job_marked_through_the_table_is_where_it_should_be() {
    let machine = machine();
    let pattern = pattern(MarkStyle::Cross, 5);
    let measured = || measure(&pattern, &machine, &options(5, 0.005), &mut |_| {}).unwrap();
    let points: Vec<_> = measured().into_iter().map(|(_, point)| point).collect();
    assert!(points.iter().zip(measured()).all(|(a, (_, b))| *a == b));
    let field = field_calibration::calibrate_field(&machine, &points, &Default::default()).unwrap();
    assert!(field.calibration.before.rms_mm > 0.3);
    field.table.check_limits(&machine.scanner, &machine.optics).unwrap();

    let job = square::sheet(190.0, &SheetProcess::of(&machine), &machine).unwrap().job;
    let marked = |table| {
        let options = MarkOptions {
            planner: Some(Planner::Classic),
            head: Some(hidden_head(&machine.optics, 5)),
            table,
            ..MarkOptions::default()
        };
        let marked = mark(&job, &machine, &Recipe::default(), &options, &mut |_| {}).unwrap();
        marked.score.contour_error_um
    };
    let (bent, straight) = (marked(None), marked(Some(field.table.clone())));
    assert!(bent.max > 300.0, "{bent:?}");
    // The classic planner rounds the square's corners by some hundred micrometres.
    assert!(straight.p99 < 40.0, "{straight:?}");
}
