//! The two axes between ticks: exact states at sub-steps from one transition each.

use crate::mismatch::Mismatch;
use ftheta_model::block::VoltageSample;
use ftheta_model::machine::{Axis, Machine, Sensor};
use ftheta_model::space::{FieldPoint, MirrorAngles};
use ftheta_model::trace::AxisStates;
use ftheta_physics::axis_loop::AxisLoop;
use ftheta_physics::galvo::{CURRENT, Galvo, State};
use ftheta_physics::head::Tracer;
use ftheta_physics::lossy::LossyAxis;
use ftheta_physics::map_table::MapTable;
use ftheta_physics::optics::field_from_angles;
use ftheta_physics::servo::{Gains, ServoError};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Longest time between points of the trace, ns.
const STEP_MAX_NS: u32 = 2000;

/// What both axes are sent for a tick.
#[derive(Clone, Copy)]
pub enum Command<'a> {
    /// Angles, rad.
    Angles([f64; 2]),
    /// Voltages with planned states.
    Volts(&'a [VoltageSample; 2]),
}

/// Two axes, their sensors, and the optics behind them.
#[derive(Clone)]
pub struct Beam {
    axes: [AxisLoop; 2],
    /// Mirror angle at each sub-step of a tick from the states at its start and the voltage.
    substeps: Vec<(State, f64)>,
    /// Goes from sub-step to sub-step instead where the scanner has losses.
    lossy: Option<LossyAxis>,
    angle_row: State,
    speed_row: State,
    table: Option<MapTable>,
    /// The head as it really is; none is a perfect one.
    tracer: Option<Tracer>,
    machine: Machine,
    random: Xoshiro256PlusPlus,
    tick_s: f64,
    n_ticks: u64,
    angles: [f64; 2],
    voltages: [f64; 2],
}

impl Beam {
    /// Both axes at rest in the centre.
    ///
    /// # Errors
    /// If the machine's servo cannot be built.
    pub fn new(machine: &Machine, mismatch: &Mismatch, seed: u64) -> Result<Self, ServoError> {
        let scanner = &machine.scanner;
        let tick_s = machine.output.period_s();
        let nominal = Galvo::new(scanner);
        // The driver was tuned on the nominal axis and does not know of the mismatch.
        let gains = Gains::design(scanner, tick_s)?;
        let plant = mismatch.apply(&nominal);
        let axis = AxisLoop::new(&plant, gains, scanner, tick_s);
        let n_substeps = substeps(machine.output.period_ns);
        let row = plant.mirror_row();
        let substeps = (1..=n_substeps)
            .map(|index| {
                let step = plant.step(tick_s * f64::from(index) / f64::from(n_substeps));
                (step.a.transpose() * row, row.dot(&step.b))
            })
            .collect();
        let mut beam = Self {
            axes: [axis.clone(), axis],
            substeps,
            lossy: LossyAxis::new(&plant, scanner, tick_s / f64::from(n_substeps)),
            angle_row: row,
            speed_row: plant.mirror_speed_row(),
            table: None,
            tracer: None,
            machine: machine.clone(),
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            tick_s,
            n_ticks: 0,
            angles: [0.0; 2],
            voltages: [0.0; 2],
        };
        beam.tabulate();
        Ok(beam)
    }

    /// Puts another head behind the motors.
    pub fn set_head(&mut self, head: Tracer) {
        self.tracer = Some(head);
        self.tabulate();
    }

    /// Makes the table of the optics.
    fn tabulate(&mut self) {
        // A little further than the limit, where an overshoot may go.
        let reach_rad = 1.1 * self.machine.scanner.angle_max_rad;
        self.table = MapTable::new(reach_rad, 0.0, |x_rad, y_rad| {
            let place = self.exact_place([x_rad, y_rad]);
            Some([place.x_mm, place.y_mm])
        });
    }

    /// Number of trace points per tick.
    pub fn n_substeps(&self) -> usize {
        self.substeps.len()
    }

