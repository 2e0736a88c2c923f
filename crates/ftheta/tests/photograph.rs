//! Photographs of what the twin burned: where light was, and what a picture shows of it.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::model::machine::Machine;
use ftheta::model::pattern::{Feature, FeatureShape, GridMark, LineProcess, MarkStyle, Pattern};
use ftheta::model::picture::PixelPoint;
use ftheta::model::space::FieldPoint;
use ftheta::photograph::{BurnOptions, Photograph, PhotographOptions, photograph};
use ftheta::physics::head::Tracer;
use ftheta::physics::optics::angles_from_field;
use ftheta::twin::hidden_head::hidden_head;
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::photograph::{CameraOptions, Sensor};
use ftheta::{Error, machines};

fn machine(name: &str) -> Machine {
    machines::find(name).unwrap()
}

/// A straight look from above through a perfect lens, without noise.
fn options(machine: &Machine) -> PhotographOptions {
    PhotographOptions {
        burn: BurnOptions {
            true_machine: machine.clone(),
            head: None,
            table: None,
            mismatch: Mismatch::default(),
            late_ns: [0; 2],
            dose: 3.0,
            power: None,
            dose_slope: 0.0,
            jitter_mm: 0.0,
            spot_diameter_mm: Some(0.1),
            overburn: 0.0,
            missing: 0.0,
        },
        camera: CameraOptions {
            pixel_mm: None,
            megapixels: None,
            tilt_deg: Some(0.0),
            turn_deg: 0.0,
            mirrored: false,
            distortion: 0.0,
            seed: 5,
        },
        sensor: Sensor {
            blur_px: 0.8,
            noise: 0.0,
            exposure: 1.0,
            unevenness: 0.0,
            glare: 0.0,
            n_dirt: 0,
            gamma: 1.0,
            seed: 5,
        },
        bright: false,
        print_error: None,
        print_noise_mm: 0.015,
        sheet_lies: [0.0; 3],
        texture: [0.0; 2],
    }
}

fn pattern(shapes: Vec<FeatureShape>) -> Pattern {
    let name = |(index, shape)| Feature { id: format!("f{index}"), shape };
    let features = shapes.into_iter().enumerate().map(name).collect();
    Pattern { kind: "delay".into(), field_mm: 50.0, features, ..Pattern::default() }
}

fn line(from: [f64; 2], to: [f64; 2], speed_mm_s: f64) -> FeatureShape {
    FeatureShape::Line {
        from_mm: FieldPoint::new(from[0], from[1]),
        to_mm: FieldPoint::new(to[0], to[1]),
        process: LineProcess { speed_mm_s, power_ratio: 1.0 },
    }
}

/// Lines both ways along x and y from 1 to 10 m/s.
fn comb() -> Vec<(FieldPoint, FieldPoint, f64)> {
    let mut lines = Vec::new();
    for (index, speed_mm_s) in [1000.0, 5000.0, 10_000.0].into_iter().enumerate() {
        let at = 0.8 * index as f64;
        let [a, b] = [FieldPoint::new(0.0, at), FieldPoint::new(4.0, at)];
        let [c, d] = [FieldPoint::new(-4.0 - at, 0.0), FieldPoint::new(-4.0 - at, 4.0)];
        let back = [[0.0, 0.4], [4.0, 0.4]].map(|[x, y]| FieldPoint::new(x, y + at));
        lines.extend([(a, b, speed_mm_s), (back[1], back[0], speed_mm_s), (c, d, speed_mm_s)]);
    }
    lines
}

fn take(shapes: Vec<FeatureShape>, machine: &Machine, options: &PhotographOptions) -> Photograph {
    photograph(&pattern(shapes), &[], machine, options, &mut |_| {}).unwrap()
}

