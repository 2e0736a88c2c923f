//! How far a burned line reaches beyond where light was switched, from how wide lines are.
//!
//! A line burns where the dose of a Gaussian spot exceeds a threshold. With w the 1/e² radius and D
//! the peak dose over the threshold a line is `√2 w √(ln D)` wide, and its end lies
//! `-(w/√2) erfinv(2/D - 1)` beyond the switching point. Source: optics.md D.2.

/// The slope of squared widths over the logarithm of the dose has to be so many deviations.
const SIGNIFICANT: f64 = 5.0;
/// Widths have to differ by this part.
const DIFFERENT: f64 = 0.06;
/// Part of the squared widths' variance that the dose has to explain.
const EXPLAINED: f64 = 0.9;
/// Doses that a line can have, as a logarithm: from where it just shows.
const LOG_DOSE: [f64; 2] = [0.02, 7.0];
/// Width by the spot's radius at a dose of three times the threshold.
pub const USUAL_WIDTH: f64 = 1.482_3;
/// Rows of a tip that are reckoned with.
const N_TIP: usize = 48;
/// Rows that a profile along a line is made of: distance from the middle by half a width, weight.
pub const ROW_WEIGHTS: [(f64, f64); 5] =
    [(-1.0, 0.135), (-0.5, 0.607), (0.0, 1.0), (0.5, 0.607), (1.0, 0.135)];

/// Lines of one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedWidth {
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Power over the pattern's.
    pub power_ratio: f64,
    /// Width of the lines, mm.
    pub width_mm: f64,
}

/// How the dose follows the speed.
#[derive(Clone, Debug, PartialEq)]
pub enum Growth {
    /// Nothing is known of the widths, so the ends are taken to grow alike.
    Alike,
    /// Growth of each speed's ends beyond the switching point, from its lines' width.
    Modelled {
        /// 1/e² radius of the spot, mm.
        spot_radius_mm: f64,
        /// Whether the widths show it; if not, a dose of three times the threshold gives it, and
        /// only differences of the growth mean something.
        clear: bool,
        /// Growth in the order of the speeds, mm.
        growth_mm: Vec<f64>,
    },
}

/// How ends are looked at: a picture shows less growth than there is on the centre line, since tips
/// are round and rows are averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Standard deviation of the picture's blur, mm.
    pub blur_mm: f64,
    /// How far from the middle of a line rows are averaged, mm.
    pub rows_mm: f64,
}

/// Growth at the ends from the widths of lines.
///
/// Where the widths follow the dose they give the spot. Where they differ a little without rule the
/// spot need not be known: growth changes by 0.6 to 0.8 of what the width does for any.
///
/// * `least_mm`: differences of widths below it are noise
pub fn growth(speeds: &[SpeedWidth], least_mm: f64, look: &Look) -> Growth {
    let widths = || speeds.iter().map(|speed| speed.width_mm);
    let (least, most) = (widths().fold(f64::INFINITY, f64::min), widths().fold(0.0, f64::max));
    if speeds.is_empty() || least <= 0.0 || most - least < least_mm {
        return Growth::Alike;
    }
    let usual = widths().sum::<f64>() / speeds.len() as f64 / USUAL_WIDTH;
    let clear = (speeds.len() >= 3 && most > (1.0 + DIFFERENT) * least).then(|| by_dose(speeds));
    let clear = clear.flatten();
    let spot_radius_mm = clear.unwrap_or(usual);
    let growth_mm = speeds.iter().map(|speed| {
        let log_dose = 0.5 * (speed.width_mm / spot_radius_mm).powi(2);
        let dose = log_dose.clamp(LOG_DOSE[0], LOG_DOSE[1]).exp();
        seen_growth(spot_radius_mm, dose, look)
    });
    let growth_mm = growth_mm.collect();
    Growth::Modelled { spot_radius_mm, clear: clear.is_some(), growth_mm }
}

/// The spot's radius where widths follow the dose, mm.
fn by_dose(speeds: &[SpeedWidth]) -> Option<f64> {
    // Power as the pattern says; or not, if that would be the same dose for all.
    let as_said = speeds.iter().map(|s| (s.power_ratio / s.speed_mm_s).ln());
    let constant = speeds.iter().map(|s| -s.speed_mm_s.ln());
    let fits = [as_said.collect::<Vec<_>>(), constant.collect()].map(|x| spot_radius(&x, speeds));
    let best = fits.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(spot_radius_mm, _)| spot_radius_mm)
}

/// How far an end reaches beyond the switching point on the centre line.
///
/// * `dose`: peak dose over threshold, above 1
pub fn end_growth(spot_radius_mm: f64, dose: f64) -> f64 {
    -spot_radius_mm * std::f64::consts::FRAC_1_SQRT_2 * inverse_erf(2.0 / dose - 1.0)
}