    /// Plays one tick with these commands, calls `visit` with the beam's place at each sub-step
    /// after its start.
    #[inline]
    pub fn tick(&mut self, command: Command<'_>, mut visit: impl FnMut(FieldPoint)) {
        let mut before = [*self.axes[0].state(), *self.axes[1].state()];
        for axis in 0..2 {
            let error_rad = self.sensor_error(axis);
            self.voltages[axis] = match command {
                Command::Angles(angles_rad) => self.axes[axis].tick(angles_rad[axis], error_rad),
                Command::Volts(samples) => self.axes[axis].tick_beside(&samples[axis], error_rad),
            };
        }
        self.n_ticks += 1;
        for index in 0..self.substeps.len() {
            if let Some(lossy) = &self.lossy {
                for (state, &voltage_v) in before.iter_mut().zip(&self.voltages) {
                    *state = lossy.advance(state, voltage_v);
                }
                self.angles = before.map(|state| self.angle_row.dot(&state));
            } else {
                let (row, per_volt) = &self.substeps[index];
                self.angles =
                    [0, 1].map(|axis| row.dot(&before[axis]) + per_volt * self.voltages[axis]);
            }
            visit(self.place());
        }
    }

    /// Where the beam is, in the field.
    #[inline]
    fn place(&self) -> FieldPoint {
        let [x_rad, y_rad] = self.angles;
        match self.table.as_ref().and_then(|table| table.value(x_rad, y_rad)) {
            Some([x_mm, y_mm]) => FieldPoint::new(x_mm, y_mm),
            None => self.exact_place(self.angles),
        }
    }

    fn exact_place(&self, [x_rad, y_rad]: [f64; 2]) -> FieldPoint {
        match (&self.tracer, self.machine.optics.first_mirror) {
            (None, _) => field_from_angles(&self.machine.optics, MirrorAngles::new(x_rad, y_rad)),
            (Some(head), Axis::X) => head.place(MirrorAngles::new(x_rad, y_rad)),
            (Some(head), Axis::Y) => {
                let place = head.place(MirrorAngles::new(y_rad, x_rad));
                FieldPoint::new(place.y_mm, place.x_mm)
            }
        }
    }

    /// What the axes do now.
    pub fn states(&self, time_ns: u64) -> AxisStates {
        let states = [self.axes[0].state(), self.axes[1].state()];
        AxisStates {
            time_ns,
            angle_rad: self.angles,
            speed_rad_s: states.map(|state| self.speed_row.dot(state)),
            current_a: states.map(|state| state[CURRENT]),
            voltage_v: self.voltages,
        }
    }

    fn sensor_error(&mut self, axis: usize) -> f64 {
        let Sensor { gain_error, nonlinearity, drift_rad_s, noise_rad } =
            self.machine.scanner.sensor;
        let mut error_rad = 0.0;
        if gain_error != 0.0 || nonlinearity != 0.0 {
            let angle_rad = self.axes[axis].rotor_rad();
            let share = angle_rad / self.machine.scanner.angle_max_rad;
            error_rad += angle_rad * (gain_error + nonlinearity * share * share);
        }
        if drift_rad_s != 0.0 {
            error_rad += drift_rad_s * self.n_ticks as f64 * self.tick_s;
        }
        if noise_rad != 0.0 {
            let normal: f64 = StandardNormal.sample(&mut self.random);
            error_rad += noise_rad * normal;
        }
        error_rad
    }
}

/// Fewest sub-steps of a whole number of nanoseconds that are short enough.
fn substeps(period_ns: u32) -> u32 {
    let fewest = period_ns.div_ceil(STEP_MAX_NS);
    (fewest..=period_ns).find(|&n| period_ns.is_multiple_of(n)).unwrap_or(period_ns)
}

#[cfg(test)]
mod tests {
    use super::substeps;

    #[test]
    fn substeps_are_short_and_whole() {
        for (period_ns, expected) in [(10_000, 5), (1_000, 1), (2_500, 2), (100_000, 50)] {
            assert_eq!(substeps(period_ns), expected);
        }
    }
}
