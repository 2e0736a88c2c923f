//! How late light appears and goes, from a picture of lines marked both ways at several speeds.
//!
//! [`estimate`] is the entry: a picture and its pattern in, [`Delays`] out. What a picture shows is
//! net of the mirrors' lag, which cannot be seen in one.

mod coarse;
pub mod error;
mod frame;
pub mod growth;
mod layout;
pub mod measured;
mod pairing;
mod placement;
mod profile;
mod rectangle;
mod regression;
mod strokes;
mod view;

use error::DelayError;
use ftheta_model::pattern::Pattern;
use ftheta_model::picture::{Picture, PixelPoint};
use ftheta_model::space::FieldPoint;
use ftheta_physics::camera::View;
use growth::{Growth, Look, SpeedWidth, growth};
use layout::{Layout, Row, RowProcess};
use measured::{ROWS_WIDTHS, Reject, Scene, SeenLine};
use regression::{LineEnd, Regression, WRONG_SHARE, regress};

/// Fewest lines each way, and speeds.
const N_LINES_MIN: usize = 2;
const N_SPEEDS_MIN: usize = 2;
/// Differences of widths below this are noise, px.
const WIDTH_PX: f64 = 0.12;
/// Blur by the softness of tips: their roundness adds to it.
const TIP_BLUR: f64 = 0.9;
/// Greatest softness of edges by the distance of rows.
const BLUR: f64 = 0.2;
/// Greatest deviation of rows from where the view has them, px rms.
const BENT_PX: f64 = 1.0;
/// Share of the ends that may lie on cut-off white, percent.
const SATURATED_PERCENT: f64 = 10.0;
/// Greatest deviation of a delay, µs: beyond it no number is given.
const UNCERTAIN_US: f64 = 5.0;
/// Greatest deviation of ends from the regression, in widths of a line and one pixel.
const SCATTER_WIDTHS: f64 = 0.5;
/// Lines of the same speed: to this part.
const SAME_SPEED: f64 = 1e-3;

/// How delays are drawn from a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Lines both ways at several speeds; nothing about spot or dose has to be known.
    Comb,
    /// Gaps between the lines of one speed and the sides of a rectangle, as the patent has it. The
    /// mean of both delays is as good as a comb's, their difference hangs on how far ends grow.
    Rectangle,
}

/// What is known beside picture and pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DelayOptions {
    /// Method; `None` takes the comb's from two speeds on.
    pub method: Option<Method>,
    /// 1/e² radius of the spot, mm, for the rectangle.
    pub spot_radius_mm: Option<f64>,
}

/// Delays as a picture shows them.
#[derive(Clone, Debug)]
pub struct Delays {
    /// How they were found.
    pub method: Method,
    /// Lateness of the start and of the stop, s; positive is late.
    pub tau_on_s: f64,
    /// See there.
    pub tau_off_s: f64,
    /// Standard deviations of start, stop and their mean, s.
    pub sd_s: [f64; 3],
    /// Acceleration with which lines start, mm/s², if the ends show it.
    pub acceleration_mm_s2: Option<f64>,
    /// How the ends grow with the dose.
    pub growth: Growth,
    /// Growth that was fitted beside it, mm.
    pub growth_mm: f64,
    /// Deviation of the ends from the regression, mm.
    pub rms_mm: f64,
    /// What the patent's formula makes of start and stop, s: measured from the outer edge of a
    /// side to the visible end. It is off by (half a width - growth) / speed.
    pub patent_s: Option<[f64; 2]>,
    /// Every line of the pattern.
    pub lines: Vec<Line>,
    /// Widths of the lines by speed.
    pub widths: Vec<SpeedWidth>,
    /// The picture.
    pub scene: SceneFacts,
}

/// What the picture is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneFacts {
    /// Whether marks are brighter than the ground.
    pub bright: bool,
    /// Contrast and noise, of full scale.
    pub contrast: f64,
    /// See there.
    pub noise: f64,
    /// Softness of edges, px.
    pub blur_px: f64,
    /// Scale, mm/px.
    pub mm_per_px: f64,
    /// Relative deviation of the scale along the lines.
    pub scale_sd: f64,
    /// What rows and references are off the fitted view, px rms.
    pub view_rms_px: f64,
    /// Whether burned references fix scale and perspective; if not, the distance of the rows does.
    pub references: bool,
    /// Whether the picture shows the pattern upside down.
    pub upside_down: bool,
    /// Whether it might as well be upside down: the pattern has nothing that tells.
    pub upright_assumed: bool,
}

