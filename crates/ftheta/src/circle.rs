//! One uniform turn of a circle or ellipse, or a spiral, planned, played on the twin and measured.

use crate::Error;
use crate::lit::Lit;
use crate::mark::{MarkOptions, Marked, PlanTimes, Played, Stage, plan_times, play_watched};
use crate::promise::promise;
use ftheta_model::machine::Machine;
use ftheta_model::recipe::{ClassicRecipe, Pen};
use ftheta_physics::plan::Plan;
use ftheta_planner::circle::{self, CircleDraft, CircleOptions};
pub use ftheta_planner::circle::{Ellipse, Spiral};
use ftheta_planner::classic::Settings;
use ftheta_planner::optimal::is_servo_known;
use kurbo::Point;

/// Least way over which a speed is measured, mm: a trace's rounding is 1e-4 of it.
const SPEED_WAY_MM: f64 = 0.01;

/// What came of a circle.
pub struct Circled {
    /// The plan, its score and picture.
    pub marked: Marked,
    /// From rest in the centre to the first light, s.
    pub run_in_s: f64,
    /// From the last tick of the turn to rest, s.
    pub run_out_s: f64,
    /// One turn, or all of a spiral, s.
    pub turn_s: f64,
    /// What the beam did in light.
    pub roundness: Roundness,
}

/// How true a turn is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roundness {
    /// Greatest distance from the path, mm.
    pub error_max_mm: f64,
    /// Root mean square of the distance, mm.
    pub error_rms_mm: f64,
    /// Smallest and greatest speed over the path's.
    pub speed_ratio: [f64; 2],
}

/// A path that is passed at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Round {
    /// One turn of an ellipse.
    Ellipse(Ellipse),
    /// Several turns of a growing or falling radius.
    Spiral(Spiral),
}

impl Round {
    fn length_mm(&self) -> f64 {
        match self {
            Self::Ellipse(ellipse) => ellipse.length_mm(),
            Self::Spiral(spiral) => spiral.length_mm(),
        }
    }

    fn speed_mm_s(&self) -> f64 {
        match self {
            Self::Ellipse(ellipse) => ellipse.speed_mm_s,
            Self::Spiral(spiral) => spiral.speed_mm_s,
        }
    }

    fn distance_mm(&self, place: Point) -> f64 {
        match self {
            Self::Ellipse(ellipse) => ellipse.distance_mm(place),
            Self::Spiral(spiral) => spiral.distance_mm(place),
        }
    }

    fn draft(&self, machine: &Machine, options: &CircleOptions) -> Result<CircleDraft, Error> {
        Ok(match self {
            Self::Ellipse(ellipse) => circle::draft(machine, ellipse, options)?,
            Self::Spiral(spiral) => circle::spiral(machine, spiral, options)?,
        })
    }
}

/// Plans, plays and measures one turn, or a spiral.
///
/// * `pen`: its speed is the path's
///
/// # Errors
/// If the drive is not known, the path cannot be reached, or the audit refuses.
pub fn circle(
    machine: &Machine,
    round: &Round,
    pen: Pen,
    options: &MarkOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Circled, Error> {
    if !is_servo_known(machine) {
        let why = "its servo is not known, or has a memory of its own";
        return Err(Error::NoPlanner { planner: "circle", why });
    }
    observer(Stage::Plan);
    let (tolerance_mm, voltage_reserve) = (options.tolerance_mm, options.reserve);
    let settings = Settings::new(machine, &ClassicRecipe::default())?;
    let planned = round.draft(machine, &CircleOptions { pen, tolerance_mm, voltage_reserve })?;
    observer(Stage::Audit);
    let plan = Plan::new(planned.draft)?;
    let mut lit = Lit::default();
    let Played { score, dose, states } =
        play_watched(&plan, options, observer, &mut |trace| lit.add(trace))?;
    let times = PlanTimes { marked_mm: round.length_mm(), ..plan_times(&plan) };
    let (seed, warnings) = (options.seed, Vec::new());
    let promise = promise(&plan)?;
    Ok(Circled {
        marked: Marked { plan, settings, times, promise, score, dose, states, seed, warnings },
        run_in_s: planned.run_in_s,
        run_out_s: planned.run_out_s,
        turn_s: planned.turn_s,
        roundness: roundness(&lit, round),
    })
}

/// How true the lit places are to their path.
fn roundness(lit: &Lit, round: &Round) -> Roundness {
    let errors_mm = || lit.places.iter().map(|(_, place)| round.distance_mm(*place));
    let squares: f64 = errors_mm().map(|error| error * error).sum();
    let way_mm = |pair: &[(usize, Point)]| pair[0].1.distance(pair[1].1);
    let ways_mm: Vec<f64> = lit.places.windows(2).map(way_mm).collect();
    let step_mm = round.speed_mm_s() * lit.step_s;
    let n_steps = ((SPEED_WAY_MM / step_mm).ceil() as usize).clamp(1, ways_mm.len().max(1));
    let speeds = ways_mm
        .windows(n_steps)
        .map(|ways_mm| ways_mm.iter().sum::<f64>() / (n_steps as f64 * step_mm));
    Roundness {
        error_max_mm: errors_mm().fold(0.0, |max, error| max.max(error.abs())),
        error_rms_mm: (squares / lit.places.len().max(1) as f64).sqrt(),
        speed_ratio: speeds
            .fold([f64::INFINITY, 0.0], |[min, max], speed| [min.min(speed), max.max(speed)]),
    }
}
