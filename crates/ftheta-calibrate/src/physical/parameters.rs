//! The mounting errors that are fitted, and how far a workshop may be off.

use ftheta_model::machine::{Lens, Optics};
use ftheta_physics::head::{Head, HeadLens};

/// An error of mounting that marks can tell.
#[derive(Clone, Copy)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
    /// How far off it usually is.
    pub sigma: f64,
    /// Puts it into a head.
    set: fn(&mut Head, f64),
}

/// A parameter as the marks have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty for a ratio.
    pub unit: &'static str,
    /// Its value, off the nominal one.
    pub value: f64,
    /// Standard deviation that the marks leave.
    pub sigma: f64,
    /// Standard deviation before any mark.
    pub prior: f64,
}

/// Mirror distance of a head whose lens hides it, mm: it does not move the field.
const HIDDEN_MM: f64 = 30.0;
/// Slopes of the chief ray by image height and focal length, x and y: typical of scan lenses.
const STRETCH: [f64; 2] = [0.70, 0.63];
/// Focal length for which the spread of the higher lens terms is stated, mm.
const LENS_MM: f64 = 420.0;

const fn parameter(
    name: &'static str,
    unit: &'static str,
    sigma: f64,
    set: fn(&mut Head, f64),
) -> Parameter {
    Parameter { name, unit, sigma, set }
}

/// Errors of every head.
const MOUNTING: [Parameter; 21] = [
    parameter("gain_x", "", 4e-3, |head, v| head.response[0].gain += v),
    parameter("gain_y", "", 4e-3, |head, v| head.response[1].gain += v),
    parameter("zero_x", "rad", 1.5e-3, |head, v| head.response[0].zero_rad += v),
    parameter("zero_y", "rad", 1.5e-3, |head, v| head.response[1].zero_rad += v),
    parameter("square_x", "", 2.5e-4, |head, v| head.response[0].square += v),
    parameter("square_y", "", 2.5e-4, |head, v| head.response[1].square += v),
    parameter("cube_x", "", 4e-4, |head, v| head.response[0].cube += v),
    parameter("cube_y", "", 4e-4, |head, v| head.response[1].cube += v),
    parameter("axis1_tilt_y", "rad", 2e-3, |head, v| head.axis1_tilt_rad[1] += v),
    parameter("cone1", "rad", 1e-3, |head, v| head.cone_rad[0] += v),
    parameter("cone2", "rad", 1e-3, |head, v| head.cone_rad[1] += v),
    parameter("axis1_tilt_x", "rad", 1.5e-3, |head, v| head.axis1_tilt_rad[0] += v),
    parameter("axis2_tilt_y", "rad", 1.5e-3, |head, v| head.axis2_tilt_rad[0] += v),
    parameter("axis2_tilt_z", "rad", 1.5e-3, |head, v| head.axis2_tilt_rad[1] += v),
    parameter("beam_tilt_y", "rad", 1.5e-3, |head, v| head.beam_tilt_rad[0] += v),
    parameter("beam_tilt_z", "rad", 1.5e-3, |head, v| head.beam_tilt_rad[1] += v),
    parameter("plane_slope_x", "", 2e-3, |head, v| head.plane.slope[0] += v),
    parameter("plane_slope_y", "", 2e-3, |head, v| head.plane.slope[1] += v),
    parameter("frame_x", "mm", 0.6, |head, v| head.frame.shift_mm[0] += v),
    parameter("frame_y", "mm", 0.6, |head, v| head.frame.shift_mm[1] += v),
    parameter("frame_rotation", "rad", 4e-3, |head, v| head.frame.rotation_rad += v),
];

/// Errors of a lens; the last two depend on whether its polynomial is known.
const LENS: [Parameter; 5] = [
    parameter("focal_length", "", 6e-3, |head, v| {
        with_lens(head, |lens| lens.coefficients_mm.iter_mut().for_each(|c| *c *= 1.0 + v));
    }),
    parameter("lens_tilt_x", "rad", 3e-3, |head, v| with_lens(head, |lens| lens.tilt_rad[0] += v)),
    parameter("lens_tilt_y", "rad", 3e-3, |head, v| with_lens(head, |lens| lens.tilt_rad[1] += v)),
    parameter("tangential_x", "", 8e-5, |head, v| with_lens(head, |lens| lens.tangential[0] += v)),
    parameter("tangential_y", "", 8e-5, |head, v| with_lens(head, |lens| lens.tangential[1] += v)),
];

/// Errors of a head that focuses before its mirrors.
const DISTANCES: [Parameter; 2] = [
    parameter("mirror_distance", "mm", 2.0, |head, v| head.mirror_distance_mm += v),
    parameter("working_distance", "mm", 5.0, |head, v| head.working_distance_mm += v),
];

fn with_lens(head: &mut Head, change: impl FnOnce(&mut HeadLens)) {
    if let Some(lens) = &mut head.lens {
        change(lens);
    }
}

/// A nominal head and what may be off it.
pub struct Parameters {
    nominal: Head,
    all: Vec<Parameter>,
}

impl Parameters {
    /// The parameters of a machine's head. A lens of which only the focal length is known may have
    /// any third and fifth order.
    pub fn new(optics: &Optics) -> Self {
        let mut all = MOUNTING.to_vec();
        let nominal = match &optics.lens {
            Lens::FTheta { coefficients_mm } => {
                let focal_mm = coefficients_mm[0];
                let known = coefficients_mm[1..].iter().any(|&c| c != 0.0);
                let orders_mm = if known { [2.0, 5.0, 10.0] } else { [20.0, 100.0, 100.0] };
                let [third_mm, fifth_mm, seventh_mm] =
                    orders_mm.map(|sigma_mm| sigma_mm * focal_mm / LENS_MM);
                // The focal length scales the others, so it is put in first.
                all.extend(LENS);
                all.push(parameter("lens_third_order", "mm", third_mm, |head, v| {
                    with_lens(head, |lens| lens.coefficients_mm[2] += v);
                }));
                all.push(parameter("lens_fifth_order", "mm", fifth_mm, |head, v| {
                    with_lens(head, |lens| lens.coefficients_mm[4] += v);
                }));
                all.push(parameter("lens_seventh_order", "mm", seventh_mm, |head, v| {
                    with_lens(head, |lens| lens.coefficients_mm[6] += v);
                }));
                let mut coefficients_mm = coefficients_mm.clone();
                coefficients_mm.resize(coefficients_mm.len().max(7), 0.0);
                let mut lens = HeadLens::perfect(coefficients_mm);
                lens.stretch_per_mm = STRETCH.map(|slope| slope / focal_mm);
                Head::perfect(HIDDEN_MM, focal_mm, Some(lens))
            }
            Lens::PostObjective { mirror_distance_mm, working_distance_mm } => {
                all.extend(DISTANCES);
                Head::perfect(*mirror_distance_mm, working_distance_mm - optics.plane_mm, None)
            }
        };
        Self { nominal, all }
    }

    /// The parameters.
    pub fn all(&self) -> &[Parameter] {
        &self.all
    }

    /// The head with these values, each in units of its sigma.
    pub fn head(&self, values: &[f64]) -> Head {
        let mut head = self.nominal.clone();
        for (parameter, value) in self.all.iter().zip(values) {
            (parameter.set)(&mut head, value * parameter.sigma);
        }
        head
    }
}
