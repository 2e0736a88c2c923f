//! Checks that the parts of a plan fit together, before anything is made of them.

use super::AuditError;
use ftheta_model::plan::{Motion, PlanDraft, Segment};
use ftheta_model::recipe::Interpolation;
use kurbo::Point;

/// Longest average that a track may ask for, ticks.
const SMOOTHING_TICKS_MAX: u32 = 1000;

/// Checks that indices exist, numbers are finite and segments join end to end from the centre.
pub fn check_structure(draft: &PlanDraft) -> Result<(), AuditError> {
    let malformed = |place: String, what: &str| AuditError::Malformed { place, what: what.into() };
    if draft.segments.is_empty() {
        return Err(malformed("the plan".into(), "no segments"));
    }
    check_numbers(draft)?;
    if let Some(index) = draft.marks.iter().position(|mark| mark.pen_index >= draft.pens.len()) {
        return Err(malformed(format!("mark {index}"), "its pen does not exist"));
    }
    // Where the motion before ends, while it is bound to a vertex; it starts at rest.
    let mut at = Some(Point::ZERO);
    for (index, segment) in draft.segments.iter().enumerate() {
        let place = || format!("segment {index}");
        if segment.n_ticks == 0 {
            return Err(malformed(place(), "no samples"));
        }
        if segment.mark_index.is_some_and(|mark| mark as usize >= draft.marks.len()) {
            return Err(malformed(place(), "its mark does not exist"));
        }
        check_segment(draft, segment).map_err(|what| malformed(place(), what))?;
        let ends = segment.motion.ends();
        let follows_on = match (&segment.motion, ends, at) {
            (Motion::Hold { .. } | Motion::Travel { .. }, Some((first, _)), Some(at)) => {
                draft.vertices[first] == at
            }
            // What a drive leads to is seen when the axes are driven.
            (Motion::Hold { .. } | Motion::Track { .. }, ..) => true,
            (Motion::Travel { .. }, ..) => false,
            (Motion::Drive { .. }, ..) => {
                index > 0 && !matches!(draft.segments[index - 1].motion, Motion::Travel { .. })
            }
        };
        if !follows_on {
            return Err(malformed(place(), "it does not start where the one before ends"));
        }
        at = match segment.motion {
            Motion::Drive { .. } | Motion::Track { .. } => None,
            _ => ends.map(|(_, last)| draft.vertices[last]),
        };
    }
    Ok(())
}

fn check_numbers(draft: &PlanDraft) -> Result<(), AuditError> {
    let malformed = |kind: &str, index: usize| {
        let what = "a number is not finite".into();
        Err(AuditError::Malformed { place: format!("{kind} {index}"), what })
    };
    if let Some(index) = draft.vertices.iter().position(|vertex| !vertex.is_finite()) {
        return malformed("vertex", index);
    }
    let finite = |s: &ftheta_model::plan::Station| {
        let directions = [s.arriving, s.leaving];
        s.distance_mm.is_finite() && directions.iter().all(|d| (d.hypot() - 1.0).abs() < 1e-6)
    };
    if let Some(index) = draft.stations.iter().position(|station| !finite(station)) {
        return malformed("station", index);
    }
    let numbers =
        |knot: &ftheta_model::plan::Knot| [knot.time_s, knot.distance_mm, knot.speed_mm_s];
    if let Some(index) =
        draft.knots.iter().position(|knot| numbers(knot).iter().any(|value| !value.is_finite()))
    {
        return malformed("knot", index);
    }
    let driven = |pair: &[f32; 2]| pair.iter().all(|value| value.is_finite());
    match draft.drives.iter().position(|pair| !driven(pair)) {
        Some(index) => malformed("drive", index),
        None => Ok(()),
    }
}

