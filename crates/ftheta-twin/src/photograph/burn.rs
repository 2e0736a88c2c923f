//! What the beam burned, as straight segments with their energy.

use ftheta_model::space::FieldPoint;
use ftheta_model::trace::{Light, Trace};
use kurbo::Point;
use std::f64::consts::{FRAC_2_PI, PI, SQRT_2};

/// By how much the beam may be elsewhere at a moment than its segment says, mm.
const TOLERANCE_MM: f64 = 2e-4;

/// A straight piece of the beam's way at one speed and power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Where it begins, mm.
    pub from: Point,
    /// Where it ends, mm.
    pub to: Point,
    /// Its energy, J.
    pub energy_j: f64,
}

/// The segments of one interval of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Index of the interval.
    pub light: usize,
    /// Its segments, in order.
    pub segments: Vec<Segment>,
}

/// Everything that was burned, interval by interval.
pub type Burn = Vec<Run>;

/// Collects what a trace burns.
#[derive(Debug, Default)]
pub struct Burner {
    runs: Burn,
    /// Power and way of the interval that may go on: time, place.
    power_w: f64,
    way: Vec<(f64, Point)>,
}

impl Burner {
    /// Takes the stretch that follows on.
    pub fn add(&mut self, trace: &Trace) {
        for light in &trace.light {
            let goes_on = self.runs.last().is_some_and(|run| run.light == light.index);
            if !goes_on {
                self.end();
                self.runs.push(Run { light: light.index, segments: Vec::new() });
            } else if self.power_w != light.power_w {
                self.end();
            }
            self.power_w = light.power_w;
            self.follow(trace, light);
        }
    }

    /// Everything that was burned.
    pub fn finish(mut self) -> Burn {
        self.end();
        self.runs
    }

    fn follow(&mut self, trace: &Trace, light: &Light) {
        let mut put = |time_ns: u64| {
            let index = time_ns as f64 / trace.step_ns as f64 - trace.first_index as f64;
            let last = trace.points.len().saturating_sub(1);
            let before = (index.max(0.0) as usize).min(last);
            let [from, to] = [before, (before + 1).min(last)]
                .map(|index| Point::from(FieldPoint::from(trace.points[index])));
            let time_s = time_ns as f64 * 1e-9;
            if self.way.last().is_none_or(|(last_s, _)| *last_s < time_s) {
                self.way.push((time_s, from.lerp(to, index - before as f64)));
            }
        };
        put(light.on_ns);
        let first = light.on_ns / trace.step_ns + 1;
        (first..light.off_ns.div_ceil(trace.step_ns)).for_each(|step| put(step * trace.step_ns));
        put(light.off_ns);
    }

    /// Turns the way so far into as few segments as will do.
    fn end(&mut self) {
        let way = std::mem::take(&mut self.way);
        let Some(run) = self.runs.last_mut() else {
            return;
        };
        let mut open = vec![(0, way.len().saturating_sub(1))];
        while let Some((first, last)) = open.pop().filter(|(first, last)| first < last) {
            let (start, end) = (way[first], way[last]);
            let off = |index: &usize| {
                let share = (way[*index].0 - start.0) / (end.0 - start.0);
                start.1.lerp(end.1, share).distance(way[*index].1)
            };
            let farthest = (first + 1..last).max_by(|a, b| off(a).total_cmp(&off(b)));
            match farthest.filter(|index| off(index) > TOLERANCE_MM) {
                Some(index) => open.extend([(index, last), (first, index)]),
                None => {
                    let energy_j = self.power_w * (end.0 - start.0);
                    run.segments.push(Segment { from: start.1, to: end.1, energy_j });
                }
            }
        }
    }
}

/// Energy by area, and how it changes from place to place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fluence {
    pub(super) value: f64,
    pub(super) slope: kurbo::Vec2,
}

impl Segment {
    /// Fluence of a Gaussian beam at a place, J/mm².
    ///
    /// * `radius_mm`: of the beam, where intensity has fallen to 1/e²
    pub(super) fn fluence(&self, place: Point, radius_mm: f64) -> Fluence {
        // A beam at rest is a segment too short to be seen.
        let shortest_mm = 1e-4 * radius_mm;
        let along = self.to - self.from;
        let length_mm = along.hypot().max(shortest_mm);
        let along = if along.hypot() < shortest_mm {
            kurbo::Vec2::new(1.0, 0.0)
        } else {
            along / length_mm
        };
        let across = kurbo::Vec2::new(-along.y, along.x);
        let off = place - self.from;
        let (s, d) = (off.dot(along), off.dot(across));
        let peak = self.energy_j / length_mm * FRAC_2_PI.sqrt() / radius_mm;
        let profile = peak * (-2.0 * (d / radius_mm).powi(2)).exp();
        let [since, until] = [s, length_mm - s].map(|x| SQRT_2 * x / radius_mm);
        let value = 0.5 * profile * (erf(since) + erf(until));
        let bell = |x: f64| (-x * x).exp();
        let along_slope = profile * SQRT_2 / (PI.sqrt() * radius_mm) * (bell(since) - bell(until));
        let across_slope = -4.0 * d / (radius_mm * radius_mm) * value;
        Fluence { value, slope: along * along_slope + across * across_slope }
    }

