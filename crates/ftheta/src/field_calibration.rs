//! From measured points to a calibrated field: what the mirrors were told round by round, the fit,
//! the table, and what to do next.

use crate::Error;
use crate::field::corrected;
use crate::field_picture::FieldPicture;
use ftheta_calibrate::accuracy::{Spread, distance_mm};
use ftheta_calibrate::calibrate::{CalibrateOptions, Calibration, Model, calibrate};
use ftheta_calibrate::error::CalibrateError;
use ftheta_calibrate::mark::Mark;
use ftheta_calibrate::table::Grid;
use ftheta_model::calibration::MeasuredPoint;
use ftheta_model::machine::Machine;
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_model::warning::Warning;
use ftheta_physics::correction::{About, CorrectionPlane, CorrectionTable, Drift};
use ftheta_physics::optics::{angles_from_field, scale_mm_per_rad};
use ftheta_report::calibration_report::{
    AxesFound, CalibrationReportInput, ErrorMap, ErrorSummary, ReportParameter, ReportPoint,
    calibration_report_html,
};
use std::collections::BTreeSet;

/// What a round of marks went through on its way to the mirrors.
#[derive(Clone, Debug)]
pub enum MarkedThrough {
    /// The machine's nominal optics.
    Nominal,
    /// Nothing: the angle is the place divided by twice the focal length.
    Linear,
    /// A correction table.
    Table(Box<CorrectionTable>),
}

/// How to calibrate.
#[derive(Clone, Debug, Default)]
pub struct FieldOptions {
    /// Model and noise.
    pub calibrate: CalibrateOptions,
    /// The table's grid.
    pub grid: Grid,
    /// What the rounds were marked through, from the first on. A later round that is not listed was
    /// marked through the table that the rounds before it give.
    pub marked_through: Vec<MarkedThrough>,
}

/// A calibrated field.
pub struct FieldCalibration {
    /// What was found.
    pub calibration: Calibration,
    /// The correction.
    pub table: CorrectionTable,
    /// The marks, in the order of the points.
    pub marks: Vec<Mark>,
    /// What to do next, the most useful first.
    pub advice: Vec<String>,
}

/// Grids of more marks that are thought of, marks along a side.
const FORECASTS: [usize; 3] = [5, 9, 17];
/// A forecast below this part of what is expected now is worth telling.
const WORTH: f64 = 0.8;
/// Fewest marks of a drift.
const N_DRIFT: usize = 4;
/// They spread at least this much along each axis, mechanical rad rms.
const DRIFT_SPREAD_RAD: f64 = 0.005;
/// Rows named in a sentence.
const N_ROWS_NAMED: usize = 8;

/// Calibrates a machine's field from measured points.
///
/// # Errors
/// If a target is out of the optics' reach, or the points give no calibration or no table.
pub fn calibrate_field(
    machine: &Machine,
    points: &[MeasuredPoint],
    options: &FieldOptions,
) -> Result<FieldCalibration, Error> {
    let rounds: BTreeSet<u32> = points.iter().map(|point| point.round).collect();
    let mut marks: Vec<Option<Mark>> = vec![None; points.len()];
    for (index, &round) in rounds.iter().enumerate() {
        let before: Vec<Mark> = marks.iter().flatten().copied().collect();
        let through = match options.marked_through.get(index) {
            Some(through) => through.clone(),
            None if index == 0 => MarkedThrough::Nominal,
            None => {
                let earlier = calibrate(&machine.optics, &before, &options.calibrate)?;
                MarkedThrough::Table(Box::new(earlier.table(machine, options.grid)?))
            }
        };
        for (slot, point) in marks.iter_mut().zip(points).filter(|(_, p)| p.round == round) {
            *slot = Some(mark(point, command(machine, &through, point)?));
        }
    }
    let marks: Vec<Mark> = marks.into_iter().flatten().collect();
    let calibration = calibrate(&machine.optics, &marks, &options.calibrate)?;
    let table = calibration.table(machine, options.grid)?;
    Ok(finished(machine, calibration, table, marks))
}

