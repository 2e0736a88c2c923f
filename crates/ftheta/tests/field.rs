//! Places as mirror angles and back, and tables in other kinds of files.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta::exchange;
use ftheta::field::{angles_of, csv, places_of};
use ftheta_formats::cor_file::{self, CorVersion};
use ftheta_formats::grid_csv;
use ftheta_formats::machine::preset;
use ftheta_formats::points::{Place, read_angles};
use ftheta_model::machine::{Lens, Machine};
use ftheta_model::space::FieldPoint;
use ftheta_physics::correction::{About, CorrectionPlane, CorrectionTable, Drift, optics_id};
use ftheta_physics::grid_map::{GridMap, Interpolation};

fn machine() -> Machine {
    preset("S14-f255").unwrap().unwrap()
}

/// A smooth correction of some tenths of a millimetre.
fn table(machine: &Machine) -> CorrectionTable {
    let value = |u: f64, v: f64| {
        Some([1.002 * u + 0.003 * v + 0.01 * u * v, 0.999 * v - 0.02 * u * u + 1e-4])
    };
    let angles =
        GridMap::tabled(machine.scanner.angle_max_rad, Interpolation::CatmullRom, 65, value)
            .unwrap();
    let about = About {
        machine: machine.name.clone(),
        optics_id: optics_id(&machine.optics),
        model: "physical".into(),
        n_rounds: 1,
    };
    CorrectionTable::new(about, vec![CorrectionPlane { z_mm: 0.0, angles }], Drift::NONE).unwrap()
}

fn place(x_mm: f64, y_mm: f64, z_mm: Option<f64>, line: u32) -> Place {
    Place { place_mm: FieldPoint::new(x_mm, y_mm), z_mm, line }
}

fn grid_of_places(half_mm: f64) -> Vec<Place> {
    let at = |index: u32| half_mm * (f64::from(index) / 10.0 - 1.0);
    (0..441).map(|index| place(at(index % 21), at(index / 21), None, index)).collect()
}

#[test]
fn places_come_back_from_their_angles() {
    let machine = machine();
    let table = table(&machine);
    let places = grid_of_places(0.5 * machine.optics.field_mm);
    for table in [None, Some(&table)] {
        let mapped = angles_of(&machine, table, &places).unwrap();
        let rows = read_angles("a.csv", csv(&mapped).as_bytes()).unwrap();
        let back = places_of(&machine, table, &rows).unwrap();
        for (place, back) in places.iter().zip(&back) {
            let (dx, dy) = (
                place.place_mm.x_mm - back.place_mm.x_mm,
                place.place_mm.y_mm - back.place_mm.y_mm,
            );
            // Ten decimals of a degree are 1e-9 mm here.
            assert!(dx.hypot(dy) < 2e-9, "{place:?} {back:?}");
        }
    }
}