    /// Greatest fluence that it may leave anywhere, J/mm².
    pub(super) fn peak(&self, radius_mm: f64) -> f64 {
        let length_mm = (self.to - self.from).hypot();
        let line = self.energy_j / length_mm * FRAC_2_PI.sqrt() / radius_mm;
        line.min(self.energy_j * FRAC_2_PI / (radius_mm * radius_mm))
    }

    /// Distance of a place, mm.
    pub(super) fn distance_mm(&self, place: Point) -> f64 {
        let along = self.to - self.from;
        let share = (place - self.from).dot(along) / along.hypot2().max(f64::MIN_POSITIVE);
        place.distance(self.from.lerp(self.to, share.clamp(0.0, 1.0)))
    }
}

/// The error function to 1.5e-7. Source: Abramowitz and Stegun, 7.1.26.
fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let powers = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let sum = powers.iter().fold(0.0, |sum, factor| (sum + factor) * t);
    (1.0 - sum * (-x * x).exp()).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ftheta_model::trace::TracePoint;

    /// Two stretches of a beam at 1 m/s that turns a corner, lit from 3 µs to 21 µs.
    #[test]
    fn a_way_becomes_its_segments() {
        let at = |index: u64| TracePoint {
            x_nm: 2000 * index.min(6) as i32,
            y_nm: 2000 * index.saturating_sub(6) as i32,
        };
        let stretch = |range: std::ops::Range<u64>, on_ns, off_ns| Trace {
            step_ns: 2000,
            first_index: range.start,
            points: range.map(at).collect(),
            light: vec![Light { index: 4, on_ns, off_ns, power_w: 2.0 }],
            ..Trace::default()
        };
        let mut burner = Burner::default();
        burner.add(&stretch(0..6, 3000, 10_000));
        burner.add(&stretch(5..13, 10_000, 21_000));
        let runs = burner.finish();
        assert_eq!((runs.len(), runs[0].light), (1, 4));
        let expected = [(0.003, 0.0, 0.012, 0.0, 18e-6), (0.012, 0.0, 0.012, 0.009, 18e-6)];
        assert_eq!(runs[0].segments.len(), 2);
        for (segment, (x1, y1, x2, y2, energy_j)) in runs[0].segments.iter().zip(expected) {
            assert!(segment.from.distance(Point::new(x1, y1)) < 1e-9, "{segment:?}");
            assert!(segment.to.distance(Point::new(x2, y2)) < 1e-9, "{segment:?}");
            assert!((segment.energy_j - energy_j).abs() < 1e-12, "{segment:?}");
        }
    }

    /// Half width and end growth of a line of three times the threshold, w = 50 µm, as
    /// `reference/optics.json` has them; slopes are differences.
    #[test]
    fn lines_are_as_wide_and_long_as_the_reference_says() {
        let radius_mm = 0.05;
        let energy_j = 3.0 * 4.0 * radius_mm / FRAC_2_PI.sqrt();
        let line = Segment { from: Point::ZERO, to: Point::new(4.0, 0.0), energy_j };
        let value = |x: f64, y: f64| line.fluence(Point::new(x, y), radius_mm).value;
        assert!((line.peak(radius_mm) - 3.0).abs() < 1e-9);
        assert!((value(2.0, 0.037_057_595) - 1.0).abs() < 1e-6);
        assert!((value(-0.010_768_182, 0.0) - 1.0).abs() < 1e-6);
        let (x, y, step) = (0.01, 0.02, 1e-5);
        let slope = line.fluence(Point::new(x, y), radius_mm).slope;
        let dx = (value(x + step, y) - value(x - step, y)) / (2.0 * step);
        let dy = (value(x, y + step) - value(x, y - step)) / (2.0 * step);
        assert!((slope.x - dx).abs() < 0.1 && (slope.y - dy).abs() < 0.1, "{slope:?} {dx} {dy}");
        let rest = Segment { from: Point::ZERO, to: Point::ZERO, energy_j: 1.0 };
        let peak = FRAC_2_PI / (radius_mm * radius_mm);
        assert!((rest.fluence(Point::ZERO, radius_mm).value / peak - 1.0).abs() < 1e-3);
        assert!((rest.peak(radius_mm) - peak).abs() < 1e-9);
    }
}
