//! The correction table of a head: from the mirror angles that nominal optics ask for to those that
//! put the beam of the real head on the same place.
//!
//! It comes last, where samples are rendered, and keeps no memory, so a plan does not change with
//! it. Several planes hold several heights of the work plane; between them it is linear.

use crate::audit::CORRECTION_RESERVE;
use crate::grid_map::GridMap;
use crate::optics::field_from_angles;
use ftheta_model::machine::{Axis, Lens, Machine, Optics, Scanner};
use ftheta_model::space::MirrorAngles;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use thiserror::Error;

/// Part of the angle and speed limits that plans use; the rest is the table's.
const NOMINAL_SHARE: f64 = 1.0 - CORRECTION_RESERVE;

/// A checked correction table. Clones share the nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectionTable {
    about: About,
    planes: Vec<CorrectionPlane>,
    drift: Drift,
    /// Height of the work plane at hand, mm.
    z_mm: f64,
}

/// Where a table comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// Name of the machine.
    pub machine: String,
    /// What identifies its optics, from [`optics_id`].
    pub optics_id: String,
    /// How the table was made, one word.
    pub model: String,
    /// Rounds of measurement that went into it.
    pub n_rounds: u32,
}

/// The correction at one height of the work plane.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectionPlane {
    /// Height of the work plane above the nominal one, towards the head, mm.
    pub z_mm: f64,
    /// From nominal to corrected mechanical angles, rad, x and y.
    pub angles: GridMap,
}

/// What has moved since the table was made, as gain and offset of each axis' corrected angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Gain of each axis, near one.
    pub gain: [f64; 2],
    /// Offset of each axis, mechanical rad.
    pub offset_rad: [f64; 2],
}

impl Drift {
    /// Nothing has moved.
    pub const NONE: Self = Self { gain: [1.0; 2], offset_rad: [0.0; 2] };
}

/// Why a table cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CorrectionError {
    /// There is no plane.
    #[error("the table has no plane")]
    Empty,
    /// Planes out of order.
    #[error("plane {index} at z = {z_mm} mm does not lie above the one before it")]
    Planes {
        /// Which plane.
        index: usize,
        /// Its height, mm.
        z_mm: f64,
    },
    /// A value that is no angle.
    #[error("node {node:?} (column, row) holds {value_rad} rad, the limit is ±{limit_rad} rad")]
    Value {
        /// Column and row.
        node: [usize; 2],
        /// What it holds, rad.
        value_rad: f64,
        /// Greatest magnitude, rad.
        limit_rad: f64,
    },
    /// The map is not one to one.
    #[error(
        "the table folds over between nodes {node:?} and the next (column, row): two places would \
         get the same mirror angles"
    )]
    Fold {
        /// Column and row of the cell.
        node: [usize; 2],
    },
    /// Made for another machine.
    #[error(
        "the table is for machine {table} (optics {table_id}), this is {machine} (optics {id})"
    )]
    Machine {
        /// Name in the table.
        table: String,
        /// Id in the table.
        table_id: String,
        /// Name of the machine at hand.
        machine: String,
        /// Its id.
        id: String,
    },
    /// Needs an angle that the mirrors do not have.
    #[error(
        "at nominal angles ({:.3}°, {:.3}°) the table asks {axis:?} for {:.3}°, the limit is \
         {:.3}°; if the machine file has a wrong focal length, lens polynomial or too large a \
         field, mend that first",
        place_rad[0].to_degrees(), place_rad[1].to_degrees(), value_rad.to_degrees(),
        limit_rad.to_degrees()
    )]
    Angle {
        /// Nominal angles, rad.
        place_rad: [f64; 2],
        /// Which mirror.
        axis: Axis,
        /// Angle asked for, rad.
        value_rad: f64,
        /// Greatest angle, rad.
        limit_rad: f64,
    },
    /// Needs a speed that the mirrors do not have.
    #[error(
        "at nominal angles ({:.3}°, {:.3}°) the table makes {axis:?} {ratio:.4} times as fast as \
         planned, the limit is {limit:.4}; if the machine file has a wrong focal length, lens \
         polynomial or too large a field, mend that first",
        place_rad[0].to_degrees(), place_rad[1].to_degrees()
    )]
    Speed {
        /// Nominal angles, rad.
        place_rad: [f64; 2],
        /// Which mirror.
        axis: Axis,
        /// Speed asked for by the speed planned.
        ratio: f64,
        /// Greatest ratio.
        limit: f64,
    },
}