fn check_segment(draft: &PlanDraft, segment: &Segment) -> Result<(), &'static str> {
    let motion = &segment.motion;
    if motion.ends().is_some_and(|(_, last)| last >= draft.vertices.len()) {
        return Err("its vertices do not exist");
    }
    match *motion {
        Motion::Hold { .. } => Ok(()),
        Motion::Travel { .. } => check_profile(draft, motion),
        Motion::Track { .. } => check_track(draft, motion),
        Motion::Drive { first } => {
            let end = u64::from(first) + u64::from(segment.n_ticks);
            if end > draft.drives.len() as u64 {
                return Err("its drives do not exist");
            }
            Ok(())
        }
    }
}

/// Checks a travel's speed profile against its vertices: `render` trusts the length.
fn check_profile(draft: &PlanDraft, motion: &Motion) -> Result<(), &'static str> {
    let (&Motion::Travel { n_vertices, profile, interpolation, .. }, Some((first, last))) =
        (motion, motion.ends())
    else {
        return Ok(());
    };
    let positive = |value: f64| value > 0.0;
    if n_vertices < 2
        || !(profile.length_mm.is_finite() && profile.speed_mm_s.is_finite())
        || !(positive(profile.length_mm) && positive(profile.speed_mm_s))
        || !(positive(profile.acceleration_mm_s2) && positive(profile.deceleration_mm_s2))
    {
        return Err("its speed profile is impossible");
    }
    if interpolation == Interpolation::Dda && n_vertices != 2 {
        return Err("a DDA takes one vector at a time");
    }
    let vertices = &draft.vertices[first..=last];
    let length_mm: f64 = vertices.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    if (length_mm - profile.length_mm).abs() > 1e-9 * (1.0 + length_mm) {
        return Err("its profile is not as long as its vertices");
    }
    Ok(())
}

/// Checks that a track's legs have a length and its speed profile is one.
fn check_track(draft: &PlanDraft, motion: &Motion) -> Result<(), &'static str> {
    let (
        &Motion::Track { n_vertices, first_station, first_knot, n_knots, smoothing_ticks, .. },
        Some((first, last)),
    ) = (motion, motion.ends())
    else {
        return Ok(());
    };
    if n_vertices < 2 || n_knots == 0 {
        return Err("it has no path or no speed");
    }
    if !(1..=SMOOTHING_TICKS_MAX).contains(&smoothing_ticks) {
        return Err("it is averaged over an impossible number of ticks");
    }
    let knots_end = u64::from(first_knot) + u64::from(n_knots);
    if knots_end > draft.knots.len() as u64 {
        return Err("its knots do not exist");
    }
    let vertices = &draft.vertices[first..=last];
    match first_station {
        None => {
            if vertices.windows(2).any(|pair| pair[0] == pair[1]) {
                return Err("a leg of it has no length");
            }
        }
        Some(station) => {
            let start = station as usize;
            let Some(stations) = draft.stations.get(start..start + vertices.len()) else {
                return Err("its stations do not exist");
            };
            let longer = |(pair, ends): (&[ftheta_model::plan::Station], &[Point])| {
                let length_mm = pair[1].distance_mm - pair[0].distance_mm;
                // No curve is shorter than its chord.
                length_mm > 0.0 && length_mm > ends[0].distance(ends[1]) * (1.0 - 1e-9)
            };
            if !stations.windows(2).zip(vertices.windows(2)).all(longer) {
                return Err("a leg of it is shorter than its chord");
            }
        }
    }
    let knots = &draft.knots[first_knot as usize..knots_end as usize];
    let continuous = |pair: &[ftheta_model::plan::Knot]| {
        let duration_s = pair[1].time_s - pair[0].time_s;
        let mean_mm_s = 0.5 * (pair[0].speed_mm_s + pair[1].speed_mm_s);
        let gap_mm = pair[1].distance_mm - pair[0].distance_mm - mean_mm_s * duration_s;
        duration_s >= 0.0 && gap_mm.abs() <= 1e-9 * (1.0 + pair[1].distance_mm.abs())
    };
    if !knots.windows(2).all(continuous) || knots.iter().any(|knot| knot.speed_mm_s < 0.0) {
        return Err("its speed profile has a gap");
    }
    Ok(())
}
