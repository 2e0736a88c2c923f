//! From a toolpath to an audited plan, by the planner asked for or the best that the machine has.

use crate::Error;
use crate::mark::{MarkOptions, Stage};
use crate::promise::{Promise, promise};
use ftheta_model::machine::{Machine, Scanner};
use ftheta_model::plan::Planner;
use ftheta_model::toolpath::Toolpath;
use ftheta_model::warning::Warning;
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use ftheta_planner::classic::{self, Settings};
use ftheta_planner::corner::Corners;
use ftheta_planner::jump::{Atlas, AxisOptions, CurrentBound, Model, Transitions};
use ftheta_planner::optimal::{self, Motions, OptimalOptions, OptimalPlanner, Restraint};

/// How much of the tolerance is used up knowingly.
#[derive(Clone, Copy)]
struct Care {
    /// Part of what a plan may miss its marks by that it does.
    share: f64,
    /// Part of the tolerance by which a mirror may be off when a mark begins, on any motor within
    /// the machine file's uncertainties.
    held: f64,
}

/// In the order to be tried: both mirrors off as far at once are rare, but there are jobs for them.
const CARES: [Care; 3] = [
    Care { share: 1.0, held: 0.75 },
    Care { share: 0.75, held: 0.75 },
    Care { share: 0.5, held: 0.65 },
];

/// What is left of a jump is not asked to be less than this, which any servo drowns, rad.
const EPSILON_MIN_RAD: f64 = 2e-8;
/// Nor more than this, which is no longer arrival, rad.
const EPSILON_MAX_RAD: f64 = 1e-3;
/// New sequences after which an atlas is kept although it is not complete.
const N_BETWEEN_SAVES: usize = 40;

/// What a toolpath is planned with.
pub(crate) struct Planning<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) settings: &'a Settings,
    pub(crate) options: &'a MarkOptions,
}

