//! A machine: scanner, optics, laser and output, as the user's machine file states them.

/// Everything the planner knows of a machine; the twin may have other values.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Preset or file name.
    pub name: String,
    /// The motors, equal on both axes.
    pub scanner: Scanner,
    /// Mirrors and lens.
    pub optics: Optics,
    /// The source.
    pub laser: Laser,
    /// What is sent.
    pub output: Output,
}

/// One galvanometer axis: limited-rotation motor, shaft, mirror, driver.
#[derive(Clone, Debug, PartialEq)]
pub struct Scanner {
    /// Inertia of the rotor, kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Inertia of the mirror, kg·m².
    pub mirror_inertia_kg_m2: f64,
    /// Torque per current, N·m/A; equal to the back-EMF constant in V·s/rad.
    pub torque_constant_n_m_a: f64,
    /// Coil resistance, ohm.
    pub resistance_ohm: f64,
    /// Coil inductance, H.
    pub inductance_h: f64,
    /// First torsional mode of the free rotor and mirror, Hz.
    pub torsional_mode_hz: f64,
    /// Damping ratio of that mode.
    pub damping_ratio: f64,
    /// Greatest driver voltage, V, either sign.
    pub voltage_max_v: f64,
    /// Greatest driver current, A, either sign.
    pub current_max_a: f64,
    /// Current that the coil stands for ever, A rms.
    pub current_rms_a: f64,
    /// Thermal time constant of the coil, s.
    pub thermal_time_s: f64,
    /// Greatest mechanical angle, rad, either sign.
    pub angle_max_rad: f64,
    /// Greatest mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// Relative uncertainty of the torsional mode that plans must stand.
    pub f1_uncertainty: f64,
    /// Relative uncertainty of the torque constant that plans must stand.
    pub kt_uncertainty: f64,
    /// What makes the axis nonlinear.
    pub losses: Losses,
    /// The position loop of the driver.
    pub servo: Servo,
    /// The position sensor.
    pub sensor: Sensor,
}

/// Torque that an axis loses to its angle and to friction; all zero is a linear axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// Relative loss of the torque constant at the greatest angle; it grows with the angle squared.
    pub torque_falloff: f64,
    /// Coulomb friction on the rotor, N·m.
    pub friction_coulomb_n_m: f64,
    /// Viscous friction on the rotor, N·m·s/rad.
    pub friction_viscous_n_m_s_rad: f64,
}

/// The position loop inside the scanner's driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Servo {
    /// Linear-quadratic state feedback, tuned to a tracking lag.
    StateFeedback {
        /// Weight of the mirror's speed in the cost, s.
        velocity_weight_s: f64,
        /// Tracking lag on a ramp, s; the voltage weight is searched for it.
        lag_s: f64,
    },
    /// PID on the sensor's angle with an inner current loop.
    Pid {
        /// Closed position loop's bandwidth, Hz.
        bandwidth_hz: f64,
        /// Damping ratio of the position loop.
        damping: f64,
        /// Integral time, s; infinite switches the integral off.
        integral_time_s: f64,
        /// Bandwidth of the inner current loop, Hz.
        current_bandwidth_hz: f64,
    },
}

/// Errors of the angle sensor on the rotor; all zero is a perfect sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensor {
    /// Relative gain error.
    pub gain_error: f64,
    /// Cubic error at the greatest angle, relative to that angle.
    pub nonlinearity: f64,
    /// Drift of the zero, rad/s.
    pub drift_rad_s: f64,
    /// Noise, rad rms per sample.
    pub noise_rad: f64,
}

/// Mirrors and lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Optics {
    /// Lens, or focusing before the mirrors.
    pub lens: Lens,
    /// Which coordinate the first mirror in the beam moves.
    pub first_mirror: Axis,
    /// Side of the square field, mm.
    pub field_mm: f64,
    /// Free diameter of the mirrors across the beam, mm; `None` where it is not known.
    pub aperture_mm: Option<f64>,
    /// The lens that keeps a post-objective head's focus in the work plane; `None` for a fixed
    /// focus.
    pub focus: Option<Focus>,
    /// Height of the work plane above the nominal one, towards the head, mm. All places of the
    /// field are in it.
    pub plane_mm: f64,
}

impl Optics {
    /// Optics of this lens over the nominal work plane, with a fixed focus.
    pub fn new(lens: Lens, first_mirror: Axis, field_mm: f64) -> Self {
        Self { lens, first_mirror, field_mm, aperture_mm: None, focus: None, plane_mm: 0.0 }
    }

    /// Height above the nominal work plane that every other one stays below, mm: that of the second
    /// mirror; infinite behind an F-theta lens.
    pub fn height_limit_mm(&self) -> f64 {
        match self.lens {
            Lens::PostObjective { working_distance_mm, .. } => working_distance_mm,
            Lens::FTheta { .. } => f64::INFINITY,
        }
    }