/// How far an end reaches beyond the switching point as a picture shows it: where the mean of the
/// rows is halfway between line and ground.
pub fn seen_growth(spot_radius_mm: f64, dose: f64, look: &Look) -> f64 {
    let w = spot_radius_mm;
    let half_mm = w * (0.5 * dose.ln()).sqrt();
    let blur_mm = look.blur_mm.max(1e-3 * w);
    // The tip row by row: where it begins, and how much the row counts.
    let rows: Vec<(f64, f64)> = (0..N_TIP)
        .map(|index| {
            let y = half_mm * ((2 * index + 1) as f64 / N_TIP as f64 - 1.0);
            let fall = (-2.0 * (y / w).powi(2)).exp();
            let share = (2.0 / (dose * fall) - 1.0).min(1.0);
            let reach = -w * std::f64::consts::FRAC_1_SQRT_2 * inverse_erf(share);
            let weight = ROW_WEIGHTS.iter().map(|(off, weight)| {
                let away = (y - off * look.rows_mm) / blur_mm;
                weight * (-0.5 * away * away).exp()
            });
            (reach, weight.sum())
        })
        .collect();
    let total: f64 = rows.iter().map(|row| row.1).sum();
    let lit = |t: f64| {
        let row = |(reach, weight): &(f64, f64)| {
            weight * 0.5 * (1.0 + libm::erf((reach - t) / (blur_mm * std::f64::consts::SQRT_2)))
        };
        rows.iter().map(row).sum::<f64>()
    };
    let reach_mm = 3.0 * w + 5.0 * blur_mm;
    bisect(-reach_mm, reach_mm, |t| lit(t) > 0.5 * total)
}

/// Radius of the spot and how much of the widths it explains; `None` if it explains too little.
fn spot_radius(log_dose: &[f64], speeds: &[SpeedWidth]) -> Option<(f64, f64)> {
    let n = speeds.len() as f64;
    let squares: Vec<f64> = speeds.iter().map(|speed| speed.width_mm.powi(2)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let (x_mean, y_mean) = (mean(log_dose), mean(&squares));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in log_dose.iter().zip(&squares) {
        let (x, y) = (x - x_mean, y - y_mean);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    if xx < 1e-6 || xy <= 0.0 {
        return None;
    }
    let explained = xy * xy / (xx * yy);
    let left = (yy * (1.0 - explained) / (n - 2.0)).max(0.0);
    let clear = xy / xx > SIGNIFICANT * (left / xx).sqrt();
    (clear && explained > EXPLAINED).then(|| ((0.5 * xy / xx).sqrt(), explained))
}

/// Inverse of the error function.
fn inverse_erf(value: f64) -> f64 {
    bisect(-6.0, 6.0, |t| libm::erf(t) < value)
}

/// Where something that holds below ceases to hold; some hundred calls a picture.
fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Look = Look { blur_mm: 0.02, rows_mm: 0.025 };

    #[test]
    fn growth_is_that_of_the_reference() {
        // reference/optics.json, sync.end_growth.
        let known = [
            (1.5, -0.010_768_182_48),
            (2.0, 0.0),
            (3.0, 0.010_768_182_48),
            (5.0, 0.021_040_530_84),
            (10.0, 0.032_038_789_14),
        ];
        for (dose, growth_mm) in known {
            assert!((end_growth(0.05, dose) - growth_mm).abs() < 1e-9, "{dose}");
        }
    }

    #[test]
    fn a_sharp_look_at_the_centre_line_shows_all_of_the_growth() {
        let look = Look { blur_mm: 1e-4, rows_mm: 0.0 };
        let seen = seen_growth(0.05, 3.0, &look);
        assert!((seen - end_growth(0.05, 3.0)).abs() < 2e-4, "{seen}");
        // optics.md, d_sync4: 0.8 to 4.8 µm instead of 10.8 at 20 µm/px and a blur of 1 px.
        let seen = seen_growth(0.05, 3.0, &LOOK);
        assert!((0.0..0.006).contains(&seen), "{seen}");
    }

    #[test]
    fn widths_of_constant_power_give_the_spot() {
        let speeds: Vec<SpeedWidth> = [1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
            .map(|v| {
                let width_mm = std::f64::consts::SQRT_2 * 0.05 * (15.0_f64 / v).ln().sqrt();
                SpeedWidth { speed_mm_s: v * 1e3, power_ratio: 1.0, width_mm }
            })
            .into();
        let Growth::Modelled { spot_radius_mm, clear, growth_mm } = growth(&speeds, 0.0, &LOOK)
        else {
            panic!()
        };
        assert!(clear && (spot_radius_mm - 0.05).abs() < 1e-9);
        assert!((growth_mm[5] - seen_growth(0.05, 1.5, &LOOK)).abs() < 1e-9);
        let alike: Vec<_> = speeds.iter().map(|s| SpeedWidth { width_mm: 0.07, ..*s }).collect();
        let Growth::Modelled { clear, growth_mm, .. } = growth(&alike, 0.0, &LOOK) else {
            panic!()
        };
        assert!(!clear && growth_mm.iter().all(|growth| *growth == growth_mm[0]));
        assert_eq!(growth(&alike, 1e-6, &LOOK), Growth::Alike);
    }
}
