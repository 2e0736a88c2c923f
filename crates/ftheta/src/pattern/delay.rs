//! Lines whose ends show how late light appears and goes: a comb at several speeds both ways, or
//! the patent's open rectangle.
//!
//! Rows of the comb run along x or y. Across them, beside where any line can reach, stand reference
//! lines whose place no delay moves: two on one side and one on the other, and one along the rows
//! on the last row's side only, so that a picture tells how it lies. Power is proportional to
//! speed, so that all lines have the same dose and their ends grow alike.

use super::error::PatternError;
use super::sheet::{self, Sheet, SheetProcess};
use ftheta_model::job::{Job, Layer, Paint, Shape};
use ftheta_model::machine::Machine;
use ftheta_model::pattern::{Feature, FeatureShape, LaserDelays, LineProcess, Pattern};
use ftheta_model::recipe::Pen;
use ftheta_model::space::FieldPoint;
use kurbo::{Affine, BezPath, Point, Rect, Shape as _, Vec2};

/// Distance of rows, in spot diameters, and at least, mm.
const PITCH_SPOTS: f64 = 5.0;
const PITCH_MIN_MM: f64 = 0.4;
/// From where lines may reach to the references, and between two of them, mm.
const REFERENCE_GAP_MM: f64 = 0.6;
/// Speed of references by the slowest line's: slow, and gone over both ways.
const REFERENCE_SPEED: f64 = 0.5;
/// Lines each way that stand together.
const N_BLOCK: usize = 2;
/// Size of labels, mm.
const LETTER_MM: f64 = 1.2;
/// Speeds that can be marked, mm/s, lines of a speed each way, lengths of a line, mm, and delays
/// that the pattern may have room for, µs.
const SPEEDS_MM_S: [f64; 2] = [1.0, 100_000.0];
const N_LINES: [u32; 2] = [1, 100];
const LENGTH_MM: [f64; 2] = [0.5, 100.0];
/// What presets may leave of a line, by its length.
const PRESET_LEAVES: [f64; 2] = [0.25, 3.0];
/// Colours of the pens of each speed, in turn.
const COLORS: [&str; 7] =
    ["#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf"];

/// Which pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Lines both ways at several speeds.
    Comb,
    /// Two lines between the sides of a rectangle.
    Rectangle,
}

/// Along which axis lines run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineAxis {
    /// Along x.
    X,
    /// Along y.
    Y,
}

/// What the pattern is like.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayOptions {
    /// Which pattern.
    pub method: Method,
    /// Along which axis its lines run.
    pub axis: LineAxis,
    /// Speeds, mm/s: several for a comb, one for a rectangle.
    pub speeds_mm_s: Vec<f64>,
    /// Lines of each speed each way.
    pub n_lines: u32,
    /// Length of a line, mm.
    pub length_mm: f64,
    /// Delays that the pattern has room for at the fastest speed, either way, s.
    pub room_s: f64,
    /// How much later than in time light is switched on and off on purpose, s: so that a gap shows.
    pub preset_s: [f64; 2],
    /// Settings of the delays that are in force while the pattern is marked; those of the machine
    /// file if `None`.
    pub laser: Option<LaserDelays>,
    /// Power at the fastest speed, W.
    pub power_w: f64,
}

impl DelayOptions {
    /// A comb of 10 lines each way, 4 mm long, at six speeds up to 10 m/s, or a rectangle of 10 mm
    /// at 5 m/s with gaps of 1 mm; along x, with the machine file's delays and 10 W, or what the
    /// laser has.
    pub fn usual(method: Method, machine: &Machine) -> Self {
        let comb = method == Method::Comb;
        Self {
            method,
            axis: LineAxis::X,
            speeds_mm_s: if comb { vec![1e3, 2e3, 4e3, 6e3, 8e3, 1e4] } else { vec![5e3] },
            n_lines: if comb { 10 } else { 1 },
            length_mm: if comb { 4.0 } else { 10.0 },
            room_s: 250e-6,
            preset_s: if comb { [0.0; 2] } else { [200e-6, -200e-6] },
            laser: None,
            power_w: SheetProcess::of(machine).power_w,
        }
    }
}

