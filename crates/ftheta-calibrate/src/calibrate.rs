//! The entry: marks in, a calibration out.

use crate::accuracy::{Spread, distance_mm};
use crate::axes::Axes;
use crate::error::CalibrateError;
use crate::mark::Mark;
pub use crate::physical::{Estimate, Noise};
use crate::physical::{Physical, fit};
use crate::sanity;
use crate::surface::{Family, Surface};
use ftheta_model::machine::{Axis, Optics};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_model::warning::Warning;
use ftheta_physics::head::{Head, solve};
use ftheta_physics::optics::angles_from_field;
use nalgebra::Vector2;

/// What the error of a field is described by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The head's physics with priors, and a smooth residual.
    Physical,
    /// A polynomial over the field.
    Polynomial,
    /// Splines over zones.
    Zones,
    /// Scale and pincushion, then nine points.
    NinePoint,
    /// Scale and pincushion alone.
    Scale,
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Physical, Self::Polynomial, Self::Zones, Self::NinePoint, Self::Scale];

    /// Name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self.family() {
            None => "physical",
            Some(family) => family.name(),
        }
    }

    fn family(self) -> Option<Family> {
        match self {
            Self::Physical => None,
            Self::Polynomial => Some(Family::Polynomial),
            Self::Zones => Some(Family::Zones),
            Self::NinePoint => Some(Family::NinePoint),
            Self::Scale => Some(Family::Scale),
        }
    }

    /// Fewest marks.
    pub fn n_marks_min(self) -> usize {
        match self {
            Self::Scale | Self::Physical => sanity::N_MARKS_MIN,
            Self::Polynomial => 5,
            Self::NinePoint | Self::Zones => 9,
        }
    }
}

/// How to calibrate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrateOptions {
    /// The model; `None` picks one.
    pub model: Option<Model>,
    /// What is known of the noise.
    pub noise: Noise,
}

/// A calibrated head, and what is known of it.
pub struct Calibration {
    /// The model used.
    pub model: Model,
    /// Why this one, in words.
    pub why: String,
    /// How the axes run.
    pub axes: Axes,
    /// Marks, by index, that were taken for wrong and left out.
    pub outliers: Vec<usize>,
    /// How far each mark was measured from what the model says without it, mm.
    pub left_out_mm: Vec<Vector2<f64>>,
    /// Noise of a mark's coordinate, as found or given, mm.
    pub noise_mm: f64,
    /// Distances of the used marks from their targets.
    pub before: Spread,
    /// What the model leaves of them.
    pub after: Spread,
    /// Leaving each out in turn; `None` where too few marks are there to spare one.
    pub left_out: Option<Spread>,
    /// Errors to expect over the field that was measured.
    pub expected: Spread,
    /// The same place by place.
    pub expected_map: ExpectedMap,
    /// The errors of mounting found, whatever the model.
    pub parameters: Vec<Estimate>,
    /// Coefficients of the model, if it is not physical, mm.
    pub coefficients: Vec<(String, f64)>,
    /// Rounds of measurement.
    pub n_rounds: u32,
    /// What weakens the result.
    pub warnings: Vec<Warning>,
    optics: Optics,
    physical: Physical,
    surface: Option<Surface>,
}

/// Errors to expect over a square grid, rows of rising y.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExpectedMap {
    /// Half the side, mm.
    pub half_mm: f64,
    /// Places along a side.
    pub n_places: usize,
    /// Standard deviation of the distance at each, mm.
    pub errors_mm: Vec<f64>,
}

/// Places along a side of the map of expected errors.
const N_PLACES: usize = 21;
/// The same for what more marks would bring.
const N_FORECAST: usize = 9;
/// From this many marks on the physical model is the default.
const N_PHYSICAL: usize = 9;
/// A polynomial has to be this much better at marks left out to be preferred, and needs so many.
const PREFERRED: f64 = 0.7;
const N_PREFERRED: usize = 49;
/// Margin of the axes below which they are doubtful.
const AXES_MARGIN: f64 = 3.0;