/// Calibrates the field at another height, and makes its plane one of a table's.
///
/// * `options`: rounds that are not listed were marked through nominal optics at height 0
/// * `z_mm`: height of the plane of the marks, from the nominal work plane towards the head
/// * `onto`: the table; a plane of the same height is replaced
///
/// # Errors
/// As [`calibrate_field`], or if there is no room for the plane or the table has a drift.
pub fn calibrate_plane(
    machine: &Machine,
    points: &[MeasuredPoint],
    options: &FieldOptions,
    (z_mm, onto): (f64, &CorrectionTable),
) -> Result<FieldCalibration, Error> {
    if onto.drift() != Drift::NONE {
        return Err(CalibrateError::Drifted.into());
    }
    let optics = machine.optics.at_height(z_mm).ok_or(CalibrateError::Room { z_mm })?;
    let there = Machine { optics, ..machine.clone() };
    let rounds: BTreeSet<u32> = points.iter().map(|point| point.round).collect();
    let mut marks = Vec::with_capacity(points.len());
    for point in points {
        let index = rounds.iter().take_while(|round| **round < point.round).count();
        let through = options.marked_through.get(index).unwrap_or(&MarkedThrough::Nominal);
        marks.push(mark(point, command(machine, through, point)?));
    }
    let calibration = calibrate(&there.optics, &marks, &options.calibrate)?;
    let own = calibration.table(&there, options.grid)?;
    let mut planes: Vec<_> =
        onto.planes().iter().filter(|plane| plane.z_mm != z_mm).cloned().collect();
    planes.extend(own.planes().iter().map(|plane| CorrectionPlane { z_mm, ..plane.clone() }));
    planes.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm));
    let n_rounds = onto.about().n_rounds.max(calibration.n_rounds);
    let about = About::of(machine, calibration.model.name(), n_rounds);
    let table = CorrectionTable::new(about, planes, Drift::NONE).map_err(CalibrateError::from)?;
    Ok(finished(machine, calibration, table, marks))
}

/// A measured point with what the mirrors were told.
fn mark(point: &MeasuredPoint, command: MirrorAngles) -> Mark {
    let MeasuredPoint { target_mm: target, measured_mm: measured, round, line } = *point;
    Mark { target, command, measured, round, line }
}

fn finished(
    machine: &Machine,
    mut calibration: Calibration,
    table: CorrectionTable,
    marks: Vec<Mark>,
) -> FieldCalibration {
    if let Err(error) = table.check_limits(&machine.scanner, &machine.optics) {
        let message = format!("this table will be refused for marking: {error}");
        calibration.warnings.push(Warning::new("table", message));
    }
    let advice = advice(&calibration, &marks);
    FieldCalibration { calibration, table, marks, advice }
}

/// How far marks were off before and after a correction of drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftFound {
    /// Distances of the marks from their targets.
    pub before: Spread,
    /// What gain and offset leave of them.
    pub after: Spread,
}

/// Follows what has moved since a table was made, from marks made through it.
///
/// # Errors
/// If the marks are too few or on a line, out of the table, or the corrected table asks too much.
pub fn calibrate_drift(
    machine: &Machine,
    table: CorrectionTable,
    points: &[MeasuredPoint],
) -> Result<(CorrectionTable, DriftFound), Error> {
    let commands = |table: &CorrectionTable, points: &[MeasuredPoint]| {
        let through = MarkedThrough::Table(Box::new(table.clone()));
        points.iter().map(|point| command(machine, &through, point)).collect::<Result<Vec<_>, _>>()
    };
    let sent = commands(&table, points)?;
    // Had the head not moved, these commands would have made the marks where they were found.
    let seen: Vec<_> = points
        .iter()
        .map(|point| MeasuredPoint { target_mm: point.measured_mm, ..*point })
        .collect();
    let there = commands(&table, &seen)?;
    let moved = table.clone().with_drift(fit_drift(table.drift(), &sent, &there)?);
    moved.check_limits(&machine.scanner, &machine.optics).map_err(CalibrateError::from)?;
    let off = |point: &MeasuredPoint| distance_mm(point.measured_mm, point.target_mm);
    let before = Spread::of(points.iter().map(off));
    // What the new table changes, in the field, is added to where the marks were found.
    let scale = scale_mm_per_rad(&machine.optics);
    let changed = there.iter().zip(commands(&moved, &seen)?);
    let after = Spread::of(points.iter().zip(changed).map(|(point, (old, new))| {
        let FieldPoint { x_mm, y_mm } = point.measured_mm;
        let there = FieldPoint::new(
            x_mm + scale * (new.x_rad - old.x_rad),
            y_mm + scale * (new.y_rad - old.y_rad),
        );
        distance_mm(there, point.target_mm)
    }));
    Ok((moved, DriftFound { before, after }))
}

