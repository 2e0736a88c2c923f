//! Places of the field as mirror angles, and back, with or without a correction table.

use crate::{Error, import};
use ftheta_formats::points::{AnglesRow, Place, read_angles, read_places};
use ftheta_model::machine::{Axis, Lens, Machine};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_physics::correction::CorrectionTable;
use ftheta_physics::focus::travel_of_shift_mm;
use ftheta_physics::optics::{angles_from_field, field_from_angles, path_difference_mm};
use std::fmt::Write;
use std::path::Path;
use thiserror::Error;

/// What two ways through the optics may differ by, mm.
const SAME_MM: f64 = 1e-6;

/// A place and the mirrors' angles for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapped {
    /// Where the beam lands, mm.
    pub place_mm: FieldPoint,
    /// Mechanical, as they are sent: corrected where there is a table.
    pub angles: MirrorAngles,
    /// Where the focusing lens has to stand, from the middle of its travel, mm; without one, how
    /// much farther from the head the focus has to be than in the field's centre. `None` behind an
    /// F-theta lens for places without a height.
    pub focus_mm: Option<f64>,
}

/// Why a place has no angles, or angles no place.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("line {line}: {what}")]
pub struct FieldError {
    /// Line of the list, from 1.
    pub line: u32,
    /// What is wrong there.
    pub what: Unmapped,
}

/// Why something has no image.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Unmapped {
    /// Beyond the optics.
    #[error("the optics do not reach ({}, {}) mm at a height of {z_mm} mm", place_mm.x_mm, place_mm.y_mm)]
    Place {
        /// Where, mm.
        place_mm: FieldPoint,
        /// Height above the nominal work plane, mm.
        z_mm: f64,
    },
    /// Beyond the mirrors.
    #[error(
        "({}, {}) mm needs {axis:?} at {:.4}°, the limit is ±{:.4}°", place_mm.x_mm, place_mm.y_mm,
        angle_rad.to_degrees(), limit_rad.to_degrees()
    )]
    Angle {
        /// Where, mm.
        place_mm: FieldPoint,
        /// Which mirror.
        axis: Axis,
        /// Its angle, mechanical rad.
        angle_rad: f64,
        /// Greatest angle, rad.
        limit_rad: f64,
    },
    /// Beyond the focusing lens.
    #[error(
        "({}, {}) mm at a height of {z_mm} mm needs the focusing lens at {travel_mm:.4} mm, the \
         limit is ±{limit_mm} mm", place_mm.x_mm, place_mm.y_mm
    )]
    Focus {
        /// Where, mm.
        place_mm: FieldPoint,
        /// Height above the nominal work plane, mm.
        z_mm: f64,
        /// Travel of the lens, mm.
        travel_mm: f64,
        /// Greatest travel, mm.
        limit_mm: f64,
    },
    /// Angles of which optics or table know nothing.
    #[error(
        "angles ({:.4}°, {:.4}°) are beyond {limit}", angles.x_rad.to_degrees(),
        angles.y_rad.to_degrees()
    )]
    Angles {
        /// Mechanical.
        angles: MirrorAngles,
        /// What they are beyond.
        limit: &'static str,
    },
}

impl FieldError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let (value, limit) = self.what.fault();
        (format!("line {}", self.line), value, limit)
    }
}

impl Unmapped {
    /// Value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String) {
        let place = |p: FieldPoint| format!("({}, {}) mm", p.x_mm, p.y_mm);
        let degrees = |rad: f64| format!("{:.4}°", rad.to_degrees());
        match *self {
            Self::Place { place_mm, .. } => (place(place_mm), "the reach of the optics".into()),
            Self::Angle { angle_rad, limit_rad, .. } => {
                (degrees(angle_rad), format!("±{}", degrees(limit_rad)))
            }
            Self::Focus { travel_mm, limit_mm, .. } => {
                (format!("{travel_mm:.4} mm"), format!("±{limit_mm} mm"))
            }
            Self::Angles { angles, limit } => {
                (format!("({}, {})", degrees(angles.x_rad), degrees(angles.y_rad)), limit.into())
            }
        }
    }
}

/// The mirrors' angles for places.
///
/// * `table`: of this machine
///
/// # Errors
/// The first place that optics, table, mirrors or focusing lens do not reach.
///
/// # Limits
/// Behind an F-theta lens a height moves the focus alone; what else it does is left to the table's
/// planes.
pub fn angles_of(
    machine: &Machine,
    table: Option<&CorrectionTable>,
    places: &[Place],
) -> Result<Vec<Mapped>, FieldError> {
    let has_focus = matches!(machine.optics.lens, Lens::PostObjective { .. });
    let mapped = |place: &Place| {
        let Place { place_mm, z_mm, .. } = *place;
        let height_mm = z_mm.unwrap_or(machine.optics.plane_mm);
        let unreached = Unmapped::Place { place_mm, z_mm: height_mm };
        let optics = machine.optics.at_height(height_mm).ok_or(unreached)?;
        let nominal = angles_from_field(&optics, place_mm).ok_or(unreached)?;
        check_angles(machine, place_mm, nominal)?;
        let angles = match table {
            Some(table) => corrected(table, nominal, height_mm)?,
            None => nominal,
        };
        check_angles(machine, place_mm, angles)?;
        let shift_mm = path_difference_mm(&optics, place_mm) - height_mm;
        let focus_mm = match &machine.optics.focus {
            Some(focus) => {
                let travel_mm = travel_of_shift_mm(&optics, focus, shift_mm);
                let limit_mm = focus.travel_mm;
                if travel_mm.abs() > limit_mm {
                    let z_mm = height_mm;
                    return Err(Unmapped::Focus { place_mm, z_mm, travel_mm, limit_mm });
                }
                Some(travel_mm)
            }
            None => (has_focus || z_mm.is_some()).then_some(shift_mm),
        };
        Ok(Mapped { place_mm, angles, focus_mm })
    };
    places.iter().map(|place| mapped(place).map_err(|what| at(place.line, what))).collect()
}

