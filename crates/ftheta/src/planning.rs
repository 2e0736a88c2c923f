//! From a toolpath to an audited plan, by the planner asked for or the best that the machine has.

use crate::Error;
use crate::mark::{MarkOptions, Stage};
use ftheta_model::machine::Machine;
use ftheta_model::plan::Planner;
use ftheta_model::toolpath::Toolpath;
use ftheta_model::warning::Warning;
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::plan::Plan;
use ftheta_planner::classic::{self, Settings};
use ftheta_planner::jump::{AxisOptions, CurrentBound, Model};
use ftheta_planner::optimal;

/// Part of the tolerance that may be left of a jump when a mark begins (`design/control.md`).
const JUMP_SHARE: f64 = 1.0 / 3.0;

/// What a toolpath is planned with.
pub(crate) struct Planning<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) settings: &'a Settings,
    pub(crate) options: &'a MarkOptions,
}

impl Planning<'_> {
    /// The audited plan by the planner asked for, or the best that the machine allows.
    pub(crate) fn plan(
        &self,
        toolpath: Toolpath,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Plan, Error> {
        let Self { machine, settings, options } = *self;
        let obstacle = optimal::obstacle(machine);
        if let (Some(Planner::Optimal), Some(why)) = (options.planner, obstacle) {
            return Err(Error::NoPlanner { planner: Planner::Optimal.name(), why });
        }
        if options.planner != Some(Planner::Classic) && obstacle.is_none() {
            return self.plan_optimal(&toolpath, warnings, observer);
        }
        let draft = classic::draft(toolpath, machine, settings, options.tolerance_mm)?;
        observer(Stage::Audit);
        Ok(Plan::new(draft)?)
    }

    fn plan_optimal(
        &self,
        toolpath: &Toolpath,
        warnings: &mut Vec<Warning>,
        observer: &mut dyn FnMut(Stage),
    ) -> Result<Plan, Error> {
        let Self { machine, settings, options } = *self;
        let (scanner, tolerance_mm) = (&machine.scanner, options.tolerance_mm);
        let epsilon_rad = JUMP_SHARE * tolerance_mm / scale_mm_per_rad(&machine.optics);
        let axis = AxisOptions {
            model: Model::Robust { epsilon_rad },
            tick_s: machine.output.period_s(),
            voltage_reserve: options.reserve,
            current_bound: CurrentBound::Always,
        };
        let mut atlas = options.atlas_store.load(scanner, axis, warnings)?;
        let n_kept = atlas.n_sequences();
        let longest_rad = optimal::longest_step_rad(toolpath, machine);
        while atlas.grow(longest_rad)? {
            observer(Stage::Atlas((atlas.reach_rad() / longest_rad).sqrt()));
        }
        let mut refused = None;
        for heat_share in optimal::HEAT_SHARES {
            observer(Stage::Plan);
            let jumps = (&mut atlas, heat_share);
            let draft = optimal::draft(toolpath.clone(), machine, settings, tolerance_mm, jumps)?;
            if atlas.n_sequences() > n_kept {
                options.atlas_store.save(scanner, &atlas, warnings);
            }
            observer(Stage::Audit);
            match Plan::new(draft) {
                Ok(plan) => return Ok(plan),
                Err(error) if error.is_heat() => refused = Some(error),
                Err(error) => return Err(error.into()),
            }
        }
        Err(refused.expect("there is a share, and it was refused").into())
    }
}
