//! Heads with hidden errors, marks measured on them, and what a calibration leaves.
#![allow(dead_code, reason = "tests, bench and example each use a part")]

use ftheta::calibrate::calibrate::{CalibrateOptions, Calibration, Model, Noise, calibrate};
use ftheta::calibrate::mark::Mark;
use ftheta::model::calibration::MeasuredPoint;
use ftheta::model::machine::{Axis, Lens, Optics};
use ftheta::model::space::{FieldPoint, MirrorAngles};
use ftheta::physics::head::{Head, Tracer};
use ftheta::physics::optics::angles_from_field;
use ftheta::twin::hidden_head::hidden_head;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// The f = 420 mm lens of the presets.
pub const F420: [f64; 4] = [420.456, -6.051, 37.397, -55.24];

/// Places along a side of the grid on which errors are judged.
const N_JUDGED: usize = 41;

/// How marks are made and measured.
#[derive(Clone, Copy)]
pub struct Setup {
    pub n_side: usize,
    pub field_mm: f64,
    pub noise_um: f64,
    /// Part of the field over which marks are spread; errors are judged in all of it.
    pub reach: f64,
    /// Whether the machine file has the lens' polynomial, or its focal length alone.
    pub polynomial: bool,
    /// Times the errors that no model contains.
    pub stress: f64,
    pub model: Option<Model>,
    pub known_noise: bool,
}

impl Setup {
    pub fn new(n_side: usize, noise_um: f64, polynomial: bool) -> Self {
        Self {
            n_side,
            field_mm: 280.0,
            noise_um,
            reach: 1.0,
            polynomial,
            stress: 1.0,
            model: None,
            known_noise: false,
        }
    }

    /// What the machine file says.
    pub fn optics(&self) -> Optics {
        let coefficients_mm = if self.polynomial { F420.to_vec() } else { vec![F420[0]] };
        Optics::new(Lens::FTheta { coefficients_mm }, Axis::X, 336.0)
    }

    pub fn head(&self, seed: u64) -> Head {
        let truth = Self { polynomial: true, ..*self };
        let mut head = hidden_head(&truth.optics(), seed);
        let stress = self.stress;
        head.surface_mm = head.surface_mm.map(|v| v * stress);
        head.axis1_tilt_rad[0] *= stress;
        head.axis2_tilt_rad = head.axis2_tilt_rad.map(|v| v * stress);
        head.cone_rad[1] *= stress;
        for response in &mut head.response {
            response.fifth *= stress;
            response.ripple *= stress;
        }
        if let Some(lens) = &mut head.lens {
            lens.ripple_mm *= stress;
            lens.pupil_walk_mm *= stress;
            let nominal = [0.00165, 0.0015];
            let off = [0, 1].map(|k| nominal[k] + stress * (lens.stretch_per_mm[k] - nominal[k]));
            lens.stretch_per_mm = off;
        }
        head
    }

    /// Targets, row by row.
    pub fn targets(&self) -> Vec<FieldPoint> {
        grid(self.n_side, 0.5 * self.reach * self.field_mm)
    }

    /// Marks through the nominal inverse, measured with noise.
    pub fn marks(&self, head: &Head, seed: u64) -> Vec<Mark> {
        let optics = self.optics();
        let commands: Vec<_> =
            self.targets().iter().map(|&t| angles_from_field(&optics, t).unwrap()).collect();
        self.measured(head, &commands, 1, seed)
    }

    /// Marks made with certain commands, measured with noise.
    pub fn measured(
        &self,
        head: &Head,
        commands: &[MirrorAngles],
        round: u32,
        seed: u64,
    ) -> Vec<Mark> {
        let tracer = Tracer::new(head);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || -> f64 {
            let normal: f64 = StandardNormal.sample(&mut random);
            normal * self.noise_um * 1e-3
        };
        let pairs = self.targets().into_iter().zip(commands).zip(2..);
        pairs
            .map(|((target, &command), line)| {
                let place = tracer.place(command);
                let measured = FieldPoint::new(place.x_mm + noise(), place.y_mm + noise());
                Mark { target, command, measured, round, line }
            })
            .collect()
    }

    pub fn options(&self) -> CalibrateOptions {
        let sigma_mm = self.known_noise.then_some(self.noise_um * 1e-3);
        CalibrateOptions { model: self.model, noise: Noise { sigma_mm } }
    }

    /// Root mean square and greatest error over the field, µm, for one head.
    pub fn errors_um(&self, seed: u64) -> (Calibration, f64, f64) {
        let head = self.head(seed);
        let marks = self.marks(&head, seed ^ 0x5eed);
        let calibration = calibrate(&self.optics(), &marks, &self.options()).unwrap();
        let (rms, max) = self.judge_um(&head, &calibration);
        (calibration, rms, max)
    }

    /// The errors of a calibration on its head, µm.
    pub fn judge_um(&self, head: &Head, calibration: &Calibration) -> (f64, f64) {
        let tracer = Tracer::new(head);
        let optics = self.optics();
        let (mut square, mut greatest, mut n) = (0.0, 0.0f64, 0.0);
        for target in grid(N_JUDGED, 0.5 * self.field_mm) {
            let nominal = angles_from_field(&optics, target).unwrap();
            let place = tracer.place(calibration.command(target, nominal).unwrap());
            let error = (place.x_mm - target.x_mm).hypot(place.y_mm - target.y_mm) * 1e3;
            square += error * error;
            greatest = greatest.max(error);
            n += 1.0;
        }
        ((square / n).sqrt(), greatest)
    }
}

/// A square grid of places, row by row.
pub fn grid(n_side: usize, half_mm: f64) -> Vec<FieldPoint> {
    let at = |k: usize| half_mm * (2.0 * k as f64 / (n_side - 1) as f64 - 1.0);
    (0..n_side * n_side).map(|k| FieldPoint::new(at(k % n_side), at(k / n_side))).collect()
}

/// Marks as they are typed in.
pub fn points(marks: &[Mark]) -> Vec<MeasuredPoint> {
    let point = |mark: &Mark| MeasuredPoint {
        target_mm: mark.target,
        measured_mm: mark.measured,
        round: mark.round,
        line: mark.line,
    };
    marks.iter().map(point).collect()
}
