//! Delays from the gaps between fast lines and the slow sides of a rectangle.
//!
//! The patent measures from a side's outer edge to where the line seems to begin: that is too much
//! by half a side's width and too little by what the end grows, `(W/2 - b)/v` in all, and no number
//! of lines averages it away. Here it is measured from the middle of a side, and the growth comes
//! from the width of the lines and the spot. Source: optics.md D.2.

use super::error::DelayError;
use super::growth::{Growth, SpeedWidth, USUAL_WIDTH, seen_growth};
use super::layout::Layout;
use super::measured::Reject;
use super::regression::LineEnd;
use super::{Delays, Line, LineEndSeen, Method, Observed, SceneFacts, nominal};
use ftheta_model::picture::Picture;

/// What the growth is uncertain by, as a part of the width: with a spot from a data sheet, without,
/// and where the width cannot be seen for blur.
const GROWTH_SD: [f64; 2] = [0.03, 0.08];
const GROWTH_SD_UNSEEN: f64 = 0.2;
/// A width is seen from so many times the softness of edges on.
const SEEN_WIDTH: f64 = 2.7;
/// Largest dose over threshold that is reckoned with, as a logarithm.
const LOG_DOSE_MAX: f64 = 7.0;

/// Delays of a rectangle.
pub fn rectangle(
    picture: &Picture,
    layout: &Layout,
    speeds: &[f64],
    spot_radius_mm: Option<f64>,
) -> Result<Delays, DelayError> {
    if layout.columns_mm.len() < 2 {
        return Err(DelayError::NoSides { n_sides: layout.columns_mm.len() });
    }
    let (observed, ends) = free_ends(picture, layout, speeds)?;
    let widths = observed.widths_by_speed(layout, speeds);
    let Growing { spot_mm, width_mm, growth_mm, sd_mm: growth_sd_mm } =
        growing(&observed, &widths, spot_radius_mm);
    // How late each end is, and what the patent would say.
    let late = |on: bool, extra_mm: f64| {
        let outward = if on { -1.0 } else { 1.0 };
        let times = ends.iter().filter(|end| end.on == on);
        times
            .map(|end| (end.sense * end.off_mm - outward * extra_mm) / end.speed_mm_s)
            .collect::<Vec<f64>>()
    };
    let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
    let [on, off] = [true, false].map(|on| late(on, growth_mm));
    // The patent's gap reaches to the outer edge, so half a width more, and nothing for the growth.
    let patent_s = [true, false].map(|on| mean(&late(on, 0.5 * width_mm)));
    let speed = mean(speeds);
    let edge_sd_s = observed.facts.mm_per_px * 0.1 / speed / (0.5 * on.len().max(1) as f64).sqrt();
    let sd_s = (growth_sd_mm / speed).hypot(edge_sd_s);
    Ok(Delays {
        method: Method::Rectangle,
        tau_on_s: mean(&on),
        tau_off_s: mean(&off),
        sd_s: [sd_s, sd_s, edge_sd_s],
        acceleration_mm_s2: None,
        growth: Growth::Modelled {
            spot_radius_mm: spot_mm,
            clear: spot_radius_mm.is_some(),
            growth_mm: vec![growth_mm],
        },
        growth_mm: 0.0,
        rms_mm: 0.0,
        patent_s: Some(patent_s),
        lines: lines(&observed, layout, &ends),
        widths,
        scene: observed.facts,
    })
}

/// The pattern as it was found, and the ends of its lines: all of them, free of the sides.
fn free_ends(
    picture: &Picture,
    layout: &Layout,
    speeds: &[f64],
) -> Result<(Observed, Vec<LineEnd>), DelayError> {
    let n_ends = 2 * layout.rows.iter().filter(|row| row.process.is_some()).count();
    let observed = Observed::new(picture, layout).map_err(|error| match error {
        // Lines that touch a side are no strokes of their own.
        DelayError::LinesMissing { n_found, .. } if n_found > 0 => {
            DelayError::NoGap { n_free: 0, n_ends }
        }
        other => other,
    })?;
    let ends = observed.line_ends(layout, speeds);
    let n_free = ends.len();
    if n_free < n_ends {
        let all = observed.lines.iter().flat_map(|line| line.ends);
        let other = all.filter_map(Result::err).find(|&reject| reject != Reject::AtReference);
        let n_rejected = n_ends - n_free;
        return Err(match other.map(Reject::reason) {
            Some(reason) => DelayError::Rejected { n_rejected, n_ends, limit: 0, reason },
            None => DelayError::NoGap { n_free, n_ends },
        });
    }
    Ok((observed, ends))
}

fn lines(observed: &Observed, layout: &Layout, ends: &[LineEnd]) -> Vec<Line> {
    let lines = observed.lines.iter().enumerate().map(|(index, line)| {
        let row = &layout.rows[line.row];
        let of = |on: bool| {
            let end = ends.iter().find(|end| end.row == index && end.on == on);
            LineEndSeen {
                pixel: line.ends[usize::from(!on)].ok().map(|end| end.pixel),
                nominal: nominal(&observed.view, row, usize::from(!on)),
                off_mm: end.map(|end| end.sense * end.off_mm),
                left_mm: None,
                reject: None,
            }
        };
        Line {
            id: row.id.clone(),
            speed_mm_s: row.process.map_or(0.0, |process| process.speed_mm_s),
            forth: row.sense() > 0.0,
            ends: [of(true), of(false)],
        }
    });
    lines.collect()
}

/// How far ends grow, and how well that is known.
struct Growing {
    spot_mm: f64,
    width_mm: f64,
    growth_mm: f64,
    sd_mm: f64,
}

fn growing(observed: &Observed, widths: &[SpeedWidth], spot_radius_mm: Option<f64>) -> Growing {
    let width_mm =
        widths.iter().map(|width| width.width_mm).sum::<f64>() / widths.len().max(1) as f64;
    let SceneFacts { blur_px, mm_per_px, .. } = observed.facts;
    let seen = width_mm > SEEN_WIDTH * blur_px * mm_per_px;
    let (width_mm, sd) = match spot_radius_mm {
        // What looks wide is blur: the usual dose is the better guess.
        Some(spot_mm) if !seen => (USUAL_WIDTH * spot_mm, GROWTH_SD_UNSEEN),
        Some(_) => (width_mm, GROWTH_SD[0]),
        None if !seen => (width_mm.max(blur_px * mm_per_px), GROWTH_SD_UNSEEN),
        None => (width_mm, GROWTH_SD[1]),
    };
    let spot_mm = spot_radius_mm.unwrap_or(width_mm / USUAL_WIDTH);
    let log_dose = (0.5 * (width_mm / spot_mm).powi(2)).min(LOG_DOSE_MAX);
    let growth_mm = seen_growth(spot_mm, log_dose.exp(), &observed.look());
    Growing { spot_mm, width_mm, growth_mm, sd_mm: sd * width_mm }
}
