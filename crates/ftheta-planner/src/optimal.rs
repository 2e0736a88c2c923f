//! Planner `optimal`: jumps at the limit of motors and resonance, from the jump atlas.
//!
//! Marks are still those of the classic planner, from rest to rest.

use crate::classic::Settings;
use crate::jump::{Atlas, Jump, N_LEVELS};
use crate::{PlanError, builder};
use ftheta_model::machine::{Drive, Machine, Servo};
use ftheta_model::plan::PlanDraft;
use ftheta_model::toolpath::Toolpath;
use ftheta_physics::audit::CORRECTION_RESERVE;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::optics::angles_from_field;
use ftheta_physics::servo::Gains;
use kurbo::Point;
use std::collections::BTreeMap;

/// How much of the machine jumps may use, since the servo's answer to what the marks have left adds
/// to them, and the marks themselves need some heat: how much is seen when the plan is audited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restraint {
    /// Part of the coil's steady heat that jumps may use.
    pub heat_share: f64,
    /// Part of the current that they leave.
    pub current_reserve: f64,
    /// Part of the voltage that they leave, of what the user's reserve has left.
    pub voltage_reserve: f64,
}

/// In the order to be tried.
pub const RESTRAINTS: [Restraint; 4] = [
    Restraint { heat_share: 0.95, current_reserve: 0.02, voltage_reserve: 0.0 },
    Restraint { heat_share: 0.8, current_reserve: 0.08, voltage_reserve: 0.08 },
    Restraint { heat_share: 0.6, current_reserve: 0.2, voltage_reserve: 0.2 },
    Restraint { heat_share: 0.4, current_reserve: 0.4, voltage_reserve: 0.4 },
];
/// Near the edge of the angles a jump is prolonged by this part at a time, so that its commands,
/// which lead the mirror, stay within them.
const LONGER: f64 = 1.0 / 12.0;
/// After so many prolongations a jump at constant speed, whose commands never lead, is as good.
const N_LONGER_MAX: usize = 3;

/// Why jumps of this machine cannot be planned by voltage, if they cannot.
pub fn obstacle(machine: &Machine) -> Option<&'static str> {
    match (machine.output.drive, machine.scanner.servo) {
        (Drive::BlackBox, _) => Some("the drive is a black box: what its servo does is not known"),
        (_, Servo::Pid { .. }) => Some("the memory of a PID servo would outlast the jump"),
        (_, Servo::StateFeedback { .. }) => None,
    }
}

/// The content of a plan with jumps from the atlas, before the audit.
///
/// * `atlas`: for this machine's scanner and period; extended as far as the jumps need
/// * `heat_share`: that of a [`Restraint`]
///
/// # Errors
/// As [`crate::classic::draft`], and if the atlas cannot be extended.
pub fn draft(
    toolpath: Toolpath,
    machine: &Machine,
    settings: &Settings,
    tolerance_mm: f64,
    (atlas, heat_share): (&mut Atlas, f64),
) -> Result<PlanDraft, PlanError> {
    let longest_rad = longest_step_rad(&toolpath, machine);
    atlas.extend(0, longest_rad)?;
    let n_ticks_max = atlas.jump(longest_rad).map_or(0, |jump| jump.n_ticks);
    let jumps = Jumps {
        machine,
        atlas,
        galvo: Galvo::new(&machine.scanner),
        gains: Gains::design(&machine.scanner, machine.output.period_s())?,
        used: BTreeMap::new(),
        sequences_v: Vec::new(),
        heat_a2: [0.0; 2],
        heat_max_a2: heat_share * machine.scanner.current_rms_a.powi(2),
        n_ticks_max,
    };
    builder::draft(toolpath, machine, settings, tolerance_mm, Some(jumps))
}

/// The longest step that an axis takes from the centre through the marks and back, rad.
pub fn longest_step_rad(toolpath: &Toolpath, machine: &Machine) -> f64 {
    let angles = |place: Point| angles_from_field(&machine.optics, place.into());
    let mut at = angles(Point::ZERO);
    let mut longest_rad = 0.0_f64;
    for mark in &toolpath.marks {
        if let (Some(from), Some(to)) = (at, angles(mark.start())) {
            let step_rad = (to.x_rad - from.x_rad).abs().max((to.y_rad - from.y_rad).abs());
            longest_rad = longest_rad.max(step_rad);
        }
        at = mark.points.last().and_then(|&end| angles(end));
    }
    // And back to the centre.
    let back_rad = at.map_or(0.0, |end| end.x_rad.abs().max(end.y_rad.abs()));
    longest_rad.max(back_rad)
}

