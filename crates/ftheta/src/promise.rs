//! What contour error a plan promises on motors that the machine file is not certain of.

use crate::Error;
use ftheta_model::block::Block;
use ftheta_model::machine::Machine;
use ftheta_physics::axis_loop::AxisLoop;
use ftheta_physics::galvo::{Galvo, State};
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use ftheta_planner::render::Renderer;

/// Greatest errors while light is on, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Promise {
    /// Distance of the planned beam from its mark.
    pub planned_mm: f64,
    /// By how much the beam of a motor whose torsional mode is off by the machine file's uncertainty
    /// is beside the planned one.
    pub f1_mm: f64,
    /// The same for the torque constant.
    pub kt_mm: f64,
}

impl Promise {
    /// Contour error on any one of these motors.
    pub fn contour_mm(&self) -> f64 {
        self.planned_mm + self.f1_mm.max(self.kt_mm)
    }
}

/// Both axes of a motor, and how much its beam has been beside the nominal one, rad.
struct Motor {
    axes: [AxisLoop; 2],
    row: State,
    beside_rad: f64,
}

impl Motor {
    fn new(plant: &Galvo, gains: Gains, machine: &Machine) -> Self {
        let axis = AxisLoop::new(plant, gains, &machine.scanner, machine.output.period_s());
        Self { axes: [axis.clone(), axis], row: plant.mirror_row(), beside_rad: 0.0 }
    }

    fn mirrors_rad(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.row.dot(self.axes[axis].state()))
    }

    fn tick(&mut self, block: &Block, index: usize, rad_per_word: f64) {
        let word = block.words[index];
        for (axis, word) in [word.x, word.y].into_iter().enumerate() {
            match block.volts.get(index) {
                Some(planned) => self.axes[axis].tick_beside(&planned[axis], 0.0),
                None => self.axes[axis].tick(f64::from(word) * rad_per_word, 0.0),
            };
        }
    }
}

/// Plays a plan on the motors at the borders of the machine file's uncertainties, one at a time;
/// `None` for a plan whose distance from its marks is not known, as a classic one's.
///
/// # Errors
/// If the machine's servo cannot be built.
///
/// # Accuracy
/// At ticks; the field distance of an angle is taken in the field's centre.
pub fn promise(plan: &Plan) -> Result<Option<Promise>, Error> {
    let Some(planned_mm) = plan.planned_error_mm() else {
        return Ok(None);
    };
    let machine = &plan.machine;
    let scanner = &machine.scanner;
    let gains = Gains::design(scanner, machine.output.period_s())?;
    let nominal = Galvo::new(scanner);
    let plants = [-1.0, 1.0].map(|sign| {
        let omega = nominal.omega * (1.0 + sign * scanner.f1_uncertainty);
        let torque_constant = nominal.torque_constant * (1.0 + sign * scanner.kt_uncertainty);
        [Galvo { omega, ..nominal }, Galvo { torque_constant, ..nominal }]
    });
    let mut reference = Motor::new(&nominal, gains, machine);
    let mut motors = plants.as_flattened().iter().map(|plant| Motor::new(plant, gains, machine));
    let mut motors: [Motor; 4] = std::array::from_fn(|_| motors.next()).map(|motor| {
        motor.unwrap_or_else(|| Motor::new(&nominal, gains, machine))
    });
    let rad_per_word = machine.output.word_step_rad();
    let period_ns = i64::from(machine.output.period_ns);
    let mut renderer = Renderer::new(plan);
    let mut block = Block::default();
    let mut mark = 0;
    while renderer.next_block(&mut block) {
        for index in 0..block.words.len() {
            let end_ns = (block.first_index as i64 + index as i64 + 1) * period_ns;
            reference.tick(&block, index, rad_per_word);
            let lit = is_lit(plan, &mut mark, end_ns);
            let [x, y] = reference.mirrors_rad();
            for motor in &mut motors {
                motor.tick(&block, index, rad_per_word);
                if lit {
                    let [other_x, other_y] = motor.mirrors_rad();
                    motor.beside_rad = motor.beside_rad.max((other_x - x).hypot(other_y - y));
                }
            }
        }
    }
    let scale = scale_mm_per_rad(&machine.optics);
    let worst = |one: usize, other: usize| {
        scale * motors[one].beside_rad.max(motors[other].beside_rad)
    };
    Ok(Some(Promise { planned_mm, f1_mm: worst(0, 2), kt_mm: worst(1, 3) }))
}

/// Whether light is emitted at a time; times may not fall.
fn is_lit(plan: &Plan, mark: &mut usize, time_ns: i64) -> bool {
    let laser = &plan.machine.laser;
    while let Some(planned) = plan.marks.get(*mark) {
        if time_ns <= planned.off_ns as i64 + laser.off_latency_ns {
            return time_ns >= planned.on_ns as i64 + laser.on_latency_ns;
        }
        *mark += 1;
    }
    false
}
