//! Correction files: bit for bit, and no damage goes unnoticed.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta_formats::correction_file::{CorrectionFileError, read, write};
use ftheta_physics::correction::{About, CorrectionPlane, CorrectionTable, Drift};
use ftheta_physics::grid_map::{GridMap, Interpolation};

fn plane(z_mm: f64, n_nodes: usize, interpolation: Interpolation) -> CorrectionPlane {
    // Near the identity, with last digits that few decimals would lose.
    let value = |u: f64, v: f64| Some([u * 1.01 + v * v / 3.0, v * 0.99 - u * u / 7.0 + 1e-17]);
    let angles = GridMap::tabled(0.21 + 1e-16, interpolation, n_nodes, value).unwrap();
    CorrectionPlane { z_mm, angles }
}

fn table(drift: Drift) -> CorrectionTable {
    let about = About {
        machine: "my \"head\"\n, µ".into(),
        optics_id: "0123456789abcdef".into(),
        model: "physical".into(),
        n_rounds: 3,
    };
    let planes = vec![
        plane(-1.5, 3, Interpolation::Bilinear),
        plane(1.0 / 3.0, 5, Interpolation::CatmullRom),
    ];
    CorrectionTable::new(about, planes, drift).unwrap()
}

const DRIFT: Drift = Drift { gain: [1.000_012_3, 0.99999], offset_rad: [1e-5 / 3.0, -0.0] };

#[test]
fn tables_are_read_as_written_bit_for_bit() {
    for drift in [Drift::NONE, DRIFT] {
        let (table, text) = (table(drift), write(&table(drift)));
        let read = read(text.as_bytes()).unwrap();
        assert_eq!((&read, write(&read)), (&table, text));
        let bits = |table: &CorrectionTable| {
            let values = table.planes().iter().flat_map(|plane| plane.angles.nodes());
            values.flat_map(|(u, v, [x, y])| [u, v, x, y]).map(f64::to_bits).collect::<Vec<_>>()
        };
        assert_eq!(bits(&read), bits(&table));
    }
    let head: Vec<String> = write(&table(DRIFT)).lines().take(8).map(String::from).collect();
    expect![[r#"
        ftheta correction 1
        machine "my \"head\"\n, µ" "0123456789abcdef"
        model "physical"
        rounds 3
        drift gain 1.0000123 0.99999 offset_rad 3.3333333333333337e-6 -0.0
        planes 2
        plane z_mm -1.5 nodes 3 half_width_rad 0.2100000000000001 bilinear
        -0.19740000000000008 -0.2142000000000001"#]]
    .assert_eq(&head.join("\n"));
}

#[test]
fn every_damage_is_noticed() {
    let whole = write(&table(DRIFT)).into_bytes();
    for n_bytes in 0..whole.len() {
        assert!(read(&whole[..n_bytes]).is_err(), "cut to {n_bytes}");
        for bit in [0x01, 0x10, 0x80] {
            let mut flipped = whole.clone();
            flipped[n_bytes] ^= bit;
            assert!(read(&flipped).is_err(), "bit {bit} of {n_bytes}");
        }
    }
    let lines: Vec<&str> = str::from_utf8(&whole).unwrap().split_inclusive('\n').collect();
    for index in 0..lines.len() {
        let without: String =
            lines.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, l)| *l).collect();
        assert!(read(without.as_bytes()).is_err(), "without line {}", index + 1);
        let twice: String =
            lines.iter().enumerate().map(|(i, l)| l.repeat(1 + usize::from(i == index))).collect();
        assert!(read(twice.as_bytes()).is_err(), "line {} twice", index + 1);
    }
}

#[test]
fn the_line_at_fault_is_named() {
    let whole = write(&table(DRIFT));
    let error = |from: &str, to: &str| {
        let changed = whole.replacen(from, to, 1);
        assert_ne!(changed, whole, "{from}");
        read(changed.as_bytes()).unwrap_err().to_string()
    };
    let found = [
        error("correction 1", "correction 2"),
        error("\"0123456789abcdef\"", "0123"),
        error("rounds 3", "rounds -3"),
        error("drift gain", "drift gains"),
        error("offset_rad 3", "offset_rad NaN3"),
        error("planes 2", "planes 0"),
        error("planes 2", "planes 99999999999999999999"),
        error("nodes 3", "nodes 2"),
        error("nodes 3", "nodes 60000"),
        error("nodes 3", "nodes 4"),
        error("bilinear", "nearest"),
        error("half_width_rad 0.", "half_width_rad -0."),
        error("sha256 ", "sha256 00"),
        error("rounds 3", "rounds 4"),
        read(format!("{whole}more").as_bytes()).unwrap_err().to_string(),
        read(b"").unwrap_err().to_string(),
        read(b"ftheta correction 1\n\xff").unwrap_err().to_string(),
        read(whole.replace('\n', "\r\n").as_bytes()).unwrap_err().to_string(),
    ];
    expect![[r#"
        line 1: "ftheta correction 2" is not ftheta correction 1
        line 2: "machine \"my \\\"head\\\"\\n, µ\" 0123" is not machine "NAME" "ID"
        line 4: "rounds -3" is not rounds N
        line 5: "drift gains 1.0000123 0.99999 offset_rad 3.3333333333333337e" is not drift gain X Y offset_rad X Y
        line 5: "drift gain 1.0000123 0.99999 offset_rad NaN3.333333333333333" is not drift gain X Y offset_rad X Y
        line 6: "planes 0" is not planes N, N from 1 to 64
        line 6: "planes 99999999999999999999" is not planes N, N from 1 to 64
        line 7: "plane z_mm -1.5 nodes 2 half_width_rad 0.2100000000000001 bi" is not plane z_mm Z nodes N half_width_rad W and bilinear or catmull-rom, N from 3 to 1025, W above 0
        line 7: "plane z_mm -1.5 nodes 60000 half_width_rad 0.210000000000000" is not plane z_mm Z nodes N half_width_rad W and bilinear or catmull-rom, N from 3 to 1025, W above 0
        line 17: "plane z_mm 0.3333333333333333 nodes 5 half_width_rad 0.21000" is not two angles in rad
        line 7: "plane z_mm -1.5 nodes 3 half_width_rad 0.2100000000000001 ne" is not plane z_mm Z nodes N half_width_rad W and bilinear or catmull-rom, N from 3 to 1025, W above 0
        line 7: "plane z_mm -1.5 nodes 3 half_width_rad -0.2100000000000001 b" is not plane z_mm Z nodes N half_width_rad W and bilinear or catmull-rom, N from 3 to 1025, W above 0
        line 43: "sha256 005c2af76201fd2edd37db7749cbe9ba0a35d51a3abb08154f849" is not sha256 and 64 hexadecimal digits
        line 43: the checksum is not that of the lines above it: the file was changed
        line 44: "more" is not the end of the file
        line 1: the end of the file is not ftheta correction 1
        byte 20 is not text
        line 1: "ftheta correction 1\r" is not ftheta correction 1"#]].assert_eq(&found.join("\n"));
}

/// A file whose checksum is right and whose table folds over.
#[test]
fn tables_that_fold_over_are_refused() {
    use sha2::{Digest, Sha256};
    let whole = write(&table(Drift::NONE));
    let mut lines: Vec<&str> = whole.lines().collect();
    lines.pop();
    // Two nodes of the first plane change places.
    lines.swap(6, 7);
    let text = lines.join("\n") + "\n";
    let digest: String = Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect();
    let error = read(format!("{text}sha256 {digest}\n").as_bytes()).unwrap_err();
    assert!(matches!(error, CorrectionFileError::Table(_)), "{error}");
}