/// Chooses sequences of the atlas, and lets the coils cool where they must.
pub(crate) struct Jumps<'a> {
    machine: &'a Machine,
    atlas: &'a mut Atlas,
    galvo: Galvo,
    gains: Gains,
    /// Sequences used so far, by level and number of ticks.
    used: BTreeMap<(usize, usize), Used>,
    sequences_v: Vec<Vec<f64>>,
    /// Filtered squared current of each axis, A².
    heat_a2: [f64; 2],
    heat_max_a2: f64,
    /// Ticks of the job's longest jump: none is prolonged beyond, which would need programs that no
    /// other jump does.
    n_ticks_max: usize,
}

/// A jump that was chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chosen {
    /// Ticks to wait before, for the coils to cool.
    pub(crate) n_wait: u32,
    /// Ticks of the jump.
    pub(crate) n_ticks: u32,
    /// Index of its sequence.
    pub(crate) sequence: u32,
}

/// What one sequence does at a factor of one.
#[derive(Clone, Copy, Debug)]
struct Used {
    /// Index in the plan, once a jump uses it.
    sequence: Option<u32>,
    /// Range of the commands, rad from the start.
    commands_rad: (f64, f64),
    speed_rad_s: f64,
    /// By how much it raises the heat, A².
    heat_a2: f64,
}