impl CorrectionError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let degrees = |rad: f64| format!("{:.3}°", rad.to_degrees());
        let node = |[column, row]: [usize; 2]| format!("table: column {column}, row {row}");
        let at = |place_rad: [f64; 2], axis| {
            let [x, y] = place_rad.map(degrees);
            format!("table: {axis:?} at nominal angles ({x}, {y})")
        };
        match *self {
            Self::Empty => ("table".into(), "0 planes".into(), "1 plane".into()),
            Self::Planes { index, z_mm } => (
                format!("table: plane {index}"),
                format!("{z_mm} mm"),
                "above the one before".into(),
            ),
            Self::Value { node: at, value_rad, limit_rad } => {
                (node(at), format!("{value_rad} rad"), format!("±{limit_rad} rad"))
            }
            Self::Fold { node: at } => (node(at), "folds over".into(), "one to one".into()),
            Self::Machine { ref table, ref table_id, ref machine, ref id } => (
                "table: machine".into(),
                format!("{table} (optics {table_id})"),
                format!("{machine} (optics {id})"),
            ),
            Self::Angle { place_rad, axis, value_rad, limit_rad } => {
                (at(place_rad, axis), degrees(value_rad), degrees(limit_rad))
            }
            Self::Speed { place_rad, axis, ratio, limit } => {
                (at(place_rad, axis), format!("{ratio:.4} times"), format!("{limit:.4} times"))
            }
        }
    }
}

impl About {
    /// A table for a machine.
    ///
    /// * `model`: how it was made, one word
    pub fn of(machine: &Machine, model: &str, n_rounds: u32) -> Self {
        Self {
            machine: machine.name.clone(),
            optics_id: optics_id(&machine.optics),
            model: model.to_owned(),
            n_rounds,
        }
    }
}

impl CorrectionTable {
    /// Greatest magnitude of an angle in a table, rad: a right angle of the beam.
    pub const ANGLE_MAX_RAD: f64 = std::f64::consts::FRAC_PI_4;

    /// A table from its planes.
    ///
    /// * `planes`: of rising height
    ///
    /// # Errors
    /// If there is no plane, a height is not above the one before, an angle is no angle, or a plane
    /// folds over.
    pub fn new(
        about: About,
        planes: Vec<CorrectionPlane>,
        drift: Drift,
    ) -> Result<Self, CorrectionError> {
        if planes.is_empty() {
            return Err(CorrectionError::Empty);
        }
        let mut below_mm = f64::NEG_INFINITY;
        for (index, plane) in planes.iter().enumerate() {
            if !(plane.z_mm > below_mm && plane.z_mm.is_finite()) {
                return Err(CorrectionError::Planes { index, z_mm: plane.z_mm });
            }
            below_mm = plane.z_mm;
            plane.check()?;
        }
        Ok(Self { about, planes, drift, z_mm: 0.0 })
    }