/// Gain and offset of each axis that make up for what moved, on top of those there are.
///
/// * `sent`: what made the marks
/// * `there`: what the places at which they were found would have asked for
fn fit_drift(
    drift: Drift,
    sent: &[MirrorAngles],
    there: &[MirrorAngles],
) -> Result<Drift, CalibrateError> {
    let n_marks = sent.len();
    if n_marks < N_DRIFT {
        return Err(CalibrateError::TooFew { n_marks, model: "drift", limit: N_DRIFT });
    }
    let n = n_marks as f64;
    let mut moved = drift;
    let of_axis: [fn(&MirrorAngles) -> f64; 2] = [|angles| angles.x_rad, |angles| angles.y_rad];
    for (axis, of_axis) in of_axis.into_iter().enumerate() {
        let mean = |all: &[MirrorAngles]| all.iter().map(of_axis).sum::<f64>() / n;
        let (sent_mean, there_mean) = (mean(sent), mean(there));
        let (mut by_sent, mut by_there) = (0.0, 0.0);
        for (sent, there) in sent.iter().zip(there) {
            let off = of_axis(there) - there_mean;
            by_sent += off * (of_axis(sent) - sent_mean);
            by_there += off * off;
        }
        let spread_rad = (by_there / n).sqrt();
        if spread_rad < DRIFT_SPREAD_RAD {
            return Err(CalibrateError::Narrow { spread_rad, limit_rad: DRIFT_SPREAD_RAD });
        }
        // The head answers `there` to `sent`, so `there` needs gain · there + offset.
        let gain = by_sent / by_there;
        moved.gain[axis] = gain * drift.gain[axis];
        moved.offset_rad[axis] = gain * drift.offset_rad[axis] + (sent_mean - gain * there_mean);
    }
    Ok(moved)
}

/// What the mirrors were told for a point.
fn command(
    machine: &Machine,
    through: &MarkedThrough,
    point: &MeasuredPoint,
) -> Result<MirrorAngles, Error> {
    let FieldPoint { x_mm, y_mm } = point.target_mm;
    let line = point.line;
    let unreached = || CalibrateError::Target { line, x_mm, y_mm };
    let nominal = || angles_from_field(&machine.optics, point.target_mm).ok_or_else(unreached);
    match through {
        MarkedThrough::Nominal => Ok(nominal()?),
        MarkedThrough::Linear => {
            let scale = scale_mm_per_rad(&machine.optics);
            Ok(MirrorAngles::new(x_mm / scale, y_mm / scale))
        }
        MarkedThrough::Table(table) => {
            Ok(corrected(table, nominal()?, 0.0).map_err(|_| unreached())?)
        }
    }
}

