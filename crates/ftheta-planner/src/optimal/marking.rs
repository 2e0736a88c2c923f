//! One mark after the other: its speed, its corners, its light.

use super::lens::LensAxis;
use super::path::Path;
use super::pieces::Piece;
use super::speed::{SpeedLimits, averaged_mm, time_at_s};
use super::turn::{Allowance, Turn, candidates, straight_mm};
use super::weave::{Stretch, Weave};
use super::{Corner, N_REST_TICKS, OptimalOptions};
use crate::PlanError;
use crate::corner::Corners;
use ftheta_model::plan::PlannedMark;
use ftheta_model::recipe::Pen;
use ftheta_model::toolpath::Mark;
use ftheta_physics::audit::CORRECTION_RESERVE;
use ftheta_physics::follow::TAPS_AFTER;
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::scale_mm_per_rad;

/// Part of the tolerance by which a plan itself may miss a curve; the rest is for the machine.
const MISS_SHARE: f64 = 0.85;
/// The same in corners whose programs stand other motors by themselves.
const TURN_SHARE: f64 = 0.93;
/// By how much of the tolerance the corner itself may be missed: a beam that is within the
/// tolerance of both legs of a right angle misses it by √2.
const COVERAGE_SHARE: f64 = 1.35;
/// Part of the greatest angular acceleration that the beam may have along a mark.
const ALONG_SHARE: f64 = 0.35;
/// Part of the voltage and current that marks may use.
const MARK_SHARE: f64 = 0.8;
/// Corners sharper than this are stopped in, where the path is to be exact, rad.
const STOP_RAD: f64 = 0.02;
/// Where there is no room to come to a mark, it is tried slower, so often and by this much.
const N_SLOWER: u32 = 8;
const SLOWER: f64 = 0.5;
/// Part of the voltage that the back-EMF of a mark may take.
const COAST_SHARE: f64 = 0.25;
/// Part of the mirrors' greatest speed that marks may have.
const SPEED_SHARE: f64 = 0.9 * (1.0 - CORRECTION_RESERVE);
/// How far a beam's nearest point is from where its speed profile says, in tolerances.
const NEAR: f64 = 2.0;
/// Least power, as a part of the pen's, so that light does not end before the mark does.
const POWER_MIN: f64 = 1e-6;

/// Plans mark after mark.
pub(super) struct Marking<'a> {
    pub(super) weave: Weave<'a>,
    pub(super) options: &'a OptimalOptions,
    pub(super) corners: Option<&'a Corners>,
    pub(super) galvo: Galvo,
    /// How long the beam runs at mark speed before and after light, s.
    pub(super) run_s: [f64; 2],
}

/// A mark as it is made: stretches, and between each two a turn with its voltages.
struct Stroke<'p> {
    pieces: Vec<Piece<'p>>,
    turns: Vec<Turn>,
    joints: Vec<Vec<[f64; 2]>>,
}

impl Stroke<'_> {
    /// Whether it is made at the pen's speed from end to end.
    fn is_steady(&self, pen: &Pen) -> bool {
        match &self.pieces[..] {
            [piece] => match piece.stretch.knots[..] {
                [knot] => knot.speed_mm_s == pen.mark_speed_mm_s,
                _ => false,
            },
            _ => false,
        }
    }
}

/// Power from times on, s and W.
type Powers = Vec<(f64, f64)>;