    /// A table of the nominal work plane alone, of which nothing has drifted.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn flat(about: About, angles: GridMap) -> Result<Self, CorrectionError> {
        Self::new(about, vec![CorrectionPlane { z_mm: 0.0, angles }], Drift::NONE)
    }

    /// Where the table comes from.
    pub fn about(&self) -> &About {
        &self.about
    }

    /// Its planes, of rising height.
    pub fn planes(&self) -> &[CorrectionPlane] {
        &self.planes
    }

    /// What has moved since it was made.
    pub fn drift(&self) -> Drift {
        self.drift
    }

    /// The same table with another drift.
    #[must_use]
    pub fn with_drift(self, drift: Drift) -> Self {
        Self { drift, ..self }
    }

    /// The same table for a work plane at another height, mm, instead of the nominal one.
    ///
    /// * `z_mm`: beyond the planes it counts as that of the outermost one
    #[must_use]
    pub fn at_height(self, z_mm: f64) -> Self {
        Self { z_mm, ..self }
    }

    /// Corrected from nominal angles in the work plane at hand, rad.
    #[inline]
    pub fn angles(&self, nominal_rad: [f64; 2]) -> [f64; 2] {
        self.angles_at(nominal_rad, self.z_mm)
    }

    /// Corrected from nominal angles at a height of the work plane, rad.
    ///
    /// * `z_mm`: beyond the planes it counts as that of the outermost one
    #[inline]
    pub fn angles_at(&self, nominal_rad: [f64; 2], z_mm: f64) -> [f64; 2] {
        let corrected = match self.planes.as_slice() {
            [only] => only.angles.value(nominal_rad),
            planes => {
                let (below, share) = between(planes, z_mm);
                let [low, high] =
                    [below, below + 1].map(|plane| planes[plane].angles.value(nominal_rad));
                [0, 1].map(|axis| low[axis] + share * (high[axis] - low[axis]))
            }
        };
        let Drift { gain, offset_rad } = self.drift;
        [0, 1].map(|axis| gain[axis] * corrected[axis] + offset_rad[axis])
    }

    /// Slopes of the corrected by the nominal angles, in the work plane at hand: rows corrected x
    /// and y, columns nominal x and y.
    pub fn slopes(&self, nominal_rad: [f64; 2]) -> [[f64; 2]; 2] {
        let (below, share) = between(&self.planes, self.z_mm);
        let low = self.planes[below].angles.slopes(nominal_rad);
        let high = self.planes.get(below + 1).map(|plane| plane.angles.slopes(nominal_rad));
        [0, 1].map(|row| {
            [0, 1].map(|column| {
                let value = low[row][column];
                let above = high.map_or(value, |high| high[row][column]);
                self.drift.gain[row] * (value + share * (above - value))
            })
        })
    }

    /// Nominal from corrected angles, rad, by Newton; `None` outside the table.
    ///
    /// # Accuracy
    /// 1e-13 rad.
    pub fn nominal(&self, corrected_rad: [f64; 2]) -> Option<[f64; 2]> {
        // The best node near by is a start even where the axes are swapped.
        let distance =
            |value: [f64; 2]| (value[0] - corrected_rad[0]).hypot(value[1] - corrected_rad[1]);
        let (below, _) = between(&self.planes, self.z_mm);
        let nodes = self.planes[below].angles.nodes();
        let start = nodes.min_by(|a, b| distance(a.2).total_cmp(&distance(b.2)))?;
        let mut nominal = [start.0, start.1];
        let half = self.planes[below].angles.half_width();
        for _ in 0..20 {
            let value = self.angles(nominal);
            let [[a, b], [c, d]] = self.slopes(nominal);
            let (u, v) = (corrected_rad[0] - value[0], corrected_rad[1] - value[1]);
            let determinant = a * d - b * c;
            let step = [(d * u - b * v) / determinant, (a * v - c * u) / determinant];
            nominal = [0, 1].map(|axis| (nominal[axis] + step[axis]).clamp(-half, half));
            if step[0].abs().max(step[1].abs()) < 1e-14 {
                break;
            }
        }
        (distance(self.angles(nominal)) < 1e-12).then_some(nominal)
    }

    /// Checks that the table is for these optics.
    ///
    /// # Errors
    /// If it is for others.
    pub fn check_machine(&self, machine: &str, optics: &Optics) -> Result<(), CorrectionError> {
        let id = optics_id(optics);
        if id == self.about.optics_id {
            return Ok(());
        }
        let About { machine: table, optics_id: table_id, .. } = self.about.clone();
        Err(CorrectionError::Machine { table, table_id, machine: machine.to_owned(), id })
    }

    /// Checks that nothing in the field leaves the mirrors' limits through the table. Where the
    /// beam is dark and beyond the field, words are held at the last one.
    ///
    /// # Errors
    /// If somewhere an angle or a speed would leave its limit.
    pub fn check_limits(&self, scanner: &Scanner, optics: &Optics) -> Result<(), CorrectionError> {
        let limit_rad = scanner.angle_max_rad;
        let outside = |[x_rad, y_rad]: [f64; 2]| {
            let place = field_from_angles(optics, MirrorAngles::new(x_rad, y_rad));
            place.x_mm.abs().max(place.y_mm.abs()) > 0.5 * optics.field_mm
        };
        let reach_rad = NOMINAL_SHARE * limit_rad;
        // Four times as fine as the grid: between nodes a cubic may bulge.
        let n_nodes = 4 * self.planes[0].angles.n_nodes();
        let at = |index: usize| reach_rad * (2.0 * index as f64 / (n_nodes - 1) as f64 - 1.0);
        for index in 0..n_nodes * n_nodes {
            let place_rad = [at(index % n_nodes), at(index / n_nodes)];
            if outside(place_rad) {
                continue;
            }
            let (angles, slopes) = (self.angles(place_rad), self.slopes(place_rad));
            for (k, axis) in [Axis::X, Axis::Y].into_iter().enumerate() {
                let value_rad = angles[k];
                if value_rad.abs() > limit_rad {
                    return Err(CorrectionError::Angle { place_rad, axis, value_rad, limit_rad });
                }
                let (ratio, limit) = (slopes[k][0].abs() + slopes[k][1].abs(), 1.0 / NOMINAL_SHARE);
                if ratio > limit {
                    return Err(CorrectionError::Speed { place_rad, axis, ratio, limit });
                }
            }
        }
        Ok(())
    }
}

