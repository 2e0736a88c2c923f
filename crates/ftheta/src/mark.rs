//! The main job: a job laid, planned, audited, played on the twin and scored.

use crate::Error;
use crate::atlas_store::AtlasStore;
use crate::focus_report::spot_growth;
use crate::planning::Planning;
use crate::promise::Promise;
use ftheta_model::block::{Block, SampleSink};
use ftheta_model::dose::DoseMap;
use ftheta_model::job::Job;
use ftheta_model::machine::Machine;
use ftheta_model::plan::{Motion, PlanDraft, Planner};
use ftheta_model::recipe::{Pen, Recipe};
use ftheta_model::toolpath::Toolpath;
use ftheta_model::trace::{AxisStates, Trace};
use ftheta_model::warning::{Imported, Warning};
use ftheta_physics::correction::CorrectionTable;
use ftheta_physics::head::Head;
use ftheta_physics::optics::scale_mm_per_rad;
use ftheta_physics::plan::Plan;
use ftheta_planner::classic::Settings;
use ftheta_planner::optimal::Corner;
use ftheta_planner::render::Renderer;
use ftheta_report::score::{Score, Scorer};
use ftheta_toolpath::lay::{LayOptions, Order, lay};
use ftheta_twin::mismatch::Mismatch;
use ftheta_twin::twin::{Twin, TwinOptions};
use kurbo::Shape;

/// How a job is marked.
#[derive(Clone, Debug)]
pub struct MarkOptions {
    /// Speed of all pens, mm/s; `None` leaves the pens' own.
    pub speed_mm_s: Option<f64>,
    /// How the motion is planned; `None` is the best that the machine allows.
    pub planner: Option<Planner>,
    /// How planned marks take corners.
    pub corner: Corner,
    /// Part of the voltage that planned jumps keep for the servo's feedback.
    pub reserve: f64,
    /// Where jump atlases are kept.
    pub atlas_store: AtlasStore,
    /// Greatest distance of the beam from a mark, mm.
    pub tolerance_mm: f64,
    /// Order of the marks; the recipe's if `None`.
    pub order: Option<Order>,
    /// Marks what fits of shapes that leave the field.
    pub clip: bool,
    /// How the twin's plant differs from the machine.
    pub mismatch: Mismatch,
    /// Noise of the position sensors, mm rms in the field, added to the machine file's.
    pub noise_mm: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// Correction of the head as it really is.
    pub table: Option<CorrectionTable>,
    /// The head on the twin; none is a perfect one.
    pub head: Option<Head>,
}

/// Part of the voltage that planned jumps keep for feedback, unless told otherwise.
pub const RESERVE: f64 = 0.12;

impl Default for MarkOptions {
    /// Pens' own speed, the best planner, 12 % reserve, no store, 10 µm, the recipe's order, no
    /// clipping, no mismatch, no noise, seed 1, a perfect head without a table.
    fn default() -> Self {
        Self {
            speed_mm_s: None,
            planner: None,
            corner: Corner::Auto,
            reserve: RESERVE,
            atlas_store: AtlasStore::none(),
            tolerance_mm: 0.010,
            order: None,
            clip: false,
            mismatch: Mismatch::default(),
            noise_mm: 0.0,
            seed: 1,
            table: None,
            head: None,
        }
    }
}

/// What came of a job.
pub struct Marked {
    /// The plan that was played.
    pub plan: Plan,
    /// The planner's constants.
    pub settings: Settings,
    /// Where the plan's time goes.
    pub times: PlanTimes,
    /// What contour error the plan promises on motors that are not the nominal one.
    pub promise: Option<Promise>,
    /// What the beam did on the twin.
    pub score: Score,
    /// The energy on the work plane.
    pub dose: DoseMap,
    /// States of the axes over time, thinned.
    pub states: Vec<AxisStates>,
    /// Seed of the twin's noise.
    pub seed: u64,
    /// What was ignored or changed.
    pub warnings: Vec<Warning>,
}

