//! Printed signs that tell which they are: AprilTags of the family 36h11.

/// Name of the family, as pattern files have it.
pub const FAMILY: &str = "tag36h11";
/// Cells along a tag's side, the black border among them. White of a cell's width has to be
/// around it.
pub const N_CELLS: usize = 8;
/// Cells along the side of what the code fills.
pub const N_DATA: usize = 6;
/// Least number of cells in which two tags differ, in any of four turns.
pub const N_DIFFERENT: u32 = 11;

/// The first tags of the family; `CODES[3]` is number 3.
///
/// The data row by row from the upper left, the most significant of 36 bits first, 1 is white.
/// Upright is as OpenCV draws them (`DICT_APRILTAG_36h11`), half a turn from AprilRobotics' own
/// table. Source: E. Olson 2011, AprilTag.
pub const CODES: [u64; 64] = [
    0x21a146bab,
    0x92d18fe9b,
    0x7089014bb,
    0x193979e27,
    0x44153d3d7,
    0x35cd5b8cf,
    0xa10ba56a0,
    0x2b874a608,
    0xb57fb8d44,
    0x4e20b5a64,
    0x61d897f2c,
    0xab3469ffc,
    0x594ca45c2,
    0xfa1c2d2e2,
    0x97c24b972,
    0x75928624a,
    0x1caafe99a,
    0x3236ddc16,
    0x884e527d6,
    0x5771a8c7e,
    0xf52925b81,
    0x2e59cc1a1,
    0x7fa58ab31,
    0xeb43384f9,
    0x3913d5345,
    0xd79b1a3b5,
    0x0dfbe768d,
    0x5cd7a031d,
    0xb9c8f7a4b,
    0x46987e06b,
    0x6e0c5d527,
    0x5bc567bb4,
    0x1e6302bc2,
    0x8ac7d046a,
    0xa65fe2326,
    0x5400eb616,
    0xf7a066836,
    0x2dd0afdf6,
    0x3b9cb60b1,
    0xad6a1caf9,
    0x93b62efb5,
    0xbb210d93d,
    0xdee55094b,
    0xa0cd1479b,
    0x2a23abb27,
    0x4f67f4b5f,
    0x58a815818,
    0x743427d64,
    0x1dec40874,
    0x892ab3a02,
    0x38d5742ee,
    0x0c43567a1,
    0x5db311cb1,
    0xc957ca1f9,
    0xa22457823,
    0x29ace98f3,
    0xccc52c528,
    0xda8b3578c,
    0xd5b4b9e36,
    0xac9cdd3ce,
    0xcbdaa8391,
    0x1986256b1,
    0xbae6cc889,
    0xdf91b10e5,
];

/// Which cells of a tag are white, row by row from the upper left, border included; `None` if
/// there is no such tag.
pub fn cells(number: usize) -> Option<[[bool; N_CELLS]; N_CELLS]> {
    let code = CODES.get(number)?;
    let mut cells = [[false; N_CELLS]; N_CELLS];
    for bit in 0..N_DATA * N_DATA {
        let is_white = code >> (N_DATA * N_DATA - 1 - bit) & 1 == 1;
        cells[1 + bit / N_DATA][1 + bit % N_DATA] = is_white;
    }
    Some(cells)
}

/// A code turned by a quarter, clockwise.
pub fn turned(code: u64) -> u64 {
    (0..N_DATA * N_DATA).fold(0, |turned, bit| {
        let (row, column) = (bit / N_DATA, bit % N_DATA);
        let from = (N_DATA - 1 - column) * N_DATA + row;
        turned << 1 | code >> (N_DATA * N_DATA - 1 - from) & 1
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_differ_in_every_turn() {
        for (number, &code) in CODES.iter().enumerate() {
            let mut turns = vec![code];
            for _ in 0..3 {
                turns.push(turned(turns[turns.len() - 1]));
            }
            assert_eq!(turned(turns[3]), code);
            let itself = turns[1..].iter().map(|turn| (turn ^ code).count_ones());
            assert!(itself.min() >= Some(N_DIFFERENT), "{number}");
            for &turn in &turns {
                let near = CODES[..number].iter().map(|other| (other ^ turn).count_ones());
                assert!(near.min().unwrap_or(36) >= N_DIFFERENT, "{number}");
            }
        }
    }

    /// Number 0 as OpenCV draws it.
    #[test]
    fn tag_0_is_opencvs() {
        let rows = cells(0).unwrap().map(|row| row.map(|white| if white { '#' } else { '.' }));
        let rows = rows.map(|row| row.iter().collect::<String>());
        assert_eq!(
            rows,
            [
                "........", "...#....", "..##.#..", "....#.#.", "....##..", ".#.###..", ".#.#.##.",
                "........"
            ]
        );
        assert!(cells(64).is_none());
    }
}