impl Planning<'_> {
    /// The audited plan by the planner asked for, or the best that the machine allows, and what it
    /// promises on motors that are not the nominal one.
    pub(crate) fn plan(
        &self,
        toolpath: Toolpath,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<(Plan, Option<Promise>), Error> {
        match self.options.planner {
            Some(Planner::Classic) => Ok((self.plan_classic(toolpath, observer)?, None)),
            Some(Planner::Optimal) | None if optimal::is_servo_known(self.machine) => {
                self.plan_with_care(&toolpath, warnings, observer)
            }
            Some(Planner::Optimal) | None => Ok((self.plan_by_lag(toolpath, observer)?, None)),
        }
    }

    /// Plans with ever more care, until the tolerance is kept on every motor within the machine
    /// file's uncertainties; where that cannot be, the plan that comes nearest.
    fn plan_with_care(
        &self,
        toolpath: &Toolpath,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<(Plan, Option<Promise>), Error> {
        let mut best: Option<(Plan, Promise)> = None;
        let mut refused = None;
        for care in CARES {
            let plan = match self.plan_optimal(toolpath, care, warnings, observer) {
                Ok(plan) => plan,
                Err(Error::Audit(error)) if error.is_miss() => {
                    refused = Some(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            let Some(promise) = promise(&plan)? else {
                return Ok((plan, None));
            };
            let promised_mm = promise.contour_mm();
            if best.as_ref().is_none_or(|(_, best)| promised_mm < best.contour_mm()) {
                best = Some((plan, promise));
            }
            if promised_mm <= self.options.tolerance_mm {
                break;
            }
        }
        match (best, refused) {
            (Some((plan, promise)), _) => Ok((plan, Some(promise))),
            (None, Some(error)) => Err(error.into()),
            (None, None) => Ok((self.plan_classic(toolpath.clone(), observer)?, None)),
        }
    }

    /// Plans for a head of which only the lag is known.
    fn plan_by_lag(
        &self,
        toolpath: Toolpath,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Plan, Error> {
        observer(Stage::Plan);
        let optimal = self.optimal(optimal::RESTRAINTS[0], self.options.reserve, CARES[0]);
        let planner = OptimalPlanner::new(self.machine, Motions::Lag, optimal)?;
        let draft = planner.draft(toolpath)?;
        observer(Stage::Audit);
        Ok(Plan::new(draft)?)
    }

    fn optimal(&self, restraint: Restraint, voltage_reserve: f64, care: Care) -> OptimalOptions {
        let MarkOptions { tolerance_mm, corner, .. } = *self.options;
        OptimalOptions { tolerance_mm, care: care.share, corner, voltage_reserve, restraint }
    }

    /// Plans with ever more restraint, until the audit finds that driver and coils stand it.
    fn plan_optimal(
        &self,
        toolpath: &Toolpath,
        care: Care,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Plan, Error> {
        let Self { machine, options, .. } = *self;
        let mut refused = None;
        for restraint in optimal::RESTRAINTS {
            let mut scanner = machine.scanner.clone();
            scanner.current_max_a *= 1.0 - restraint.current_reserve;
            let axis = self.axis_options(&restraint, care);
            let longest_rad = optimal::longest_step_rad(toolpath, machine);
            let atlas = self.atlas(&scanner, axis, longest_rad, warnings, observer)?;
            observer(Stage::Plan);
            let transitions = Transitions::with_atlas(atlas)?;
            let near = transitions.less_certain(&optimal::near_scanner(&scanner))?;
            let gains = Gains::design(&machine.scanner, axis.tick_s)?;
            let corners = Corners::new(&scanner, axis, Some(&gains))?;
            let motions =
                Motions::Known { transitions: &transitions, near: &near, corners: &corners };
            let optimal = self.optimal(restraint, axis.voltage_reserve, care);
            let planner = OptimalPlanner::new(machine, motions, optimal)?;
            let kept = [(&transitions, Some(&corners)), (&near, None)];
            for (transitions, corners) in kept {
                options.atlas_store.restore(transitions, corners, warnings);
            }
            planner.solve(toolpath);
            let draft = planner.draft(toolpath.clone());
            for (transitions, corners) in kept {
                options.atlas_store.save_solved(transitions, corners, warnings);
            }
            let draft = draft?;
            observer(Stage::Audit);
            match Plan::new(draft) {
                Ok(plan) => return Ok(plan),
                Err(error) if error.is_strain() => refused = Some(error),
                Err(error) => return Err(error.into()),
            }
        }
        let error = refused.expect("there is a restraint, and it was refused");
        if options.planner == Some(Planner::Optimal) {
            return Err(error.into());
        }
        let message = format!("jumps are planned as classic, since at the limit {error}");
        warnings.push(Warning::new("plan", message));
        self.plan_classic(toolpath.clone(), observer)
    }

    fn axis_options(&self, restraint: &Restraint, care: Care) -> AxisOptions {
        let Self { machine, options, .. } = *self;
        let epsilon_rad = care.held * options.tolerance_mm / scale_mm_per_rad(&machine.optics);
        AxisOptions {
            model: Model::Held { epsilon_rad: epsilon_rad.clamp(EPSILON_MIN_RAD, EPSILON_MAX_RAD) },
            tick_s: machine.output.period_s(),
            voltage_reserve: 1.0 - (1.0 - options.reserve) * (1.0 - restraint.voltage_reserve),
            current_bound: CurrentBound::Always,
        }
    }

    /// The atlas as far as the longest jump.
    fn atlas(
        &self,
        scanner: &Scanner,
        axis: AxisOptions,
        longest_rad: f64,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Atlas, Error> {
        let options = self.options;
        let mut atlas = options.atlas_store.load(scanner, axis, warnings)?;
        let mut n_kept = atlas.n_sequences();
        while atlas.grow(longest_rad)? {
            observer(Stage::Atlas((atlas.reach_rad() / longest_rad).sqrt()));
            // Now and then, so that little is lost when the build is interrupted.
            if atlas.n_sequences() >= n_kept + N_BETWEEN_SAVES {
                options.atlas_store.save(&atlas, warnings);
                n_kept = atlas.n_sequences();
            }
        }
        if atlas.n_sequences() > n_kept {
            options.atlas_store.save(&atlas, warnings);
        }
        Ok(atlas.up_to(longest_rad))
    }

    fn plan_classic(
        &self,
        toolpath: Toolpath,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Plan, Error> {
        let tolerance_mm = self.options.tolerance_mm;
        observer(Stage::Plan);
        let draft = classic::draft(toolpath, self.machine, self.settings, tolerance_mm)?;
        observer(Stage::Audit);
        Ok(Plan::new(draft)?)
    }
}