/// Where the time of a plan goes, on its own clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanTimes {
    /// First light to last light, s.
    pub duration_s: f64,
    /// Light, s.
    pub mark_s: f64,
    /// Darkness between first and last light, s.
    pub jump_s: f64,
    /// The part of `jump_s` in which the command stands still, s.
    pub delay_s: f64,
    /// Jumps between marks.
    pub n_jumps: usize,
    /// Length of all marks, mm.
    pub marked_mm: f64,
}

/// A stage of [`mark`], told to its observer when it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// Shapes become vectors in order.
    Lay,
    /// Jumps are solved that no earlier job has needed; the share of them done, about.
    Atlas(f64),
    /// Vectors become motion.
    Plan,
    /// Every sample of the plan is checked.
    Audit,
    /// The twin plays; the share of the samples done.
    Play(f64),
    /// Dose map and figures are finished.
    Finish,
    /// The classic planner's delays are tuned, for comparison; the share of the columns done.
    Tune(f64),
}

/// States of the axes that are kept, about.
const N_STATES: u64 = 100_000;

/// Most pixels of the dose map's bounding box.
const N_PIXELS_MAX: f64 = 24e6;

/// Fewest and most pixels across a spot, where memory allows.
const SPOT_PIXELS: [f64; 2] = [3.0, 12.0];
/// Pixels along the longer side of a drawing, within these bounds.
const N_PIXELS_WIDE: f64 = 1200.0;

/// Accuracy of the length of a curve, mm.
const LENGTH_ACCURACY_MM: f64 = 1e-6;

/// Blocks between two looks at the trace.
const N_BLOCKS_PER_STRETCH: usize = 32;

/// Marks a job on the digital twin.
///
/// * `observer` is told when a stage begins, so that a front end can show progress and time it
///
/// # Errors
/// If the job leaves the field, a setting is out of the machine's range, or the audit refuses.
pub fn mark(
    job: &Job,
    machine: &Machine,
    recipe: &Recipe,
    options: &MarkOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Marked, Error> {
    observer(Stage::Lay);
    let Imported { value: toolpath, mut warnings } = lay_out(job, machine, recipe, options)?;
    observer(Stage::Plan);
    let settings = Settings::new(machine, &recipe.classic)?;
    let planning = Planning { machine, settings: &settings, options };
    let (plan, promise) = planning.plan(toolpath, &mut warnings, observer)?;
    let Played { score, dose, states } = play(&plan, options, observer)?;
    warnings.extend(shortcomings(&plan, &score));
    warnings.extend(plane_warnings(&plan, options.table.as_ref()));
    let times = plan_times(&plan);
    warnings.extend(promise.and_then(|promise| broken(&plan, &promise)));
    let seed = options.seed;
    Ok(Marked { plan, settings, times, promise, score, dose, states, seed, warnings })
}

/// The toolpath of a job at the speeds asked for.
pub(crate) fn lay_out(
    job: &Job,
    machine: &Machine,
    recipe: &Recipe,
    options: &MarkOptions,
) -> Result<Imported<Toolpath>, Error> {
    let of_recipe = if recipe.keep_order { Order::Keep } else { Order::Shortest };
    let lay_options = LayOptions {
        flatten_tolerance_mm: recipe.flatten_tolerance_mm.unwrap_or(0.002),
        order: options.order.unwrap_or(of_recipe),
        half_field_mm: 0.5 * machine.optics.field_mm,
        clip: options.clip,
        ..LayOptions::default()
    };
    let mut laid = lay(job, &lay_options)?;
    if let Some(speed_mm_s) = options.speed_mm_s {
        laid.value.pens.iter_mut().for_each(|pen| pen.mark_speed_mm_s = speed_mm_s);
    }
    Ok(laid)
}

/// Stray energy from which on it is worth a warning.
const STRAY_WARNING: f64 = 0.01;

/// Part by which the spot may be larger than in focus without a word.
const SPOT_GROWTH_WARNING: f64 = 0.05;

/// Part of a pen's speed below which a mark is called slower.
const SLOWER_WARNING: f64 = 0.95;

/// What a user has to know of a result before relying on it.
fn shortcomings(plan: &PlanDraft, score: &Score) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |message: String| warnings.push(Warning::new("result", message));
    let (error_um, tolerance_um) = (score.contour_error_um.max, plan.tolerance_mm * 1e3);
    if error_um > tolerance_um {
        warn(format!("contour error {error_um:.1} µm exceeds the tolerance of {tolerance_um} µm"));
    }
    if score.stray_energy_ratio > STRAY_WARNING {
        let percent = score.stray_energy_ratio * 100.0;
        warn(format!("{percent:.1} % of the energy falls farther off its mark than the tolerance"));
    }
    if let Some(focus) = score.focus_error_um {
        let (off_mm, growth) = (1e-3 * focus.max, spot_growth(&plan.machine, 1e-3 * focus.max));
        if growth > SPOT_GROWTH_WARNING {
            let percent = growth * 100.0;
            warn(format!("the focus is off by {off_mm:.2} mm, the spot {percent:.0} % larger"));
        }
    }
    warnings.extend(slower_marks(plan));
    let mut warn = |message: String| warnings.push(Warning::new("result", message));
    let dark = |index: usize| plan.marks.iter().any(|m| m.pen_index == index && m.power_w == 0.0);
    for (_, pen) in plan.pens.iter().enumerate().filter(|&(index, _)| dark(index)) {
        warn(format!("pen \"{}\" has no power, so its marks see no light", pen.name));
    }
    warnings
}

