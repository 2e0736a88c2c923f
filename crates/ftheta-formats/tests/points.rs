//! Tables of measured points: every form that they are known in, and every way to be wrong.

use expect_test::{Expect, expect};
use ftheta_formats::points::{Points, read, read_angles, read_places};
use ftheta_model::calibration::MeasuredPoint;
use proptest::prelude::*;

/// Points and warnings of a file, one a line.
fn shown(bytes: &[u8]) -> String {
    let read = match read("m.csv", bytes) {
        Ok(read) => read,
        Err(error) => return format!("error | {error}"),
    };
    let mut out = String::new();
    let mut line = |first: [f64; 2], measured: [f64; 2], round: u32, line: u32| {
        out.push_str(&format!("{line}: {first:?} {measured:?} round {round}\n"));
    };
    match read.value {
        Points::Measured(points) => points.iter().for_each(|p| {
            let (t, m) = (p.target_mm, p.measured_mm);
            line([t.x_mm, t.y_mm], [m.x_mm, m.y_mm], p.round, p.line);
        }),
        Points::Commanded(points) => points.iter().for_each(|p| {
            line(p.command_units, [p.measured_mm.x_mm, p.measured_mm.y_mm], p.round, p.line);
        }),
    }
    read.warnings.iter().for_each(|warning| out.push_str(&format!("warning | {warning}\n")));
    out
}

#[track_caller]
fn check(text: impl AsRef<[u8]>, expected: Expect) {
    expected.assert_eq(&shown(text.as_ref()));
}

const HEADER: &str = "target_x_mm,target_y_mm,measured_x_mm,measured_y_mm";

