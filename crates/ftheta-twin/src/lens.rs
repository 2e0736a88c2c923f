//! The focusing lens and its axis: what it is told, it does after its lag, within its limits.

use ftheta_model::machine::{Focus, Machine};
use ftheta_model::space::FieldPoint;
use ftheta_physics::focus::lens_travel_mm;

/// An axis of second order without overshoot, whose ramps are late by the lag.
#[derive(Clone, Debug)]
pub struct LensAxis {
    focus: Focus,
    /// How late it follows a ramp, s; a tick at least.
    lag_s: f64,
    tick_s: f64,
    at_mm: f64,
    speed_mm_s: f64,
}

impl LensAxis {
    /// At rest where the field's centre needs it; `None` for a machine without such a lens.
    ///
    /// * `late_s`: lag beside the machine file's
    pub fn new(machine: &Machine, late_s: f64) -> Option<Self> {
        let focus = machine.optics.focus.clone()?;
        let at_mm = lens_travel_mm(&machine.optics, FieldPoint::default())?;
        let tick_s = machine.output.period_s();
        let lag_s = (focus.lag_s + late_s).max(tick_s);
        Some(Self { focus, lag_s, tick_s, at_mm, speed_mm_s: 0.0 })
    }

    /// Travel at the end of a tick with this command, mm.
    ///
    /// Exact for a command that stands through the tick, as long as speed and acceleration keep
    /// their limits; where they would not, they are held there, and the lens falls behind.
    pub fn tick(&mut self, command_mm: f64) -> f64 {
        let Focus { travel_mm, speed_max_mm_s, acceleration_max_mm_s2, .. } = self.focus;
        let tick_s = self.tick_s;
        let off_mm = self.at_mm - command_mm.clamp(-travel_mm, travel_mm);
        // Both poles at -rate: off(t) = (off + slope t) exp(-rate t).
        let rate = 2.0 / self.lag_s;
        let slope = self.speed_mm_s + rate * off_mm;
        let decay = (-rate * tick_s).exp();
        let free_mm_s = (self.speed_mm_s - rate * slope * tick_s) * decay;
        let most = acceleration_max_mm_s2 * tick_s;
        let speed_mm_s = free_mm_s
            .clamp(self.speed_mm_s - most, self.speed_mm_s + most)
            .clamp(-speed_max_mm_s, speed_max_mm_s);
        self.at_mm += match speed_mm_s == free_mm_s {
            true => (off_mm + slope * tick_s) * decay - off_mm,
            false => 0.5 * (self.speed_mm_s + speed_mm_s) * tick_s,
        };
        self.speed_mm_s = speed_mm_s;
        self.at_mm
    }
}
