//! Strokes planned, played on the twin, and burned.

use super::BurnOptions;
use super::strokes::{Stroke, Strokes};
use crate::Error;
use crate::mark::{MarkOptions, Stage, lay_out};
use crate::planning::Planning;
use ftheta_model::block::{Block, SampleSink};
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::Machine;
use ftheta_model::plan::Planner;
use ftheta_model::recipe::{ClassicRecipe, Hatch, Pen, Recipe};
use ftheta_physics::galvo::Galvo;
use ftheta_physics::plan::Plan;
use ftheta_physics::servo::Gains;
use ftheta_planner::classic::Settings;
use ftheta_planner::render::Renderer;
use ftheta_toolpath::lay::Order;
use ftheta_twin::photograph::{Burn, Burner};
use ftheta_twin::twin::{Twin, TwinOptions};
use kurbo::Vec2;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Run-in of every line in lags of the servo, after which the beam is at its speed.
const RUN_IN_LAGS: f64 = 8.0;
/// What a run-out is longer than the light needs, in lags.
const RUN_OUT_LAGS: f64 = 0.5;
/// Distance of lines that fill areas, in spot diameters.
const HATCH_SPOTS: f64 = 0.5;
/// The twin's own map of the dose is not looked at, and may be coarse.
const MAP_PIXEL_MM: f64 = 1.0;
const N_BLOCKS_PER_STRETCH: usize = 32;

/// What the twin burns of these strokes, by stroke; one stroke may have many runs.
///
/// A classic controller marks them: every leg runs in and out at its own speed in the dark, so
/// that light begins and ends where the beam follows its command by exactly its lag.
pub(super) fn burn(
    strokes: &Strokes,
    machine: &Machine,
    options: &BurnOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Burn, Error> {
    if strokes.all.is_empty() {
        return Ok(Burn::new());
    }
    observer(Stage::Lay);
    let mark_options = MarkOptions {
        order: Some(Order::Keep),
        planner: Some(Planner::Classic),
        mismatch: options.mismatch,
        table: options.table.clone(),
        head: options.head.clone(),
        ..MarkOptions::default()
    };
    let recipe = Recipe { classic: runs(machine, options)?, ..Recipe::default() };
    let toolpath = lay_out(&job(&strokes.all, machine), machine, &recipe, &mark_options)?;
    let settings = Settings::new(machine, &recipe.classic)?;
    let planning = Planning { machine, settings: &settings, options: &mark_options };
    let (plan, _) = planning.plan(toolpath.value, &mut Vec::new(), observer)?;
    let mut burned = play(&plan, options, observer)?;
    for run in &mut burned {
        let source = plan.marks.get(run.light).map(|mark| mark.source.as_str());
        run.light = source.and_then(stroke_of).unwrap_or(usize::MAX);
    }
    Ok(burned)
}

/// Moves every run as a whole, as pulses do that come when they like.
pub(super) fn jitter(burned: &mut Burn, jitter_mm: f64, seed: u64) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6a69_7474_6572);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    for run in burned {
        let off = Vec2::new(normal(), normal()) * jitter_mm;
        for segment in &mut run.segments {
            segment.from += off;
            segment.to += off;
        }
    }
}

/// Runs in the dark that are long enough for the servo and for late light.
fn runs(machine: &Machine, options: &BurnOptions) -> Result<ClassicRecipe, Error> {
    let gains = Gains::design(&machine.scanner, machine.output.period_s())?;
    let lag_s = gains.lag_s(&Galvo::new(&machine.scanner));
    let (laser, real) = (&machine.laser, &options.true_machine.laser);
    let late_s = [
        real.on_latency_ns - laser.on_latency_ns + options.late_ns[0],
        real.off_latency_ns - laser.off_latency_ns + options.late_ns[1],
    ]
    .map(|ns| ns as f64 * 1e-9);
    Ok(ClassicRecipe {
        sky_run_in_s: Some(RUN_IN_LAGS * lag_s + (-late_s[0]).max(0.0)),
        sky_run_out_s: Some((1.0 + RUN_OUT_LAGS) * lag_s + late_s[1].max(late_s[0]).max(0.0)),
        jump_delay_min_s: Some(2.0 * lag_s),
        jump_delay_s: Some(4.0 * lag_s),
        ..ClassicRecipe::default()
    })
}

/// A pen for every speed, power and paint.
fn job(strokes: &[Stroke], machine: &Machine) -> Job {
    let mut pens: Vec<Pen> = Vec::new();
    let mut shapes = Vec::with_capacity(strokes.len());
    for (index, stroke) in strokes.iter().enumerate() {
        let hatch = (stroke.paint != Paint::Stroke).then_some(Hatch {
            spacing_mm: HATCH_SPOTS * machine.laser.spot_diameter_mm,
            angle_deg: 0.0,
            outline: true,
        });
        let same = |pen: &Pen| {
            pen.mark_speed_mm_s == stroke.speed_mm_s
                && pen.power_w == stroke.power_w
                && pen.hatch == hatch
        };
        let pen_index = pens.iter().position(same).unwrap_or_else(|| {
            pens.push(Pen {
                name: format!("{} mm/s", stroke.speed_mm_s),
                mark_speed_mm_s: stroke.speed_mm_s,
                power_w: stroke.power_w,
                n_passes: 1,
                hatch,
            });
            pens.len() - 1
        });
        let (path, paint) = (stroke.curve.clone(), stroke.paint);
        shapes.push(Shape { source: format!("stroke {index}"), path, paint, pen_index });
    }
    Job { pens, layers: vec![Layer { name: "pattern".into(), shapes }], page_mm: [0.0; 2] }
}

/// The stroke that a mark came from.
fn stroke_of(source: &str) -> Option<usize> {
    source.strip_prefix("stroke ")?.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

fn play(
    plan: &Plan,
    options: &BurnOptions,
    observer: &mut dyn FnMut(Stage),
) -> Result<Burn, Error> {
    let n_samples = plan.n_samples();
    let twin_options = TwinOptions {
        mismatch: options.mismatch,
        seed: 1,
        pixel_mm: MAP_PIXEL_MM,
        state_stride: n_samples,
    };
    let mut real = plan.machine.clone();
    real.laser.on_latency_ns = options.true_machine.laser.on_latency_ns + options.late_ns[0];
    real.laser.off_latency_ns = options.true_machine.laser.off_latency_ns + options.late_ns[1];
    let mut twin = Twin::new(&real, &twin_options)?;
    if let Some(head) = &options.head {
        twin = twin.with_head(head);
    }
    let mut renderer = Renderer::new(plan);
    if let Some(table) = &options.table {
        renderer = renderer.correct_by(table);
    }
    let mut burner = Burner::default();
    let mut block = Block::default();
    let mut n_blocks = 0;
    while renderer.next_block(&mut block) {
        twin.push(&block)?;
        n_blocks += 1;
        if n_blocks % N_BLOCKS_PER_STRETCH == 0 {
            observer(Stage::Play(block.first_index as f64 / n_samples as f64));
            burner.add(&twin.take_trace());
        }
    }
    twin.finish();
    burner.add(&twin.take_trace());
    Ok(burner.finish())
}
