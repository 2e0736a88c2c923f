//! Pulsed lasers: pulses that wait for triggers keep their distance, those that run free do not.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta::formats::{machine, svg};
use ftheta::mark::{MarkOptions, Marked, mark};
use ftheta::model::block::{Block, LaserEdge, SampleSink};
use ftheta::model::machine::Machine;
use ftheta::model::plan::PlanDraft;
use ftheta::model::recipe::Recipe;
use ftheta::model::space::DacCodes;
use ftheta::physics::audit::AuditError;
use ftheta::physics::plan::Plan;
use ftheta::planner::optimal::Corner;
use ftheta::planner::render::Renderer;
use ftheta::report::score::RatioSpread;
use ftheta::toolpath::lay::Order;
use ftheta::twin::mismatch::Mismatch;
use ftheta::twin::twin::{Twin, TwinOptions};

fn pulsed(pulse_khz: f64, pulses_triggered: bool) -> Machine {
    let mut machine = machine::preset("S10-f160").unwrap().unwrap();
    machine.laser.pulse_khz = Some(pulse_khz);
    machine.laser.pulses_triggered = pulses_triggered;
    machine
}

fn run(machine: &Machine, path: &str, corner: Corner) -> Marked {
    let drawing = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='20mm' viewBox='0 0 20 20'>\
         <path d='{path}' fill='none' stroke='black'/></svg>"
    );
    let recipe = Recipe::default();
    let job = svg::read(drawing.as_bytes(), &recipe, &svg::SvgOptions::default()).unwrap().value;
    let options = MarkOptions {
        speed_mm_s: Some(2000.0),
        corner,
        order: Some(Order::Keep),
        ..MarkOptions::default()
    };
    mark(&job, machine, &recipe, &options, &mut |_| {}).unwrap()
}

fn spacing(marked: &Marked) -> RatioSpread {
    marked.score.pulse_spacing_ratio.unwrap()
}

fn triggers_ns(marked: &Marked) -> Vec<u64> {
    let mut renderer = Renderer::new(&marked.plan);
    let mut block = Block::default();
    let mut all = Vec::new();
    while renderer.next_block(&mut block) {
        all.extend_from_slice(&block.triggers_ns);
    }
    all
}

/// A triangle with stops in its corners: the beam is slower there, its pulses are not closer.
#[test]
fn triggered_pulses_keep_their_distance_where_the_beam_is_slower() {
    let triangle = "M4 4 L14 4 L9 12 L4 4";
    let triggered = run(&pulsed(200.0, true), triangle, Corner::Exact);
    let free = run(&pulsed(200.0, false), triangle, Corner::Exact);
    let (triggered_at, free_at) = (spacing(&triggered), spacing(&free));
    assert!(triggered_at.p01 > 0.98 && triggered_at.p99 < 1.02, "{triggered_at:?}");
    assert!(triggered_at.min > 0.9 && triggered_at.max < 1.1, "{triggered_at:?}");
    assert!(free_at.p01 < 0.5, "{free_at:?}");
    for marked in [&triggered, &free] {
        let dose = marked.score.dose_ratio.unwrap();
        assert!(dose.p01 > 0.95 && dose.p99 < 1.05, "{dose:?}");
    }
    // 28.87 mm of 10 µm and 50 µJ each; power steps are within 0.1 %.
    let n_pulses = triggers_ns(&triggered).len();
    assert!(n_pulses.abs_diff(2887) <= 3, "{n_pulses}");
    assert!((triggered.score.energy_j - 50e-6 * n_pulses as f64).abs() < 1e-9);
}

/// Blocks are handed over one after the other; pulses do not know of it.
#[test]
fn pulses_go_on_from_block_to_block() {
    let back_and_forth = "M2 5 L18 5 M18 6 L2 6 ".repeat(8);
    for triggered in [true, false] {
        let marked = run(&pulsed(30.0, triggered), &back_and_forth, Corner::Auto);
        assert!(marked.plan.n_samples() > 3 * 4096);
        let spacing = spacing(&marked);
        assert!(spacing.min > 0.999 && spacing.max < 1.001, "{spacing:?}");
        // 16 mm at 2 m/s are 8 ms, 240 pulses at 30 kHz, 333 µJ each.
        let energy_j = 16.0 * 240.0 * 10.0 / 30e3;
        assert!(
            (marked.score.energy_j / energy_j - 1.0).abs() < 0.003,
            "{}",
            marked.score.energy_j
        );
    }
}