/// A line to be marked.
struct Line {
    id: String,
    from: Point,
    to: Point,
    /// Index of its speed; `None` for a reference.
    speed: Option<usize>,
}

/// The pattern for a machine.
///
/// # Errors
/// If the options are out of range, or it does not fit the machine's field.
pub fn sheet(options: &DelayOptions, machine: &Machine) -> Result<Sheet, PatternError> {
    check(options)?;
    let (lines, labels) = match options.method {
        Method::Comb => comb(options, machine.laser.spot_diameter_mm),
        Method::Rectangle => rectangle(options),
    };
    let turn = match options.axis {
        LineAxis::X => Affine::IDENTITY,
        LineAxis::Y => Affine::new([0.0, 1.0, -1.0, 0.0, 0.0, 0.0]),
    };
    let drawn = lines.iter().map(|line| line.path(options, turn).bounding_box());
    let all = labels.iter().map(|(_, path)| (turn * path.clone()).bounding_box()).chain(drawn);
    let bounds = all.reduce(|a, b| a.union(b)).unwrap_or(Rect::ZERO);
    let reach_mm = 2.0 * bounds.abs().x1.max(-bounds.x0).max(bounds.y1).max(-bounds.y0);
    // Whole micrometres, since it is read by people.
    let reach_mm = (reach_mm * 1e3).ceil() * 1e-3;
    let limit_mm = machine.optics.field_mm;
    if reach_mm > limit_mm {
        return Err(PatternError::DelayField { reach_mm, limit_mm });
    }
    let fastest = options.speeds_mm_s.iter().copied().fold(0.0, f64::max);
    let features = lines.iter().map(|line| line.feature(options, turn, fastest)).collect();
    let [on_us, off_us] = options.preset_s.map(|s| s * 1e6);
    let own = options.laser.unwrap_or_else(|| sheet::delays(&machine.laser));
    let pattern = Pattern {
        kind: "delay".into(),
        field_mm: reach_mm,
        features,
        machine: Some(machine.name.clone()),
        laser: Some(LaserDelays { on_us: own.on_us + on_us, off_us: own.off_us + off_us }),
    };
    let job = job(options, &lines, &labels, turn, reach_mm);
    Ok(Sheet {
        pattern,
        job,
        hatch_spacing_mm: None,
        keep_order: true,
        places: Vec::new(),
        printed: None,
    })
}

fn check(options: &DelayOptions) -> Result<(), PatternError> {
    let refuse = |option, value: f64, unit, limits: [f64; 2]| {
        let fits = (limits[0]..=limits[1]).contains(&value);
        (!fits).then_some(PatternError::Option { option, value, unit, limits }).map_or(Ok(()), Err)
    };
    for &speed in &options.speeds_mm_s {
        refuse("--speeds", speed, "mm/s", SPEEDS_MM_S)?;
    }
    let n_speeds = options.speeds_mm_s.len() as f64;
    match options.method {
        Method::Comb => refuse("--speeds", n_speeds, "of them", [2.0, 20.0])?,
        Method::Rectangle => refuse("--speeds", n_speeds, "of them", [1.0, 1.0])?,
    }
    refuse("--lines", f64::from(options.n_lines), "", N_LINES.map(f64::from))?;
    refuse("--length-mm", options.length_mm, "mm", LENGTH_MM)?;
    // What presets leave of the fastest line: they must not turn it round, nor make it endless.
    let fastest = options.speeds_mm_s.iter().copied().fold(0.0, f64::max);
    let [on_s, off_s] = options.preset_s;
    let left_mm = options.length_mm + (off_s - on_s) * fastest;
    let limits = PRESET_LEAVES.map(|part| part * options.length_mm);
    refuse("--preset-us, length left", left_mm, "mm", limits)
}

