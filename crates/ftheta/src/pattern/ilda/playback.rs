//! Points played as show lasers do: at a constant rate, whatever the mirrors do.

use super::{CIRCLE_GAIN, Feature, Ilda, PatternOptions, Traced};
use crate::Error;
use crate::lit::Lit;
use crate::mark::twin;
use ftheta_model::block::{Block, LaserEdge, SampleSink};
use ftheta_model::dose::DoseMap;
use ftheta_model::machine::{Laser, Machine};
use ftheta_model::space::DacCodes;
use ftheta_physics::axis_loop::response;
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::angles_from_field;
use ftheta_physics::servo::Gains;
use ftheta_planner::PlanError;
use ftheta_twin::twin::TwinOptions;
use kurbo::{Point, Vec2};

/// Points of a turn of the circle, as published.
const N_CIRCLE: usize = 12;
/// Turns in the dark, so that the axes swing steadily, and in light.
const TURNS: [usize; 2] = [1, 5];
/// Points of a line, by the frame's side.
const N_LINE: f64 = 24.0;
const N_LINE_MIN: usize = 6;
/// Points at rest in corners and at ends, and in the dark where the next stroke begins.
const N_CORNER: usize = 4;
const N_DARK: usize = 10;

/// A point, and whether the way to it is lit.
struct Sent {
    place: Point,
    lit: bool,
}

/// What comes of the pattern's points, played at this rate on the twin, and the energy on the
/// plane.
///
/// Light comes a servo's lag late, as on a tuned projector, and goes on time, since strokes end at
/// rest.
///
/// # Errors
/// If the optics do not reach a point, or the servo cannot be built.
///
/// * `rate`: points per second
pub(super) fn playback(
    ilda: &Ilda,
    machine: &Machine,
    rate: f64,
    options: &PatternOptions,
) -> Result<(Traced, DoseMap), Error> {
    let (points, circle) = points(ilda);
    let period_s = machine.output.period_s();
    let gains = Gains::design(&machine.scanner, period_s)?;
    let lag_s = gains.lag_s(&Galvo::new(&machine.scanner));
    let words: Vec<DacCodes> =
        points.iter().map(|point| word(machine, point.place)).collect::<Result<_, _>>()?;
    let duration_s = points.len() as f64 / rate;
    // Until the last light has gone out.
    let n_samples = ((duration_s + 2.0 * lag_s) / period_s).ceil() as usize;
    let at = |sample: usize| ((sample as f64 * period_s * rate) as usize).min(words.len() - 1);
    let power_w = options.pen.power_w;
    let block = Block {
        first_index: 0,
        words: (0..n_samples).map(|sample| words[at(sample)]).collect(),
        edges: edges(&points, &machine.laser, rate, lag_s)
            .map(|(time_ns, lit)| LaserEdge { time_ns, power_w: if lit { power_w } else { 0.0 } })
            .collect(),
        ..Block::default()
    };
    let twin_options = TwinOptions {
        mismatch: options.mark.mismatch,
        seed: options.mark.seed,
        pixel_mm: machine.laser.spot_diameter_mm / 3.0,
        state_stride: u64::MAX,
    };
    // What plays points sends no triggers.
    let laser = Laser { pulses_triggered: false, ..machine.laser.clone() };
    let machine = &Machine { laser, ..machine.clone() };
    let mut twin = twin(machine, &options.mark, &twin_options)?;
    twin.push(&block)?;
    twin.finish();
    let mut lit = Lit::default();
    lit.add(&twin.take_trace());
    Ok((ilda.traced(&lit, Some(circle), duration_s), twin.into_dose()))
}

/// When light goes on and off, ns.
fn edges(
    points: &[Sent],
    laser: &Laser,
    rate: f64,
    lag_s: f64,
) -> impl Iterator<Item = (u64, bool)> {
    let changes = points.windows(2).enumerate().filter(|(_, pair)| pair[0].lit != pair[1].lit);
    changes.map(move |(index, pair)| {
        let lit = pair[1].lit;
        let (late_s, latency_ns) =
            if lit { (lag_s, laser.on_latency_ns) } else { (0.0, laser.off_latency_ns) };
        let light_ns = (((index + 1) as f64 / rate + late_s) * 1e9).round() as i64;
        ((light_ns - latency_ns).max(0) as u64, lit)
    })
}

