//! The classic planner with tuned delays: within the tolerance, and not to be bettered by a step.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use ftheta::against::{Against, Column, WAYS, Way, against};
use ftheta::atlas_store::AtlasStore;
use ftheta::formats::{machine, svg};
use ftheta::import;
use ftheta::mark::{MarkOptions, mark};
use ftheta::model::job::Job;
use ftheta::model::machine::Machine;
use ftheta::model::plan::Planner;
use ftheta::model::recipe::{ClassicRecipe, Recipe};
use ftheta::planner::classic::Settings;
use std::fs;
use std::path::Path;

const TOLERANCE_UM: f64 = 10.0;

struct Bench {
    job: Job,
    recipe: Recipe,
    machine: Machine,
}

impl Bench {
    /// The six letters of the gallery.
    fn new() -> Self {
        let drawing = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../gallery/text.svg"));
        let (recipe, _) = import::recipe_for(drawing, None).unwrap();
        let job = import::drawing(drawing, &recipe, &svg::SvgOptions::default()).unwrap().value;
        Self { job, recipe, machine: machine::preset("S10-f160").unwrap().unwrap() }
    }

    fn against(&self, folder: &Path) -> Against {
        let options =
            MarkOptions { atlas_store: AtlasStore::new(Some(folder.into())), ..classic() };
        against(&self.job, &self.machine, &self.recipe, &options, &mut |_| {}).unwrap()
    }

    /// Time of the job with other settings, where they keep what the way asks for.
    fn duration_s(&self, way: Way, settings: ClassicRecipe) -> Option<f64> {
        let recipe = Recipe { classic: settings, ..self.recipe.clone() };
        let marked = mark(&self.job, &self.machine, &recipe, &classic(), &mut |_| {}).ok()?;
        let score = marked.score;
        let coverage_um = if way.coverage { score.coverage_error_um.max } else { 0.0 };
        let kept = score.contour_error_um.max.max(coverage_um) <= TOLERANCE_UM;
        kept.then_some(score.duration_s)
    }
}

fn classic() -> MarkOptions {
    MarkOptions { planner: Some(Planner::Classic), ..MarkOptions::default() }
}

/// The settings as a user would write them.
fn recipe(settings: &Settings) -> ClassicRecipe {
    ClassicRecipe {
        jump_speed_mm_s: Some(settings.jump_speed_mm_s),
        jump_delay_min_s: Some(settings.jump_delay_min_s),
        jump_delay_s: Some(settings.jump_delay_s),
        mark_delay_s: Some(settings.mark_delay_s),
        polygon_delay_s: Some(settings.polygon_delay_s),
        laser_on_delay_ns: Some(settings.laser_on_delay_ns),
        laser_off_delay_ns: Some(settings.laser_off_delay_ns),
        sky_run_in_s: Some(settings.sky_run_in_s),
        sky_run_out_s: Some(settings.sky_run_out_s),
        ..ClassicRecipe::default()
    }
}

/// Every prescribed step from these settings that leaves light as long as its mark.
fn steps(at: &ClassicRecipe, sky: bool) -> Vec<ClassicRecipe> {
    let mut near = Vec::new();
    for sign in [-1.0, 1.0] {
        let later = |time_s: Option<f64>| time_s.map(|time_s| time_s + sign * 10e-6);
        let edge = |time_ns: Option<i64>| time_ns.map(|time_ns| time_ns + sign as i64 * 1000);
        let jump_delay_s = later(at.jump_delay_s);
        near.extend([
            ClassicRecipe {
                jump_speed_mm_s: at.jump_speed_mm_s.map(|v| v * 2f64.powf(sign)),
                ..*at
            },
            ClassicRecipe { jump_delay_s, jump_delay_min_s: jump_delay_s, ..*at },
            ClassicRecipe { polygon_delay_s: later(at.polygon_delay_s), ..*at },
        ]);
        if sky {
            near.push(ClassicRecipe { sky_run_in_s: later(at.sky_run_in_s), ..*at });
            near.push(ClassicRecipe { sky_run_out_s: later(at.sky_run_out_s), ..*at });
        } else {
            near.push(ClassicRecipe { mark_delay_s: later(at.mark_delay_s), ..*at });
        }
        // Light is as short as it may be, so that only more of it is left to try.
        let longer = match sign > 0.0 {
            true => ClassicRecipe { laser_off_delay_ns: edge(at.laser_off_delay_ns), ..*at },
            false => ClassicRecipe { laser_on_delay_ns: edge(at.laser_on_delay_ns), ..*at },
        };
        near.push(longer);
    }
    near
}

#[test]
fn tuned_delays_keep_the_tolerance_and_no_single_step_betters_them() {
    let bench = Bench::new();
    let folder = tempfile::tempdir().unwrap();
    let found = bench.against(folder.path());
    for (way, column) in WAYS.into_iter().zip(&found.columns) {
        let Column { settings, score, .. } = column.as_ref().unwrap();
        let at = recipe(settings);
        assert_eq!(bench.duration_s(way, at), Some(score.duration_s), "{way:?}");
        assert_eq!(settings.skywriting(), way.sky);
        for near in steps(&at, way.sky) {
            let near_s = bench.duration_s(way, near);
            assert!(near_s.is_none_or(|near_s| near_s >= score.duration_s), "{way:?}: {near:?}");
        }
    }
    let [a, b, sky_a, sky_b] =
        found.columns.each_ref().map(|column| column.as_ref().unwrap().score.duration_s);
    assert!(a < b && sky_a <= sky_b, "more asked, more time: {a} {b} {sky_a} {sky_b}");
    let derived = bench.duration_s(WAYS[0], ClassicRecipe::default());
    assert!(derived.is_none_or(|derived_s| a < derived_s), "{a} s, lag-derived {derived:?}");
}

#[test]
fn delays_are_kept_and_damaged_ones_found_again() {
    let bench = Bench::new();
    let folder = tempfile::tempdir().unwrap();
    let first = bench.against(folder.path());
    let files: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    let [file] = &files[..] else { panic!("one file and nothing half-written: {files:?}") };
    let whole = fs::read(file).unwrap();
    let same = |found: &Against| {
        for (one, other) in first.columns.iter().zip(&found.columns) {
            let (one, other) = (one.as_ref().unwrap(), other.as_ref().unwrap());
            assert_eq!((one.plan.id(), &one.score), (other.plan.id(), &other.score));
        }
        assert_eq!(fs::read(file).unwrap(), whole);
    };
    let again = bench.against(folder.path());
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    same(&again);
    let mut damaged = whole.clone();
    damaged[100] ^= 1;
    fs::write(file, &damaged).unwrap();
    let anew = bench.against(folder.path());
    assert!(anew.warnings.iter().any(|warning| warning.to_string().contains("made anew")));
    same(&anew);
}
