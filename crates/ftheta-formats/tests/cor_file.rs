//! EZCAD's correction files against bytes built by hand, and grids as CSV.

use ftheta_formats::cor_file::{CorFileError, CorTable, CorVersion, N_SIDE, read, write};
use ftheta_formats::grid_csv::{self, OffsetGrid};
use proptest::prelude::*;

/// A file of version 2 whose first and last nodes are known.
fn by_hand() -> Vec<u8> {
    let mut bytes = b"JCZ_COR_2_1\0garbage".to_vec();
    bytes.resize(28, 0xaa);
    bytes.extend(500.25f64.to_le_bytes());
    bytes.resize(36 + 65 * 65 * 8, 0);
    // Row 0, column 64: its second number; row 64, column 0: its first.
    let (right, top) = (36 + 64 * 8 + 4, 36 + 64 * 65 * 8);
    bytes[right..right + 4].copy_from_slice(&(-2774i32).to_le_bytes());
    bytes[top..top + 4].copy_from_slice(&301i32.to_le_bytes());
    bytes.extend([1, 0, 0, 0]);
    bytes
}

#[test]
fn version_2_is_read_and_written_byte_by_byte() {
    let table = read(&by_hand()).unwrap();
    assert_eq!((table.units_per_mm, table.image_index), (500.25, 1));
    assert_eq!(table.offsets.len(), N_SIDE * N_SIDE);
    assert_eq!((table.offsets[64], table.offsets[64 * 65]), ([0, -2774], [301, 0]));
    let mut expected = by_hand();
    expected[11..28].fill(0);
    assert_eq!(write(&table, CorVersion::Two).unwrap(), expected);
    assert_eq!(expected.len(), 33_840);
}

#[test]
fn version_1_is_read_and_written() {
    let mut bytes: Vec<u8> = b"LMC1COR_1.0".iter().flat_map(|&letter| [letter, 0]).collect();
    bytes.resize(24 + 43 * 8, 0);
    bytes.extend(213.5f64.to_le_bytes());
    bytes.resize(528, 0);
    bytes.extend((0..65 * 65 * 2).flat_map(|index| (f64::from(index) + 0.25).to_le_bytes()));
    bytes.extend((-7i32).to_le_bytes());
    let table = read(&bytes).unwrap();
    assert_eq!((table.units_per_mm, table.image_index), (213.5, -7));
    assert_eq!((table.offsets[0], table.offsets[4224]), ([0, 1], [8448, 8449]));
    let written = write(&table, CorVersion::One).unwrap();
    assert_eq!((written.len(), read(&written)), (68_132, Ok(table)));
    bytes[..22].copy_from_slice(b"LMC1COR_1.0\0\0\0\0\0\0\0\0\0\0\0");
    assert!(read(&bytes).is_ok());
}

#[test]
fn damage_and_tables_that_no_board_takes_are_refused() {
    let good = by_hand();
    for n_bytes in [0, 5, 22, 28, 100, good.len() - 1] {
        assert!(read(&good[..n_bytes]).is_err(), "{n_bytes}");
    }
    let longer = [&good[..], &[0]].concat();
    let error = read(&longer).unwrap_err();
    assert_eq!(error.to_string(), "33841 bytes, a file with the label JCZ_COR_2_1 has 33840");
    let changed = |at: usize, with: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        read(&bytes).unwrap_err()
    };
    assert!(matches!(changed(0, b"X"), CorFileError::Label { .. }));
    assert!(matches!(changed(11, b"2"), CorFileError::Label { .. }));
    for scale in [f64::NAN, 0.0, -500.0, 1e300, f64::INFINITY] {
        assert!(matches!(
            changed(28, &scale.to_le_bytes()),
            CorFileError::Scale { offset: 28, .. }
        ));
    }
    let error = changed(36 + (2 * 65 + 3) * 8, &40_000i32.to_le_bytes());
    assert_eq!(error.to_string(), "row 2, column 3: an offset of 40000 is outside ±32767");
    let few = CorTable { units_per_mm: 500.0, offsets: vec![[0; 2]; 9], image_index: 0 };
    assert_eq!(write(&few, CorVersion::Two), Err(CorFileError::Nodes { n_nodes: 9 }));
    let mut nodes = vec![[0; 2]; 65 * 65];
    nodes[66] = [0, i32::MIN];
    let far = CorTable { units_per_mm: 500.0, offsets: nodes, image_index: 0 };
    assert!(matches!(
        write(&far, CorVersion::One),
        Err(CorFileError::Offset { row: 1, column: 1, .. })
    ));
}

