//! A closed path as harmonics of the mirrors' angles, and what motor and driver do for each.

use super::Ellipse;
use crate::PlanError;
use ftheta_model::machine::Machine;
use ftheta_model::space::FieldPoint;
use ftheta_physics::galvo::{Galvo, State, Step};
use ftheta_physics::optics::angles_from_field;
use kurbo::{Arc, BezPath, Point, Shape};
use nalgebra::{Complex, SMatrix, SVector};
use std::f64::consts::TAU;

/// Places of a turn that the angles are taken from.
const N_PLACES: usize = 512;
/// Harmonics up to this part of the ticks' rate.
const RATE_SHARE: f64 = 0.25;
/// Smaller ones are rounding of the optics, rad.
const SMALLEST_RAD: f64 = 1e-14;
/// Fewest and most ticks of a turn.
const N_TICKS: (f64, f64) = (10.0, 1e7);
/// Steps of Newton's method, which doubles its digits.
const N_NEWTON: usize = 6;
/// Distance of the stored curve from the true one, mm: what a trace resolves.
const CURVE_MM: f64 = 1e-6;
/// Nodes and weights of Gauss's rule with five places, on -1 to 1.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 128.0 / 225.0),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Both axes at a tick.
pub(super) type States = [State; 2];

/// States and voltages of both axes on a closed path.
pub(super) struct Harmonics {
    axes: [Vec<Wave>; 2],
}

/// One harmonic of one axis.
struct Wave {
    order: f64,
    states: SVector<Complex<f64>, 5>,
    voltage_v: Complex<f64>,
}

impl Ellipse {
    /// Its length, mm.
    ///
    /// # Accuracy
    /// 1e-9 of it up to axes of 1:20.
    pub fn length_mm(&self) -> f64 {
        let step = TAU / N_PLACES as f64;
        (0..N_PLACES).map(|index| self.arc_mm(index as f64 * step, step)).sum()
    }

    /// Distance of a place from it, mm; outside is positive.
    ///
    /// # Accuracy
    /// Of a small distance d, `d / r` of it, where r is the smaller radius.
    pub fn distance_mm(&self, place: Point) -> f64 {
        let off = place - self.centre;
        let (x, y) = (off.x / self.radii_mm.x, off.y / self.radii_mm.y);
        let level = x.hypot(y);
        let slope = (x / self.radii_mm.x).hypot(y / self.radii_mm.y);
        (level - 1.0) * level / slope
    }

    fn place(&self, angle_rad: f64) -> FieldPoint {
        let (sin, cos) = angle_rad.sin_cos();
        let x_mm = self.centre.x + self.radii_mm.x * cos;
        FieldPoint::new(x_mm, self.centre.y + self.radii_mm.y * sin)
    }

    /// Length per angle of the parameter, mm.
    fn slope_mm(&self, angle_rad: f64) -> f64 {
        let (sin, cos) = angle_rad.sin_cos();
        (self.radii_mm.x * sin).hypot(self.radii_mm.y * cos)
    }

    /// Length over a stretch of the parameter.
    fn arc_mm(&self, from_rad: f64, stretch_rad: f64) -> f64 {
        let half = 0.5 * stretch_rad;
        let at =
            |(node, weight): (f64, f64)| weight * self.slope_mm(from_rad + half * (1.0 + node));
        half * GAUSS.into_iter().map(at).sum::<f64>()
    }

    /// Angles of the parameter at equal distances along it, from the place farthest in x on.
    fn even_angles(&self) -> Vec<f64> {
        let step_mm = self.length_mm() / N_PLACES as f64;
        let mut angle_rad = 0.0;
        let mut angles_rad = Vec::with_capacity(N_PLACES);
        for _ in 0..N_PLACES {
            angles_rad.push(angle_rad);
            let mut stretch_rad = step_mm / self.slope_mm(angle_rad);
            for _ in 0..N_NEWTON {
                let missing_mm = step_mm - self.arc_mm(angle_rad, stretch_rad);
                stretch_rad += missing_mm / self.slope_mm(angle_rad + stretch_rad);
            }
            angle_rad += stretch_rad;
        }
        angles_rad
    }

    /// Its curve from this many turns, in `N_PLACES`, after the place farthest in x.
    pub(super) fn curve(&self, turns: f64) -> BezPath {
        let start_angle = self.even_angles()[(turns * N_PLACES as f64) as usize % N_PLACES];
        let (center, radii) = (self.centre, self.radii_mm);
        Arc { center, radii, start_angle, sweep_angle: TAU, x_rotation: 0.0 }.to_path(CURVE_MM)
    }
}

