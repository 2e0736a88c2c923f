//! A recipe: pens, what they apply to, and the settings of the classic planner.

/// Process settings of a mark.
#[derive(Clone, Debug, PartialEq)]
pub struct Pen {
    /// Its name in the recipe, or the colour it was made from.
    pub name: String,
    /// Speed of the beam along a mark, mm/s.
    pub mark_speed_mm_s: f64,
    /// Laser power while marking, W.
    pub power_w: f64,
    /// How often each mark is gone over, at least 1.
    pub n_passes: u32,
    /// How areas are filled; without one the outline is marked instead.
    pub hatch: Option<Hatch>,
}

/// Parallel lines that fill an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hatch {
    /// Distance of neighbouring lines, mm.
    pub spacing_mm: f64,
    /// Direction of the lines, degrees from +x towards +y.
    pub angle_deg: f64,
    /// Whether the outline of the area is marked as well.
    pub outline: bool,
}

/// A pen and what it is used for.
#[derive(Clone, Debug, PartialEq)]
pub struct PenRule {
    /// The pen.
    pub pen: Pen,
    /// Paint colour as RGB; `None` matches any colour.
    pub color_rgb: Option<[u8; 3]>,
    /// Layer name, without regard to case; `None` matches any layer.
    pub layer: Option<String>,
}

/// Everything a user sets about the process, apart from the machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recipe {
    /// The first rule that matches a shape gives its pen. A shape that none matches gets a
    /// default pen named after its colour.
    pub pens: Vec<PenRule>,
    /// Whether marks keep the drawing's order and directions, where they matter more than time.
    pub keep_order: bool,
    /// Settings of the classic planner; what is `None` is derived from the machine.
    pub classic: ClassicRecipe,
    /// How text is marked.
    pub text: TextStyle,
    /// Greatest distance of a flattened curve from the true one, mm; `None` is 0.002.
    pub flatten_tolerance_mm: Option<f64>,
}

/// How text is marked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextStyle {
    /// As the outlines of the font's letters, filled or stroked as the drawing says.
    #[default]
    Outline,
    /// As single strokes (Hershey), for engraving.
    SingleStroke,
}

/// User's choices for the classic planner; `None` takes the value derived from the scanner's lag.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassicRecipe {
    /// Speed of jumps, mm/s.
    pub jump_speed_mm_s: Option<f64>,
    /// Wait after the shortest jumps, s.
    pub jump_delay_min_s: Option<f64>,
    /// Wait after jumps of `jump_length_limit_mm` and longer, s.
    pub jump_delay_s: Option<f64>,
    /// Length from which the jump delay no longer grows, mm.
    pub jump_length_limit_mm: Option<f64>,
    /// Wait after a mark, s.
    pub mark_delay_s: Option<f64>,
    /// Wait in a corner of 90 degrees, s; scaled by 1 - cos of the turning angle.
    pub polygon_delay_s: Option<f64>,
    /// Laser-on edge after the first mark command, ns; negative is earlier.
    pub laser_on_delay_ns: Option<i64>,
    /// Laser-off edge after the last mark command, ns; negative is earlier.
    pub laser_off_delay_ns: Option<i64>,
    /// How micro-steps are computed.
    pub interpolation: Option<Interpolation>,
    /// Acceleration at the start of a mark, mm/s²; `None` is constant speed at once.
    pub acceleration_mm_s2: Option<f64>,
    /// Deceleration at the end of a mark, mm/s²; `None` is constant speed to the end.
    pub deceleration_mm_s2: Option<f64>,
    /// Skywriting: how long the beam runs at mark speed before a leg, s; `None` is 0. Either run
    /// above 0 turns skywriting on.
    pub sky_run_in_s: Option<f64>,
    /// Skywriting: how long the beam runs on at mark speed after a leg, s; `None` is 0.
    pub sky_run_out_s: Option<f64>,
}

/// How a vector becomes micro-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Every point from the vector's start: no error accumulates.
    #[default]
    Absolute,
    /// Digital differential analyser: one rounded increment added per tick.
    Dda,
}

impl Default for Pen {
    /// 1 000 mm/s, 10 W, one pass, no hatch.
    fn default() -> Self {
        Self {
            name: "default".into(),
            mark_speed_mm_s: 1000.0,
            power_w: 10.0,
            n_passes: 1,
            hatch: None,
        }
    }
}
