//! The report of a made-up run: complete, self-contained, bounded and safe.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod machine;

use ftheta_model::dose::DoseMap;
use ftheta_model::plan::{PlanDraft, PlannedMark, Planner};
use ftheta_model::recipe::Pen;
use ftheta_model::space::FieldPoint;
use ftheta_model::trace::{AxisStates, Light, Trace, TracePoint};
use ftheta_model::warning::Warning;
use ftheta_physics::audit::Limits;
use ftheta_report::comparison::Rival;
use ftheta_report::plate::{PlateOptions, plate_png};
use ftheta_report::report::{ReportInput, TimeSplit, report_html};
use ftheta_report::score::score;
use kurbo::{Affine, BezPath, Circle, ParamCurve, ParamCurveArclen, PathSeg, Point, Rect, Shape};

const STEP_NS: u64 = 2000;

/// A beam that follows its command late, as a servo does.
#[derive(Default)]
struct Run {
    trace: Trace,
    marks: Vec<PlannedMark>,
    command: Point,
    beam: Point,
    between: Point,
    dose: Option<DoseMap>,
}

impl Run {
    fn step(&mut self, command: Point, lit: bool) {
        let before = self.beam;
        self.command = command;
        self.between = self.between.lerp(command, 0.06);
        self.beam = self.beam.lerp(self.between, 0.06);
        let n = self.trace.points.len() as u64;
        self.trace.points.push(FieldPoint::from(self.beam).into());
        if n.is_multiple_of(5) {
            let angle = |p: Point| [p.x / 320.0, p.y / 320.0];
            let speed = (self.beam - before) / 2e-6 / 320.0;
            let last = self.trace.states.last().copied().unwrap_or_default();
            let current =
                [(speed.x - last.speed_rad_s[0]) * 8e-2, (speed.y - last.speed_rad_s[1]) * 8e-2];
            self.trace.states.push(AxisStates {
                time_ns: n * STEP_NS,
                angle_rad: angle(self.beam),
                speed_rad_s: [speed.x, speed.y],
                current_a: current,
                voltage_v: [2.0 * current[0] + 0.15 * speed.x, 2.0 * current[1] + 0.15 * speed.y],
            });
        }
        if let Some(dose) = self.dose.as_mut().filter(|_| lit) {
            splat(dose, self.beam);
        }
    }

    fn jump(&mut self, to: Point) {
        let from = self.command;
        let n = (40.0 * from.distance(to)) as usize + 20;
        for k in 1..=n {
            let t = k as f64 / n as f64;
            self.step(from.lerp(to, t * t * (3.0 - 2.0 * t)), false);
        }
        (0..120).for_each(|_| self.step(to, false));
    }

    fn mark(&mut self, curve: &BezPath, source: &str, pen_index: usize) {
        self.jump(curve.segments().next().unwrap().start());
        let index = self.marks.len();
        let on_ns = self.trace.points.len() as u64 * STEP_NS + 70_000;
        for segment in curve.segments() {
            let n = (segment.arclen(1e-4) / 0.002).max(1.0) as usize;
            for k in 1..=n {
                let on = self.trace.points.len() as u64 * STEP_NS > on_ns;
                self.step(segment.eval(k as f64 / n as f64), on);
            }
        }
        let end = self.command;
        (0..40).for_each(|_| self.step(end, true));
        let off_ns = self.trace.points.len() as u64 * STEP_NS - 12_000;
        self.trace.light.push(Light { index, on_ns, off_ns, power_w: 10.0 });
        self.marks.push(PlannedMark {
            curve: curve.clone(),
            pen_index,
            source: source.into(),
            on_ns,
            off_ns,
            power_w: 10.0,
            steps: Vec::new(),
        });
    }
}

fn splat(dose: &mut DoseMap, beam: Point) {
    let (i, j) = ((beam.x / dose.pixel_mm) as i32, (beam.y / dose.pixel_mm) as i32);
    for dj in -3..=3 {
        for di in -3..=3 {
            let place = Point::new(f64::from(i + di), f64::from(j + dj));
            let off = place.to_vec2() * dose.pixel_mm - beam.to_vec2();
            let energy_j = 2e-6 * (-2.0 * off.hypot2() / (0.015 * 0.015)).exp();
            dose.add(i + di, j + dj, energy_j as f32);
        }
    }
}