/// Where the beam lands in the nominal work plane for mirror angles, as they are sent.
///
/// * `table`: of this machine
///
/// # Errors
/// The first angles that are beyond mirrors, table or optics.
pub fn places_of(
    machine: &Machine,
    table: Option<&CorrectionTable>,
    rows: &[AnglesRow],
) -> Result<Vec<Mapped>, FieldError> {
    let mapped = |angles: MirrorAngles| {
        let beyond = |limit| Unmapped::Angles { angles, limit };
        let limit_rad = machine.scanner.angle_max_rad;
        if angles.x_rad.abs().max(angles.y_rad.abs()) > limit_rad {
            return Err(beyond("the mirrors' greatest angle"));
        }
        let nominal = match table {
            Some(table) => {
                let nominal = table.nominal([angles.x_rad, angles.y_rad]);
                let [x_rad, y_rad] = nominal.ok_or(beyond("the correction table"))?;
                MirrorAngles::new(x_rad, y_rad)
            }
            None => angles,
        };
        let place_mm = field_from_angles(&machine.optics, nominal);
        // A lens polynomial may turn back far outside the field, and then two angles share a place.
        let back = angles_from_field(&machine.optics, place_mm)
            .map(|back| field_from_angles(&machine.optics, back))
            .map(|back| (back.x_mm - place_mm.x_mm).hypot(back.y_mm - place_mm.y_mm));
        if !back.is_some_and(|apart_mm| apart_mm < SAME_MM) {
            return Err(beyond("the reach of the optics"));
        }
        Ok(Mapped { place_mm, angles, focus_mm: None })
    };
    rows.iter().map(|row| mapped(row.angles).map_err(|what| at(row.line, what))).collect()
}

/// Places and angles as CSV: `x_mm,y_mm,angle_x_deg,angle_y_deg[,focus_mm]`, lengths to nine
/// decimals, degrees mechanical with ten.
pub fn csv(rows: &[Mapped]) -> String {
    let has_focus = rows.iter().any(|row| row.focus_mm.is_some());
    let mut out = String::from("x_mm,y_mm,angle_x_deg,angle_y_deg");
    out.push_str(if has_focus { ",focus_mm\n" } else { "\n" });
    for Mapped { place_mm, angles, focus_mm } in rows {
        let (x_deg, y_deg) = (angles.x_rad.to_degrees(), angles.y_rad.to_degrees());
        // A picometre is what ten decimals of a degree are worth; a zero has no sign.
        let [x_mm, y_mm] = [place_mm.x_mm, place_mm.y_mm].map(|mm| (mm * 1e9).round() / 1e9 + 0.0);
        // Writing to a string does not fail.
        let _ = write!(out, "{x_mm},{y_mm},{x_deg:.10},{y_deg:.10}");
        if has_focus {
            let _ = write!(out, ",{:.9}", focus_mm.unwrap_or(0.0));
        }
        out.push('\n');
    }
    out
}

/// Maps a list in a file: places to angles, or with `inverse` angles to places.
///
/// # Errors
/// If the file is at fault, or as [`angles_of`] and [`places_of`].
pub fn map_file(
    path: &Path,
    machine: &Machine,
    table: Option<&CorrectionTable>,
    inverse: bool,
) -> Result<Vec<Mapped>, Error> {
    let (file, bytes) = (path.display().to_string(), import::bytes(path)?);
    let mapped = match inverse {
        true => places_of(machine, table, &read_angles(&file, &bytes)?),
        false => angles_of(machine, table, &read_places(&file, &bytes)?),
    };
    mapped.map_err(|source| Error::Field { path: path.into(), source })
}

fn at(line: u32, what: Unmapped) -> FieldError {
    FieldError { line, what }
}

fn check_angles(
    machine: &Machine,
    place_mm: FieldPoint,
    angles: MirrorAngles,
) -> Result<(), Unmapped> {
    let limit_rad = machine.scanner.angle_max_rad;
    for (axis, angle_rad) in [(Axis::X, angles.x_rad), (Axis::Y, angles.y_rad)] {
        if angle_rad.abs() > limit_rad {
            return Err(Unmapped::Angle { place_mm, axis, angle_rad, limit_rad });
        }
    }
    Ok(())
}

/// What the table makes of nominal angles, if they are within it.
pub fn corrected(
    table: &CorrectionTable,
    nominal: MirrorAngles,
    z_mm: f64,
) -> Result<MirrorAngles, Unmapped> {
    let half_rad = table.planes().iter().map(|plane| plane.angles.half_width());
    let half_rad = half_rad.fold(f64::INFINITY, f64::min);
    if nominal.x_rad.abs().max(nominal.y_rad.abs()) > half_rad {
        return Err(Unmapped::Angles { angles: nominal, limit: "the correction table" });
    }
    let [x_rad, y_rad] = table.angles_at([nominal.x_rad, nominal.y_rad], z_mm);
    Ok(MirrorAngles::new(x_rad, y_rad))
}