#[test]
fn heights_move_the_focus() {
    let mut machine = machine();
    let places = [place(10.0, -20.0, Some(5.0), 2), place(0.0, 0.0, None, 3)];
    expect![[r#"
        x_mm,y_mm,angle_x_deg,angle_y_deg,focus_mm
        10,-20,1.1225644226,-2.2485867713,-5.000000000
        0,0,0.0000000000,0.0000000000,0.000000000
    "#]]
    .assert_eq(&csv(&angles_of(&machine, None, &places).unwrap()));
    machine.optics.lens =
        Lens::PostObjective { mirror_distance_mm: 30.0, working_distance_mm: 460.0 };
    machine.scanner.angle_max_rad = 0.3;
    let places = [place(140.0, 140.0, None, 2), place(140.0, 140.0, Some(10.0), 3)];
    let mapped = angles_of(&machine, None, &places).unwrap();
    // Optics reference: 39.6697 mm in the corner of a 280 mm field.
    assert!((mapped[0].focus_mm.unwrap() - 39.6697).abs() < 1e-4);
    // In a plane that is 10 mm higher the angles are larger and the focus is nearer.
    assert!(mapped[1].angles.y_rad > mapped[0].angles.y_rad);
    let length_mm = 140f64.hypot(30.0 + 450f64.hypot(140.0));
    assert!((mapped[1].focus_mm.unwrap() - (length_mm - 490.0)).abs() < 1e-9);
}

#[test]
fn places_and_angles_out_of_reach_name_their_line() {
    let machine = machine();
    let table = table(&machine);
    let place_error = |table, x_mm, z_mm| {
        let places = [place(1.0, 1.0, None, 2), place(x_mm, 0.0, z_mm, 7)];
        angles_of(&machine, table, &places).unwrap_err().to_string()
    };
    let angle_error = |table, machine: &Machine, text: &str| {
        let rows = read_angles("a.csv", text.as_bytes()).unwrap();
        places_of(machine, table, &rows).unwrap_err().to_string()
    };
    let mut wide = machine.clone();
    wide.scanner.angle_max_rad = 0.78;
    let mut post = machine.clone();
    post.optics.lens = Lens::PostObjective { mirror_distance_mm: 30.0, working_distance_mm: 460.0 };
    let high = angles_of(&post, None, &[place(0.0, 0.0, Some(500.0), 4)]).unwrap_err().to_string();
    let found = [
        place_error(None, 200.0, None),
        place_error(None, 5000.0, None),
        place_error(Some(&table), 111.4, None),
        angle_error(None, &machine, "0 13"),
        angle_error(Some(&table), &machine, "12.5 12.5"),
        angle_error(None, &wide, "44 44"),
        high,
    ];
    expect![[r#"
        line 7: (200, 0) mm needs X at 23.3752°, the limit is ±12.5000°
        line 7: the optics do not reach (5000, 0) mm at a height of 0 mm
        line 7: (111.4, 0) mm needs X at 12.6038°, the limit is ±12.5000°
        line 1: angles (0.0000°, 13.0000°) are beyond the mirrors' greatest angle
        line 1: angles (12.5000°, 12.5000°) are beyond the correction table
        line 1: angles (44.0000°, 44.0000°) are beyond the reach of the optics
        line 4: the optics do not reach (0, 0) mm at a height of 500 mm"#]]
    .assert_eq(&found.join("\n"));
}

/// A table through a `.cor` file and back moves no place of the field by more than the file's whole
/// units and its bilinear-free reading leave.
#[test]
fn tables_go_through_other_files_and_back() {
    let machine = machine();
    let table = table(&machine);
    let cor = exchange::cor(&table, &machine).unwrap();
    let unit_mm = 1.0 / cor.units_per_mm;
    assert!((cor.units_per_mm - 65536.0 / machine.optics.field_mm).abs() < 1e-9);
    for version in [CorVersion::One, CorVersion::Two] {
        let read = cor_file::read(&cor_file::write(&cor, version).unwrap()).unwrap();
        let back = exchange::table(&exchange::grid_of_cor(&read), &machine).unwrap();
        let apart_mm = apart_mm(&machine, &table, &back);
        assert!(apart_mm < unit_mm, "{apart_mm} of {unit_mm}");
    }
    let grid = exchange::offsets(&table, &machine, 65, 0.5 * machine.optics.field_mm).unwrap();
    let read = grid_csv::read("g.csv", grid_csv::write(&grid).as_bytes()).unwrap();
    let back = exchange::table(&read, &machine).unwrap();
    let apart_mm = apart_mm(&machine, &table, &back);
    assert!(apart_mm < 5e-4, "{apart_mm}");
    // The centre's offset is what the table does there: 1e-4 rad of twice the focal length.
    let centre = grid.offsets_mm[32 * 65 + 32];
    assert!(
        (centre[1] - 2.0 * 255.059 * 1e-4).abs() < 1e-3 && centre[0].abs() < 1e-9,
        "{centre:?}"
    );
}

/// Greatest distance that two tables put the same place apart, mm.
fn apart_mm(machine: &Machine, a: &CorrectionTable, b: &CorrectionTable) -> f64 {
    let places = grid_of_places(0.5 * machine.optics.field_mm);
    let [a, b] = [a, b].map(|table| angles_of(machine, Some(table), &places).unwrap());
    let apart = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a.angles.x_rad - b.angles.x_rad).hypot(a.angles.y_rad - b.angles.y_rad));
    apart.fold(0.0, f64::max) * 2.0 * 255.059
}
