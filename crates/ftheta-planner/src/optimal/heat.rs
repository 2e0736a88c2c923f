//! Heat of the coils as the plan goes on.

use ftheta_model::machine::Machine;

/// Filtered squared current of both axes.
#[derive(Clone, Debug)]
pub(super) struct Heat {
    heat_a2: [f64; 2],
    heat_max_a2: f64,
    decay: f64,
}

impl Heat {
    /// Cold coils that may use a share of their steady heat.
    pub(super) fn new(machine: &Machine, share: f64) -> Self {
        let scanner = &machine.scanner;
        Self {
            heat_a2: [0.0; 2],
            heat_max_a2: share * scanner.current_rms_a.powi(2),
            decay: (-machine.output.period_s() / scanner.thermal_time_s).exp(),
        }
    }

    /// The same coils, cold.
    pub(super) fn cold(&self) -> Self {
        Self { heat_a2: [0.0; 2], ..self.clone() }
    }

    /// A tick with these currents at its end.
    pub(super) fn tick(&mut self, currents_a: [f64; 2]) {
        for (heat, current) in self.heat_a2.iter_mut().zip(currents_a) {
            let square = current * current;
            *heat = square + (*heat - square) * self.decay;
        }
    }

    /// So many ticks without current worth counting.
    pub(super) fn cool(&mut self, n_ticks: u32) {
        let left = self.decay.powf(f64::from(n_ticks));
        self.heat_a2 = self.heat_a2.map(|heat| heat * left);
    }

    /// Whether an axis is hotter than allowed.
    pub(super) fn is_hot(&self) -> bool {
        self.heat_a2.iter().any(|&heat| heat > self.heat_max_a2)
    }
}