/// Lines and labels of a comb whose rows run along x.
fn comb(options: &DelayOptions, spot_mm: f64) -> (Vec<Line>, Vec<(String, BezPath)>) {
    let pitch_mm = (PITCH_SPOTS * spot_mm).max(PITCH_MIN_MM);
    let n_speeds = options.speeds_mm_s.len();
    let n_rows = 2 * options.n_lines as usize * n_speeds;
    let half_mm = 0.5 * options.length_mm;
    let fastest = options.speeds_mm_s.iter().copied().fold(0.0, f64::max);
    let side_mm = half_mm + fastest * options.room_s + REFERENCE_GAP_MM;
    let top_mm = 0.5 * (n_rows as f64 - 1.0) * pitch_mm;
    let at = |row: usize| top_mm - pitch_mm * row as f64;
    let (mut lines, mut labels) = (Vec::new(), Vec::new());
    let blocks = blocks(n_speeds, options.n_lines as usize);
    let speeds = blocks.iter().flat_map(|&(speed, n)| std::iter::repeat_n(speed, 2 * n));
    for (row, speed) in speeds.enumerate() {
        let (left, right) = (Point::new(-half_mm, at(row)), Point::new(half_mm, at(row)));
        let (from, to) = if row % 2 == 0 { (left, right) } else { (right, left) };
        lines.push(Line { id: format!("line-{}", row + 1), from, to, speed: Some(speed) });
    }
    let reference =
        |id: &str, from: Point, to: Point| Line { id: id.into(), from, to, speed: None };
    let over_mm = top_mm + 2.0 * pitch_mm;
    for (id, x_mm) in [
        ("reference-left-1", -side_mm - REFERENCE_GAP_MM),
        ("reference-left-2", -side_mm),
        ("reference-right", side_mm),
    ] {
        lines.push(reference(id, Point::new(x_mm, -over_mm), Point::new(x_mm, over_mm)));
    }
    let below_mm = -top_mm - 3.5 * pitch_mm;
    let (left, right) = (Point::new(-0.9 * half_mm, below_mm), Point::new(0.9 * half_mm, below_mm));
    lines.push(reference("reference-below", left, right));
    let mut row = 0;
    for (speed, n) in blocks {
        let text = format!("{}", options.speeds_mm_s[speed] * 1e-3);
        let middle = at(row + n) + 0.5 * pitch_mm;
        row += 2 * n;
        let label = Affine::scale(LETTER_MM) * sheet::lettering(&text);
        let size = label.bounding_box();
        let place = Vec2::new(
            -side_mm - 2.0 * REFERENCE_GAP_MM - size.width(),
            middle - 0.5 * size.height(),
        );
        labels.push((format!("label {row}: {text} m/s"), Affine::translate(place) * label));
    }
    let sign_mm = 2.5 * LETTER_MM;
    let corner = Point::new(side_mm + REFERENCE_GAP_MM, -over_mm);
    labels.extend(sheet::axes_sign(Rect::from_origin_size(corner, (sign_mm, sign_mm))));
    (lines, labels)
}

/// Speeds in the order of their rows, each with its lines each way.
///
/// They take turns, so that material which is harder to mark on one side is not taken for an effect
/// of the speed.
fn blocks(n_speeds: usize, n_lines: usize) -> Vec<(usize, usize)> {
    let turns = (0..n_lines).step_by(N_BLOCK);
    turns
        .flat_map(|done| (0..n_speeds).map(move |speed| (speed, N_BLOCK.min(n_lines - done))))
        .collect()
}