/// Number of the pattern's points.
pub(super) fn n_points(ilda: &Ilda) -> usize {
    points(ilda).0.len()
}

/// Rate at which the circle touches the square's sides: the servo's answer to its frequency, held
/// from point to point, is [`CIRCLE_GAIN`], as long as the motors stand it. `None` if the servo
/// follows any rate, or cannot be built.
pub fn tuned_rate(machine: &Machine) -> Option<f64> {
    let (galvo, period_s) = (Galvo::new(&machine.scanner), machine.output.period_s());
    let gains = Gains::design(&machine.scanner, period_s).ok()?;
    let n = N_CIRCLE as f64;
    let held = (std::f64::consts::PI / n).sin() / (std::f64::consts::PI / n);
    let gain = |rate: f64| {
        response(&galvo, &gains, period_s, rate / n).map_or(0.0, |answer| held * answer.norm())
    };
    let (mut low, mut high) = (100.0, 1.0 / period_s);
    if gain(high) > CIRCLE_GAIN {
        return None;
    }
    while high - low > 1e-6 * high {
        let middle = 0.5 * (low + high);
        if gain(middle) > CIRCLE_GAIN { low = middle } else { high = middle }
    }
    Some(low)
}

/// The points of the pattern, and which of its strokes is the circle.
fn points(ilda: &Ilda) -> (Vec<Sent>, usize) {
    let mut points = vec![Sent { place: Point::ZERO, lit: false }];
    let mut circle = 0;
    for (stroke, (_, features)) in ilda.strokes().into_iter().enumerate() {
        for (index, feature) in features.iter().enumerate() {
            match feature {
                Feature::Line(line) => {
                    if index == 0 {
                        dwell(&mut points, line.p0, N_DARK, false);
                    }
                    let part = (line.p1 - line.p0).hypot() / ilda.side_mm();
                    let n = ((N_LINE * part).ceil() as usize).max(N_LINE_MIN);
                    points.extend((usize::from(index > 0)..=n).map(|step| {
                        let place = line.p0.lerp(line.p1, step as f64 / n as f64);
                        Sent { place, lit: true }
                    }));
                    dwell(&mut points, line.p1, N_CORNER, true);
                }
                Feature::Circle(shape) => {
                    circle = stroke;
                    let [n_dark, n_lit] = TURNS.map(|turns| turns * N_CIRCLE);
                    dwell(
                        &mut points,
                        shape.center + shape.radius * Vec2::new(1.0, 0.0),
                        N_DARK,
                        false,
                    );
                    points.extend((1..=n_dark + n_lit).map(|step| {
                        let turn = std::f64::consts::TAU * step as f64 / N_CIRCLE as f64;
                        let off = Vec2::from_angle(turn) * shape.radius;
                        Sent { place: shape.center + off, lit: step > n_dark }
                    }));
                }
            }
        }
    }
    dwell(&mut points, Point::ZERO, N_DARK, false);
    (points, circle)
}

fn dwell(points: &mut Vec<Sent>, place: Point, n: usize, lit: bool) {
    points.extend((0..n).map(|_| Sent { place, lit }));
}

/// The word of a place, straight.
fn word(machine: &Machine, place: Point) -> Result<DacCodes, PlanError> {
    let (x_mm, y_mm) = (place.x, place.y);
    let angles = angles_from_field(&machine.optics, place.into())
        .ok_or(PlanError::Unreachable { x_mm, y_mm })?;
    let output = &machine.output;
    let code = |angle_rad: f64| {
        let max = f64::from(output.word_max());
        (angle_rad / output.word_step_rad()).round().clamp(-max, max) as i32
    };
    Ok(DacCodes { x: code(angles.x_rad), y: code(angles.y_rad) })
}
