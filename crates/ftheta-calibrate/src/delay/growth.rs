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
    /// All lines are as wide, so their ends grow alike.
    Alike,
    /// Slow lines are wider; growth of each speed's ends beyond the switching point.
    Modelled {
        /// 1/e² radius of the spot, mm.
        spot_radius_mm: f64,
        /// Growth in the order of the speeds, mm.
        growth_mm: Vec<f64>,
    },
    /// Widths differ, but not as the dose would have it.
    Unclear {
        /// Widest over narrowest.
        ratio: f64,
    },
}

/// Growth at the ends from the widths of lines.
pub fn growth(speeds: &[SpeedWidth]) -> Growth {
    let widths = || speeds.iter().map(|speed| speed.width_mm);
    let (least, most) = (widths().fold(f64::INFINITY, f64::min), widths().fold(0.0, f64::max));
    if speeds.len() < 3 || most < (1.0 + DIFFERENT) * least {
        return Growth::Alike;
    }
    // Power as the pattern says; or not, if that would be the same dose for all.
    let as_said = speeds.iter().map(|s| (s.power_ratio / s.speed_mm_s).ln());
    let constant = speeds.iter().map(|s| -s.speed_mm_s.ln());
    let fits = [as_said.collect::<Vec<_>>(), constant.collect()].map(|x| spot_radius(&x, speeds));
    let best = fits.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((spot_radius_mm, _)) = best else {
        return Growth::Unclear { ratio: most / least };
    };
    let growth_mm = speeds.iter().map(|speed| {
        let log_dose = 0.5 * (speed.width_mm / spot_radius_mm).powi(2);
        end_growth(spot_radius_mm, log_dose.clamp(LOG_DOSE[0], LOG_DOSE[1]).exp())
    });
    Growth::Modelled { spot_radius_mm, growth_mm: growth_mm.collect() }
}

/// How far an end reaches beyond the switching point on the centre line.
///
/// * `dose`: peak dose over threshold, above 1
pub fn end_growth(spot_radius_mm: f64, dose: f64) -> f64 {
    -spot_radius_mm * std::f64::consts::FRAC_1_SQRT_2 * inverse_erf(2.0 / dose - 1.0)
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

/// Inverse of the error function, by bisection: a dozen calls a picture.
fn inverse_erf(value: f64) -> f64 {
    let (mut low, mut high) = (-6.0, 6.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if libm::erf(middle) < value { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn widths_of_constant_power_give_the_spot() {
        let speeds: Vec<SpeedWidth> = [1.0, 2.0, 4.0, 6.0, 8.0, 10.0]
            .map(|v| {
                let width_mm = std::f64::consts::SQRT_2 * 0.05 * (15.0 / v as f64).ln().sqrt();
                SpeedWidth { speed_mm_s: v * 1e3, power_ratio: 1.0, width_mm }
            })
            .into();
        let Growth::Modelled { spot_radius_mm, growth_mm } = growth(&speeds) else { panic!() };
        assert!((spot_radius_mm - 0.05).abs() < 1e-9);
        assert!((growth_mm[5] - end_growth(0.05, 1.5)).abs() < 1e-9);
        let alike: Vec<_> = speeds.iter().map(|s| SpeedWidth { width_mm: 0.07, ..*s }).collect();
        assert_eq!(growth(&alike), Growth::Alike);
    }
}