    /// The same over a work plane of another height; `None` where there is no room for it.
    ///
    /// Behind an F-theta lens the height moves the focus alone; what else it does is left to the
    /// planes of a correction table.
    pub fn at_height(&self, plane_mm: f64) -> Option<Self> {
        let fits = plane_mm.is_finite() && plane_mm < self.height_limit_mm();
        fits.then(|| Self { plane_mm, ..self.clone() })
    }
}

/// A lens in front of the mirrors that moves the focus, and its axis (dynamic focus).
#[derive(Clone, Debug, PartialEq)]
pub struct Focus {
    /// Shift of the focus away from the head by travel of the lens (longitudinal), either sign,
    /// not zero.
    pub magnification: f64,
    /// Greatest travel of the lens from the middle of its range, mm, either side.
    pub travel_mm: f64,
    /// Greatest speed of the lens, mm/s.
    pub speed_max_mm_s: f64,
    /// Greatest acceleration of the lens, mm/s².
    pub acceleration_max_mm_s2: f64,
    /// Time by which the lens follows its command, s.
    pub lag_s: f64,
    /// Whether the middle of the range is half way between what the field's centre and its corners
    /// need, and not at the centre.
    pub balanced: bool,
}

/// How the beam is focused.
#[derive(Clone, Debug, PartialEq)]
pub enum Lens {
    /// F-theta lens: image height = f1·Θ + f2·Θ² + ..., Θ optical, rad.
    FTheta {
        /// f1 to at most f5, mm per radⁿ.
        coefficients_mm: Vec<f64>,
    },
    /// Focused before the mirrors (dynamic focus), no lens behind them.
    PostObjective {
        /// Distance e of the two mirrors, mm.
        mirror_distance_mm: f64,
        /// Distance d of the second mirror to the work plane, mm.
        working_distance_mm: f64,
    },
}

/// A coordinate of the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The x coordinate.
    X,
    /// The y coordinate.
    Y,
}

/// The laser source.
#[derive(Clone, Debug, PartialEq)]
pub struct Laser {
    /// Wavelength, nm.
    pub wavelength_nm: f64,
    /// Beam quality M², at least 1.
    pub beam_quality_m2: f64,
    /// 1/e² diameter of the collimated beam, mm.
    pub beam_diameter_mm: f64,
    /// 1/e² diameter of the spot in the work plane, mm.
    pub spot_diameter_mm: f64,
    /// Greatest power, W.
    pub power_max_w: f64,
    /// Light follows the on edge by this much, less what the mirrors are late by, ns; below 0 where
    /// the mirrors are later.
    pub on_latency_ns: i64,
    /// Light ends after the off edge by this much, less what the mirrors are late by, ns.
    pub off_latency_ns: i64,
    /// Mirrors follow their words by this much beside what the servo's model says, ns. It is taken
    /// off both latencies already, and kept so that a file says what its user wrote.
    pub mirror_delay_ns: i64,
    /// Shortest light that the source gives as asked, ns: a shorter pulse of the signal gives less
    /// or none.
    pub minimum_on_ns: i64,
    /// Whether power can follow the speed of the beam.
    pub power_modulated: bool,
    /// Pulse rate, kHz; `None` is a continuous source.
    pub pulse_khz: Option<f64>,
    /// Whether every pulse waits for its trigger, so that pulses keep their distance where the beam
    /// is slower; else pulses run free at their rate. Only of a pulsed source.
    pub pulses_triggered: bool,
}

/// What the controller sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// Period of the samples, ns.
    pub period_ns: u32,
    /// Length of an output word, bits.
    pub word_bits: u32,
    /// Mechanical angle of the greatest word, rad.
    pub word_range_rad: f64,
    /// What a sample is.
    pub drive: Drive,
}

/// What a sample is to the scanner's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// An angle word to a driver whose servo is known.
    ServoKnown,
    /// A voltage and a reference state.
    Voltage,
    /// An angle word to a driver of which only lag and limits are known.
    BlackBox,
}

impl Scanner {
    /// Inertia of rotor and mirror together, kg·m².
    pub fn inertia_kg_m2(&self) -> f64 {
        self.rotor_inertia_kg_m2 + self.mirror_inertia_kg_m2
    }
}

impl Laser {
    /// Whether the dose can follow the speed of the beam, by power or by the distance of pulses.
    pub fn follows_speed(&self) -> bool {
        self.power_modulated || self.pulses_triggered
    }

    /// Time between pulses at the full rate, s; `None` of a continuous source.
    pub fn pulse_period_s(&self) -> Option<f64> {
        self.pulse_khz.map(|khz| 1e-3 / khz)
    }
}

impl Output {
    /// Period of the samples, s.
    pub fn period_s(&self) -> f64 {
        f64::from(self.period_ns) * 1e-9
    }

    /// Greatest frequency that samples of this period can carry, Hz.
    pub fn nyquist_hz(&self) -> f64 {
        0.5 / self.period_s()
    }

    /// Greatest word, either sign.
    pub fn word_max(&self) -> i32 {
        (1 << (self.word_bits - 1)) - 1
    }

    /// Mechanical angle of one step of the word, rad.
    pub fn word_step_rad(&self) -> f64 {
        self.word_range_rad / f64::from(1u32 << (self.word_bits - 1))
    }
}
