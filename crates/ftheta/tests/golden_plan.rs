//! A small plan as text: every segment and laser edge, rounded to 1 ns and 1e-6 mm.

#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use expect_test::expect;
use ftheta::formats::{machine, svg};
use ftheta::model::machine::Machine;
use ftheta::model::plan::{Motion, PlanDraft};
use ftheta::model::recipe::Recipe;
use ftheta::model::toolpath::Toolpath;
use ftheta::planner::classic::{self, Settings};
use ftheta::planner::jump::{Atlas, AxisOptions, CurrentBound, Model};
use ftheta::planner::optimal;
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
        match segment.motion {
            Motion::Hold { vertex } => {
                let at = draft.vertices[vertex as usize];
                writeln!(out, "{owner}: hold {n_ticks} at {:.6} {:.6}", at.x, at.y).unwrap();
            }
            Motion::Jump { sequence, .. } => {
                let to = draft.vertices[segment.motion.last_vertex()];
                let (x, y) = (to.x, to.y);
                writeln!(out, "{owner}: {n_ticks} voltages of {sequence} to {x:.6} {y:.6}")
                    .unwrap();
            }
            Motion::Travel { profile, .. } => {
                let to = draft.vertices[segment.motion.last_vertex()];
                let (length, speed) = (profile.length_mm, profile.speed_mm_s);
                writeln!(
                    out,
                    "{owner}: travel {n_ticks} to {:.6} {:.6}, {length:.6} mm at {speed} mm/s",
                    to.x, to.y
                )
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
    let (toolpath, machine, settings) = corner_and_line();
    let axis = AxisOptions {
        model: Model::Robust { epsilon_rad: 1e-5 },
        tick_s: 1e-5,
        voltage_reserve: 0.12,
        current_bound: CurrentBound::Always,
    };
    let mut atlas = Atlas::restore(&machine.scanner, axis, Default::default()).unwrap();
    let draft = optimal::draft(toolpath, &machine, &settings, 0.01, (&mut atlas, 0.95)).unwrap();
    expect![[r#"
        mark 0 #corner: light edges 524190 2699190 ns, 10 W
        mark 1 #line: light edges 3204190 4327224 ns, 10 W
        jump: hold 2 at 0.000000 0.000000
        jump: 37 voltages of 0 to -3.000000 3.000000
        mark 0: travel 101 to -1.995000 3.000000, 1.005000 mm at 1000 mm/s
        mark 0: hold 16 at -1.995000 3.000000
        mark 0: travel 100 to -1.995000 2.000000, 1.000000 mm at 1000 mm/s
        jump: hold 16 at -1.995000 2.000000
        jump: 35 voltages of 1 to 0.000000 0.000000
        mark 1: travel 112 to 1.000000 -0.500000, 1.118034 mm at 1000 mm/s
        jump: hold 16 at 1.000000 -0.500000
        jump: 31 voltages of 2 to 0.000000 0.000000
        jump: hold 146 at 0.000000 0.000000
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
        jump: hold 2 at 0.000000 0.000000
        jump: travel 107 to -3.000000 3.000000, 4.242641 mm at 4000 mm/s
        jump: hold 23 at -3.000000 3.000000
        mark 0: travel 101 to -1.995000 3.000000, 1.005000 mm at 1000 mm/s
        mark 0: hold 16 at -1.995000 3.000000
        mark 0: travel 100 to -1.995000 2.000000, 1.000000 mm at 1000 mm/s
        jump: hold 16 at -1.995000 2.000000
        jump: travel 71 to 0.000000 0.000000, 2.824894 mm at 4000 mm/s
        jump: hold 21 at 0.000000 0.000000
        mark 1: travel 112 to 1.000000 -0.500000, 1.118034 mm at 1000 mm/s
        jump: hold 16 at 1.000000 -0.500000
        jump: travel 28 to 0.000000 0.000000, 1.118034 mm at 4000 mm/s
        jump: hold 18 at 0.000000 0.000000
        jump: hold 146 at 0.000000 0.000000
    "#]]
    .assert_eq(&dump(&draft));
}