/// A line of the pattern and what was seen of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its name.
    pub id: String,
    /// Its speed, mm/s.
    pub speed_mm_s: f64,
    /// Whether it runs along x, or y, towards larger values.
    pub forth: bool,
    /// Start and stop.
    pub ends: [LineEndSeen; 2],
}

/// An end of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineEndSeen {
    /// Where it is in the picture, if it was found.
    pub pixel: Option<PixelPoint>,
    /// Where it would be without delays.
    pub nominal: Option<PixelPoint>,
    /// How far it lies behind the nominal end in the direction of marking, growth and the pattern's
    /// place included, mm.
    pub off_mm: Option<f64>,
    /// What it is off the regression, mm.
    pub left_mm: Option<f64>,
    /// Why it was not used.
    pub reject: Option<Reject>,
}

/// Delays from a picture of a pattern.
///
/// # Errors
/// If the picture does not show the pattern, or not well enough.
pub fn estimate(
    picture: &Picture,
    pattern: &Pattern,
    options: &DelayOptions,
) -> Result<Delays, DelayError> {
    let layout = Layout::new(pattern)?;
    let speeds = speeds(&layout);
    match options.method.unwrap_or(if speeds.len() > 1 { Method::Comb } else { Method::Rectangle })
    {
        Method::Comb => comb(picture, &layout, &speeds),
        Method::Rectangle => {
            rectangle::rectangle(picture, &layout, &speeds, options.spot_radius_mm)
        }
    }
}

fn comb(picture: &Picture, layout: &Layout, speeds: &[f64]) -> Result<Delays, DelayError> {
    enough(layout, speeds)?;
    let observed = Observed::new(picture, layout)?;
    let widths = observed.widths_by_speed(layout, speeds);
    let growth = growth(&widths, WIDTH_PX * observed.facts.mm_per_px, &observed.look());
    let ends = observed.line_ends(layout, speeds);
    let regression = regress(&ends, &growth)
        .ok_or(DelayError::Uncertain { sd_us: f64::INFINITY, limit_us: UNCERTAIN_US })?;
    let lines = lines(layout, &observed, &ends, &regression);
    judge(&lines, &regression)?;
    let limit_mm = observed.facts.mm_per_px * (1.0 + SCATTER_WIDTHS * observed.width_px);
    if regression.rms_mm > limit_mm {
        let [rms_um, limit_um] = [regression.rms_mm, limit_mm].map(|mm| mm * 1e3);
        return Err(DelayError::Scattered { rms_um, limit_um });
    }
    // The scale's error is one of all lines together.
    let scaled = |sd: f64, tau: f64| sd.hypot(observed.facts.scale_sd * tau);
    let [on_sd, off_sd, mean_sd] = regression.sd_s;
    let (on, off) = (regression.tau_on_s, regression.tau_off_s);
    Ok(Delays {
        method: Method::Comb,
        tau_on_s: on,
        tau_off_s: off,
        sd_s: [scaled(on_sd, on), scaled(off_sd, off), scaled(mean_sd, 0.5 * (on + off))],
        acceleration_mm_s2: regression.acceleration_mm_s2,
        growth,
        growth_mm: regression.growth_mm,
        rms_mm: regression.rms_mm,
        patent_s: None,
        lines,
        widths,
        scene: observed.facts,
    })
}

/// The pattern as it was found in a picture.
struct Observed {
    lines: Vec<SeenLine>,
    /// Coarse width of all lines, px.
    width_px: f64,
    facts: SceneFacts,
    /// How (along, across) of the pattern is seen.
    view: View,
}

