//! Centres of crosses and dots, to a small part of a pixel.

use super::candidates::Shape;
use crate::raster::strip::{Strip, centre_px, crossing, straight};
use ftheta_model::pattern::MarkStyle;
use ftheta_model::picture::{Picture, PixelPoint};

/// Part of an arm that is left out at the middle and at the end: both burn more.
const MIDDLE: f64 = 0.22;
const MIDDLE_MIN_PX: f64 = 3.0;
const END: f64 = 0.12;
/// Distance of places along an arm, px.
const STEP_PX: f64 = 2.0;
/// How far across an arm is looked, by its length, and in px.
const REACH: f64 = 0.22;
const REACH_PX: [f64; 2] = [3.5, 9.0];
/// Part of an arm's places that must show it.
const SEEN: f64 = 0.6;
/// An arm runs no farther from where it is expected than this, by its length; a turn of it, rad.
const OFF: f64 = 0.12;
const TURN_RAD: f64 = 0.12;
/// Places on an arm are no farther from a straight line than this, px rms.
const STRAIGHT_PX: f64 = 0.8;
/// Rounds in which a dot's centre settles.
const N_ROUNDS: usize = 6;
/// A dot's centre is where it is looked for to this part of its radius.
const DOT_OFF: f64 = 0.8;

/// The centre of a mark near a place; `None` if there is none.
pub fn centre(
    picture: &Picture,
    bright: bool,
    shape: &Shape,
    near: PixelPoint,
) -> Option<PixelPoint> {
    match shape.style {
        MarkStyle::Cross => cross(picture, bright, shape, near),
        MarkStyle::Dot => dot(picture, bright, shape, near),
    }
}

fn cross(picture: &Picture, bright: bool, shape: &Shape, near: PixelPoint) -> Option<PixelPoint> {
    let mut here = near;
    let mut directions = shape.arms_px;
    for _ in 0..3 {
        let [along_x, along_y] = [
            bar(picture, bright, here, directions[0])?,
            bar(picture, bright, here, directions[1])?,
        ];
        // Each bar is off by so much across, at the other one's place: both are straight.
        let [(h, slope_x), (g, slope_y)] = [along_x, along_y];
        let [u, v] = directions.map(unit);
        let lines = [
            ([here.x_px - h * u[1], here.y_px + h * u[0]], turned(u, slope_x)),
            ([here.x_px - g * v[1], here.y_px + g * v[0]], turned(v, slope_y)),
        ];
        here = crossing(lines[0], lines[1])?;
        let [a, b] = shape.arms_px.map(|arm| arm[0].hypot(arm[1]));
        let off = here.distance(near);
        if off > OFF * a.min(b) + 3.0 {
            return None;
        }
        directions = [lines[0].1.map(|d| d * a), lines[1].1.map(|d| d * b)];
    }
    Some(here)
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

fn turned([x, y]: [f64; 2], slope: f64) -> [f64; 2] {
    unit([x - slope * y, y + slope * x])
}

/// Where a bar runs: its height across at the middle, and its slope; `None` if it is not there on
/// both sides.
fn bar(picture: &Picture, bright: bool, middle: PixelPoint, arm: [f64; 2]) -> Option<(f64, f64)> {
    let length = arm[0].hypot(arm[1]);
    let [x, y] = unit(arm);
    let first = (MIDDLE * length).max(MIDDLE_MIN_PX);
    let last = (1.0 - END) * length;
    let n = (((last - first) / STEP_PX) as usize).max(4);
    let reach_px = (REACH * length).clamp(REACH_PX[0], REACH_PX[1]);
    let half_length_px = (0.5 * (last - first) / n as f64).max(1.0);
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(2 * n);
    for side in [-1.0, 1.0] {
        let before = points.len();
        for index in 0..n {
            let t = side * (first + (last - first) * (index as f64 + 0.5) / n as f64);
            let place = PixelPoint::new(middle.x_px + t * x, middle.y_px + t * y);
            let strip = Strip { middle: place, direction: [x, y], half_length_px, reach_px };
            points.extend(
                centre_px(picture, bright, &strip)
                    .map(|at| (t, (at.y_px - middle.y_px) * x - (at.x_px - middle.x_px) * y)),
            );
        }
        if ((points.len() - before) as f64) < SEEN * n as f64 {
            return None;
        }
    }
    let (height, slope) = straight(&points);
    let off = |p: &(f64, f64)| (p.1 - height - slope * p.0).abs();
    let mut sizes: Vec<f64> = points.iter().map(off).collect();
    let half = sizes.len() / 2;
    let median = *sizes.select_nth_unstable_by(half, f64::total_cmp).1;
    (slope.abs() < TURN_RAD && median < STRAIGHT_PX).then_some((height, slope))
}

/// The centroid of what differs from the ground around a dot.
fn dot(picture: &Picture, bright: bool, shape: &Shape, near: PixelPoint) -> Option<PixelPoint> {
    let sign = if bright { 1.0 } else { -1.0 };
    let [x, y] = shape.arms_px;
    let radius = shape.reach_px();
    let step = (0.5_f64).max(radius / 12.0) / radius;
    let n = (1.6 / step) as i32;
    let mut here = near;
    for _ in 0..N_ROUNDS {
        let value = |u: f64, v: f64| {
            let at =
                PixelPoint::new(here.x_px + u * x[0] + v * y[0], here.y_px + u * x[1] + v * y[1]);
            sign * f64::from(picture.at(at))
        };
        let around: f64 = (0..24)
            .map(|index| {
                let (sin, cos) = (f64::from(index) * std::f64::consts::PI / 12.0).sin_cos();
                value(1.6 * cos, 1.6 * sin)
            })
            .sum::<f64>()
            / 24.0;
        let mut inside = Vec::with_capacity(((2 * n + 1) * (2 * n + 1)) as usize);
        for row in -n..=n {
            for column in -n..=n {
                let (u, v) = (f64::from(column) * step, f64::from(row) * step);
                if u * u + v * v <= 1.5 * 1.5 {
                    inside.push((value(u, v) - around, u, v));
                }
            }
        }
        let core = inside.iter().filter(|(_, u, v)| u * u + v * v < 0.25);
        let (sum, count) = core.fold((0.0, 0.0), |(sum, n), (value, ..)| (sum + value, n + 1.0));
        let depth = sum / count;
        if depth < 0.03 {
            return None;
        }
        // Between a quarter and three quarters of the depth all counts in proportion: noise beside
        // the dot does not, nor what is burnt more in it.
        let weight = |value: f64| ((value / depth - 0.25) / 0.5).clamp(0.0, 1.0);
        let (mut total, mut mean) = (0.0, [0.0; 2]);
        for (value, u, v) in inside {
            let weight = weight(value);
            total += weight;
            mean = [mean[0] + weight * u, mean[1] + weight * v];
        }
        let [u, v] = mean.map(|sum| sum / total);
        let area = total * step * step / std::f64::consts::PI;
        if !(0.4..2.2).contains(&area) {
            return None;
        }
        here = PixelPoint::new(here.x_px + u * x[0] + v * y[0], here.y_px + u * x[1] + v * y[1]);
        if u.hypot(v) * radius < 1e-3 {
            break;
        }
    }
    (here.distance(near) < DOT_OFF * radius + 2.0).then_some(here)
}
