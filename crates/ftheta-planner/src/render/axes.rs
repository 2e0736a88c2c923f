//! Both axes as the plan has them move, where commands are computed from voltages.

use super::track::{references, state};
use ftheta_model::machine::{Drive, Machine};
use ftheta_physics::follow::{Inverse, N_TAPS, TAPS_BEFORE, Taps};
use ftheta_physics::galvo::{Galvo, State, Step};
use ftheta_physics::servo::Gains;

/// What turns voltages into commands.
#[derive(Clone)]
pub(super) struct Axes {
    /// Nothing on a machine of which only the lag is known.
    model: Option<Model>,
    /// State at the tick of the next sample and voltage from it on, while they are known.
    now: Option<[(State, f64); 2]>,
    /// State a tick later, where a track has just ended: what follows goes on from there, since a
    /// path that bends sharply at its end is followed only nearly.
    later: Option<[State; 2]>,
}

#[derive(Clone)]
struct Model {
    gains: Gains,
    step: Step,
    inverse: Inverse,
    reference: Taps,
}

impl Axes {
    pub(super) fn new(machine: &Machine) -> Self {
        let model = match machine.output.drive {
            Drive::BlackBox => None,
            Drive::ServoKnown | Drive::Voltage => Model::new(machine),
        };
        Self { model, now: None, later: None }
    }

    /// The axes rest at these angles.
    pub(super) fn rest(&mut self, angles_rad: [f64; 2]) {
        self.later = None;
        self.now = Some(angles_rad.map(|rad| (State::new(rad, 0.0, 0.0, 0.0, 0.0), 0.0)));
    }

    /// The axes follow words that were not computed.
    pub(super) fn forget(&mut self) {
        self.later = None;
        self.now = None;
    }

    /// The command after which no voltage acts, if it is to be computed.
    pub(super) fn come_to_rest(&mut self) -> Option<[f64; 2]> {
        (self.model.is_some() && self.now.is_some()).then(|| self.drive([0.0; 2]))
    }

    /// The command after which these voltages act.
    #[inline]
    pub(super) fn drive(&mut self, next: [f64; 2]) -> [f64; 2] {
        let (Some(model), Some(now)) = (&self.model, &mut self.now) else {
            return next;
        };
        let mut angles_rad = next;
        let later = self.later.take();
        for (axis, (state, acting_v)) in now.iter_mut().enumerate() {
            let next_v = next[axis];
            let reference_rad = model.gains.reference_rad(state, *acting_v, next_v);
            *state = match later {
                Some(later) => later[axis],
                None => model.step.a * *state + model.step.b * *acting_v,
            };
            *acting_v = next_v;
            angles_rad[axis] =
                reference_rad.expect("a model is only made of a servo that has a reference");
        }
        angles_rad
    }

    /// The commands of samples of a track.
    ///
    /// * `angles_rad`: as [`super::track::Track::angles`] gives them
    /// * `ends`: whether the first sample is the track's first, the last its last
    pub(super) fn follow(
        &mut self,
        angles_rad: [&[f64]; 2],
        n_samples: usize,
        (first, last): (bool, bool),
        mut push: impl FnMut([f64; 2]),
    ) {
        let Some(model) = &self.model else {
            let [x_rad, y_rad] = angles_rad.map(|angles| &angles[TAPS_BEFORE + 2..]);
            x_rad.iter().zip(y_rad).take(n_samples).for_each(|(&x, &y)| push([x, y]));
            return;
        };
        let n_joints = usize::from(first && self.now.is_some());
        let left = angles_rad.map(|angles| &angles[n_joints..n_samples + N_TAPS - 1]);
        let reference = model.reference;
        let end = last.then(|| state(&model.inverse, angles_rad, n_samples));
        let after = last.then(|| state(&model.inverse, angles_rad, n_samples + 1));
        if n_joints == 1 {
            // The first command joins what was before to the first voltage of the track.
            let voltages_v = state(&model.inverse, angles_rad, 1).map(|(_, voltage_v)| voltage_v);
            push(self.drive(voltages_v));
        }
        references(&reference, left).for_each(push);
        self.now = end;
        self.later = after.map(|axes| axes.map(|(state, _)| state));
    }
}

impl Model {
    fn new(machine: &Machine) -> Option<Self> {
        let tick_s = machine.output.period_s();
        let galvo = Galvo::new(&machine.scanner);
        let gains = Gains::design(&machine.scanner, tick_s).ok()?;
        let inverse = Inverse::new(&galvo, &gains, tick_s)?;
        let reference = inverse.reference?;
        Some(Self { gains, step: galvo.step(tick_s), inverse, reference })
    }
}