impl Jumps<'_> {
    /// The sequences that the chosen jumps refer to, V.
    pub(crate) fn into_sequences(self) -> Vec<Vec<f64>> {
        self.sequences_v
    }

    /// Lets the coils cool for so many ticks; what marks add is in the share left to them.
    pub(crate) fn cool(&mut self, n_ticks: f64) {
        let left = (-n_ticks * self.period_s() / self.machine.scanner.thermal_time_s).exp();
        self.heat_a2 = self.heat_a2.map(|heat| heat * left);
    }

    /// The jump that arrives first, or `None` where only a slow one stays within the angles.
    pub(crate) fn plan(&mut self, from: Point, to: Point) -> Result<Option<Chosen>, PlanError> {
        let optics = &self.machine.optics;
        let angles = |place: Point| angles_from_field(optics, place.into());
        let (Some(start), Some(end)) = (angles(from), angles(to)) else {
            return Ok(None);
        };
        let starts_rad = [start.x_rad, start.y_rad];
        let steps_rad = [end.x_rad - start.x_rad, end.y_rad - start.y_rad];
        let mut best: Option<(usize, usize, usize)> = None;
        for level in 0..N_LEVELS {
            // What leaves the angles at the first level leaves them at all.
            let Some((n_ticks, rises_a2)) = self.shortest(level, starts_rad, steps_rad)? else {
                break;
            };
            let Some(n_wait) = self.wait(rises_a2) else {
                continue;
            };
            if best.is_none_or(|(_, n_before, ticks)| n_wait + n_ticks <= n_before + ticks) {
                best = Some((level, n_wait, n_ticks));
            }
            if n_wait == 0 {
                break;
            }
        }
        best.map(|(level, n_wait, n_ticks)| self.choose(level, n_wait, n_ticks, steps_rad))
            .transpose()
    }

    /// Fewest ticks of a level that keep commands and speed in range, and the rise in heat.
    fn shortest(
        &mut self,
        level: usize,
        starts_rad: [f64; 2],
        steps_rad: [f64; 2],
    ) -> Result<Option<(usize, [f64; 2])>, PlanError> {
        let distance_rad = steps_rad[0].abs().max(steps_rad[1].abs());
        self.atlas.extend(level, distance_rad)?;
        let first = self.atlas.jump_at(level, distance_rad, 0).map_or(0, |jump| jump.n_ticks);
        let scanner = &self.machine.scanner;
        let free = 1.0 - CORRECTION_RESERVE;
        let angle_max_rad = (free * scanner.angle_max_rad).min(self.machine.output.word_range_rad);
        let speed_max_rad_s = free * scanner.speed_max_rad_s;
        for longer in 0..=N_LONGER_MAX {
            let n_ticks = first + (first as f64 * LONGER * longer as f64).ceil() as usize;
            if longer > 0 && n_ticks > self.n_ticks_max {
                break;
            }
            self.atlas.extend_ticks(level, n_ticks)?;
            let Some(jump) = self.atlas.jump_at(level, distance_rad, n_ticks) else {
                return Ok(None);
            };
            let reach_rad = distance_rad / jump.scale;
            let used = self
                .used
                .entry((level, n_ticks))
                .or_insert_with(|| measure(&jump, self.machine, &self.galvo, &self.gains));
            let within = (0..2).all(|axis| {
                let factor = steps_rad[axis] / reach_rad;
                let (low, high) = used.commands_rad;
                let places = [low, high].map(|rad| starts_rad[axis] + factor * rad);
                places.iter().all(|place| place.abs() <= angle_max_rad)
                    && factor.abs() * used.speed_rad_s <= speed_max_rad_s
            });
            if within {
                let rise = |step_rad: f64| (step_rad / reach_rad).powi(2) * used.heat_a2;
                return Ok(Some((n_ticks, steps_rad.map(rise))));
            }
        }
        Ok(None)
    }

    /// Ticks until both coils stand a jump; `None` if one never does.
    fn wait(&self, rises_a2: [f64; 2]) -> Option<usize> {
        let mut n_wait = 0.0_f64;
        for (heat_a2, rise_a2) in self.heat_a2.into_iter().zip(rises_a2) {
            let room_a2 = self.heat_max_a2 - rise_a2;
            if room_a2 <= 0.0 {
                return None;
            }
            let wait_s = self.machine.scanner.thermal_time_s * (heat_a2 / room_a2).ln();
            n_wait = n_wait.max((wait_s / self.period_s()).ceil());
        }
        Some(n_wait as usize)
    }

    fn choose(
        &mut self,
        level: usize,
        n_wait: usize,
        n_ticks: usize,
        steps_rad: [f64; 2],
    ) -> Result<Chosen, PlanError> {
        let distance_rad = steps_rad[0].abs().max(steps_rad[1].abs());
        let jump = self
            .atlas
            .jump_at(level, distance_rad, n_ticks)
            .expect("the jump was found when its ticks were counted");
        let used = self
            .used
            .entry((level, n_ticks))
            .or_insert_with(|| measure(&jump, self.machine, &self.galvo, &self.gains));
        let sequence = *used.sequence.get_or_insert_with(|| {
            self.sequences_v.push(jump.sequence.to_vec());
            (self.sequences_v.len() - 1) as u32
        });
        let (full_a2, reach_rad) = (used.heat_a2, distance_rad / jump.scale);
        self.cool((n_wait + n_ticks) as f64);
        for (heat_a2, step_rad) in self.heat_a2.iter_mut().zip(steps_rad) {
            *heat_a2 += (step_rad / reach_rad).powi(2) * full_a2;
        }
        Ok(Chosen { n_wait: n_wait as u32, n_ticks: n_ticks as u32, sequence })
    }

    fn period_s(&self) -> f64 {
        self.machine.output.period_s()
    }
}

/// Plays a sequence on the nominal axis.
fn measure(jump: &Jump<'_>, machine: &Machine, galvo: &Galvo, gains: &Gains) -> Used {
    let tick_s = machine.output.period_s();
    let speed_row = galvo.mirror_speed_row();
    let mut used =
        Used { sequence: None, commands_rad: (0.0, 0.0), speed_rad_s: 0.0, heat_a2: 0.0 };
    let commands = crate::render::references_rad(jump.sequence, galvo, gains, tick_s);
    for command in commands {
        let (low, high) = used.commands_rad;
        used.commands_rad = (low.min(command), high.max(command));
    }
    let step = galvo.step(tick_s);
    let mut state = State::zeros();
    for &voltage in jump.sequence {
        let before_a = state[CURRENT];
        state = step.a * state + step.b * voltage;
        let after_a = state[CURRENT];
        used.speed_rad_s = used.speed_rad_s.max(speed_row.dot(&state).abs());
        // The larger of a tick's ends: never less than what is there.
        let peak_a2 = before_a.powi(2).max(after_a.powi(2));
        used.heat_a2 += peak_a2 * tick_s / machine.scanner.thermal_time_s;
    }
    used
}