impl CorrectionPlane {
    fn check(&self) -> Result<(), CorrectionError> {
        let n_nodes = self.angles.n_nodes();
        let nodes: Vec<_> = self.angles.nodes().map(|(.., value)| value).collect();
        for (index, value_rad) in
            nodes.iter().enumerate().flat_map(|(index, pair)| pair.map(|value| (index, value)))
        {
            let limit_rad = CorrectionTable::ANGLE_MAX_RAD;
            if !value_rad.is_finite() || value_rad.abs() > limit_rad {
                let node = [index % n_nodes, index / n_nodes];
                return Err(CorrectionError::Value { node, value_rad, limit_rad });
            }
        }
        // The corners of every cell turn the same way round.
        let area = |a: usize, b: usize, c: usize| {
            let [p, q, r] = [a, b, c].map(|index| nodes[index]);
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
        };
        let sign = area(0, 1, n_nodes).signum();
        for row in 0..n_nodes - 1 {
            for column in 0..n_nodes - 1 {
                let a = row * n_nodes + column;
                let (b, c, d) = (a + 1, a + n_nodes + 1, a + n_nodes);
                let areas = [area(a, b, d), area(b, c, a), area(c, d, b), area(d, a, c)];
                if !areas.iter().all(|&area| area * sign > 0.0) {
                    return Err(CorrectionError::Fold { node: [column, row] });
                }
            }
        }
        Ok(())
    }
}

/// Plane below a height, and how far up to the next one.
fn between(planes: &[CorrectionPlane], z_mm: f64) -> (usize, f64) {
    let Some(last) = planes.len().checked_sub(2) else {
        return (0, 0.0);
    };
    let below = planes[1..=last].iter().take_while(|plane| plane.z_mm <= z_mm).count();
    let (low_mm, high_mm) = (planes[below].z_mm, planes[below + 1].z_mm);
    (below, ((z_mm - low_mm) / (high_mm - low_mm)).clamp(0.0, 1.0))
}

/// Sixteen hexadecimal digits that identify optics: their lens, first mirror, field, and
/// where a focusing lens stands.
pub fn optics_id(optics: &Optics) -> String {
    let mut hash = Sha256::new();
    let mut number = |value: f64| hash.update(value.to_bits().to_le_bytes());
    number(optics.field_mm);
    number(if optics.first_mirror == Axis::X { 0.0 } else { 1.0 });
    match &optics.lens {
        Lens::FTheta { coefficients_mm } => coefficients_mm.iter().copied().for_each(&mut number),
        Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
            [-1.0, *mirror_distance_mm, *working_distance_mm].into_iter().for_each(&mut number);
        }
    }
    // Where the lens stands turns the beam a little; how fast it may move does not.
    if let Some(focus) = &optics.focus {
        [-2.0, focus.magnification, f64::from(u8::from(focus.balanced))]
            .into_iter()
            .for_each(number);
    }
    hash.finalize()[..8].iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a string takes everything");
        text
    })
}
