//! Outlines of mirrors as widths at stations along the shaft.

use super::Station;

/// Stations of an ellipse; between them its outline is straight, 0.3 % of its area less.
const N_ELLIPSE: u32 = 20;

/// A rectangle.
pub fn rectangle(width_m: f64, height_m: f64) -> Vec<Station> {
    [0.0, height_m].map(|along_m| Station { along_m, width_m }).to_vec()
}

/// A rectangle whose four corners are cut off at 45°, `corner_m` from either side.
///
/// The corner must be less than half of width and height; others give stations that
/// `Mechanism::check` refuses.
pub fn octagon(width_m: f64, height_m: f64, corner_m: f64) -> Vec<Station> {
    let cut_m = width_m - 2.0 * corner_m;
    [(0.0, cut_m), (corner_m, width_m), (height_m - corner_m, width_m), (height_m, cut_m)]
        .map(|(along_m, width_m)| Station { along_m, width_m })
        .to_vec()
}

/// An ellipse whose ends are cut straight where it is `foot_m` wide; the height is that of what is
/// left.
///
/// The foot must be narrower than the width; others give stations that are refused.
pub fn ellipse(width_m: f64, height_m: f64, foot_m: f64) -> Vec<Station> {
    // Angles from the cut to the cut, evenly, so that the ends have more stations.
    let first = (foot_m / width_m).asin();
    let span = std::f64::consts::PI - 2.0 * first;
    (0..=N_ELLIPSE)
        .map(|i| {
            let angle = first + span * f64::from(i) / f64::from(N_ELLIPSE);
            let along_m = 0.5 * height_m * (1.0 - angle.cos() / first.cos());
            // Rounding must not put the foot beside 0.
            Station { along_m: if i == 0 { 0.0 } else { along_m }, width_m: width_m * angle.sin() }
        })
        .collect()
}
