//! What programs have given, as numbers that can be kept and taken back.

use std::collections::BTreeMap;

/// Results by key: the kind of program in the first number, which of them in the others; numbers,
/// or `None` where a program has no solution.
pub type Solved = BTreeMap<[i32; 4], Option<Vec<f64>>>;

/// Raised when other numbers come out for the same keys and parameters.
pub const SOLVED_VERSION: u32 = 3;

/// Kind of the rays of fans: number of ticks, ray.
pub(crate) const RAY: i32 = 1;
/// Kind of the sides of corners: which end, speed, band.
pub(crate) const CORNER_SIDE: i32 = 2;

/// The results of a kind, with the rest of their keys.
pub(crate) fn of_kind(
    solved: &Solved,
    kind: i32,
) -> impl Iterator<Item = ([i32; 3], Option<&[f64]>)> {
    let range = [kind, i32::MIN, i32::MIN, i32::MIN]..=[kind, i32::MAX, i32::MAX, i32::MAX];
    solved.range(range).map(|(&[_, a, b, c], values)| ([a, b, c], values.as_deref()))
}
