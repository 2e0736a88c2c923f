//! Fields calibrated at several heights, for heads that move their focus.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

mod hidden;

use ftheta::exchange::{ExchangeError, offsets};
use ftheta::field_calibration::{FieldOptions, calibrate_field, calibrate_plane};
use ftheta::formats::machine;
use ftheta::formats::svg::{self, SvgOptions};
use ftheta::machines::at_height;
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::calibration::MeasuredPoint;
use ftheta::model::machine::Machine;
use ftheta::model::recipe::Recipe;
use ftheta::model::space::MirrorAngles;
use ftheta::physics::correction::{CorrectionTable, Drift};
use ftheta::physics::head::{Head, Tracer};
use ftheta::physics::optics::angles_from_field;
use ftheta::twin::hidden_head::hidden_head;
use hidden::{Setup, grid};

const MACHINE: &str = include_str!("../../../gallery/dynamic-focus.toml");
const FIELD_MM: f64 = 240.0;

/// The head over a plane that is nearer by `z_mm`.
fn above(head: &Head, z_mm: f64) -> Head {
    let mut head = head.clone();
    head.plane.height_mm -= z_mm;
    head
}

/// Marks made as if the plane were the nominal one, measured where they are.
fn points(machine: &Machine, head: &Head, z_mm: f64, seed: u64) -> Vec<MeasuredPoint> {
    let setup = Setup { field_mm: FIELD_MM, ..Setup::new(9, 10.0, true) };
    let nominal = |target: &_| angles_from_field(&machine.optics, *target).unwrap();
    let commands: Vec<MirrorAngles> = setup.targets().iter().map(nominal).collect();
    hidden::points(&setup.measured(&above(head, z_mm), &commands, 1, seed))
}

/// Greatest error over the field at a height, µm.
fn error_um(machine: &Machine, head: &Head, table: &CorrectionTable, z_mm: f64) -> f64 {
    let tracer = Tracer::new(&above(head, z_mm));
    let optics = machine.optics.at_height(z_mm).unwrap();
    let off = grid(21, 0.5 * FIELD_MM).into_iter().map(|target| {
        let nominal = angles_from_field(&optics, target).unwrap();
        let [x_rad, y_rad] = table.angles_at([nominal.x_rad, nominal.y_rad], z_mm);
        let place = tracer.place(MirrorAngles::new(x_rad, y_rad));
        1e3 * (place.x_mm - target.x_mm).hypot(place.y_mm - target.y_mm)
    });
    off.fold(0.0, f64::max)
}

/// A head with the table of its nominal plane, and with that of two more, put onto it.
struct Calibrated {
    machine: Machine,
    head: Head,
    flat: CorrectionTable,
    all: CorrectionTable,
}

fn calibrated(seed: u64) -> Calibrated {
    let machine = machine::read("dynamic-focus.toml", MACHINE).unwrap();
    let head = hidden_head(&machine.optics, seed);
    let options = FieldOptions::default();
    let flat = calibrate_field(&machine, &points(&machine, &head, 0.0, 1), &options).unwrap().table;
    let mut all = flat.clone();
    for (z_mm, seed) in [(20.0, 2), (-15.0, 3)] {
        let points = points(&machine, &head, z_mm, seed);
        all = calibrate_plane(&machine, &points, &options, (z_mm, &all)).unwrap().table;
    }
    Calibrated { machine, head, flat, all }
}

#[test]
fn planes_make_the_field_true_at_all_heights_between() {
    let Calibrated { machine, head, flat, all } = calibrated(901);
    let heights: Vec<f64> = all.planes().iter().map(|plane| plane.z_mm).collect();
    assert_eq!(heights, [-15.0, 0.0, 20.0]);
    for z_mm in [-15.0, -7.0, 0.0, 10.0, 20.0] {
        let (one, several) =
            (error_um(&machine, &head, &flat, z_mm), error_um(&machine, &head, &all, z_mm));
        assert!(several < 30.0, "{several} µm at {z_mm} mm");
        if z_mm.abs() >= 15.0 {
            assert!(one > 2.0 * several, "{one} µm by one plane, {several} µm by three");
        }
    }
    // The nominal plane is what it was, to the last bit.
    let angles = [0.1, -0.05];
    assert_eq!(flat.angles(angles), all.angles(angles));
}

/// A job over a raised plane: angles, lens and table are those of the height.
#[test]
fn marks_are_true_at_a_height() {
    let Calibrated { mut machine, head, flat, all } = calibrated(901);
    let height_mm = 17.0;
    machine.optics.focus.as_mut().unwrap().travel_mm = 12.0;
    let machine = at_height(machine, height_mm).unwrap();
    let drawing = r#"<svg xmlns="http://www.w3.org/2000/svg" width="240mm" height="240mm"
        viewBox="-120 -120 240 240" fill="none" stroke="black">
        <path d="M110 110 v6 h-6"/><path d="M-112 100 h5"/><path d="M5 -114 l3 3"/></svg>"#;
    let recipe = Recipe::default();
    let job = svg::read(drawing.as_bytes(), &recipe, &SvgOptions::default()).unwrap().value;
    let marked = |table: &CorrectionTable| {
        let options = MarkOptions {
            table: Some(table.clone()),
            head: Some(above(&head, height_mm)),
            ..MarkOptions::default()
        };
        mark(&job, &machine, &recipe, &options, &mut |_| {}).unwrap()
    };
    let (one, several) = (marked(&flat), marked(&all));
    let error_um = |marked: &Marked| marked.score.contour_error_um.max;
    assert!(error_um(&several) < 40.0, "{} µm", error_um(&several));
    assert!(error_um(&one) > 1.5 * error_um(&several), "{} µm by one plane", error_um(&one));
    let told = |marked: &Marked| marked.warnings.iter().any(|w| w.to_string().contains("planes"));
    assert!(told(&one) && !told(&several));
    // The same plan on a lens that is where it should be.
    assert!(several.score.focus_error_um.unwrap().max < 200.0);
    assert!(at_height(machine, 460.0).unwrap_err().to_string().contains("no room"));
}

#[test]
fn a_plane_of_the_same_height_is_replaced() {
    let Calibrated { machine, head, all, .. } = calibrated(902);
    let again = points(&machine, &head, 20.0, 9);
    let options = FieldOptions::default();
    let found = calibrate_plane(&machine, &again, &options, (20.0, &all)).unwrap();
    assert_eq!(found.table.planes().len(), 3);
    assert_ne!(found.table.planes()[2], all.planes()[2]);
    assert_eq!(found.table.planes()[..2], all.planes()[..2]);
}

#[test]
fn planes_that_cannot_be_are_refused() {
    let Calibrated { machine, head, flat, all } = calibrated(903);
    let points = points(&machine, &head, 0.0, 1);
    let options = FieldOptions::default();
    let refused = |z_mm, table: &CorrectionTable| {
        let found = calibrate_plane(&machine, &points, &options, (z_mm, table));
        found.map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(460.0, &flat).contains("no room"));
    let drifted = flat.clone().with_drift(Drift { gain: [1.001, 1.0], ..Drift::NONE });
    assert!(refused(10.0, &drifted).contains("drift"));
    // Files of one plane would lose the others.
    let lost = offsets(&all, &machine, 65, 100.0).unwrap_err();
    assert_eq!(lost, ExchangeError::Planes { n_planes: 3 });
}