#[test]
fn the_form_of_the_contract() {
    check(
        format!("{HEADER},round\n-60,-60,-59.21,-60.4,1\n0,0,0.1,-0.2,2\n"),
        expect![[r#"
            2: [-60.0, -60.0] [-59.21, -60.4] round 1
            3: [0.0, 0.0] [0.1, -0.2] round 2
        "#]],
    );
    let swapped =
        "Measured_Y_mm,round,TARGET_X_MM,measured_x_mm,mark,target_y_mm\n4,3,1,2,c7,-1e1\n";
    check(
        swapped,
        expect![[r#"
            2: [1.0, -10.0] [2.0, 4.0] round 3
        "#]],
    );
}

#[test]
fn spreadsheets_write_it_in_their_own_ways() {
    let plain = "target_x_mm;target_y_mm;measured_x_mm;measured_y_mm\n1,5;-2;1,25;\u{2212}2,125\n";
    let expected = "2: [1.5, -2.0] [1.25, -2.125] round 1\n";
    let utf16 = |unit: fn(u16) -> [u8; 2], mark: [u8; 2]| {
        let bytes = plain.encode_utf16().flat_map(unit);
        mark.into_iter().chain(bytes).collect::<Vec<u8>>()
    };
    for bytes in [
        plain.into(),
        format!("\u{feff}{plain}").into_bytes(),
        plain.replace('\n', "\r\n").into(),
        plain.replace('\n', "\r").into(),
        plain.replace(';', "\t").into(),
        plain.replace(';', "   ").into(),
        plain.replace(',', ".").replace(';', ",").into(),
        plain
            .lines()
            .map(|row| format!("\"{}\"\n", row.replace(';', "\";\"")))
            .collect::<String>()
            .into(),
        // Commas between quoted numbers with decimal commas.
        "target_x_mm,target_y_mm,measured_x_mm,measured_y_mm\n\"1,5\",\"-2\",\"1,25\",\"-2,125\"\n"
            .into(),
        format!("# made by hand\n; and so on\n\n{plain};;;\n").into(),
        utf16(u16::to_le_bytes, [0xff, 0xfe]),
        utf16(u16::to_be_bytes, [0xfe, 0xff]),
    ] {
        let found = shown(&bytes);
        let found = found.split_once(": ").map_or(found.as_str(), |(_, rest)| rest);
        assert_eq!(format!("2: {found}"), expected, "{}", String::from_utf8_lossy(&bytes));
    }
}

#[test]
fn tables_of_other_programs_are_known() {
    // Without names: target and measured place.
    check(
        "-10 -10 -9.5 -10.25\n10 10 9.5 10.25 # the last\n",
        expect![[r#"
            1: [-10.0, -10.0] [-9.5, -10.25] round 1
            2: [10.0, 10.0] [9.5, 10.25] round 1
            warning | m.csv: 4 columns without names, taken as target_x_mm in 1, target_y_mm in 2, measured_x_mm in 3, measured_y_mm in 4
        "#]],
    );
    // Row, column, nominal place and error.
    check(
        "0; 0; -10; 10; 0.5; -0.25\n0; 1; 0; 10; 0; 0.125\n",
        expect![[r#"
            1: [-10.0, 10.0] [-9.5, 9.75] round 1
            2: [0.0, 10.0] [0.0, 10.125] round 1
            warning | m.csv: 6 columns without names, taken as target_x_mm in 3, target_y_mm in 4, error_x_mm in 5, error_y_mm in 6
        "#]],
    );
    check(
        "row,col,nominal_x,nominal_y,error_x,error_y\n0,0,-10,10,0.5,-0.25\n",
        expect![[r#"
            2: [-10.0, 10.0] [-9.5, 9.75] round 1
        "#]],
    );
    // Measured place, indices, hexadecimal commands of a galvo, the centre at 8000.
    check(
        "-063.25 -067.30      -4      -4    2000    2000\n+000.00 +016.52 0 1 8000 9800\n",
        expect![[r#"
            1: [-24576.0, -24576.0] [-63.25, -67.3] round 1
            2: [0.0, 6144.0] [0.0, 16.52] round 1
            warning | m.csv: 6 columns without names, taken as galvo_x in 5, galvo_y in 6, measured_x_mm in 1, measured_y_mm in 2
        "#]],
    );
    // Commands in bits below settings.
    check(
        "OldCTBFile = D2_1.ctb\nNEWCAL = 400\n\n// RTC-X [bit] RTC-Y [bit] REAL-X [mm] REAL-Y [mm]\n\
         -20000\t+20000\t-51.5\t48.25\n     0\t     0\t  0.0\t 0.0\n",
        expect![[r#"
            5: [-20000.0, 20000.0] [-51.5, 48.25] round 1
            6: [0.0, 0.0] [0.0, 0.0] round 1
            warning | m.csv: 4 columns without names, taken as rtc_x in 1, rtc_y in 2, measured_x_mm in 3, measured_y_mm in 4
            warning | m.csv:1: 2 lines that set a value are not used
        "#]],
    );
    let bits = read("m.csv", b"RTC-X [Bit],RTC-Y [Bit],REAL-X [mm],REAL-Y [mm]\n-200,100,-1,2\n");
    let bits = bits.unwrap().value;
    assert_eq!(bits.clone().measured(None), None);
    assert_eq!(bits.clone().measured(Some(f64::NAN)), None);
    let MeasuredPoint { target_mm, .. } = bits.measured(Some(400.0)).unwrap()[0];
    assert_eq!((target_mm.x_mm, target_mm.y_mm), (-0.5, 0.25));
}

#[test]
fn unmeasured_and_repeated_rows_are_told() {
    check(
        format!(
            "{HEADER},round,note\n0,0,1,1,1,\n5,5,,,1,lost\n0,0,2,2,1,\n-0,0,3,3,2,\n,,,,,\n6,6\n"
        ),
        expect![[r#"
            2: [0.0, 0.0] [1.0, 1.0] round 1
            4: [0.0, 0.0] [2.0, 2.0] round 1
            5: [-0.0, 0.0] [3.0, 3.0] round 2
            warning | m.csv: columns note are not used
            warning | m.csv: rows left out for want of a measured place: 2
            warning | m.csv:4: same target and round as line 2; both are kept
        "#]],
    );
}

#[test]
fn what_is_wrong_is_named() {
    let with = |rows: &str| format!("{HEADER},round\n1,2,3,4,1\n{rows}\n");
    let cases = [
        String::new(),
        HEADER.into(),
        format!("{HEADER}\n1,2,,\n"),
        "target_x_mm,target_y_mm,measured_x_mm\n1,2,3\n".into(),
        format!("{HEADER},target_x_mm\n1,2,3,4,5\n"),
        "target_x_inch,target_y_inch,measured_x_inch,measured_y_inch\n1,2,3,4\n".into(),
        "1 2 3\n4 5 6\n".into(),
        with("1,2,3,,1"),
        with("1,2,3"),
        with(",2,3,4,1"),
        with("1,2,3,abc,1"),
        with("1,2,3,NaN,1"),
        with("1,2,-inf,4,1"),
        with("1,2,1e999,4,1"),
        with("1,2,1e7,4,1"),
        with("1,2,3,4,1.5"),
        with("1,2,3,4,0"),
        with("1,2,3,4,"),
        with("1,2,3,4,1,9"),
        with("1,2,\"3,5\",4,1"),
        "target_x_mm;target_y_mm;measured_x_mm;measured_y_mm\n1,5;2,5;1,5;2,5\n1.5;2;3;4\n".into(),
        format!("{HEADER}\n1,5,2,5,3,5,4,5\n"),
        "1.0 2.0 0 0 8000 8000\n1.0 2.0 0 0 8000 12345\n".into(),
    ];
    let found: Vec<String> = cases.iter().map(|text| shown(text.as_bytes())).collect();
    expect![[r#"
        error | m.csv: no rows, expected rows of target and measured place
        error | m.csv: no rows, expected rows of target and measured place
        error | m.csv: no row with a measured place, expected rows of target and measured place
        error | m.csv:1: columns "target_x_mm, target_y_mm, measured_x_mm", expected target_x_mm, target_y_mm, measured_x_mm, measured_y_mm and perhaps round, each once
        error | m.csv:1: columns "target_x_mm, target_y_mm, measured_x_mm, measured_y_mm, targ...", expected target_x_mm, target_y_mm, measured_x_mm, measured_y_mm and perhaps round, each once
        error | m.csv:1: columns "target_x_inch, target_y_inch, measured_x_inch, measured_y_in...", expected target_x_mm, target_y_mm, measured_x_mm, measured_y_mm and perhaps round, each once
        error | m.csv:1: columns without names, 3 of them, expected 4 (target x, y, measured x, y in mm; or commands in bits and measured), 5 (a round as well) or 6 (row, column, nominal x, y, error x, y; or measured x, y, i, j and hexadecimal galvo x, y)
        error | m.csv:3: measured_y_mm is empty, expected a finite number
        error | m.csv:3: measured_y_mm is empty, expected a finite number
        error | m.csv:3: target_x_mm is empty, expected a finite number
        error | m.csv:3: measured_y_mm is "abc", expected a finite number
        error | m.csv:3: measured_y_mm is "NaN", expected a finite number
        error | m.csv:3: measured_x_mm is "-inf", expected a finite number
        error | m.csv:3: measured_x_mm is "1e999", expected a finite number
        error | m.csv:3: measured_x_mm is "1e7", expected -1000000 to 1000000
        error | m.csv:3: round is "1.5", expected a whole number, 1 to 1000000
        error | m.csv:3: round is "0", expected a whole number, 1 to 1000000
        error | m.csv:3: round is empty, expected a whole number, 1 to 1000000
        error | m.csv:3: 6 cells, expected 5; numbers with a decimal comma need quotes or semicolons between them
        2: [1.0, 2.0] [3.0, 4.0] round 1
        3: [1.0, 2.0] [3.5, 4.0] round 1
        warning | m.csv:3: same target and round as line 2; both are kept

        error | m.csv:3: target_x_mm is "1.5", expected a finite number with a decimal comma, as in the rest of the file
        error | m.csv:2: 8 cells, expected 4; numbers with a decimal comma need quotes or semicolons between them
        error | m.csv:1: columns without names, 6 of them, expected 4 (target x, y, measured x, y in mm; or commands in bits and measured), 5 (a round as well) or 6 (row, column, nominal x, y, error x, y; or measured x, y, i, j and hexadecimal galvo x, y)"#]].assert_eq(&found.join("\n"));
    assert!(shown(&[0xff, 0xfe, 0x00]).starts_with("error | m.csv: byte 2 is not text"));
    assert!(shown(&[b'a', 0, b'b']).starts_with("error | m.csv: byte 1 is not text"));
    let error = read("m.csv", with("1,2,3,abc,1").as_bytes()).unwrap_err();
    let expected = ("m.csv:3: measured_y_mm".into(), "\"abc\"".into(), "a finite number".into());
    assert_eq!(error.fault(), expected);
}

#[test]
fn rows_beyond_the_limit_are_refused() {
    let text = format!("{HEADER}\n{}", "1,2,3,4\n".repeat(1_000_001));
    let error = read("m.csv", text.as_bytes()).unwrap_err();
    assert_eq!(error.to_string(), "m.csv:1000002: more than 1000000 rows");
}

#[test]
fn lists_of_places_and_angles() {
    let list = |text: &str| match read_places("p.csv", text.as_bytes()) {
        Ok(list) => list
            .iter()
            .map(|p| format!("{} {} {:?} {}", p.place_mm.x_mm, p.place_mm.y_mm, p.z_mm, p.line))
            .collect::<Vec<_>>()
            .join("; "),
        Err(error) => format!("error | {error}"),
    };
    let found = [
        "x_mm,y_mm\n1,2\n3,4\n",
        "y_mm,x_mm,z_mm,angle_x_deg\n1,2,3,9\n",
        "1 2\n3 4\n",
        "1;2;3,5\n",
        "1,5 2\n",
        "x_mm\n1\n",
        "x_mm,y_mm\n1,\n",
        "x_mm,y_mm,z_mm\n1,2\n",
        "x_mm,y_mm\n1,2e6\n",
        "",
    ]
    .map(list);
    expect![[r#"
        1 2 None 2; 3 4 None 3
        2 1 Some(3.0) 2
        1 2 None 1; 3 4 None 2
        1 2 Some(3.5) 1
        1.5 2 None 1
        error | p.csv:1: columns "x_mm", expected x_mm, y_mm and perhaps z_mm, each once
        error | p.csv:2: y_mm is empty, expected a finite number
        error | p.csv:2: z_mm is empty, expected a finite number
        error | p.csv:2: y_mm is "2e6", expected -1000000 to 1000000
        error | p.csv: no rows, expected rows of x_mm, y_mm and perhaps z_mm, each once"#]]
    .assert_eq(&found.join("\n"));
    let rows = "x_mm,y_mm,angle_x_deg,angle_y_deg\n1,2,90,-45\n";
    let angles = read_angles("a.csv", rows.as_bytes()).unwrap();
    assert_eq!(angles[0].angles.y_rad, -std::f64::consts::FRAC_PI_4);
    let error = read_angles("a.csv", b"angle_x_deg,angle_y_deg\n1,91\n").unwrap_err();
    assert_eq!(error.to_string(), "a.csv:2: angle_y_deg is \"91\", expected -90 to 90");
}

proptest! {
    #[test]
    fn no_bytes_cause_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read("m.csv", &bytes);
        let _ = read_places("m.csv", &bytes);
        let _ = read_angles("m.csv", &bytes);
    }

    #[test]
    fn no_table_causes_a_panic(text in "[0-9a-fx.,;\t \"#=\n\r+-]{0,200}") {
        let _ = read("m.csv", format!("{HEADER}\n{text}").as_bytes());
        let _ = read("m.csv", text.as_bytes());
        let _ = read_places("m.csv", text.as_bytes());
    }

    /// Whatever separates and whichever decimal sign, the same numbers come back.
    #[test]
    fn numbers_are_read_bit_for_bit(
        values in prop::collection::vec(prop::array::uniform4(-1e3f64..1e3), 1..9),
        separator in prop::sample::select(vec![";", "\t", "  ", ","]),
        comma in any::<bool>(),
    ) {
        let mut text = HEADER.replace(',', separator) + "\n";
        for row in &values {
            let row = row.map(|value| {
                let cell = value.to_string();
                let cell = if comma { cell.replace('.', ",") } else { cell };
                if separator == "," { format!("\"{cell}\"") } else { cell }
            });
            text.push_str(&(row.join(separator) + "\n"));
        }
        let points = read("m.csv", text.as_bytes()).unwrap().value.measured(None).unwrap();
        let found: Vec<_> = points
            .iter()
            .map(|p| [p.target_mm.x_mm, p.target_mm.y_mm, p.measured_mm.x_mm, p.measured_mm.y_mm])
            .collect();
        prop_assert_eq!(found, values);
    }
}