impl Observed {
    fn new(picture: &Picture, layout: &Layout) -> Result<Self, DelayError> {
        let strokes = strokes::strokes(picture)?;
        let placement = placement::place(layout, &strokes)?;
        let view = view::fit_view(picture, strokes.bright, layout, &placement);
        let rms_px = view.as_ref().map_or(f64::NAN, |view| view.rms_px);
        let view = view.filter(|view| view.rms_px < BENT_PX);
        let view = view.ok_or(DelayError::Bent { rms_px, limit_px: BENT_PX })?;
        let mut widths: Vec<f64> = placement.rows.iter().map(|row| row.width_px).collect();
        let middle = widths.len() / 2;
        let width_px = *widths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let (bright, contrast) = (strokes.bright, strokes.contrast);
        let scene = Scene { picture, bright, contrast, layout, view: &view };
        let marked = layout.rows.iter().enumerate().filter(|(_, row)| row.process.is_some());
        let lines: Vec<SeenLine> = marked
            .map(|(index, _)| {
                let located = placement.rows.iter().find(|located| located.row == index);
                match located {
                    Some(located) => scene.measure(located, width_px),
                    None => SeenLine::nothing(index, Reject::NotFound),
                }
            })
            .collect();
        let blur_px = gate(&lines, layout.pitch_mm() / view.mm_per_px)?;
        let facts = SceneFacts {
            bright,
            contrast,
            noise: strokes.noise,
            blur_px,
            mm_per_px: view.mm_per_px,
            scale_sd: view.scale_sd,
            view_rms_px: view.rms_px,
            references: view.columns,
            upside_down: placement.upside_down,
            upright_assumed: placement.upright_assumed,
        };
        Ok(Self { lines, width_px, facts, view: view.view })
    }

    /// How ends were looked at.
    fn look(&self) -> Look {
        let SceneFacts { mm_per_px, blur_px, .. } = self.facts;
        Look {
            blur_mm: TIP_BLUR * blur_px * mm_per_px,
            rows_mm: ROWS_WIDTHS * self.width_px * mm_per_px,
        }
    }

    /// Mean width of the lines of each speed; empty if they cannot be told.
    fn widths_by_speed(&self, layout: &Layout, speeds: &[f64]) -> Vec<SpeedWidth> {
        let mut profiles: Vec<(Vec<f64>, f64, f64)> = vec![(Vec::new(), 0.0, 0.0); speeds.len()];
        for line in self.lines.iter().filter(|line| !line.profile.is_empty()) {
            let Some(process) = layout.rows[line.row].process else { continue };
            let (sum, n, power) = &mut profiles[speed_index(speeds, process)];
            sum.resize(line.profile.len(), 0.0);
            sum.iter_mut().zip(&line.profile).for_each(|(sum, value)| *sum += value);
            (*n, *power) = (*n + 1.0, *power + process.power_ratio);
        }
        if profiles.iter().any(|(_, n, _)| *n == 0.0) {
            return Vec::new();
        }
        let means: Vec<Vec<f64>> = profiles
            .iter()
            .map(|(sum, n, _)| sum.iter().map(|value| value / n).collect())
            .collect();
        let Some((widths_px, _)) = profile::widths_px(&means, self.facts.bright) else {
            return Vec::new();
        };
        let all = speeds.iter().zip(&profiles).zip(widths_px);
        all.map(|((&speed_mm_s, (_, n, power)), width_px)| SpeedWidth {
            speed_mm_s,
            power_ratio: power / n,
            width_mm: width_px * self.facts.mm_per_px,
        })
        .collect()
    }

    fn line_ends(&self, layout: &Layout, speeds: &[f64]) -> Vec<LineEnd> {
        let mut ends = Vec::new();
        for (index, line) in self.lines.iter().enumerate() {
            let row = &layout.rows[line.row];
            let Some(process) = row.process else { continue };
            for (end, nominal_mm, on) in
                [(line.ends[0], row.ends_mm[0], true), (line.ends[1], row.ends_mm[1], false)]
            {
                ends.extend(end.ok().map(|end| LineEnd {
                    row: index,
                    speed: speed_index(speeds, process),
                    speed_mm_s: process.speed_mm_s,
                    sense: row.sense(),
                    on,
                    off_mm: end.along_mm - nominal_mm,
                    across_mm: row.across_mm,
                }));
            }
        }
        ends
    }
}

/// The pattern's speeds, mm/s, rising.
fn speeds(layout: &Layout) -> Vec<f64> {
    let processes = layout.rows.iter().filter_map(|row| row.process);
    let mut speeds: Vec<f64> = processes.map(|process| process.speed_mm_s).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup_by(|b, a| *b - *a < SAME_SPEED * *b);
    speeds
}

