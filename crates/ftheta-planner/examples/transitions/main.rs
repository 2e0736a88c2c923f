//! The campaign: random transitions on three scanners, each checked, beside `rsruckig`.
//!
//! `cargo run --release -p ftheta-planner --example transitions -- [REQUESTS] [SEED] [MODEL]`, with
//! MODEL `nominal` or `robust`. REQUESTS are shared by the three scanners. Ends with an error if
//! one request failed.

#[path = "../../tests/campaign/mod.rs"]
mod campaign;
mod ruckig;

use campaign::plant::{TICK_S, scanner};
use campaign::{Campaign, Tally};
use ftheta_planner::jump::{Atlas, AtlasOptions, AxisOptions, CurrentBound, JumpError, Model};
use std::process::ExitCode;
use std::time::Instant;

const SETS: [&str; 3] = ["S10", "S14", "S25"];
/// End error of robust plans: 11 µm at f = 160 mm.
const EPSILON_RAD: f64 = 3.49e-5;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, default: u64| match arguments.get(index) {
        Some(text) => text.parse().ok(),
        None => Some(default),
    };
    let model = match arguments.get(2).map_or("nominal", String::as_str) {
        "nominal" => Some(Model::Flexible),
        "robust" => Some(Model::Robust { epsilon_rad: EPSILON_RAD }),
        _ => None,
    };
    let (Some(n_requests), Some(seed), Some(model)) = (number(0, 1_000_000), number(1, 1), model)
    else {
        eprintln!("transitions [REQUESTS] [SEED] [nominal|robust]");
        return ExitCode::FAILURE;
    };
    let n_requests = n_requests.div_ceil(SETS.len() as u64) as usize;
    match run(Campaign {
        seed,
        n_requests,
        step_max_deg: 20.0,
        speed_max_rad_s: 300.0,
        model,
        voltage_reserve: 0.0,
    }) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(n_failed) => {
            eprintln!("{n_failed} of the requests failed");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs all scanners and returns how many requests failed.
fn run(campaign: Campaign) -> Result<usize, JumpError> {
    println!("atlas of 25 degrees, built on all processors");
    for set in ["S10", "S25"] {
        for model in [Model::Flexible, Model::Robust { epsilon_rad: EPSILON_RAD }] {
            println!("  {set} {model:?}: {:.2} s", atlas_s(set, model)?);
        }
    }
    let mut n_failed = 0;
    for set in SETS {
        let scanner = scanner(set);
        let started = Instant::now();
        let tally = campaign.run(&scanner, |route, n_ticks| {
            let outcome = ruckig::fastest(&scanner, route);
            let ours_s = n_ticks as f64 * TICK_S;
            let pair = outcome.duration_s.map_or([0.0; 4], |duration_s| {
                let leaves = if outcome.leaves { 1.0 } else { 0.0 };
                [1.0, duration_s / ours_s, leaves, if duration_s < ours_s { 1.0 } else { 0.0 }]
            });
            let [n, ratio, leaves, faster] = pair;
            [outcome.n_solves, outcome.n_failed, outcome.solve_s, n, ratio, leaves, faster]
        })?;
        print(set, &campaign, &tally, started.elapsed().as_secs_f64());
        n_failed += tally.n_failed;
    }
    Ok(n_failed)
}

fn atlas_s(set: &str, model: Model) -> Result<f64, JumpError> {
    let current_bound = CurrentBound::Always;
    let axis = AxisOptions { model, tick_s: TICK_S, voltage_reserve: 0.0, current_bound };
    let started = Instant::now();
    Atlas::build(&scanner(set), AtlasOptions { axis, range_rad: 25_f64.to_radians() })?;
    Ok(started.elapsed().as_secs_f64())
}

fn print(set: &str, campaign: &Campaign, tally: &Tally, elapsed_s: f64) {
    let planned = tally.n_planned.max(1) as f64;
    let [right, border, wrong] = tally.n_refused;
    let [voltage, current, angle, speed] = tally.ratios;
    let [solves, failed, solve_s, n, ratio, leaves, faster] = tally.yardstick;
    let (n_laws, solves) = (n.max(1.0), solves.max(1.0));
    println!("{set}, {} requests, {:?}, in {elapsed_s:.0} s", campaign.n_requests, campaign.model);
    println!("  planned {}, failed {}", tally.n_planned, tally.n_failed);
    println!("  out of room {right}, near the border {border}, wrongly refused {wrong}");
    println!(
        "  greatest voltage {voltage:.9}, current {current:.7}, angle {angle:.7}, speed {speed:.4} \
         of the limits"
    );
    println!("  greatest end error {:.4} of what is allowed", tally.end_error);
    println!(
        "  {:.1} µs a plan once its fans are solved, {:.2} ticks",
        tally.warm_s * 1e6,
        tally.n_ticks as f64 / planned
    );
    println!(
        "  rsruckig: {:.2} µs a solve, {failed} of {solves} solves failed; of {} routes {} have \
         a law within voltage and current",
        solve_s / solves * 1e6,
        tally.n_planned,
        n
    );
    println!(
        "  rsruckig: takes {:.4} of our time in the mean, {faster} laws are faster than our plan, \
         {leaves} leave the angles",
        ratio / n_laws
    );
}