/// What a work plane at another height than the nominal one does to spot and places.
fn plane_warnings(plan: &PlanDraft, table: Option<&CorrectionTable>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let optics = &plan.machine.optics;
    let mut warn = |message: String| warnings.push(Warning::new("plane", message));
    let growth = spot_growth(&plan.machine, optics.plane_mm);
    if optics.focus.is_none() && growth > SPOT_GROWTH_WARNING {
        let percent = growth * 100.0;
        warn(format!("at {} mm the fixed focus has a spot {percent:.0} % larger", optics.plane_mm));
    }
    let heights = table.and_then(|table| {
        let planes = table.planes();
        Some((planes.first()?.z_mm, planes.last()?.z_mm))
    });
    if let Some((low, high)) =
        heights.filter(|(low, high)| !(*low..=*high).contains(&optics.plane_mm))
    {
        let known =
            if low == high { format!("at {low} mm") } else { format!("{low} to {high} mm") };
        let height = optics.plane_mm;
        warn(format!(
            "the correction table knows planes {known} alone, not the one at {height} mm"
        ));
    }
    warnings
}

/// A warning where a plan cannot promise its tolerance.
fn broken(plan: &PlanDraft, promise: &Promise) -> Option<Warning> {
    let (promised_um, tolerance_um) = (promise.contour_mm() * 1e3, plan.tolerance_mm * 1e3);
    let message = format!(
        "on a motor within the machine file's uncertainties the contour error may be \
         {promised_um:.1} µm, the tolerance is {tolerance_um} µm"
    );
    (promised_um > tolerance_um).then(|| Warning::new("promise", message))
}