/// The open rectangle: a fast line above to the right, one below to the left, slow sides.
fn rectangle(options: &DelayOptions) -> (Vec<Line>, Vec<(String, BezPath)>) {
    let half_mm = 0.5 * options.length_mm;
    let corner = |x: f64, y: f64| Point::new(x * half_mm, y * half_mm);
    let line = |id: &str, from: Point, to: Point, speed: Option<usize>| Line {
        id: id.into(),
        from,
        to,
        speed,
    };
    let beyond = 1.0 + 2.0 * REFERENCE_GAP_MM / options.length_mm;
    // Fast lines both ways; sides reach beyond them, and only the left one is double.
    let n = options.n_lines as usize;
    let mut lines = Vec::new();
    for index in 0..2 * n {
        let y = 1.0 - 2.0 * index as f64 / (2 * n - 1).max(1) as f64;
        let (left, right) = (corner(-1.0, y), corner(1.0, y));
        let (from, to) = if index % 2 == 0 { (left, right) } else { (right, left) };
        lines.push(line(&format!("line-{}", index + 1), from, to, Some(0)));
    }
    let gap = REFERENCE_GAP_MM / half_mm;
    for (id, x) in [("side-left-outer", -1.0 - gap), ("side-left", -1.0), ("side-right", 1.0)] {
        lines.push(line(id, corner(x, -beyond), corner(x, beyond), None));
    }
    lines.push(line("below", corner(-0.7, -beyond - gap), corner(0.7, -beyond - gap), None));
    let sign_mm = 2.5 * LETTER_MM.min(0.2 * options.length_mm);
    let place = Point::new(half_mm + REFERENCE_GAP_MM, -beyond * half_mm);
    let labels = sheet::axes_sign(Rect::from_origin_size(place, (sign_mm, sign_mm)));
    (lines, labels)
}

impl Line {
    /// What is drawn: presets move the ends, so that any controller may mark it.
    fn path(&self, options: &DelayOptions, turn: Affine) -> BezPath {
        let mut path = BezPath::new();
        match self.speed {
            Some(speed) => {
                let along = (self.to - self.from).normalize();
                let [on_mm, off_mm] = options.preset_s.map(|s| s * options.speeds_mm_s[speed]);
                path.move_to(self.from + on_mm * along);
                path.line_to(self.to + off_mm * along);
            }
            None => {
                path.move_to(self.from);
                path.line_to(self.to);
                path.line_to(self.from);
            }
        }
        turn * path
    }

    fn feature(&self, options: &DelayOptions, turn: Affine, fastest: f64) -> Feature {
        let [from_mm, to_mm] = [self.from, self.to].map(|place| FieldPoint::from(turn * place));
        let shape = match self.speed {
            Some(speed) => {
                let speed_mm_s = options.speeds_mm_s[speed];
                let process = LineProcess { speed_mm_s, power_ratio: speed_mm_s / fastest };
                FeatureShape::Line { from_mm, to_mm, process }
            }
            None => FeatureShape::Reference { from_mm, to_mm, burned: true },
        };
        Feature { id: self.id.clone(), shape }
    }
}

/// Pens, and the lines in the order in which they are marked.
fn job(
    options: &DelayOptions,
    lines: &[Line],
    labels: &[(String, BezPath)],
    turn: Affine,
    side_mm: f64,
) -> Job {
    let fastest = options.speeds_mm_s.iter().copied().fold(0.0, f64::max);
    let slowest = options.speeds_mm_s.iter().copied().fold(f64::INFINITY, f64::min);
    let pen = |name: &str, speed_mm_s: f64, share: f64| Pen {
        name: name.into(),
        mark_speed_mm_s: speed_mm_s,
        power_w: options.power_w * share * speed_mm_s / fastest,
        ..Pen::default()
    };
    // Gone over twice, so half of the power each time.
    let mut pens = vec![pen("#000000", REFERENCE_SPEED * slowest, 0.5)];
    for (index, &speed) in options.speeds_mm_s.iter().enumerate() {
        // Shades of one colour in turn, should there be more speeds than colours.
        let base = COLORS[index % COLORS.len()];
        let shade = index / COLORS.len();
        pens.push(pen(&format!("{}{shade:x}", &base[..base.len() - 1]), speed, 1.0));
    }
    let shape = |source: String, path: BezPath, pen_index: usize| Shape {
        source,
        path,
        paint: Paint::Stroke,
        pen_index,
    };
    let marked = lines.iter().map(|line| {
        let pen_index = line.speed.map_or(0, |speed| speed + 1);
        shape(line.id.clone(), line.path(options, turn), pen_index)
    });
    let lettered = labels.iter().map(|(name, path)| shape(name.clone(), turn * path.clone(), 0));
    Job {
        pens,
        layers: vec![
            Layer { name: "lines".into(), shapes: marked.collect() },
            Layer { name: "labels".into(), shapes: lettered.collect() },
        ],
        page_mm: [side_mm; 2],
    }
}
