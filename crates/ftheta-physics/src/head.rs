//! A scan head as it was really built: a ray traced through two mirrors with their mounting errors,
//! a lens that is tilted and off centre, to a work plane that is not quite square to it.
//!
//! Frame: mirror 1 turns about an axis parallel to z at (0, -e, 0), mirror 2 about x through the
//! origin; the laser comes along +x, leaves mirror 1 along +y and mirror 2 along -z. A perfect head
//! gives the closed forms of [`crate::optics`] with the first mirror moving x.
//!
//! Source: `design/optics.md` A.4 and `reference/head_model.py` (every term, order and sign).

mod trace;

pub use trace::{Tracer, solve};

/// What a head is made of, and every way in which it is off. Lengths mm, angles rad.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// Distance e of the two mirrors' axes.
    pub mirror_distance_mm: f64,
    /// Distance d of mirror 2 to the work plane; used without a lens only.
    pub working_distance_mm: f64,
    /// Distance of each mirror's surface from its axis, towards the beam.
    pub surface_mm: [f64; 2],
    /// Whether the laser was moved so that the beam in rest meets the centre despite `surface_mm`.
    pub aligned: bool,
    /// Offset of the laser beam before mirror 1, along y and z.
    pub beam_offset_mm: [f64; 2],
    /// Direction error of the laser beam, along y and z.
    pub beam_tilt_rad: [f64; 2],
    /// Rotation of mirror 1's axis about x and y.
    pub axis1_tilt_rad: [f64; 2],
    /// Rotation of mirror 2's axis about y and z.
    pub axis2_tilt_rad: [f64; 2],
    /// Angle by which each mirror's normal is not square to its axis.
    pub cone_rad: [f64; 2],
    /// How each mirror's angle follows its command.
    pub response: [Response; 2],
    /// Lens behind the mirrors; without one the beam is focused before them.
    pub lens: Option<HeadLens>,
    /// The work plane.
    pub plane: Plane,
    /// The frame in which the field is measured.
    pub frame: Frame,
}

/// Mechanical angle of a mirror by its command c, as a share of [`Response::FULL_SCALE_RAD`]:
/// `zero + FS·(gain·c + square·c² + cube·c³ + fifth·c⁵ + ripple·sin 3πc)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Angle at command zero, rad.
    pub zero_rad: f64,
    /// Gain, near one.
    pub gain: f64,
    /// Quadratic term, share of full scale.
    pub square: f64,
    /// Cubic term, share of full scale.
    pub cube: f64,
    /// Fifth-order term, share of full scale.
    pub fifth: f64,
    /// Amplitude of the sensor's ripple, share of full scale.
    pub ripple: f64,
}

/// An F-theta lens with its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadLens {
    /// Image height = c1·Θ + c2·Θ² + ..., mm per radⁿ.
    pub coefficients_mm: Vec<f64>,
    /// Tilt about x and y.
    pub tilt_rad: [f64; 2],
    /// Decentring, as a shift of the image.
    pub decentre_mm: [f64; 2],
    /// Tangential distortion, relative at an image height of [`HeadLens::RADIUS_MM`].
    pub tangential: [f64; 2],
    /// Amplitude of a radial residual, `ripple · sin(2.2 π h / R)`.
    pub ripple_mm: f64,
    /// Distortion at an image height of R where the beam has walked 10 mm off the pupil.
    pub pupil_walk_mm: f64,
    /// Slope of the chief ray per image height, along x and y: how far from telecentric it is.
    pub stretch_per_mm: [f64; 2],
}

/// Height of the work plane away from the lens: `height + slope_x·x + slope_y·y`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plane {
    /// Height in the centre, mm.
    pub height_mm: f64,
    /// Slope along x and y.
    pub slope: [f64; 2],
}

/// Where the measuring frame lies: a place is turned by `rotation_rad`, then shifted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    /// Shift, mm.
    pub shift_mm: [f64; 2],
    /// Rotation, counter-clockwise.
    pub rotation_rad: f64,
}

impl Response {
    /// Full scale of a command, mechanical rad: 11.7°.
    pub const FULL_SCALE_RAD: f64 = 11.7 * std::f64::consts::PI / 180.0;

    /// The angle is the command.
    pub const PERFECT: Self =
        Self { zero_rad: 0.0, gain: 1.0, square: 0.0, cube: 0.0, fifth: 0.0, ripple: 0.0 };

    /// The mirror's angle, rad.
    #[inline]
    pub fn angle_rad(&self, command_rad: f64) -> f64 {
        let c = command_rad / Self::FULL_SCALE_RAD;
        let mut share = c * (self.gain + c * (self.square + c * (self.cube + c * c * self.fifth)));
        if self.ripple != 0.0 {
            share += self.ripple * (3.0 * std::f64::consts::PI * c).sin();
        }
        self.zero_rad + Self::FULL_SCALE_RAD * share
    }
}

impl HeadLens {
    /// Image height to which the errors of a lens are related, mm.
    pub const RADIUS_MM: f64 = 200.0;

    /// A lens that follows its polynomial and stands straight.
    pub fn perfect(coefficients_mm: Vec<f64>) -> Self {
        Self {
            coefficients_mm,
            tilt_rad: [0.0; 2],
            decentre_mm: [0.0; 2],
            tangential: [0.0; 2],
            ripple_mm: 0.0,
            pupil_walk_mm: 0.0,
            stretch_per_mm: [0.0; 2],
        }
    }
}

impl Head {
    /// A head without any error.
    ///
    /// * `lens`: none for a head that focuses before its mirrors
    pub fn perfect(
        mirror_distance_mm: f64,
        working_distance_mm: f64,
        lens: Option<HeadLens>,
    ) -> Self {
        Self {
            mirror_distance_mm,
            working_distance_mm,
            surface_mm: [0.0; 2],
            aligned: true,
            beam_offset_mm: [0.0; 2],
            beam_tilt_rad: [0.0; 2],
            axis1_tilt_rad: [0.0; 2],
            axis2_tilt_rad: [0.0; 2],
            cone_rad: [0.0; 2],
            response: [Response::PERFECT; 2],
            lens,
            plane: Plane::default(),
            frame: Frame::default(),
        }
    }
}