#[test]
fn light_is_late_by_what_is_asked_for() {
    for name in ["S10-f160", "S14-f420"] {
        let machine = machine(name);
        for late_us in [[0.0, 0.0], [85.0, 60.0], [-40.0, 150.0]] {
            let mut options = options(&machine);
            options.burn.late_ns = late_us.map(|us| (us * 1e3) as i64);
            options.camera.pixel_mm = Some(0.2);
            let lines = comb();
            let shapes = lines
                .iter()
                .map(|(from, to, v)| line([from.x_mm, from.y_mm], [to.x_mm, to.y_mm], *v))
                .collect();
            let truth = take(shapes, &machine, &options).truth;
            assert_eq!(truth.ends.len(), lines.len());
            for ((_, ends), (from, to, speed_mm_s)) in truth.ends.iter().zip(lines) {
                let length_mm = (to.x_mm - from.x_mm).hypot(to.y_mm - from.y_mm);
                for (found, (nominal, late_us)) in
                    ends.iter().zip([(from, late_us[0]), (to, late_us[1])])
                {
                    let share = speed_mm_s * late_us * 1e-6 / length_mm;
                    let x = nominal.x_mm + share * (to.x_mm - from.x_mm) - found.place_mm.x_mm;
                    let y = nominal.y_mm + share * (to.y_mm - from.y_mm) - found.place_mm.y_mm;
                    // A bit of the word is 0.1 µm here, in position and in the lag's place.
                    assert!(x.hypot(y) < 5e-4, "{name} {late_us} {speed_mm_s}: {x} {y}");
                }
            }
        }
    }
}

/// Where brightness passes half its step, px, from both sides.
fn edges(values: impl Iterator<Item = f32>) -> [f64; 2] {
    let values: Vec<f64> = values.map(f64::from).collect();
    let low = values.iter().copied().fold(1.0, f64::min);
    let half = 0.5 * (low + values[0]);
    let first = values.iter().position(|value| *value < half).unwrap();
    let last = values.iter().rposition(|value| *value < half).unwrap();
    let between = |a: usize, b: usize| (half - values[a]) / (values[b] - values[a]);
    [first as f64 - 1.0 + between(first - 1, first), last as f64 + between(last, last + 1)]
}

/// Width 2·w/√2·√ln 3 and ends that hardly grow, at three times the threshold, w = 50 µm.
#[test]
fn lines_are_seen_where_they_are() {
    let machine = machine("S10-f160");
    let options = options(&machine);
    let photograph = take(vec![line([0.0, 0.0], [4.0, 0.0], 5000.0)], &machine, &options);
    let picture = &photograph.picture;
    let (_, [from, to]) = &photograph.truth.ends[0];
    assert!((photograph.pixel_mm - 0.02).abs() < 1e-9);
    let row = from.pixel.y_px.round() as usize;
    let [left, right] = edges(picture.row(row).iter().copied());
    // A blurred half circle looks shorter than its tip; on the axis 10.8 µm are left to a few.
    for growth_px in [from.pixel.x_px - left, right - to.pixel.x_px] {
        assert!((0.0..0.54).contains(&growth_px), "{growth_px}");
    }
    let column = (0.5 * (from.pixel.x_px + to.pixel.x_px)) as usize;
    let [up, down] = edges((0..picture.height()).map(|y| picture.row(y)[column]));
    let width_um = (down - up) * 20.0;
    assert!((width_um - 74.1).abs() < 4.0, "{width_um}");
    assert!((0.5 * (up + down) - from.pixel.y_px).abs() < 0.01);
}

#[test]
fn crosses_are_where_the_heads_rays_fall() {
    let machine = machine("S14-f420");
    let head = hidden_head(&machine.optics, 3);
    let tracer = Tracer::new(&head);
    let places = [(-100.0, -100.0), (0.0, 0.0), (100.0, -60.0)].map(|(x, y)| FieldPoint::new(x, y));
    let cross = |(column, place_mm)| {
        let (style, size_mm) = (MarkStyle::Cross, 4.0);
        FeatureShape::Mark(GridMark { style, place_mm, size_mm, row: 0, column })
    };
    let mut options = options(&machine);
    options.burn.head = Some(head);
    options.camera.megapixels = Some(0.2);
    let photograph = take((0..3).zip(places).map(cross).collect(), &machine, &options);
    assert_eq!(photograph.truth.centres.len(), 3);
    for ((_, found), place) in photograph.truth.centres.iter().zip(places) {
        let place = tracer.place(angles_from_field(&machine.optics, place).unwrap());
        let off = (found.place_mm.x_mm - place.x_mm).hypot(found.place_mm.y_mm - place.y_mm);
        assert!(off < 2e-3, "{place:?} {off}");
    }
}