/// Marks that never reach their pen's speed, pen by pen; with a laser that is only on or off all
/// that are slower anywhere, since their dose is not what the pen says.
fn slower_marks(plan: &PlanDraft) -> Vec<Warning> {
    let modulated = plan.machine.laser.follows_speed();
    // Per pen: how many, the slowest of them and its speed.
    let mut slower: Vec<(usize, usize, f64)> = vec![(0, 0, f64::INFINITY); plan.pens.len()];
    let mut speeds: Vec<Option<f64>> = vec![None; plan.marks.len()];
    for segment in &plan.segments {
        let (Some(mark), Motion::Track { first_knot, n_knots, .. }) =
            (segment.mark_index, segment.motion)
        else {
            continue;
        };
        let knots = &plan.knots[first_knot as usize..(first_knot + n_knots) as usize];
        let speed = &mut speeds[mark as usize];
        for knot in knots {
            let reached = match (*speed, modulated) {
                (None, _) => knot.speed_mm_s,
                (Some(so_far), true) => so_far.max(knot.speed_mm_s),
                (Some(so_far), false) => so_far.min(knot.speed_mm_s),
            };
            *speed = Some(reached);
        }
    }
    for (index, (mark, speed)) in plan.marks.iter().zip(speeds).enumerate() {
        let asked_mm_s = plan.pens[mark.pen_index].mark_speed_mm_s;
        if let Some(speed) = speed.filter(|&speed| speed < SLOWER_WARNING * asked_mm_s) {
            let (n_marks, slowest, slowest_mm_s) = &mut slower[mark.pen_index];
            *n_marks += 1;
            if speed < *slowest_mm_s {
                (*slowest, *slowest_mm_s) = (index, speed);
            }
        }
    }
    let message = |(pen, (n_marks, slowest, speed)): (&Pen, (usize, usize, f64))| {
        let dose = if modulated { "their power follows" } else { "their dose is higher" };
        let text = format!(
            "{n_marks} mark(s) of pen \"{}\" are slower than its {} mm/s, {dose}; slowest is mark \
             {slowest} ({}) with {speed:.0} mm/s",
            pen.name, pen.mark_speed_mm_s, plan.marks[slowest].source
        );
        Warning::new("speed", text)
    };
    let concerned = plan.pens.iter().zip(slower).filter(|(_, (n_marks, ..))| *n_marks > 0);
    concerned.map(message).collect()
}

/// What the twin did with a plan.
pub struct Played {
    /// The figures.
    pub score: Score,
    /// The energy on the work plane.
    pub dose: DoseMap,
    /// States of the axes over time, thinned.
    pub states: Vec<AxisStates>,
}