fn grid() -> OffsetGrid {
    let offsets_mm = (0..9).map(|index| [f64::from(index) / 3.0, -1e-7]).collect();
    OffsetGrid { n_side: 3, half_width_mm: 55.1, offsets_mm }
}

#[test]
fn grids_are_read_as_written_and_with_the_first_row_on_top() {
    let text = grid_csv::write(&grid());
    assert!(text.starts_with("row,column,x_mm,y_mm,offset_x_mm,offset_y_mm\n0,0,-55.1,-55.1,0,"));
    assert_eq!(grid_csv::read("g.csv", text.as_bytes()), Ok(grid()));
    let mut rows: Vec<String> = text.lines().skip(1).map(String::from).collect();
    rows.reverse();
    let header = "row,column,x_mm,y_mm,offset_x_mm,offset_y_mm\n";
    let shuffled = header.to_owned() + &rows.join("\n");
    assert_eq!(grid_csv::read("g.csv", shuffled.as_bytes()), Ok(grid()));
    let flipped = rows.iter().map(|row| match row.split_at(2) {
        ("0,", rest) => format!("2,{rest}\n"),
        ("2,", rest) => format!("0,{rest}\n"),
        _ => format!("{row}\n"),
    });
    let flipped = header.to_owned() + &flipped.collect::<String>();
    assert_eq!(grid_csv::read("g.csv", flipped.as_bytes()), Ok(grid()));
}

#[test]
fn grids_that_are_none_are_refused() {
    let text = grid_csv::write(&grid());
    let error = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        format!("error | {}", grid_csv::read("g.csv", changed.as_bytes()).unwrap_err())
    };
    let found = [
        error("2,2,55.1,", "2,2,56,"),
        error("2,2,", "2,3,"),
        error("2,2,", "2,1,"),
        error("1,1,0,0,", "1,1,0,x,"),
        error("1,1,0,0,", "1,1,0,,"),
        error("offset_y_mm", "offset_z_mm"),
        error("2,2,55.1,55.1", "# 2,2,55.1,55.1"),
    ];
    expect_test::expect![[r#"
        error | g.csv:2: x_mm is -55.1, expected -55.55, as in an even grid with the field's centre in its own
        error | g.csv:10: column is "3", expected a whole number, 0 to 2
        error | g.csv:10: row is "2", expected a node of its own; row 2, column 1 was there before
        error | g.csv:6: y_mm is "x", expected a finite number
        error | g.csv:6: y_mm is empty, expected a finite number
        error | g.csv:1: columns "row, column, x_mm, y_mm, offset_x_mm, offset_z_mm", expected row, column, x_mm, y_mm, offset_x_mm, offset_y_mm
        error | g.csv: 8 rows, expected a square number of rows, 4 to 1050625"#]].assert_eq(&found.join("\n"));
    let nowhere = "row,column,x_mm,y_mm,offset_x_mm,offset_y_mm\n".to_owned()
        + "0,0,0,0,0,0\n0,1,0,0,0,0\n1,0,0,0,0,0\n1,1,0,0,0,0\n";
    assert!(grid_csv::read("g.csv", nowhere.as_bytes()).is_err());
}

proptest! {
    #[test]
    fn no_bytes_cause_a_panic(
        at in 0usize..33_840,
        with in any::<[u8; 8]>(),
        cut in 0usize..33_841,
    ) {
        let mut bytes = by_hand();
        for (byte, new) in bytes[at..].iter_mut().zip(with) {
            *byte = new;
        }
        bytes.truncate(cut);
        let _ = read(&bytes);
        let _ = read(&with);
        let _ = grid_csv::read("g.csv", &bytes[..bytes.len().min(300)]);
    }
}
