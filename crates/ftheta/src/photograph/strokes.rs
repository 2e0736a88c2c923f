//! What the beam is to do for a pattern: curves with speed and power.

use super::{BurnOptions, PowerRule};
use crate::rehearsal::mark_curves;
use ftheta_model::job::{FillRule, Paint, Shape};
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{FeatureShape, LineProcess, MarkStyle, Pattern};
use ftheta_model::space::FieldPoint;
use ftheta_model::tag;
use ftheta_twin::photograph::{Burn, Scene, Segment};
use kurbo::{Affine, BezPath, Circle, Line, Point, Rect, Shape as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::f64::consts::FRAC_2_PI;

/// Speed of everything that is no line with a speed of its own, mm/s at most.
const SPEED_MM_S: f64 = 1000.0;
/// Part of the laser's power that the strongest stroke takes.
const POWER: f64 = 0.9;
/// Accuracy of circles as curves, mm.
const CIRCLE_MM: f64 = 1e-6;

/// A curve to be burned.
#[derive(Clone, Debug)]
pub(super) struct Stroke {
    /// Which feature of the pattern it belongs to; `None` for lettering.
    pub(super) feature: Option<usize>,
    pub(super) curve: BezPath,
    pub(super) paint: Paint,
    pub(super) speed_mm_s: f64,
    pub(super) power_w: f64,
}

/// All curves, and the process that the dose is stated for.
#[derive(Clone, Debug)]
pub(super) struct Strokes {
    pub(super) all: Vec<Stroke>,
    /// Energy by length of the fastest line, J/mm.
    line_j_mm: f64,
    /// Strokes of crosses.
    is_arm: Vec<bool>,
}

/// How strongly a pattern is burned.
struct Process {
    rule: PowerRule,
    /// Power over speed of the fastest line, by the rule.
    fastest: f64,
    /// Energy by length of the fastest line, J/mm.
    line_j_mm: f64,
    /// Speed of what has none of its own, mm/s.
    slow_mm_s: f64,
    /// Slowest and fastest line, mm/s, and by how much their dose is off.
    speeds_mm_s: [f64; 2],
    dose_slope: f64,
}

impl Process {
    fn new(pattern: &Pattern, options: &BurnOptions, machine: &Machine) -> Self {
        let shapes = pattern.features.iter().map(|feature| &feature.shape);
        let lines: Vec<LineProcess> = shapes
            .filter_map(|shape| match shape {
                FeatureShape::Line { process, .. } | FeatureShape::Circle { process, .. } => {
                    Some(*process)
                }
                _ => None,
            })
            .collect();
        let speeds = || lines.iter().map(|line| line.speed_mm_s);
        let speeds_mm_s = [speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max)];
        let slow_mm_s = speeds_mm_s[0].min(SPEED_MM_S);
        let rule = options.power.unwrap_or_else(|| stated_or_proportional(&lines));
        let dose_slope = options.dose_slope;
        let mut found =
            Self { rule, fastest: 1.0, line_j_mm: 1.0, slow_mm_s, speeds_mm_s, dose_slope };
        if let Some(line) = lines.iter().max_by(|a, b| a.speed_mm_s.total_cmp(&b.speed_mm_s)) {
            found.fastest = found.ratio(line) / line.speed_mm_s;
        }
        let powers = lines.iter().map(|line| found.dose(line) * line.speed_mm_s);
        let greatest = powers.filter(|power| power.is_finite()).fold(slow_mm_s, f64::max);
        found.line_j_mm = POWER * machine.laser.power_max_w / greatest;
        found
    }

    fn ratio(&self, line: &LineProcess) -> f64 {
        match self.rule {
            PowerRule::Stated => line.power_ratio,
            PowerRule::Constant => 1.0,
            PowerRule::Proportional => line.speed_mm_s,
        }
    }

    /// Dose over that of the fastest line.
    fn dose(&self, line: &LineProcess) -> f64 {
        let [slow, fast] = self.speeds_mm_s;
        let share = if fast > slow { (line.speed_mm_s - slow) / (fast - slow) } else { 0.5 };
        let off = 1.0 + self.dose_slope * (2.0 * share - 1.0);
        off * self.ratio(line) / line.speed_mm_s / self.fastest.max(f64::MIN_POSITIVE)
    }
}

/// As stated where the power is not the same at all speeds.
fn stated_or_proportional(lines: &[LineProcess]) -> PowerRule {
    let differs = lines.windows(2).any(|pair| pair[0].power_ratio != pair[1].power_ratio);
    if differs { PowerRule::Stated } else { PowerRule::Proportional }
}