/// Rosettes, a frame and a hatched square.
fn run() -> Run {
    let mut run = Run { dose: Some(DoseMap::new(0.01)), ..Run::default() };
    run.trace.step_ns = STEP_NS;
    for k in 0..12 {
        let turn = Affine::rotate(f64::from(k) * std::f64::consts::TAU / 12.0);
        let petal = BezPath::from_svg("M3 0 C8 6 14 6 18 0 C14 -6 8 -6 3 0").unwrap();
        run.mark(&(turn * petal), &format!("#petal{k} <script>alert(1)</script>"), 0);
    }
    for radius in [20.0, 21.0] {
        let circle = Circle::new(Point::ZERO, radius).to_path(1e-4);
        let segments: Vec<PathSeg> = circle.segments().collect();
        let curve = BezPath::from_path_segments(segments.into_iter());
        run.mark(&curve, "#ring", 0);
    }
    let frame = BezPath::from_svg("M-23 -23 L23 -23 L23 23 L-23 23 L-23 -23").unwrap();
    run.mark(&frame, "#frame", 1);
    let square = Rect::new(-2.0, -2.0, 2.0, 2.0);
    for k in 0..80 {
        let y = square.y0 + 0.05 * (f64::from(k) + 0.5);
        let (a, b) = if k % 2 == 0 { (-2.0, 2.0) } else { (2.0, -2.0) };
        let line = BezPath::from_svg(&format!("M{a} {y} L{b} {y}")).unwrap();
        run.mark(&line, "#hatch", 1);
    }
    run
}

fn html() -> (String, Vec<u8>) {
    let run = run();
    let plan = PlanDraft {
        machine: machine::machine(),
        planner: Planner::Classic,
        tolerance_mm: 0.01,
        pens: vec![Pen::default(), Pen::default()],
        marks: run.marks,
        vertices: Vec::new(),
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments: Vec::new(),
    };
    let found = score(&plan, &run.trace);
    let dose = run.dose.unwrap();
    let picture = |longest_side_px| {
        let options = PlateOptions { page_mm: Some([50.0, 50.0]), longest_side_px };
        plate_png(&dose, &options)
    };
    let settings = [
        ("Laser on delay", "78.4 µs"),
        ("Laser off delay", "141.0 µs"),
        ("Jump speed", "8 000 mm/s"),
        ("Mark delay", "110 µs"),
    ]
    .map(|(name, value)| (name.to_string(), value.to_string()));
    let plate_png = picture(1200);
    let input = ReportInput {
        job_name: "rosette </script><b>&\"'",
        plan: &plan,
        plan_id: "b3f0a1c29d7e",
        seed: 1,
        peaks: &Limits {
            angle: 0.61,
            speed: 0.42,
            voltage: 0.93,
            current: 0.77,
            heat: 0.18,
            violations: 0,
        },
        score: &found,
        states: &run.trace.states,
        times: TimeSplit { mark_s: 0.95, jump_s: 0.21, delay_s: 0.08 },
        settings: &settings,
        against: &[
            Rival { name: "delays <A>", score: Some(&found), settings: settings[1..].to_vec() },
            Rival { name: "delays B", score: None, settings: Vec::new() },
        ],
        warnings: &[Warning::new("#text7", "has no outline & was left out")],
        plate_png: &plate_png,
    };
    (report_html(&input), picture(2000))
}

#[test]
fn the_report_is_self_contained_safe_and_bounded() {
    let (page, picture) = html();
    if let Ok(folder) = std::env::var("REPORT_OUT") {
        std::fs::write(format!("{folder}/report.html"), &page).unwrap();
        std::fs::write(format!("{folder}/mark.png"), &picture).unwrap();
    }
    assert!(page.len() < 3_000_000, "{}", page.len());
    // The picture's letters may spell anything.
    let (before, after) = page.split_once("base64,").unwrap();
    let page = format!("{before}base64,{}", after.split_once('\'').unwrap().1);
    assert!(!page.contains("<script") && !page.contains("</script"));
    assert!(!page.contains("http") && !page.contains("NaN") && !page.contains("inf "));
    assert!(page.contains("rosette &lt;/script&gt;&lt;b&gt;&amp;&quot;&#39;"));
    assert!(page.contains("#petal5 &lt;script&gt;"));
    assert!(page.contains("speed, m/s") && page.contains("power, W"));
    assert!(page.contains("data:image/png;base64,"));
    // Its own score as its rival: the same time, and dashes where nothing keeps the tolerance.
    assert!(page.contains("<th class=n>delays &lt;A&gt;<th class=n>delays B"));
    assert!(page.contains("of classic</td><td class=n>1</td><td class=n>1</td><td class=n>–</td>"));
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
}

#[test]
fn an_empty_run_still_has_a_report() {
    let plan = PlanDraft {
        machine: machine::machine(),
        planner: Planner::Classic,
        tolerance_mm: 0.01,
        pens: Vec::new(),
        marks: Vec::new(),
        vertices: Vec::new(),
        stations: Vec::new(),
        knots: Vec::new(),
        drives: Vec::new(),
        segments: Vec::new(),
    };
    let found = score(&plan, &Trace { step_ns: 1000, ..Trace::default() });
    let page = report_html(&ReportInput {
        job_name: "",
        plan: &plan,
        plan_id: "",
        seed: 0,
        peaks: &Limits::default(),
        score: &found,
        states: &[],
        times: TimeSplit::default(),
        settings: &[],
        against: &[],
        warnings: &[],
        plate_png: &[],
    });
    assert!(page.ends_with("</html>\n") && !page.contains("NaN"));
    assert_eq!(TracePoint::default(), TracePoint { x_nm: 0, y_nm: 0 });
}