fn advice(calibration: &Calibration, marks: &[Mark]) -> Vec<String> {
    let mut advice = Vec::new();
    let expected_um = calibration.expected.rms_mm * 1e3;
    if !calibration.outliers.is_empty() {
        let lines: Vec<_> = calibration.outliers.iter().map(|&index| marks[index].line).collect();
        let named: Vec<_> = lines.iter().take(N_ROWS_NAMED).map(ToString::to_string).collect();
        let more = if lines.len() > N_ROWS_NAMED { " and more" } else { "" };
        advice.push(format!(
            "Measure the mark(s) of line {}{more} again: they do not fit the others and were left \
             out",
            named.join(", ")
        ));
    }
    if calibration.axes.turned() {
        advice.push(
            "Check that the sheet lay the right way; if it did, the table turns the axes back"
                .into(),
        );
    }
    if calibration.model != Model::Physical && marks.len() >= 9 {
        advice
            .push("Leave out --model: the physical model is the better one for most heads".into());
    }
    let now_mm = calibration.expected.rms_mm;
    for n_side in FORECASTS.into_iter().filter(|n_side| n_side * n_side >= marks.len()) {
        let n_marks = n_side * n_side;
        let forecast = calibration.forecast_mm(n_side).filter(|&mm| mm < WORTH * now_mm);
        if let Some(forecast_mm) = forecast {
            advice.push(format!(
                "Marking and measuring {n_marks} marks as well as these would bring the expected \
                 error from {expected_um:.1} to about {:.1} µm rms",
                forecast_mm * 1e3
            ));
        }
    }
    advice.push(format!(
        "Mark the pattern again through the new table and measure it as round {}: that checks the \
         table, and both rounds together give a better one",
        calibration.n_rounds + 1
    ));
    advice
}

impl FieldCalibration {
    /// The page that shows it.
    ///
    /// * `pictures`: those that points were measured in
    pub fn report(&self, machine: &str, pictures: &[FieldPicture]) -> String {
        let calibration = &self.calibration;
        let um =
            |spread: Spread| ErrorSummary { rms: spread.rms_mm * 1e3, max: spread.max_mm * 1e3 };
        let points: Vec<_> = self.marks.iter().enumerate().map(|(i, m)| self.point(i, m)).collect();
        let map = &calibration.expected_map;
        let errors_um: Vec<f64> = map.errors_mm.iter().map(|error| error * 1e3).collect();
        // Cells lie around the places, so the outermost reach half a cell further.
        let half_width_mm = map.half_mm * map.n_places as f64 / (map.n_places - 1) as f64;
        let physical = calibration.parameters.iter().map(|estimate| ReportParameter {
            name: estimate.name.replace('_', " "),
            value: estimate.value,
            sigma: Some(estimate.sigma),
            unit: estimate.unit.into(),
        });
        let coefficients = calibration.coefficients.iter().map(|(name, value)| ReportParameter {
            name: name.replace('_', " "),
            value: *value,
            sigma: None,
            unit: "mm".into(),
        });
        let parameters: Vec<_> = match calibration.model {
            Model::Physical => physical.collect(),
            _ => coefficients.collect(),
        };
        let axes = &calibration.axes;
        let parts: Vec<_> = pictures
            .iter()
            .filter_map(|picture| Some((picture.part()?, picture.sights())))
            .collect();
        let views: Vec<_> = parts.iter().map(|(part, sights)| part.view(sights)).collect();
        calibration_report_html(&CalibrationReportInput {
            machine,
            model: calibration.model.name(),
            why: &calibration.why,
            points: &points,
            before_um: um(calibration.before),
            after_um: um(calibration.after),
            expected_um: um(calibration.expected),
            expected_map: ErrorMap { half_width_mm, errors_um: &errors_um },
            axes: AxesFound {
                swapped: axes.swapped,
                x_reversed: axes.x_reversed,
                y_reversed: axes.y_reversed,
            },
            parameters: &parameters,
            advice: &self.advice,
            warnings: &calibration.warnings,
            pictures: &views,
        })
    }

    fn point(&self, index: usize, mark: &Mark) -> ReportPoint {
        let place = self.calibration.place(mark.command);
        let off = |to: FieldPoint| [mark.measured.x_mm - to.x_mm, mark.measured.y_mm - to.y_mm];
        ReportPoint {
            target_mm: mark.target,
            error_before_mm: off(mark.target),
            error_after_mm: off(place),
            outlier: self.calibration.outliers.contains(&index),
            line: mark.line,
        }
    }
}