/// Calibrates a head from measured marks.
///
/// * `optics`: the machine's nominal ones
/// * `marks`: of all rounds, each with what the mirrors were told
///
/// # Errors
/// If the marks cannot be meant, or are too few for the model.
pub fn calibrate(
    optics: &Optics,
    marks: &[Mark],
    options: &CalibrateOptions,
) -> Result<Calibration, CalibrateError> {
    let mut warnings = sanity::check(optics, marks)?;
    let n_marks = marks.len();
    let asked = options.model.filter(|model| n_marks < model.n_marks_min());
    if let Some(model) = asked {
        let (model, limit) = (model.name(), model.n_marks_min());
        return Err(CalibrateError::TooFew { n_marks, model, limit });
    }
    let axes = Axes::find(optics, marks);
    warnings.extend(axis_warnings(optics, &axes));
    let singular = CalibrateError::Singular { model: "physical", n_marks };
    let physical = fit(optics, axes, marks, options.noise).ok_or(singular)?;
    let clean: Vec<Mark> = marks
        .iter()
        .zip(&physical.used)
        .filter(|(_, used)| **used)
        .map(|(mark, _)| *mark)
        .collect();
    let (model, why, surface) = choose(optics, &physical, &clean, options)?;
    let outliers = (0..n_marks).filter(|&index| !physical.used[index]).collect();
    let n_rounds = marks.iter().map(|mark| mark.round).max().unwrap_or(0);
    let mut calibration = Calibration {
        model,
        why,
        axes,
        outliers,
        left_out_mm: Vec::new(),
        noise_mm: physical.noise_mm(),
        before: Spread::of(clean.iter().map(|mark| distance_mm(mark.measured, mark.target))),
        after: Spread::default(),
        left_out: None,
        expected: Spread::default(),
        expected_map: ExpectedMap::default(),
        parameters: physical.parameters(),
        coefficients: surface.as_ref().map(Surface::coefficients).unwrap_or_default(),
        n_rounds,
        warnings,
        optics: optics.clone(),
        physical,
        surface,
    };
    let left = |mark: &Mark| distance_mm(mark.measured, calibration.place(mark.command));
    calibration.after = Spread::of(clean.iter().map(left));
    calibration.leave_out(marks);
    calibration.expect(marks)?;
    Ok(calibration)
}

/// The model asked for, or the one that suits the marks, with the reason.
fn choose(
    optics: &Optics,
    physical: &Physical,
    clean: &[Mark],
    options: &CalibrateOptions,
) -> Result<(Model, String, Option<Surface>), CalibrateError> {
    let axes = physical.axes();
    let surface = |family: Family| Surface::fit(family, optics, axes, clean);
    if let Some(model) = options.model {
        let surface = model.family().map(surface).transpose()?;
        let words = surface.as_ref().map_or(String::new(), |s| format!(": {}", s.description()));
        return Ok((model, format!("as asked for{words}"), surface));
    }
    let n_marks = physical.used.len();
    if n_marks < N_PHYSICAL {
        let why = format!("{n_marks} marks: the physical model wants {N_PHYSICAL}");
        return Ok((Model::Scale, why, Some(surface(Family::Scale)?)));
    }
    let rms = |left: &mut dyn Iterator<Item = f64>| Spread::of(left).rms_mm;
    let used = physical.left_out_mm.iter().zip(&physical.used).filter(|(_, used)| **used);
    let physical_mm = rms(&mut used.map(|(left, _)| left.norm()));
    if clean.len() >= N_PREFERRED {
        let polynomial = surface(Family::Polynomial)?;
        let polynomial_mm = rms(&mut polynomial.left_out_mm.iter().map(Vector2::norm));
        if polynomial_mm < PREFERRED * physical_mm {
            let why = format!(
                "a {} predicts left-out marks to {:.1} µm, the physical model to {:.1} µm: the \
                 marks are not those of a two-mirror head",
                polynomial.description(),
                polynomial_mm * 1e3,
                physical_mm * 1e3
            );
            return Ok((Model::Polynomial, why, Some(polynomial)));
        }
    }
    let why = format!(
        "{} marks; left-out marks are predicted to {:.1} µm rms",
        clean.len(),
        physical_mm * 1e3
    );
    Ok((Model::Physical, why, None))
}

fn axis_warnings(optics: &Optics, axes: &Axes) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |message: String| warnings.push(Warning::new("axes", message));
    let ways = [
        (axes.swapped, "x and y are swapped"),
        (axes.x_reversed, "measured x runs the other way"),
        (axes.y_reversed, "measured y runs the other way"),
    ];
    let found: Vec<_> = ways.iter().filter(|(is, _)| *is).map(|(_, words)| *words).collect();
    if !found.is_empty() {
        let words = found.join(", ");
        warn(format!("{words}; the table turns the field back, check that the sheet lay right"));
    }
    if axes.margin < AXES_MARGIN {
        let margin = axes.margin;
        warn(format!(
            "the way the axes run is doubtful: the next best is only {margin:.1} times off"
        ));
    }
    if axes.first_mirror != optics.first_mirror {
        let name = if axes.first_mirror == Axis::X { "x" } else { "y" };
        warn(format!(
            "the marks are bent as those of a head whose first mirror moves {name}: set \
             first_mirror = \"{name}\" in the machine file"
        ));
    }
    warnings
}

