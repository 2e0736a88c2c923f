//! A plan's words or voltages played on motors under their servo: where the mirrors are.

use super::{Renderer, Words};
use ftheta_model::block::Block;
use ftheta_model::space::MirrorAngles;
use ftheta_physics::axis_loop::AxisLoop;
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;

/// The mirrors of a plan, tick by tick: no noise, no sensor errors, no correction.
#[derive(Clone)]
pub struct PlayedMirrors<'a> {
    renderer: Renderer<'a>,
    axes: [AxisLoop; 2],
    mirror_row: State,
    rad_per_word: f64,
    block: Block,
    n_used: usize,
    tick: u64,
}

impl<'a> PlayedMirrors<'a> {
    /// At rest before the first sample.
    ///
    /// * `plant`: both motors
    /// * `gains`: of their servo
    pub fn new(plan: &'a Plan, plant: &Galvo, gains: Gains) -> Self {
        Self::of(Renderer::of_mirrors(plan, Words::new(plan)), plant, gains)
    }

    /// * `renderer`: of the mirrors alone, at its start
    pub(super) fn of(renderer: Renderer<'a>, plant: &Galvo, gains: Gains) -> Self {
        let machine = &renderer.plan.machine;
        let axis = AxisLoop::new(plant, gains, &machine.scanner, machine.output.period_s());
        Self {
            axes: [axis.clone(), axis],
            mirror_row: plant.mirror_row(),
            rad_per_word: machine.output.word_step_rad(),
            renderer,
            block: Block::default(),
            n_used: 0,
            tick: 0,
        }
    }

    /// Plays the next sample; `false` after the last one.
    pub fn advance(&mut self) -> bool {
        if self.n_used == self.block.words.len() {
            self.n_used = 0;
            if !self.renderer.next_block(&mut self.block) {
                return false;
            }
        }
        let word = self.block.words[self.n_used];
        for (axis, word) in [word.x, word.y].into_iter().enumerate() {
            match self.block.volts.get(self.n_used) {
                Some(planned) => self.axes[axis].tick_beside(&planned[axis], 0.0),
                None => self.axes[axis].tick(f64::from(word) * self.rad_per_word, 0.0),
            };
        }
        self.n_used += 1;
        self.tick += 1;
        true
    }

    /// Ticks played, at the end of which the mirrors are where [`Self::angles`] says.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Where the mirrors are, mechanical rad.
    pub fn angles(&self) -> MirrorAngles {
        let [x_rad, y_rad] = [0, 1].map(|axis| self.mirror_row.dot(self.axes[axis].state()));
        MirrorAngles { x_rad, y_rad }
    }
}