impl Marking<'_> {
    /// Makes all marks, from the centre and back to it if so wanted; else the first of them is not
    /// flown to, nor the last one left.
    ///
    /// # Errors
    /// As [`Self::mark`].
    pub(super) fn all(
        &mut self,
        marks: impl IntoIterator<Item = Mark>,
        [from_centre, to_centre]: [bool; 2],
    ) -> Result<(), PlanError> {
        // Long enough for an on edge that comes early, and for the first commands of a lens.
        let latency_ns = self.weave.machine.laser.on_latency_ns.max(0) as u64;
        let period_ns = u64::from(self.weave.machine.output.period_ns);
        let n_early = latency_ns.div_ceil(period_ns) as u32;
        let n_lens = self.weave.lens.as_ref().map_or(0, LensAxis::n_lag_ticks);
        self.weave.rest_in_centre(N_REST_TICKS.max(n_early).max(n_lens));
        if !from_centre {
            self.weave.forget_place();
        }
        marks.into_iter().try_for_each(|mark| self.mark(mark))?;
        if to_centre && !self.weave.fly_home()? {
            return Err(PlanError::NoRoom { place: "the way back to the centre".into() });
        }
        Ok(())
    }

    /// Flies to a mark and makes it.
    ///
    /// # Errors
    /// If it cannot be reached, or a program fails.
    pub(super) fn mark(&mut self, mark: Mark) -> Result<(), PlanError> {
        let pen = self.weave.draft.pens[mark.pen_index].clone();
        let Some(path) = Path::new(&mark).or_else(|| Path::straight(&mark.points)) else {
            return Ok(());
        };
        let limits = self.limits(&pen, &path);
        let sky = match self.options.corner {
            Corner::Sky => true,
            Corner::Auto => !self.weave.machine.laser.follows_speed(),
            Corner::Exact | Corner::Blend => false,
        };
        if sky {
            let cuts = self.sharp(&path, &limits);
            for (part, curve) in path.cut(&mark.curve, &cuts) {
                self.stroke(Mark { curve, ..mark.clone() }, part, &pen, &limits)?;
            }
            return Ok(());
        }
        self.stroke(mark, path, &pen, &limits)
    }

    /// A stretch of light without a break; slower where the mirrors' angles leave no room to come
    /// to it at its speed.
    fn stroke(
        &mut self,
        mark: Mark,
        path: Path,
        pen: &Pen,
        limits: &SpeedLimits,
    ) -> Result<(), PlanError> {
        let index = self.weave.draft.marks.len() as u32;
        let place = format!("mark {index} ({})", mark.source);
        let mut limits = *limits;
        // Light that ends later than it begins cannot be shorter than that.
        limits.speed_mm_s = limits.speed_mm_s.min(path.length_mm() / self.light_min_s());
        for _ in 0..N_SLOWER {
            let tables = self.weave.tables();
            let stroke = self.laid(&path, &limits, &place)?;
            let last =
                stroke.pieces.last().map_or(Ok(true), |last| self.weave.can_leave(&last.laid));
            if last? && self.weave.fly_to(&stroke.pieces[0].laid)? {
                return self.lit(mark, &path, pen, &stroke);
            }
            self.weave.take_back(tables);
            limits.speed_mm_s *= SLOWER;
        }
        Err(PlanError::NoRoom { place })
    }

    /// Stretches and turns of a path, in the draft's tables.
    fn laid<'p>(
        &mut self,
        path: &'p Path,
        limits: &SpeedLimits,
        place: &str,
    ) -> Result<Stroke<'p>, PlanError> {
        let turns = self.turns(path, limits)?;
        let pieces = self.pieces(path, &turns, limits, place)?;
        if let Some(joints) = self.joints(&pieces, &turns) {
            return Ok(Stroke { pieces, turns, joints });
        }
        let pieces = self.pieces(path, &[], limits, place)?;
        Ok(Stroke { pieces, turns: Vec::new(), joints: Vec::new() })
    }

    /// Follows a stroke from its beginning, where the mirrors are, with light.
    fn lit(
        &mut self,
        mark: Mark,
        path: &Path,
        pen: &Pen,
        stroke: &Stroke<'_>,
    ) -> Result<(), PlanError> {
        let Stroke { pieces, turns, joints } = stroke;
        let index = self.weave.draft.marks.len() as u32;
        let start_s = self.weave.now_s();
        let mut end_s = start_s;
        let light_s = start_s + self.run_s[0];
        let mut progress_mm = Vec::new();
        let corner_mm = |turn: &Turn| path.distances_mm[turn.vertex];
        for (piece_index, piece) in pieces.iter().enumerate() {
            let piece_s = self.weave.now_s();
            self.weave.follow(index, &piece.laid);
            let before = piece_index.checked_sub(1).and_then(|before| turns.get(before));
            let offset_mm = before.map_or(0.0, corner_mm);
            add_progress(&mut progress_mm, &self.progress_mm(piece), offset_mm);
            end_s = piece_s + time_at_s(&piece.stretch.knots, piece.stretch.path.length_mm());
            if let (Some(voltages), Some(turn)) = (joints.get(piece_index), turns.get(piece_index))
            {
                self.weave.drive(Some(index), voltages);
                let parts = [piece.part, pieces[piece_index + 1].part];
                add_progress(&mut progress_mm, &turn.progress_mm(parts), corner_mm(turn));
            }
        }
        let laser = &self.weave.machine.laser;
        // Triggered pulses can come no faster than at the rate that the pen's power stands for.
        let power_max_w = if laser.pulses_triggered { pen.power_w } else { laser.power_max_w };
        let powers = match laser.follows_speed() && !stroke.is_steady(pen) {
            true => {
                let times_s = (start_s, self.weave.period_s());
                powers(pen, power_max_w, &progress_mm, times_s)
            }
            false => Powers::new(),
        };
        let first = powers.iter().take_while(|(time_s, _)| *time_s <= light_s).last();
        let planned = PlannedMark {
            curve: mark.curve,
            pen_index: mark.pen_index,
            source: mark.source,
            on_ns: 0,
            off_ns: 0,
            power_w: first.map_or(pen.power_w, |&(_, power_w)| power_w),
            steps: Vec::new(),
        };
        self.weave.light(planned, [light_s, end_s], &powers)
    }

    /// Corners of a path that can be taken by programs.
    fn turns(&self, path: &Path, limits: &SpeedLimits) -> Result<Vec<Turn>, PlanError> {
        let (Some(corners), true) = (self.corners, limits.stop_rad == f64::INFINITY) else {
            return Ok(Vec::new());
        };
        let tolerance_mm = self.options.care * self.options.tolerance_mm;
        let allowance = Allowance {
            contour_mm: TURN_SHARE * tolerance_mm,
            coverage_mm: COVERAGE_SHARE * tolerance_mm,
        };
        let speed = limits.speed_mm_s;
        // What the states at both ends of a turn are computed from has to be straight.
        let margin_s = self.weave.smoothing.half_s + TAPS_AFTER as f64 * self.weave.period_s();
        let margin_mm = speed * margin_s;
        let mut turns: Vec<Turn> = Vec::new();
        for vertex in self.sharp(path, limits) {
            let machine = self.weave.machine;
            let Some(turn) = Turn::new(corners, machine, path, vertex, (speed, allowance))? else {
                continue;
            };
            let runs_mm = turn.runs_s().map(|run_s| speed * run_s);
            let (before_mm, after_mm) = (runs_mm[0] + margin_mm, runs_mm[1] + margin_mm);
            let room_mm = match turns.last() {
                Some(last) => {
                    let way_mm = path.distances_mm[vertex] - path.distances_mm[last.vertex];
                    way_mm - speed * (last.runs_s()[1] + 2.0 * self.weave.period_s())
                }
                None => path.distances_mm[vertex],
            };
            let left_mm = path.length_mm() - path.distances_mm[vertex];
            let fits = straight_mm(path, vertex, false, before_mm) >= before_mm
                && straight_mm(path, vertex, true, after_mm) >= after_mm
                && room_mm >= runs_mm[0]
                && left_mm >= runs_mm[1];
            if fits {
                turns.push(turn);
            }
        }
        Ok(turns)
    }

    /// Vertices too sharp for the mark speed.
    fn sharp(&self, path: &Path, limits: &SpeedLimits) -> Vec<usize> {
        let limit = (limits.miss_mm, limits.change_mm_s);
        candidates(path, limits.speed_mm_s, self.weave.smoothing, limit)
    }

    /// Voltages of the turns, joined exactly to the stretches on both sides; `None` if that is more
    /// than the motors stand.
    fn joints(&self, pieces: &[Piece<'_>], turns: &[Turn]) -> Option<Vec<Vec<[f64; 2]>>> {
        let mut joints = Vec::with_capacity(turns.len());
        for (turn, pair) in turns.iter().zip(pieces.windows(2)) {
            let voltages = turn.voltages_v([pair[0].part, pair[1].part]);
            let (from, to) = (pair[0].laid.ends(), pair[1].laid.starts());
            let voltages = self.weave.corrected(voltages, from, to)?;
            if !self.weave.allows(&voltages, from) {
                return None;
            }
            joints.push(voltages);
        }
        Some(joints)
    }

    /// Progress of the beam along the path at every tick of a stretch, from the first to the end,
    /// mm.
    fn progress_mm(&self, piece: &Piece<'_>) -> Vec<f64> {
        let Stretch { knots, path, .. } = &piece.stretch;
        let n_ticks = piece.laid.n_ticks();
        if let [knot] = knots[..] {
            let step_mm = knot.speed_mm_s * self.weave.period_s();
            let first_mm = knot.distance_mm - knot.speed_mm_s * knot.time_s;
            return (0..=n_ticks).map(|tick| first_mm + f64::from(tick) * step_mm).collect();
        }
        let (smoothing, period_s) = (self.weave.smoothing, self.weave.period_s());
        let around_mm = averaged_mm(knots, smoothing, n_ticks, period_s);
        let near_mm = NEAR * self.options.tolerance_mm;
        match &piece.places {
            Some(places) => path.nearest_mm(places, &around_mm, near_mm),
            None => path.nearest_mm(&self.weave.places(&piece.laid), &around_mm, near_mm),
        }
    }

    /// Shortest light that the laser can give, s.
    fn light_min_s(&self) -> f64 {
        let laser = &self.weave.machine.laser;
        let ordered_ns = 1 + laser.off_latency_ns - laser.on_latency_ns;
        laser.minimum_on_ns.max(ordered_ns).max(1) as f64 * 1e-9
    }

    /// What limits the speed along a path: pen, motors, focusing lens.
    fn limits(&self, pen: &Pen, path: &Path) -> SpeedLimits {
        let mut limits = self.motor_limits(pen);
        if let Some(lens) = &self.weave.lens {
            let allowed = lens.limits(path, self.weave.smoothing);
            limits.speed_mm_s = limits.speed_mm_s.min(allowed.speed_mm_s);
            limits.acceleration_mm_s2 = limits.acceleration_mm_s2.min(allowed.acceleration_mm_s2);
            limits.change_mm_s = limits.change_mm_s.min(allowed.change_mm_s);
        }
        limits
    }

    fn motor_limits(&self, pen: &Pen) -> SpeedLimits {
        let machine = self.weave.machine;
        let scanner = &machine.scanner;
        let scale = scale_mm_per_rad(&machine.optics);
        let most = self.galvo.torque_constant / self.galvo.inertia() * scanner.current_max_a;
        let voltage_max_v =
            MARK_SHARE * (1.0 - self.options.voltage_reserve) * scanner.voltage_max_v;
        // Coasting takes the back-EMF; the rest is left to come and go.
        let coasting_rad_s = COAST_SHARE * voltage_max_v / self.galvo.torque_constant;
        let fastest_rad_s = coasting_rad_s.min(SPEED_SHARE * scanner.speed_max_rad_s);
        let speed_mm_s = pen.mark_speed_mm_s.min(fastest_rad_s * scale);
        // A bend that goes on is a sine on each axis, with half the square of its peak.
        let sustained_a =
            (2.0 * self.options.restraint.bend_heat_share).sqrt() * scanner.current_rms_a;
        let current_max_a = (MARK_SHARE * scanner.current_max_a).min(sustained_a);
        SpeedLimits {
            speed_mm_s,
            acceleration_mm_s2: ALONG_SHARE * most * scale,
            miss_mm: MISS_SHARE * self.options.care * self.options.tolerance_mm,
            change_mm_s: self.weave.smoothing.change_max_mm_s(
                speed_mm_s,
                voltage_max_v,
                current_max_a,
            ),
            stop_rad: match self.options.corner {
                Corner::Exact => STOP_RAD,
                Corner::Auto | Corner::Blend | Corner::Sky => f64::INFINITY,
            },
        }
    }
}

