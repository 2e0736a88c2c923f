//! What contour error a plan promises on motors that the machine file is not certain of.

use crate::Error;
use ftheta_physics::along::Along;
use ftheta_physics::galvo::Galvo;
use ftheta_physics::optics::field_from_angles;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use ftheta_planner::optimal::near_scanner;
use ftheta_planner::render::PlayedMirrors;
use std::panic::resume_unwind;
use std::thread::{self, ScopedJoinHandle};

/// Greatest distances of the lit beam from its mark, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Promise {
    /// As planned.
    pub planned_mm: f64,
    /// On a motor whose torsional mode is off by the machine file's uncertainty, either way.
    pub f1_mm: f64,
    /// The same for the torque constant.
    pub kt_mm: f64,
    /// The same for what near ways are planned for ([`near_scanner`]), which long ones may miss.
    pub kt_near_mm: f64,
}

impl Promise {
    /// Contour error on any one motor within the uncertainties.
    pub fn contour_mm(&self) -> f64 {
        self.planned_mm.max(self.f1_mm).max(self.kt_mm)
    }
}

/// Plays a plan on the motors at the borders of the machine file's uncertainties, one at a time;
/// `None` for a plan whose distance from its marks is not known, as a classic one's.
///
/// # Errors
/// If the machine's servo cannot be built.
///
/// # Accuracy
/// At ticks, and as [`Along::new`]; no noise and no sensor errors.
pub fn promise(plan: &Plan) -> Result<Option<Promise>, Error> {
    let Some(planned_mm) = plan.planned_error_mm() else {
        return Ok(None);
    };
    let scanner = &plan.machine.scanner;
    let gains = Gains::design(scanner, plan.machine.output.period_s())?;
    let nominal = Galvo::new(scanner);
    let mode = |part: f64| Galvo { omega: nominal.omega * (1.0 + part), ..nominal };
    let torque =
        |part: f64| Galvo { torque_constant: nominal.torque_constant * (1.0 + part), ..nominal };
    let (f1, kt) = (scanner.f1_uncertainty, scanner.kt_uncertainty);
    let far = near_scanner(scanner).kt_uncertainty;
    let borders = [[mode(-f1), mode(f1)], [torque(-kt), torque(kt)], [torque(-far), torque(far)]];
    let [f1_mm, kt_mm, kt_near_mm] = thread::scope(|scope| {
        let play = |plant| scope.spawn(move || worst_mm(plan, &plant, gains));
        let played = borders.map(|pair| pair.map(play));
        // A panic in another thread is a panic here.
        let told = |one: ScopedJoinHandle<'_, f64>| one.join().unwrap_or_else(|p| resume_unwind(p));
        played.map(|pair| pair.map(told).into_iter().fold(0.0, f64::max))
    });
    Ok(Some(Promise { planned_mm, f1_mm, kt_mm, kt_near_mm }))
}

/// Greatest distance of the lit beam from its marks on a motor, mm.
fn worst_mm(plan: &Plan, plant: &Galvo, gains: Gains) -> f64 {
    let machine = &plan.machine;
    let mut mirrors = PlayedMirrors::new(plan, plant, gains);
    let mut lit = LitMark { plan, mark: 0, along: None };
    let mut worst_mm = 0.0_f64;
    while mirrors.advance() {
        let end_ns = mirrors.tick() as i64 * i64::from(machine.output.period_ns);
        if let Some(along) = lit.at(end_ns) {
            let place = field_from_angles(&machine.optics, mirrors.angles());
            worst_mm = worst_mm.max(along.distance_mm(place.into()));
        }
    }
    worst_mm
}

/// The mark that is lit.
struct LitMark<'a> {
    plan: &'a Plan,
    mark: usize,
    along: Option<Along>,
}

impl LitMark<'_> {
    /// The curve that light falls on at a time; times may not fall.
    fn at(&mut self, time_ns: i64) -> Option<&mut Along> {
        let laser = &self.plan.machine.laser;
        while let Some(mark) = self.plan.marks.get(self.mark) {
            if time_ns > mark.off_ns as i64 + laser.off_latency_ns {
                self.mark += 1;
                self.along = None;
            } else if time_ns < mark.on_ns as i64 + laser.on_latency_ns {
                return None;
            } else {
                let new = || Along::new(&mark.curve, self.plan.tolerance_mm);
                return Some(self.along.get_or_insert_with(new));
            }
        }
        None
    }
}
