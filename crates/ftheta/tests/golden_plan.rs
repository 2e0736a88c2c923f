//! A small plan as text: every segment and laser edge, rounded to 1 ns and 1e-6 mm.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta::formats::{machine, svg};
use ftheta::model::machine::Machine;
use ftheta::model::plan::{Motion, PlanDraft};
use ftheta::model::recipe::Recipe;
use ftheta::model::toolpath::Toolpath;
use ftheta::physics::servo::Gains;
use ftheta::planner::classic::{self, Settings};
use ftheta::planner::corner::Corners;
use ftheta::planner::jump::{Atlas, AxisOptions, CurrentBound, Model, Transitions};
use ftheta::planner::optimal::{
    Corner, Motions, OptimalOptions, OptimalPlanner, RESTRAINTS, longest_step_rad, near_scanner,
};
use ftheta::toolpath::lay::{LayOptions, Order, lay};
use std::fmt::Write;

fn dump(draft: &PlanDraft) -> String {
    let mut out = String::new();
    for (index, mark) in draft.marks.iter().enumerate() {
        let (on, off, watts) = (mark.on_ns, mark.off_ns, mark.power_w);
        writeln!(out, "mark {index} {}: light edges {on} {off} ns, {watts} W", mark.source)
            .unwrap();
    }
    for segment in &draft.segments {
        let owner = segment.mark_index.map_or("jump".into(), |index| format!("mark {index}"));
        let n_ticks = segment.n_ticks;
        let end = segment.motion.ends().map(|(_, last)| draft.vertices[last]);
        let to = end.map_or(String::new(), |to| format!(" to {:.6} {:.6}", to.x, to.y));
        match segment.motion {
            Motion::Hold { .. } => writeln!(out, "{owner}: hold {n_ticks}{to}").unwrap(),
            Motion::Drive { .. } => writeln!(out, "{owner}: {n_ticks} voltages").unwrap(),
            Motion::Track { first_knot, n_knots, .. } => {
                let knots = &draft.knots[first_knot as usize..(first_knot + n_knots) as usize];
                let speeds: Vec<_> =
                    knots.iter().map(|knot| format!("{:.3}", knot.speed_mm_s)).collect();
                let speeds = speeds.join(", ");
                writeln!(out, "{owner}: track {n_ticks}{to} at {speeds} mm/s").unwrap();
            }
            Motion::Travel { profile, .. } => {
                let (length, speed) = (profile.length_mm, profile.speed_mm_s);
                writeln!(out, "{owner}: travel {n_ticks}{to}, {length:.6} mm at {speed} mm/s")
                    .unwrap();
            }
        }
    }
    out
}

/// A corner and a line, their machine and settings.
fn corner_and_line() -> (Toolpath, Machine, Settings) {
    let drawing = br#"<svg xmlns="http://www.w3.org/2000/svg" width="8mm" height="8mm"
        viewBox="0 0 8 8" fill="none" stroke="black">
        <path id="corner" d="M1 1 h1.005 v1"/><path id="line" d="M4 4 l1 0.5"/></svg>"#;
    let recipe = Recipe::default();
    let job = svg::read(drawing, &recipe, &svg::SvgOptions::default()).unwrap().value;
    let machine = machine::preset("S10").unwrap().unwrap();
    let options = LayOptions { order: Order::Keep, ..LayOptions::default() };
    let toolpath = lay(&job, &options).unwrap().value;
    let settings = Settings::new(&machine, &recipe.classic).unwrap();
    (toolpath, machine, settings)
}

#[test]
fn optimal() {
    let (toolpath, machine, _) = corner_and_line();
    let axis = AxisOptions {
        model: Model::Held { epsilon_rad: 2e-5 },
        tick_s: 1e-5,
        voltage_reserve: 0.12,
        current_bound: CurrentBound::Always,
    };
    let mut atlas = Atlas::restore(&machine.scanner, axis, Default::default()).unwrap();
    atlas.extend(0, longest_step_rad(&toolpath, &machine)).unwrap();
    let transitions = Transitions::with_atlas(atlas).unwrap();
    let gains = Gains::design(&machine.scanner, 1e-5).unwrap();
    let corners = Corners::new(&machine.scanner, axis, Some(&gains)).unwrap();
    let options = OptimalOptions {
        care: 1.0,
        tolerance_mm: 0.01,
        corner: Corner::Auto,
        voltage_reserve: 0.12,
        restraint: RESTRAINTS[0],
    };
    let near = transitions.less_certain(&near_scanner(&machine.scanner)).unwrap();
    let motions = Motions::Known { transitions: &transitions, near: &near, corners: &corners };
    let planner = OptimalPlanner::new(&machine, motions, options).unwrap();
    // On as many processors as there are; then nothing is left to be solved.
    planner.solve(&toolpath);
    let n_solved = || transitions.solved().len() + near.solved().len() + corners.solved().len();
    let n_ahead = n_solved();
    let draft = planner.draft(toolpath).unwrap();
    assert_eq!(n_ahead, n_solved());
    expect![[r#"
        mark 0 #corner: light edges 370000 2381904 ns, 9.909823930961833 W
        mark 1 #line: light edges 2690000 3813034 ns, 10 W
        jump: hold 4 to 0.000000 0.000000
        jump: 34 voltages
        mark 0: track 87 to -1.995000 3.000000 at 990.982 mm/s
        mark 0: 28 voltages
        mark 0: track 86 to -1.995000 2.000000 at 1000.000 mm/s
        jump: 31 voltages
        mark 1: track 112 to 1.000000 -0.500000 at 1000.000 mm/s
        jump: 28 voltages
        jump: hold 55 to 0.000000 0.000000
    "#]]
    .assert_eq(&dump(&draft));
}

#[test]
fn classic() {
    let (toolpath, machine, settings) = corner_and_line();
    let draft = classic::draft(toolpath, &machine, &settings, 0.01).unwrap();
    expect![[r#"
        mark 0 #corner: light edges 1454190 3629190 ns, 10 W
        mark 1 #line: light edges 4704190 5827224 ns, 10 W
        jump: hold 2 to 0.000000 0.000000
        jump: travel 107 to -3.000000 3.000000, 4.242641 mm at 4000 mm/s
        jump: hold 23 to -3.000000 3.000000
        mark 0: travel 101 to -1.995000 3.000000, 1.005000 mm at 1000 mm/s
        mark 0: hold 16 to -1.995000 3.000000
        mark 0: travel 100 to -1.995000 2.000000, 1.000000 mm at 1000 mm/s
        jump: hold 16 to -1.995000 2.000000
        jump: travel 71 to 0.000000 0.000000, 2.824894 mm at 4000 mm/s
        jump: hold 21 to 0.000000 0.000000
        mark 1: travel 112 to 1.000000 -0.500000, 1.118034 mm at 1000 mm/s
        jump: hold 16 to 1.000000 -0.500000
        jump: travel 28 to 0.000000 0.000000, 1.118034 mm at 4000 mm/s
        jump: hold 18 to 0.000000 0.000000
        jump: hold 146 to 0.000000 0.000000
    "#]]
    .assert_eq(&dump(&draft));
}
