//! Calibration of heads with hidden errors: a seeded part of `04_calibration_figures`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

mod hidden;

use ftheta::calibrate::calibrate::{CalibrateOptions, Calibration, Model, calibrate};
use ftheta::calibrate::error::CalibrateError;
use ftheta::calibrate::mark::Mark;
use ftheta::field_calibration::{FieldOptions, calibrate_drift, calibrate_field};
use ftheta::model::machine::{Axis, Machine};
use ftheta::model::space::{FieldPoint, MirrorAngles};
use ftheta::physics::head::Tracer;
use ftheta::physics::optics::angles_from_field;
use hidden::{Setup, grid, points};

/// Mean of root mean squares and of maxima over a few heads, µm.
fn mean_um(setup: Setup, seeds: std::ops::Range<u64>) -> (f64, f64) {
    let n = (seeds.end - seeds.start) as f64;
    let errors: Vec<_> = seeds.map(|seed| setup.errors_um(seed)).collect();
    (errors.iter().map(|e| e.1).sum::<f64>() / n, errors.iter().map(|e| e.2).sum::<f64>() / n)
}

/// The figures asked for, over four heads: a fifth is allowed for so few.
#[test]
fn hidden_heads_are_calibrated() {
    for (n_side, noise_um, polynomial, rms_um, max_um) in [
        (3, 10.0, true, 18.0, 34.0),
        (5, 10.0, false, 9.0, 21.0),
        (9, 10.0, false, 6.0, 17.0),
        (3, 2.0, true, 14.0, 26.0),
        (5, 2.0, false, 4.0, 9.0),
        (9, 2.0, false, 2.2, 7.0),
    ] {
        let (rms, max) = mean_um(Setup::new(n_side, noise_um, polynomial), 400..404);
        let asked = format!("{n_side}, {noise_um} µm: {rms:.1} / {max:.1} of {rms_um} / {max_um}");
        assert!(rms <= 1.2 * rms_um && max <= 1.2 * max_um, "{asked}");
    }
    let (rms, max) = mean_um(Setup::new(17, 10.0, false), 400..401);
    assert!(rms <= 1.2 * 4.0 && max <= 1.2 * 13.0, "289 marks: {rms:.1} / {max:.1}");
    let stress = Setup { stress: 5.0, ..Setup::new(17, 10.0, false) };
    let (rms, max) = mean_um(stress, 400..401);
    assert!(rms <= 1.2 * 7.0 && max <= 1.2 * 20.0, "stress: {rms:.1} / {max:.1}");
}

/// What is expected is what comes, within a half, and the noise is found within a third.
#[test]
fn expectations_are_honest() {
    for (n_side, noise_um) in [(5, 10.0), (9, 10.0), (9, 50.0)] {
        let setup = Setup::new(n_side, noise_um, false);
        let results: Vec<_> = (500..504).map(|seed| setup.errors_um(seed)).collect();
        let expected: f64 = results.iter().map(|r| r.0.expected.rms_mm * 1e3).sum();
        let found: f64 = results.iter().map(|r| r.1).sum();
        assert!((expected / found).ln().abs() < 0.4, "{expected} expected, {found} found");
        let noise: f64 = results.iter().map(|r| r.0.noise_mm * 1e3 / 4.0).sum();
        assert!((noise / noise_um).ln().abs() < 0.3, "noise {noise} of {noise_um}");
    }
}

/// Marks that reach 5 % beyond the field, as in the tables of `optics.md` B.2: within 15 % of them
/// over 20 heads, six of which are tried here.
#[test]
fn surfaces_are_as_good_as_the_reference() {
    for (model, n_side, rms_um, max_um) in [
        (Model::Polynomial, 9, 6.9, 17.0),
        (Model::Polynomial, 17, 4.4, 12.0),
        (Model::Zones, 9, 10.5, 26.0),
        (Model::Zones, 17, 5.4, 15.0),
    ] {
        let setup = Setup { model: Some(model), reach: 1.05, ..Setup::new(n_side, 10.0, false) };
        let (rms, max) = mean_um(setup, 1000..1006);
        let name = model.name();
        assert!(rms <= 1.2 * rms_um && max <= 1.2 * max_um, "{name}: {rms:.1} / {max:.1}");
    }
}

/// One mark 1.2 mm off is found, and no other accused.
#[test]
fn wrong_marks_are_named() {
    for (n_side, noise_um, polynomial) in [(3, 10.0, true), (3, 50.0, true), (5, 10.0, false)] {
        let setup = Setup::new(n_side, noise_um, polynomial);
        for seed in 600..604 {
            let head = setup.head(seed);
            let mut marks = setup.marks(&head, seed);
            let wrong = (seed as usize * 7) % marks.len();
            let (sin, cos) = (seed as f64).sin_cos();
            marks[wrong].measured.x_mm += 1.2 * cos;
            marks[wrong].measured.y_mm += 1.2 * sin;
            let calibration = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
            assert_eq!(calibration.outliers, [wrong], "{n_side}, {noise_um}, seed {seed}");
            assert_eq!(calibration.model, Model::Physical);
        }
    }
}