#[test]
fn print_is_off_and_a_caliper_says_by_how_much() {
    let machine = machine("S14-f420");
    let printed = |code: &str, x: f64, y: f64| FeatureShape::Fiducial {
        family: "tag36h11".into(),
        code: code.into(),
        place_mm: FieldPoint::new(x, y),
        size_mm: 8.0,
        burned: false,
    };
    let reference = |x: f64, y: f64| FeatureShape::Reference {
        from_mm: FieldPoint::new(-x, -y),
        to_mm: FieldPoint::new(x, y),
        burned: false,
    };
    let shapes = vec![
        printed("7", -60.0, -60.0),
        printed("8", 60.0, 50.0),
        reference(50.0, 0.0),
        reference(0.0, 40.0),
    ];
    let mut options = options(&machine);
    options.print_error = Some([0.003, -0.002]);
    options.camera.megapixels = Some(1.0);
    let photograph = take(shapes, &machine, &options);
    let [x_mm, y_mm] = photograph.caliper_mm.map(Option::unwrap);
    assert!((x_mm - 100.3).abs() < 0.08 && (y_mm - 79.84).abs() < 0.08, "{x_mm} {y_mm}");
    assert_eq!(photograph.truth.print_scale, [1.003, 0.998]);
    for (id, place) in &photograph.truth.centres {
        let (x, y) = if id == "f0" { (-60.18, -59.88) } else { (60.18, 49.9) };
        let off = (place.place_mm.x_mm - x).hypot(place.place_mm.y_mm - y);
        assert!(off < 0.08, "{id}: {off}");
        // The border's upper left corner is black, its margin is white.
        let pixel_mm = photograph.pixel_mm;
        let beside = |mm: f64| {
            let px = mm / pixel_mm;
            let (x_px, y_px) = (place.pixel.x_px - px, place.pixel.y_px - px);
            photograph.picture.at(PixelPoint::new(x_px, y_px))
        };
        assert!(beside(3.5) < 0.15 && beside(4.5) > 0.7, "{id}: {} {}", beside(3.5), beside(4.5));
    }
    let again = take(vec![printed("7", 0.0, 0.0)], &machine, &options).picture;
    assert!(again == take(vec![printed("7", 0.0, 0.0)], &machine, &options).picture);
}

#[test]
fn what_cannot_be_seen_is_said() {
    let machine = machine("S14-f420");
    let options = options(&machine);
    let message = |shapes: Vec<FeatureShape>, options: &PhotographOptions| {
        let error = photograph(&pattern(shapes), &[], &machine, options, &mut |_| {}).unwrap_err();
        assert!(matches!(error, Error::Photograph(_)));
        error.to_string()
    };
    assert_eq!(message(vec![], &options), "the pattern has nothing that is burned or printed");
    let mut fine = options.clone();
    fine.camera.pixel_mm = Some(1e-5);
    let found = message(vec![line([0.0, 0.0], [4.0, 0.0], 1000.0)], &fine);
    assert!(found.contains("more than the limit of 100000000"), "{found}");
    let unknown = FeatureShape::Fiducial {
        family: "tag36h11".into(),
        code: "64".into(),
        place_mm: FieldPoint::default(),
        size_mm: 8.0,
        burned: false,
    };
    assert_eq!(message(vec![unknown], &options), "fiducial 0 is no tag36h11 of number 0 to 63");
}