/// Appends places along a stretch, whose first tick is the last of the stretch before.
///
/// * `offset_mm`: what they count from, along the whole path
fn add_progress(all_mm: &mut Vec<f64>, stretch_mm: &[f64], offset_mm: f64) {
    all_mm.pop();
    all_mm.extend(stretch_mm.iter().map(|at_mm| at_mm + offset_mm));
}

/// Power of each tick, so that every millimetre gets the pen's energy: what a tick cannot give,
/// because the laser has no more, the next one does.
///
/// * `progress_mm`: along the path, at each tick from `start_s` on
fn powers(
    pen: &Pen,
    power_max_w: f64,
    progress_mm: &[f64],
    (start_s, period_s): (f64, f64),
) -> Powers {
    let energy_j_mm = pen.power_w / pen.mark_speed_mm_s;
    let most_mm = power_max_w * period_s / energy_j_mm;
    let least_mm = POWER_MIN * pen.mark_speed_mm_s * period_s;
    let mut given_mm = progress_mm.first().copied().unwrap_or(0.0);
    let windows = progress_mm.windows(2).enumerate();
    windows
        .map(|(tick, pair)| {
            let step_mm = (pair[1] - given_mm).clamp(least_mm, most_mm);
            given_mm += step_mm;
            (start_s + tick as f64 * period_s, step_mm * energy_j_mm / period_s)
        })
        .collect()
}