/// All eight ways that a sheet can lie, and a head whose mirrors are in the other order.
#[test]
fn axes_are_found() {
    let setup = Setup::new(5, 50.0, false);
    let head = setup.head(700);
    for way in 0..8 {
        let [swapped, x_reversed, y_reversed] = [way & 1 != 0, way & 2 != 0, way & 4 != 0];
        let mut marks = setup.marks(&head, 700 + way);
        for mark in &mut marks {
            let FieldPoint { x_mm, y_mm } = mark.measured;
            let (x, y) = if swapped { (y_mm, x_mm) } else { (x_mm, y_mm) };
            let sign = |reversed: bool| if reversed { -1.0 } else { 1.0 };
            mark.measured = FieldPoint::new(sign(x_reversed) * x, sign(y_reversed) * y);
        }
        let found = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
        let axes = found.axes;
        assert_eq!(
            (axes.swapped, axes.x_reversed, axes.y_reversed, axes.first_mirror),
            (swapped, x_reversed, y_reversed, Axis::X)
        );
        assert!(axes.margin > 30.0 && found.after.rms_mm < 0.1, "{:?}", found.after);
    }
    // Commands exchanged before the mirrors, places after them: the other order of the mirrors.
    let tracer = Tracer::new(&head);
    let mut marks = setup.marks(&head, 1);
    for mark in &mut marks {
        let place = tracer.place(MirrorAngles::new(mark.command.y_rad, mark.command.x_rad));
        mark.measured = FieldPoint::new(place.y_mm, place.x_mm);
    }
    let found = calibrate(&setup.optics(), &marks, &setup.options()).unwrap();
    assert_eq!(found.axes.first_mirror, Axis::Y);
    assert!(
        found.after.rms_mm < 0.05 && found.warnings.iter().any(|w| w.to_string().contains("y"))
    );
}

fn machine() -> Machine {
    ftheta::machines::find("S14-f420").unwrap()
}

/// A second round, marked through the table of the first, makes a better table; four marks follow a
/// head that has moved since.
#[test]
fn rounds_add_up_and_drift_is_followed() {
    let (machine, setup) = (machine(), Setup::new(5, 50.0, true));
    let mut head = setup.head(800);
    let mut all = points(&setup.marks(&head, 800));
    let first = calibrate_field(&machine, &all, &FieldOptions::default()).unwrap();
    let commands: Vec<_> = setup
        .targets()
        .iter()
        .map(|&target| {
            let nominal = angles_from_field(&machine.optics, target).unwrap();
            let [x, y] = first.table.angles([nominal.x_rad, nominal.y_rad]);
            MirrorAngles::new(x, y)
        })
        .collect();
    all.extend(points(&setup.measured(&head, &commands, 2, 801)));
    let second = calibrate_field(&machine, &all, &FieldOptions::default()).unwrap();
    assert_eq!(second.marks[25].command, commands[0]);
    assert_eq!(second.table.about().n_rounds, 2);
    let expected = |c: &Calibration| c.expected.rms_mm;
    assert!(expected(&second.calibration) < 0.85 * expected(&first.calibration));

    // The head warms up; four marks are made through the table.
    head.response[0].zero_rad += 2e-4;
    head.response[1].gain *= 1.0005;
    let four = Setup { n_side: 2, noise_um: 2.0, field_mm: 200.0, ..setup };
    let through = |target: &FieldPoint, table: &ftheta::physics::correction::CorrectionTable| {
        let nominal = angles_from_field(&machine.optics, *target).unwrap();
        let [x, y] = table.angles([nominal.x_rad, nominal.y_rad]);
        MirrorAngles::new(x, y)
    };
    let sent: Vec<_> = four.targets().iter().map(|t| through(t, &second.table)).collect();
    let marks = points(&four.measured(&head, &sent, 1, 802));
    let (moved, found) = calibrate_drift(&machine, second.table.clone(), &marks).unwrap();
    assert!(found.before.rms_mm > 0.1 && found.after.rms_mm < 0.03, "{found:?}");
    let tracer = Tracer::new(&head);
    let error_mm = |table| {
        let off = grid(9, 100.0).into_iter().map(|target| {
            let place = tracer.place(through(&target, table));
            (place.x_mm - target.x_mm).hypot(place.y_mm - target.y_mm)
        });
        off.fold(0.0, f64::max)
    };
    assert!(error_mm(&second.table) > 0.15 && error_mm(&moved) < 0.08, "{}", error_mm(&moved));
}