/// A source cannot pulse faster than at its rate, however the beam moves.
#[test]
fn triggers_are_never_closer_than_the_rate_allows() {
    let zigzag = "M2 2 L6 2 L2.5 3 L6 3.5 L2 4.2 L2.03 4.2 M8 8 A3 3 0 1 1 7.9 8";
    for corner in [Corner::Auto, Corner::Sky, Corner::Blend] {
        let mut machine = pulsed(80.0, true);
        // Then nothing but triggers makes the dose follow the speed.
        machine.laser.power_modulated = false;
        let marked = run(&machine, zigzag, corner);
        let times = triggers_ns(&marked);
        assert!(times.len() > 500);
        let closest = times.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap();
        assert!(closest >= 12_498, "{closest} ns");
        assert!(spacing(&marked).max < 1.15, "{:?}", spacing(&marked));
    }
}

/// More power than the pen's would be pulses faster than the source gives them.
#[test]
fn the_audit_keeps_the_rate_of_triggers() {
    let marked = run(&pulsed(80.0, true), "M2 2 L6 2", Corner::Auto);
    let mut draft = PlanDraft::clone(&marked.plan);
    draft.marks[0].power_w *= 1.01;
    let error = Plan::new(draft.clone()).unwrap_err();
    assert!(matches!(error, AuditError::Power { .. }), "{error}");
    // A source that runs free gives that power at its own rate.
    draft.machine.laser.pulses_triggered = false;
    Plan::new(draft).unwrap();
}

/// Every mark gets its light, also one that is shorter than half a pulse.
#[test]
fn the_shortest_mark_gets_one_pulse_in_its_middle() {
    let machine = pulsed(1.0, true);
    let marked = run(&machine, "M4 4 L4.5 4", Corner::Auto);
    let [trigger_ns] = triggers_ns(&marked)[..] else { panic!("one pulse") };
    let planned = &marked.plan.marks[0];
    let laser = &machine.laser;
    let off_ns = planned.off_ns.saturating_add_signed(laser.off_latency_ns - laser.on_latency_ns);
    assert!(trigger_ns.abs_diff(u64::midpoint(planned.on_ns, off_ns)) <= 1);
    // Ten millijoules: 10 W at 1 kHz.
    assert!((marked.score.energy_j - 0.01).abs() < 1e-12);
    assert_eq!(marked.score.pulse_spacing_ratio, None);
}

/// Pulses that run free come by a clock of their own, so a short mark may see none.
#[test]
fn free_pulses_come_by_their_own_clock() {
    let machine = pulsed(20.0, false);
    let options =
        TwinOptions { mismatch: Mismatch::default(), seed: 1, pixel_mm: 0.01, state_stride: 1 };
    let mut twin = Twin::new(&machine, &options).unwrap();
    let edge = |time_ns, power_w| LaserEdge { time_ns, power_w };
    // Light 20 µs and 15 µs later: 101 to 149 µs between two pulses, 160 to 310 µs with three.
    let edges = [(81_000, 8.0), (134_000, 0.0), (140_000, 8.0), (295_000, 0.0)];
    let block = Block {
        words: vec![DacCodes::default(); 100],
        edges: edges.map(|(time_ns, power_w)| edge(time_ns, power_w)).into(),
        ..Block::default()
    };
    twin.push(&block).unwrap();
    let trace = twin.take_trace();
    let pulses: Vec<_> = trace.pulses.iter().map(|pulse| (pulse.index, pulse.time_ns)).collect();
    assert_eq!(pulses, [(1, 200_000), (1, 250_000), (1, 300_000)]);
    let light_j: f64 = trace
        .light
        .iter()
        .map(|light| light.power_w * 1e-9 * (light.off_ns - light.on_ns) as f64)
        .sum();
    assert!((light_j - 3.0 * 8.0 / 20e3).abs() < 1e-12, "{light_j} J");
    assert!((twin.into_dose().total_j() - light_j).abs() < 1e-6 * light_j);
}

#[test]
fn triggers_need_a_rate() {
    let text = machine::to_toml(&pulsed(50.0, true));
    let lines = text.lines().filter(|line| !line.starts_with("pulse_khz"));
    let without: String = lines.flat_map(|line| [line, "\n"]).collect();
    let error = machine::read("laser.toml", &without).unwrap_err().to_string();
    assert!(error.contains("pulses") && error.contains("pulse_khz"), "{error}");
    let fast = text.replace("pulse_khz = 50", "pulse_khz = 20000");
    assert!(machine::read("laser.toml", &fast).is_err());
    let again = machine::read("S10-f160", &text).unwrap();
    assert!(again.laser.pulses_triggered);
    assert_eq!(again.laser.pulse_khz, Some(50.0));
}
