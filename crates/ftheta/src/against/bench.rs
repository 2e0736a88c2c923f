//! Plays candidates of one toolpath on one twin, each once.

use super::delays::Delays;
use super::descent::Rank;
use super::excerpt::excerpt;
use crate::Error;
use crate::mark::{MarkOptions, score, twin};
use ftheta_model::machine::Machine;
use ftheta_model::recipe::ClassicRecipe;
use ftheta_model::toolpath::{Mark, Toolpath};
use ftheta_physics::plan::Plan;
use ftheta_planner::classic::{self, Settings};
use ftheta_planner::render::Renderer;
use ftheta_report::score::Score;
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::twin::{Twin, TwinOptions};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The lag-derived start is rounded to whole steps at both edges, µs.
const LIGHT_ROUNDING_US: f64 = 1.0;

/// What the contour and coverage errors may be.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Greatest error, µm.
    pub tolerance_um: f64,
    /// Whether it holds for the coverage as well.
    pub coverage: bool,
}

/// Figures of a candidate that count.
#[derive(Clone, Copy, Debug)]
struct Figures {
    duration_s: f64,
    contour_um: f64,
    coverage_um: f64,
}

/// What candidates are played with.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    pub machine: &'a Machine,
    /// Interpolation and ramps, which are not tuned.
    pub recipe: &'a ClassicRecipe,
    pub options: &'a MarkOptions,
    /// Any renderer for the machine.
    pub renderer: &'a Renderer<'a>,
}

/// A toolpath and what is known of its candidates.
pub struct Bench<'a> {
    setup: Setup<'a>,
    toolpath: Toolpath,
    twin: Twin,
    known: Mutex<BTreeMap<Delays, Option<Figures>>>,
}

impl<'a> Bench<'a> {
    /// Nothing played yet.
    pub fn new(setup: Setup<'a>, toolpath: Toolpath) -> Result<Self, Error> {
        let twin_options = TwinOptions {
            mismatch: Mismatch::default(),
            seed: setup.options.seed,
            // Nobody looks at the dose or the states.
            pixel_mm: setup.machine.optics.field_mm,
            state_stride: u64::MAX,
        };
        let twin = twin(setup.machine, setup.options, &twin_options)?;
        Ok(Self { setup, toolpath, twin, known: Mutex::default() })
    }

    /// A part of the job, as long as `time_s`, about.
    ///
    /// * `plan` of the whole
    pub fn excerpt(&self, plan: &Plan, time_s: f64) -> Result<Self, Error> {
        let renderer = self.setup.renderer.for_plan(plan);
        let score = score(plan, renderer, &mut self.twin.clone(), &mut |_, _| {})?;
        Self::new(self.setup, excerpt(&self.toolpath, &score, time_s))
    }

    /// Number of its marks.
    pub fn n_marks(&self) -> usize {
        self.toolpath.marks.len()
    }

    /// What the job allows, mm.
    pub fn tolerance_mm(&self) -> f64 {
        self.setup.options.tolerance_mm
    }

    /// Samples of a candidate, about.
    pub fn n_samples(&self, settings: &Settings) -> u64 {
        let mark = |mark: &Mark| {
            let speed_mm_s = self.toolpath.pens[mark.pen_index].mark_speed_mm_s;
            mark.length_mm() / speed_mm_s + settings.jump_delay_s + settings.mark_delay_s
        };
        let time_s: f64 = self.toolpath.marks.iter().map(mark).sum();
        (time_s / self.setup.machine.output.period_s()).ceil().max(1.0) as u64
    }

    /// The settings, the audited plan and what the twin makes of it.
    pub fn play(&self, delays: Delays) -> Result<(Settings, Plan, Score), Error> {
        let Setup { machine, recipe, options, renderer } = self.setup;
        let settings = Settings::new(machine, &delays.recipe(recipe))?;
        let toolpath = self.toolpath.clone();
        let plan = classic::plan(toolpath, machine, &settings, options.tolerance_mm)?;
        let mut twin = self.twin.clone();
        let score = score(&plan, renderer.for_plan(&plan), &mut twin, &mut |_, _| {})?;
        Ok((settings, plan, score))
    }

    /// How near a candidate is to a goal. What cannot be planned is as far as can be.
    ///
    /// Light that is shorter than its mark's command counts as no plan: the contour error alone
    /// would best be kept by marking next to nothing.
    pub fn rank(&self, delays: Delays, goal: Goal) -> Rank {
        if delays.light_missing_us(&self.setup.machine.laser) > LIGHT_ROUNDING_US {
            return Rank::NONE;
        }
        self.figures(delays).map_or(Rank::NONE, |figures| {
            let coverage_um = if goal.coverage { figures.coverage_um } else { 0.0 };
            let error_um = figures.contour_um.max(coverage_um);
            let excess_um = (error_um - goal.tolerance_um).max(0.0);
            Rank { excess_um, duration_s: figures.duration_s }
        })
    }

    fn figures(&self, delays: Delays) -> Option<Figures> {
        if let Some(&known) = self.known().get(&delays) {
            return known;
        }
        let figures = self.play(delays).ok().map(|(_, _, score)| Figures {
            duration_s: score.duration_s,
            contour_um: score.contour_error_um.max,
            coverage_um: score.coverage_error_um.max,
        });
        self.known().insert(delays, figures);
        figures
    }

    /// How many candidates were played.
    pub fn n_played(&self) -> usize {
        self.known().len()
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<Delays, Option<Figures>>> {
        // Every entry is whole, whoever panicked.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