impl Calibration {
    /// Where commands put the beam, mm, as the model has it.
    pub fn place(&self, command: MirrorAngles) -> FieldPoint {
        match &self.surface {
            Some(surface) => surface.place(command),
            None => self.physical.place(command),
        }
    }

    /// The commands that put the beam on a place; `None` where they are not found.
    ///
    /// * `nominal`: what the nominal optics ask for there
    pub fn command(&self, place: FieldPoint, nominal: MirrorAngles) -> Option<MirrorAngles> {
        solve(place, self.turned(nominal), |command| self.place(command))
    }

    /// Nominal angles the way the axes run.
    pub(crate) fn turned(&self, nominal: MirrorAngles) -> MirrorAngles {
        let turned = self.axes.head(FieldPoint::new(nominal.x_rad, nominal.y_rad));
        self.axes.commands(MirrorAngles::new(turned.x_mm, turned.y_mm))
    }

    /// The head's mounting errors as one; mirror 1 moves its first coordinate.
    pub fn head(&self) -> Head {
        self.physical.head()
    }

    /// Errors to expect of the physical model with a grid of more marks over the same square, mm
    /// rms.
    ///
    /// * `n_side`: marks along each side of the grid
    pub fn forecast_mm(&self, n_side: usize) -> Option<f64> {
        let half_mm = self.expected_map.half_mm;
        let commands = |n_side: usize| -> Option<Vec<_>> {
            let grid = self.grid_commands(half_mm, n_side).ok()?;
            Some(grid.into_iter().map(|(_, command)| command).collect())
        };
        self.physical.forecast_mm(&commands(n_side)?, &commands(N_FORECAST)?)
    }

    /// Commands for a grid over a square in the middle of the field.
    ///
    /// # Errors
    /// The first place that is not reached.
    fn grid_commands(
        &self,
        half_mm: f64,
        n_side: usize,
    ) -> Result<Vec<(FieldPoint, MirrorAngles)>, CalibrateError> {
        let at = |k: usize| half_mm * (2.0 * k as f64 / (n_side - 1) as f64 - 1.0);
        let with_command = |k: usize| {
            let place = FieldPoint::new(at(k % n_side), at(k / n_side));
            let nominal = angles_from_field(&self.optics, place);
            let command = nominal.and_then(|nominal| self.command(place, nominal));
            let FieldPoint { x_mm, y_mm } = place;
            Ok((place, command.ok_or(CalibrateError::Unreachable { x_mm, y_mm })?))
        };
        (0..n_side * n_side).map(with_command).collect()
    }

    /// What each mark would be off if it had not been used.
    fn leave_out(&mut self, marks: &[Mark]) {
        let used = &self.physical.used;
        let mut left = self.physical.left_out_mm.clone();
        if let Some(surface) = &self.surface {
            let mut kept = surface.left_out_mm.iter();
            for (index, mark) in marks.iter().enumerate() {
                let place = surface.place(mark.command);
                let off =
                    Vector2::new(mark.measured.x_mm - place.x_mm, mark.measured.y_mm - place.y_mm);
                left[index] = if used[index] { *kept.next().unwrap_or(&off) } else { off };
            }
        }
        let kept = left.iter().zip(used).filter(|(_, used)| **used);
        let spread = Spread::of(kept.map(|(left, _)| left.norm()));
        self.left_out = spread.rms_mm.is_finite().then_some(spread);
        self.left_out_mm = left;
    }

    /// Errors to expect over the square of the targets: what the marks leave open of the physics,
    /// and what the model is off it.
    fn expect(&mut self, marks: &[Mark]) -> Result<(), CalibrateError> {
        let targets: Vec<_> = marks.iter().map(|mark| mark.target).collect();
        let half_mm = sanity::reach_mm(&targets);
        let (places, commands): (Vec<_>, Vec<_>) =
            self.grid_commands(half_mm, N_PLACES)?.into_iter().unzip();
        let (open_mm, greatest_mm) = self.physical.expected_mm(&commands);
        let off = |(open, (command, place)): (&f64, (&MirrorAngles, &FieldPoint))| {
            let off_mm = match &self.surface {
                Some(_) => distance_mm(self.physical.place(*command), *place),
                None => 0.0,
            };
            (open.hypot(off_mm), off_mm)
        };
        let all: Vec<_> = open_mm.iter().zip(commands.iter().zip(&places)).map(off).collect();
        let rms_mm = Spread::of(all.iter().map(|(error, _)| *error)).rms_mm;
        let max_mm = greatest_mm.hypot(all.iter().map(|(_, off)| *off).fold(0.0, f64::max));
        self.expected = Spread { rms_mm, max_mm };
        let errors_mm = all.into_iter().map(|(error, _)| error).collect();
        self.expected_map = ExpectedMap { half_mm, n_places: N_PLACES, errors_mm };
        Ok(())
    }
}