/// Checks that there are lines enough both ways, and speeds.
fn enough(layout: &Layout, speeds: &[f64]) -> Result<(), DelayError> {
    let of = |sense: f64| {
        layout.rows.iter().filter(move |row| row.process.is_some() && row.sense() == sense)
    };
    for (what, sense) in [("lines that run forth", 1.0), ("lines that run back", -1.0)] {
        let found = of(sense).count();
        if found < N_LINES_MIN {
            return Err(DelayError::Pattern { what, found, limit: N_LINES_MIN });
        }
    }
    match speeds.len() {
        found @ 0..N_SPEEDS_MIN => {
            Err(DelayError::Pattern { what: "speeds", found, limit: N_SPEEDS_MIN })
        }
        _ => Ok(()),
    }
}

fn speed_index(speeds: &[f64], process: RowProcess) -> usize {
    let near = |speed: &f64| (speed - process.speed_mm_s).abs() <= 2.0 * SAME_SPEED * speed;
    speeds.iter().position(near).unwrap_or(0)
}

/// Softness of the edges, if the picture is good enough.
fn gate(seen: &[SeenLine], pitch_px: f64) -> Result<f64, DelayError> {
    let all = || seen.iter().flat_map(|line| line.ends);
    let n_saturated = all().filter(|end| *end == Err(Reject::Saturated)).count();
    let share = 100.0 * n_saturated as f64 / all().count().max(1) as f64;
    if share > SATURATED_PERCENT {
        return Err(DelayError::Saturated { share, limit: SATURATED_PERCENT });
    }
    let mut soft: Vec<f64> = all().flatten().map(|end| end.edge.soft_px).collect();
    if soft.is_empty() {
        return Ok(0.0);
    }
    let middle = soft.len() / 2;
    let blur_px = *soft.select_nth_unstable_by(middle, f64::total_cmp).1;
    let limit_px = BLUR * pitch_px;
    if blur_px > limit_px {
        return Err(DelayError::Blurred { blur_px, pitch_px, limit_px });
    }
    Ok(blur_px)
}

/// Where an end of a row would be without delays.
fn nominal(view: &View, row: &Row, end: usize) -> Option<PixelPoint> {
    view.pixel(FieldPoint::new(row.ends_mm[end], row.across_mm))
}

fn lines(
    layout: &Layout,
    observed: &Observed,
    ends: &[LineEnd],
    regression: &Regression,
) -> Vec<Line> {
    let (view, all) = (&observed.view, observed.lines.iter().enumerate());
    all.map(|(index, line)| {
        let row = &layout.rows[line.row];
        let of = |on: bool| {
            let seen = line.ends[usize::from(!on)];
            let fitted = ends.iter().position(|end| end.row == index && end.on == on);
            let wrong = fitted.is_some_and(|fitted| !regression.used[fitted]);
            LineEndSeen {
                pixel: seen.ok().map(|end| end.pixel),
                nominal: nominal(view, row, usize::from(!on)),
                off_mm: fitted.map(|fitted| ends[fitted].sense * ends[fitted].off_mm),
                left_mm: fitted.map(|fitted| regression.left_mm[fitted]),
                reject: seen.err().or(wrong.then_some(Reject::Outlier)),
            }
        };
        Line {
            id: row.id.clone(),
            speed_mm_s: row.process.map_or(0.0, |process| process.speed_mm_s),
            forth: row.sense() > 0.0,
            ends: [of(true), of(false)],
        }
    })
    .collect()
}

/// Whether what was found may be used.
fn judge(lines: &[Line], regression: &Regression) -> Result<(), DelayError> {
    let ends = || lines.iter().flat_map(|line| line.ends);
    let n_ends = ends().count();
    let rejects: Vec<Reject> = ends().filter_map(|end| end.reject).collect();
    let limit = (WRONG_SHARE * n_ends as f64) as usize;
    if rejects.len() > limit {
        let n_of = |reject: Reject| rejects.iter().filter(|&&other| other == reject).count();
        let commonest = rejects.iter().copied().max_by_key(|&reject| n_of(reject));
        let reason = commonest.map_or("", Reject::reason);
        return Err(DelayError::Rejected { n_rejected: rejects.len(), n_ends, limit, reason });
    }
    let sd_us = 1e6 * regression.sd_s[0].max(regression.sd_s[1]);
    if sd_us > UNCERTAIN_US || sd_us.is_nan() {
        return Err(DelayError::Uncertain { sd_us, limit_us: UNCERTAIN_US });
    }
    Ok(())
}