/// The thesis' own test: a square with a cross, nine marks measured to 50 µm. It printed 0.5 mm to
/// 200 mm and 1 mm beyond by parameters, 0.1 and 0.3 mm with nine points; noise puts the worst
/// of nine marks 0.12 mm off.
#[test]
fn the_thesis_test_is_replayed() {
    for (field_mm, scale_mm, nine_mm) in [(120.0, 0.5, 0.15), (200.0, 0.8, 0.2), (280.0, 1.1, 0.3)]
    {
        let worst_mm = |model: Model| {
            let setup = Setup { field_mm, model: Some(model), ..Setup::new(3, 50.0, false) };
            mean_um(setup, 900..904).1 * 1e-3
        };
        let (scale, nine, physical) =
            (worst_mm(Model::Scale), worst_mm(Model::NinePoint), worst_mm(Model::Physical));
        let told = format!("{field_mm} mm: {scale:.3}, {nine:.3}, {physical:.3} mm");
        assert!(scale < scale_mm && nine < nine_mm && physical < nine, "{told}");
        assert!(nine < scale, "{told}");
    }
}

/// Every model works on a grid, and is better the more it knows.
#[test]
fn all_models_fit_a_grid() {
    let error = |model: Model| {
        let (calibration, rms, _) =
            Setup { model: Some(model), ..Setup::new(9, 10.0, false) }.errors_um(1000);
        assert_eq!(calibration.model, model);
        rms
    };
    let [physical, polynomial, zones, nine, scale] = Model::ALL.map(error);
    assert!(physical < 7.0 && polynomial < 9.0 && zones < 12.0, "{physical} {polynomial} {zones}");
    assert!(nine < 60.0 && scale < 1000.0 && zones < nine && nine < scale, "{nine} {scale}");
}

/// What cannot be meant is refused, with what is suspected.
#[test]
fn bad_points_are_refused() {
    let setup = Setup::new(5, 10.0, true);
    let marks = setup.marks(&setup.head(1), 1);
    let refusal = |change: &dyn Fn(&mut Vec<Mark>)| {
        let mut changed = marks.clone();
        change(&mut changed);
        match calibrate(&setup.optics(), &changed, &CalibrateOptions::default()) {
            Err(error) => error.to_string(),
            Ok(calibration) => panic!("accepted: {:?}", calibration.after),
        }
    };
    let measured = |scale: f64| {
        move |marks: &mut Vec<Mark>| {
            for mark in marks {
                mark.measured.x_mm *= scale;
                mark.measured.y_mm *= scale;
            }
        }
    };
    assert!(refusal(&|marks| marks.truncate(3)).contains("3 marks are too few"));
    assert!(refusal(&|marks| marks.truncate(5)).contains("lie on a line"));
    assert!(refusal(&measured(1.0 / 25.4)).contains("measured places in inch"));
    assert!(refusal(&measured(25.4)).contains("targets in inch"));
    assert!(refusal(&measured(1000.0)).contains("µm"));
    assert!(refusal(&measured(3.0)).contains("focal length"));
    let exchanged = |marks: &mut Vec<Mark>| {
        for mark in marks {
            (mark.target, mark.measured) = (mark.measured, mark.target);
        }
    };
    assert!(refusal(&exchanged).contains("exchanged"));
    let shuffled = |marks: &mut Vec<Mark>| {
        let places: Vec<_> = marks.iter().map(|mark| mark.measured).collect();
        marks.iter_mut().enumerate().for_each(|(k, mark)| mark.measured = places[k * 7 % 25]);
    };
    assert!(refusal(&shuffled).contains("do not follow the targets"));
    let same = |marks: &mut Vec<Mark>| {
        let first = marks[0];
        marks.iter_mut().for_each(|mark| *mark = first);
    };
    assert!(refusal(&same).contains("lie on a line"));
    let few = CalibrateOptions { model: Some(Model::NinePoint), ..CalibrateOptions::default() };
    let error = calibrate(&setup.optics(), &marks[..8], &few).err().unwrap();
    assert_eq!(error, CalibrateError::TooFew { n_marks: 8, model: "nine-point", limit: 9 });

    let quadrant: Vec<_> =
        marks.iter().filter(|m| m.target.x_mm > 0.0 && m.target.y_mm > 0.0).copied().collect();
    let calibration = calibrate(&setup.optics(), &quadrant, &CalibrateOptions::default()).unwrap();
    assert!(calibration.warnings.iter().any(|w| w.to_string().contains("1 of 4 quadrants")));
}
