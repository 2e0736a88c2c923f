//! One mark while its light is on: nearest points, energy along the curve, the beam's path.

use crate::contour::{Contour, Foot, Nearest};
use crate::coverage::BeamPath;
use crate::line_dose::LineDose;
use crate::progress::Progress;
use ftheta_model::plan::{PlanDraft, PlannedMark};
use kurbo::Point;

/// Finest step of arc length that curves are sampled at, mm.
const STEP_MM: f64 = 1e-3;
/// Most samples of one mark; longer ones than 4 m are sampled coarser.
const N_SAMPLES_MAX: f64 = 4e6;

/// What is known of a mark so far.
pub struct MarkTrack {
    /// Its index in the plan.
    pub mark_index: usize,
    /// Its curve.
    pub contour: Contour,
    /// Energy along it.
    pub dose: LineDose,
    /// Line energy that its pen asks for, J/mm.
    pub asked_j_mm: f64,
    path: BeamPath,
    step_mm: f64,
    /// Where the light came on: distance before the curve's start, mm.
    pub before_start_mm: f64,
    /// Where the beam is.
    pub beam: Point,
    /// What of the curve is nearest to it.
    nearest: Nearest,
    /// Where along the curve its light belongs.
    progress: Progress,
    /// Greatest distance so far, mm, and where the beam was.
    pub worst: (f64, Point),
}

impl MarkTrack {
    /// A mark whose light comes on with the beam at `beam`.
    pub fn new(plan: &PlanDraft, mark_index: usize, mark: &PlannedMark, beam: Point) -> Self {
        let contour = Contour::new(&mark.curve);
        let laser = &plan.machine.laser;
        let pen = plan.pens.get(mark.pen_index);
        let speed_mm_s = pen.map_or(f64::INFINITY, |pen| pen.mark_speed_mm_s);
        let pitch_mm = laser.pulse_khz.map_or(0.0, |pulse_khz| speed_mm_s / (1e3 * pulse_khz));
        let window_mm = laser.spot_diameter_mm.max(2.0 * pitch_mm);
        let step_mm = STEP_MM.max(contour.length_mm() / N_SAMPLES_MAX);
        let foot = contour.nearest_to_start(beam, contour.start().distance(beam));
        let mut nearest = Nearest::default();
        contour.find_nearest(beam, &mut nearest);
        let mut dose = LineDose::new(&contour, window_mm, step_mm);
        // What lies closer than the window is averaged anyway.
        let mut progress = Progress::new(foot.at_mm, window_mm);
        progress.advance(&contour, (beam, &nearest), 0.0, (0.0, &mut dose));
        let mut path = BeamPath::default();
        path.add(beam, 0.0);
        Self {
            mark_index,
            before_start_mm: contour.before_start_mm(beam, foot),
            dose,
            asked_j_mm: pen.map_or(0.0, |pen| pen.power_w) / speed_mm_s,
            path,
            step_mm,
            contour,
            beam,
            worst: (nearest.distance_mm, beam),
            nearest,
            progress,
        }
    }

    /// Distance of the beam from the curve, mm.
    pub fn distance_mm(&self) -> f64 {
        self.nearest.distance_mm
    }

    /// Moves the beam to `beam` while `energy_j` is emitted.
    pub fn advance(&mut self, beam: Point, energy_j: f64) {
        let way_mm = self.beam.distance(beam);
        self.contour.find_nearest(beam, &mut self.nearest);
        let light = (energy_j, &mut self.dose);
        self.progress.advance(&self.contour, (beam, &self.nearest), way_mm, light);
        self.beam = beam;
        self.path.add(beam, 0.5 * self.step_mm);
        if self.distance_mm() > self.worst.0 {
            self.worst = (self.distance_mm(), beam);
        }
    }

    /// Ends the light; returns how far it went past the curve's end, mm.
    pub fn end(&mut self) -> f64 {
        let at_mm = self.progress.settle(&mut self.dose);
        let foot = Foot { at_mm, distance_mm: self.distance_mm() };
        let foot = self.contour.nearest_to_end(self.beam, foot);
        self.contour.past_end_mm(self.beam, foot)
    }

    /// Distances in mm of the curve's points from the lit beam, each with the number of times that
    /// the curve passes the point.
    pub fn coverage_mm(&mut self) -> Vec<(usize, f64)> {
        // The thinned path must still reach to where the light went off.
        self.path.add(self.beam, 1e-9);
        let n = (self.contour.length_mm() / self.step_mm).ceil() as usize + 1;
        std::mem::take(&mut self.path).into_distances_mm(&self.contour, self.step_mm, n)
    }
}