/// Plays a plan on the twin; memory does not grow with the plan, except for what is returned.
///
/// # Errors
/// If the machine's servo cannot be built.
pub fn play(
    plan: &Plan,
    options: &MarkOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Played, Error> {
    play_watched(plan, options, observer, &mut |_| {})
}

/// The same, with every stretch of the trace shown to `watch`.
pub(crate) fn play_watched(
    plan: &Plan,
    options: &MarkOptions,
    observer: &mut dyn FnMut(Stage),
    watch: &mut dyn FnMut(&Trace),
) -> Result<Played, Error> {
    let n_samples = plan.n_samples();
    let twin_options = TwinOptions {
        mismatch: options.mismatch,
        seed: options.seed,
        pixel_mm: pixel_mm(plan),
        state_stride: n_samples.div_ceil(N_STATES),
    };
    let mut twin = twin(&plan.machine, options, &twin_options)?;
    let mut states = Vec::new();
    if let Some(head) = &options.head {
        twin = twin.with_head(head);
    }
    let mut renderer = Renderer::new(plan);
    if let Some(table) = &options.table {
        renderer = renderer.correct_by(table);
    }
    let score = score(plan, renderer, &mut twin, &mut |first_index, trace| {
        observer(Stage::Play(first_index as f64 / n_samples as f64));
        watch(&trace);
        states.extend(trace.states);
    })?;
    observer(Stage::Finish);
    Ok(Played { score, dose: twin.into_dose(), states })
}

/// A twin of this machine, with the noise asked for.
pub(crate) fn twin(
    machine: &Machine,
    options: &MarkOptions,
    twin_options: &TwinOptions,
) -> Result<Twin, Error> {
    let mut machine = machine.clone();
    let sensor = &mut machine.scanner.sensor;
    // A displacement in the field is half that of the beam's angle times the focal length.
    let noise_rad = options.noise_mm / scale_mm_per_rad(&machine.optics);
    sensor.noise_rad = sensor.noise_rad.hypot(noise_rad);
    Ok(Twin::new(&machine, twin_options)?)
}

/// Plays a plan from a renderer at its start on a twin at rest.
///
/// * `see` is given stretch after stretch, and the index of the sample after it
pub(crate) fn score(
    plan: &Plan,
    mut renderer: Renderer<'_>,
    twin: &mut Twin,
    see: &mut dyn FnMut(u64, Trace),
) -> Result<Score, Error> {
    let mut scorer = Scorer::new(plan);
    let mut block = Block::default();
    let mut n_blocks = 0;
    let mut look = |twin: &mut Twin, index: u64| {
        let trace = twin.take_trace();
        scorer.add(&trace);
        see(index, trace);
    };
    while renderer.next_block(&mut block) {
        if n_blocks % N_BLOCKS_PER_STRETCH == 0 {
            look(twin, block.first_index);
        }
        n_blocks += 1;
        twin.push(&block)?;
    }
    twin.finish();
    look(twin, plan.n_samples());
    Ok(scorer.finish())
}

/// A third of the spot; finer where a small drawing is seen large, coarser where the drawing is so
/// large that memory would not do.
fn pixel_mm(plan: &PlanDraft) -> f64 {
    let (mut low, mut high) = (kurbo::Point::ZERO, kurbo::Point::ZERO);
    for (index, &vertex) in plan.vertices.iter().enumerate() {
        // The first and last vertices are the field centre.
        if index != 0 && index + 1 != plan.vertices.len() {
            low = kurbo::Point::new(low.x.min(vertex.x), low.y.min(vertex.y));
            high = kurbo::Point::new(high.x.max(vertex.x), high.y.max(vertex.y));
        }
    }
    let (width_mm, height_mm) = (high.x - low.x, high.y - low.y);
    let [coarse_mm, fine_mm] = SPOT_PIXELS.map(|n| plan.machine.laser.spot_diameter_mm / n);
    let pixel_mm = (width_mm.max(height_mm) / N_PIXELS_WIDE).clamp(fine_mm, coarse_mm);
    pixel_mm.max((width_mm * height_mm / N_PIXELS_MAX).sqrt())
}

/// Where the time of a plan goes.
pub fn plan_times(plan: &PlanDraft) -> PlanTimes {
    let (Some(first), Some(last)) = (plan.marks.first(), plan.marks.last()) else {
        return PlanTimes::default();
    };
    let laser = &plan.machine.laser;
    let latency_ns = laser.off_latency_ns - laser.on_latency_ns;
    let seconds =
        |from_ns: u64, to_ns: u64| ((to_ns as i64 - from_ns as i64) + latency_ns) as f64 * 1e-9;
    let mut times = PlanTimes {
        duration_s: seconds(first.on_ns, last.off_ns),
        mark_s: plan.marks.iter().map(|mark| seconds(mark.on_ns, mark.off_ns).max(0.0)).sum(),
        ..PlanTimes::default()
    };
    times.jump_s = times.duration_s - times.mark_s;
    times.marked_mm = plan.marks.iter().map(|mark| mark.curve.perimeter(LENGTH_ACCURACY_MM)).sum();
    let last_mark = plan.marks.len() as u32 - 1;
    let mut mark_before = None;
    // Skywriting's runs belong to the jump between them.
    let mut jumped = false;
    for segment in &plan.segments {
        let between = mark_before.is_some_and(|mark| mark < last_mark);
        match (segment.mark_index, segment.motion) {
            (Some(index), _) => {
                mark_before = Some(index);
                jumped = false;
            }
            (None, Motion::Travel { .. } | Motion::Track { .. } | Motion::Drive { .. }) => {
                times.n_jumps += usize::from(between && !jumped);
                jumped = true;
            }
            (None, Motion::Hold { .. }) if between => {
                times.delay_s += f64::from(segment.n_ticks) * plan.machine.output.period_s();
            }
            (None, Motion::Hold { .. }) => {}
        }
    }
    times
}