impl Harmonics {
    pub(super) fn new(machine: &Machine, ellipse: &Ellipse) -> Result<Self, PlanError> {
        let turn_ticks = ellipse.length_mm() / ellipse.speed_mm_s / machine.output.period_s();
        let (low, high) = N_TICKS;
        if !(low..=high).contains(&turn_ticks) {
            return Err(PlanError::Setting {
                place: "circle".into(),
                quantity: "samples of a turn",
                value: turn_ticks,
                low,
                high,
                unit: "",
            });
        }
        let mut angles = [Vec::with_capacity(N_PLACES), Vec::with_capacity(N_PLACES)];
        for angle_rad in ellipse.even_angles() {
            let place = ellipse.place(angle_rad);
            let (x_mm, y_mm) = (place.x_mm, place.y_mm);
            let there = angles_from_field(&machine.optics, place)
                .ok_or(PlanError::Unreachable { x_mm, y_mm })?;
            angles[0].push(there.x_rad);
            angles[1].push(there.y_rad);
        }
        let galvo = Galvo::new(&machine.scanner);
        let step = galvo.step(machine.output.period_s());
        let row = galvo.mirror_row();
        let n_orders = ((RATE_SHARE * turn_ticks) as usize).min(N_PLACES / 4);
        let axes = angles.map(|angles_rad| {
            let wave = |order: usize| {
                let angle_rad = amplitude(&angles_rad, order);
                let is_small = order > 0 && angle_rad.norm() < SMALLEST_RAD;
                if is_small { None } else { Wave::new(&step, &row, order, turn_ticks, angle_rad) }
            };
            (0..=n_orders).filter_map(wave).collect()
        });
        Ok(Self { axes })
    }

    /// States of both axes at this many turns after the place farthest in x.
    pub(super) fn states(&self, turns: f64) -> States {
        self.axes.each_ref().map(|waves| {
            let at = |wave: &Wave| (wave.states * wave.turned(turns)).map(|value| value.re);
            waves.iter().map(at).sum()
        })
    }

    /// Voltages of the tick that begins there.
    pub(super) fn voltages_v(&self, turns: f64) -> [f64; 2] {
        let at = |wave: &Wave, turns: f64| (wave.voltage_v * wave.turned(turns)).re;
        self.axes.each_ref().map(|waves| waves.iter().map(|wave| at(wave, turns)).sum())
    }
}

impl Wave {
    /// The motor's answer at the ticks; `None` for a frequency at which it has none.
    fn new(
        step: &Step,
        row: &State,
        order: usize,
        turn_ticks: f64,
        angle_rad: Complex<f64>,
    ) -> Option<Self> {
        if order == 0 {
            // At rest anywhere no voltage is needed.
            let mut states = SVector::zeros();
            states[0] = angle_rad;
            return Some(Self { order: 0.0, states, voltage_v: Complex::ZERO });
        }
        let ahead = Complex::from_polar(1.0, TAU * order as f64 / turn_ticks);
        let resolvent = SMatrix::<Complex<f64>, 5, 5>::from_fn(|row, column| {
            let diagonal = if row == column { ahead } else { Complex::ZERO };
            diagonal - step.a[(row, column)]
        });
        let per_volt = resolvent.lu().solve(&step.b.map(Complex::from))?;
        let mirror: Complex<f64> =
            row.iter().zip(per_volt.iter()).map(|(row, state)| state * *row).sum();
        let voltage_v = angle_rad / mirror;
        Some(Self { order: order as f64, states: per_volt * voltage_v, voltage_v })
    }

    fn turned(&self, turns: f64) -> Complex<f64> {
        Complex::from_polar(1.0, TAU * (self.order * turns).fract())
    }
}

/// Amplitude of a harmonic of evenly spaced values of one turn.
fn amplitude(values: &[f64], order: usize) -> Complex<f64> {
    let n = values.len();
    let back =
        |index: usize| Complex::from_polar(1.0, -TAU * ((order * index) % n) as f64 / n as f64);
    let sum: Complex<f64> =
        values.iter().enumerate().map(|(index, value)| back(index) * *value).sum();
    sum * (if order == 0 { 1.0 } else { 2.0 } / n as f64)
}
