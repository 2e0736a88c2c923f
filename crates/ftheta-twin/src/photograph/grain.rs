//! Unevenness of a surface: a fixed value for every place, from a seed.

use kurbo::Point;

/// Smooth noise from -1 to 1 with features of this size.
pub(super) fn grain(place: Point, size_mm: f64, seed: u64) -> f64 {
    let (u, v) = (place.x / size_mm, place.y / size_mm);
    let (u0, v0) = (u.floor(), v.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (a, b) = (smooth(u - u0), smooth(v - v0));
    let at = |i: i64, j: i64| knot(u0 as i64 + i, v0 as i64 + j, seed);
    let row = |j: i64| at(0, j) + a * (at(1, j) - at(0, j));
    row(0) + b * (row(1) - row(0))
}

/// A value from -1 to 1 for every pair of numbers. Source: the finaliser of SplitMix64.
fn knot(i: i64, j: i64, seed: u64) -> f64 {
    let mut mixed = seed ^ (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed ^= (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(31);
    mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    2.0 * ((mixed ^ mixed >> 31) >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}