/// The strokes of a pattern.
pub(super) fn strokes(
    pattern: &Pattern,
    labels: &[Shape],
    machine: &Machine,
    options: &BurnOptions,
    seed: u64,
) -> Strokes {
    let process = Process::new(pattern, options, machine);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6d69_7373_696e_6700);
    let mut strokes = Strokes { all: Vec::new(), line_j_mm: process.line_j_mm, is_arm: Vec::new() };
    let mut put = |feature, curve, paint, speed_mm_s: f64, dose: f64, is_arm| {
        let power_w = dose * process.line_j_mm * speed_mm_s;
        strokes.all.push(Stroke { feature, curve, paint, speed_mm_s, power_w });
        strokes.is_arm.push(is_arm);
    };
    for (index, feature) in pattern.features.iter().enumerate() {
        let can_miss = matches!(feature.shape, FeatureShape::Line { .. } | FeatureShape::Mark(_));
        let drawn = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        if can_miss && drawn < options.missing {
            continue;
        }
        let is_arm = matches!(&feature.shape,
            FeatureShape::Mark(mark) if mark.style == MarkStyle::Cross);
        for (curve, paint, speed_mm_s, dose) in curves(&feature.shape, &process) {
            put(Some(index), curve, paint, speed_mm_s, dose, is_arm);
        }
    }
    for label in labels {
        put(None, label.path.clone(), label.paint, process.slow_mm_s, 1.0, false);
    }
    strokes
}

/// Curves of a feature with their speed and dose; none if it is not burned.
fn curves(shape: &FeatureShape, process: &Process) -> Vec<(BezPath, Paint, f64, f64)> {
    let slow_mm_s = process.slow_mm_s;
    let line = |from: &FieldPoint, to: &FieldPoint| {
        Line::new(Point::from(*from), Point::from(*to)).to_path(CIRCLE_MM)
    };
    match shape {
        FeatureShape::Line { from_mm, to_mm, process: own } => {
            vec![(line(from_mm, to_mm), Paint::Stroke, own.speed_mm_s, process.dose(own))]
        }
        FeatureShape::Circle { centre_mm, radius_mm, process: own } => {
            let curve = Circle::new(Point::from(*centre_mm), *radius_mm).to_path(CIRCLE_MM);
            vec![(curve, Paint::Stroke, own.speed_mm_s, process.dose(own))]
        }
        FeatureShape::Mark(mark) => {
            let paint = match mark.style {
                MarkStyle::Cross => Paint::Stroke,
                MarkStyle::Dot => Paint::Fill(FillRule::NonZero),
            };
            mark_curves(mark).into_iter().map(|curve| (curve, paint, slow_mm_s, 1.0)).collect()
        }
        // Both ways, half of the dose each.
        FeatureShape::Reference { from_mm, to_mm, burned: true } => {
            [line(from_mm, to_mm), line(to_mm, from_mm)]
                .map(|curve| (curve, Paint::Stroke, slow_mm_s, 0.5))
                .to_vec()
        }
        FeatureShape::Fiducial { code, place_mm, size_mm, burned: true, .. } => {
            let placed = Affine::translate(Point::from(*place_mm).to_vec2());
            let curve = code.parse().ok().and_then(tag_curve);
            let curve = curve.map(|curve| placed * Affine::scale(*size_mm) * curve);
            curve
                .map(|curve| (curve, Paint::Fill(FillRule::NonZero), slow_mm_s, 1.0))
                .into_iter()
                .collect()
        }
        _ => Vec::new(),
    }
}

/// The black cells of a tag of side 1 around the origin.
fn tag_curve(number: usize) -> Option<BezPath> {
    let mut curve = BezPath::new();
    let step = 1.0 / tag::N_CELLS as f64;
    for (row, cells) in tag::cells(number)?.iter().enumerate() {
        for (column, _) in cells.iter().enumerate().filter(|(_, white)| !**white) {
            let (x, y) = (step * column as f64 - 0.5, 0.5 - step * (row + 1) as f64);
            curve.extend(Rect::new(x, y, x + step, y + step).to_path(CIRCLE_MM));
        }
    }
    Some(curve)
}

impl Strokes {
    /// Greatest fluence of the fastest line, J/mm².
    pub(super) fn peak_j_mm2(&self, spot_radius_mm: f64) -> f64 {
        self.line_j_mm * FRAC_2_PI.sqrt() / spot_radius_mm
    }

    /// The scene with what the first moment of every arm leaves.
    pub(super) fn overburned(&self, mut scene: Scene, burned: &Burn, overburn: f64) -> Scene {
        let radius_mm = scene.spot_radius_mm;
        let energy_j = overburn * self.peak_j_mm2(radius_mm) * radius_mm.powi(2) / FRAC_2_PI;
        for run in burned.iter().filter(|run| self.is_arm.get(run.light) == Some(&true)) {
            if let Some(first) = run.segments.first().filter(|_| energy_j > 0.0) {
                scene.segments.push(Segment { from: first.from, to: first.from, energy_j });
            }
        }
        scene
    }
}
