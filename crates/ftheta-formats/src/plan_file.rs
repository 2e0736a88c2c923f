//! Plan files: a plan as text, complete with its machine and curves, so that it can be verified
//! without anything else.

use crate::machine;
use crate::toml_table::TomlError;
use ftheta_model::block::LaserEdge;
use ftheta_model::plan::{
    Knot, Motion, PlanDraft, PlannedMark, Planner, Segment, SpeedProfile, Station,
};
use ftheta_model::recipe::{Interpolation, Pen};
use kurbo::{BezPath, Point, Vec2};
use std::io::{self, Write};
use std::str::{FromStr, SplitWhitespace};
use thiserror::Error;

const HEADER: &str = "ftheta-plan 3";

/// What is wrong with a plan file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PlanFileError {
    /// A line is not what it should be.
    #[error("plan file line {line}: expected {expected}, found \"{found}\"")]
    Line {
        /// Line from 1.
        line: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there, cut short.
        found: String,
    },
    /// The machine in it is at fault.
    #[error("plan file: {0}")]
    Machine(#[from] TomlError),
}

impl PlanFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Line { line, expected, found } => {
                (format!("line {line}"), found.clone(), (*expected).into())
            }
            Self::Machine(error) => error.fault(),
        }
    }
}

/// Writes a plan. Every number is the shortest text that reads back as the same bits.
///
/// # Errors
/// Only those of `out`.
pub fn write(draft: &PlanDraft, id: &str, out: &mut impl Write) -> io::Result<()> {
    let machine = machine::to_toml(&draft.machine);
    let planner = draft.planner.name();
    writeln!(out, "{HEADER}\nid {id}\nplanner {planner}\ntolerance_mm {}", draft.tolerance_mm)?;
    writeln!(out, "machine {}\n{machine}", machine.lines().count())?;
    writeln!(out, "pens {}", draft.pens.len())?;
    for pen in &draft.pens {
        let name = one_line(&pen.name);
        writeln!(out, "{} {} {} {name}", pen.mark_speed_mm_s, pen.power_w, pen.n_passes)?;
    }
    writeln!(out, "marks {}", draft.marks.len())?;
    for mark in &draft.marks {
        let PlannedMark { curve, pen_index, source, on_ns, off_ns, power_w, steps } = mark;
        writeln!(out, "{pen_index} {on_ns} {off_ns} {power_w} {}", one_line(source))?;
        writeln!(out, "{}", curve.to_svg())?;
        writeln!(out, "steps {}", steps.len())?;
        for step in steps {
            writeln!(out, "{} {}", step.time_ns, step.power_w)?;
        }
    }
    writeln!(out, "vertices {}", draft.vertices.len())?;
    for vertex in &draft.vertices {
        writeln!(out, "{} {}", vertex.x, vertex.y)?;
    }
    writeln!(out, "stations {}", draft.stations.len())?;
    for Station { arriving: a, leaving: b, distance_mm } in &draft.stations {
        writeln!(out, "{} {} {} {} {distance_mm}", a.x, a.y, b.x, b.y)?;
    }
    writeln!(out, "knots {}", draft.knots.len())?;
    for Knot { time_s, distance_mm, speed_mm_s } in &draft.knots {
        writeln!(out, "{time_s} {distance_mm} {speed_mm_s}")?;
    }
    writeln!(out, "drives {}", draft.drives.len())?;
    for [x, y] in &draft.drives {
        writeln!(out, "{x} {y}")?;
    }
    writeln!(out, "segments {}", draft.segments.len())?;
    for segment in &draft.segments {
        write_segment(segment, out)?;
    }
    writeln!(out, "end")
}

/// Names are the only free text: kept on their line.
fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

fn write_segment(segment: &Segment, out: &mut impl Write) -> io::Result<()> {
    match segment.mark_index {
        Some(index) => write!(out, "{index} {} ", segment.n_ticks)?,
        None => write!(out, "- {} ", segment.n_ticks)?,
    }
    match segment.motion {
        Motion::Hold { vertex } => writeln!(out, "hold {vertex}"),
        Motion::Drive { first } => writeln!(out, "drive {first}"),
        Motion::Track {
            first_vertex,
            n_vertices,
            first_station,
            first_knot,
            n_knots,
            smoothing_ticks,
        } => {
            let station = first_station.map_or("-".into(), |first| first.to_string());
            writeln!(
                out,
                "track {first_vertex} {n_vertices} {station} {first_knot} {n_knots} \
                 {smoothing_ticks}"
            )
        }
        Motion::Travel { first_vertex, n_vertices, profile: p, interpolation } => {
            let kind = match interpolation {
                Interpolation::Absolute => "travel",
                Interpolation::Dda => "dda",
            };
            writeln!(
                out,
                "{kind} {first_vertex} {n_vertices} {} {} {} {}",
                p.length_mm, p.speed_mm_s, p.acceleration_mm_s2, p.deceleration_mm_s2
            )
        }
    }
}

/// Reads a plan file: its content, still to be audited, and the id it claims.
///
/// # Errors
/// The first line that is not as [`write()`] makes it. A file cut short lacks its last line.
pub fn read(text: &str) -> Result<(PlanDraft, String), PlanFileError> {
    let mut lines = Lines { lines: text.lines(), number: 0 };
    let header = lines.next("the header of a plan file")?;
    if header != HEADER {
        return Err(lines.error("\"ftheta-plan 3\"", header));
    }
    let id = lines.after("id")?.to_owned();
    let planner = match lines.after("planner")? {
        "classic" => Planner::Classic,
        "optimal" => Planner::Optimal,
        other => return Err(lines.error("a known planner", other)),
    };
    let tolerance_mm = lines.number_after("tolerance_mm")?;
    let n_lines: usize = lines.number_after("machine")?;
    let mut toml = String::new();
    for _ in 0..n_lines {
        toml.push_str(lines.next("a line of the machine file")?);
        toml.push('\n');
    }
    let machine = machine::read("machine in the plan", &toml)?;
    lines.next("an empty line")?;
    let draft = PlanDraft {
        machine,
        planner,
        tolerance_mm,
        pens: lines.table("pens", read_pen)?,
        marks: lines.table("marks", read_mark)?,
        vertices: lines.table("vertices", read_vertex)?,
        stations: lines.table("stations", read_station)?,
        knots: lines.table("knots", read_knot)?,
        drives: lines.table("drives", read_drive)?,
        segments: lines.table("segments", read_segment)?,
    };
    let last = lines.next("the last line, \"end\"")?;
    if last != "end" {
        return Err(lines.error("the last line, \"end\"", last));
    }
    if let Some(more) = lines.lines.next() {
        return Err(lines.error("nothing after the last line", more));
    }
    Ok((draft, id))
}

fn read_pen(lines: &mut Lines<'_>) -> Result<Pen, PlanFileError> {
    let line = lines.next("a pen")?;
    let mut fields = line.splitn(4, ' ');
    let mut field = || fields.next().unwrap_or_default();
    let (speed, power, passes, name) = (field(), field(), field(), field());
    Ok(Pen {
        name: name.into(),
        mark_speed_mm_s: lines.parse(speed, "a speed in mm/s")?,
        power_w: lines.parse(power, "a power in W")?,
        n_passes: lines.parse(passes, "a number of passes")?,
        hatch: None,
    })
}

fn read_mark(lines: &mut Lines<'_>) -> Result<PlannedMark, PlanFileError> {
    let line = lines.next("a mark")?;
    let mut fields = line.splitn(5, ' ');
    let mut field = || fields.next().unwrap_or_default();
    let (pen, on, off, power, source) = (field(), field(), field(), field(), field());
    let pen_index = lines.parse(pen, "a pen's index")?;
    let on_ns = lines.parse(on, "the laser-on edge in ns")?;
    let off_ns = lines.parse(off, "the laser-off edge in ns")?;
    let power_w = lines.parse(power, "a power in W")?;
    let path = lines.next("the curve of a mark")?;
    let curve = BezPath::from_svg(path).map_err(|_| lines.error("a curve", path))?;
    if curve.elements().len() < 2 || !curve.is_finite() {
        return Err(lines.error("a finite curve", path));
    }
    let steps = lines.table("steps", read_step)?;
    Ok(PlannedMark { curve, pen_index, source: source.into(), on_ns, off_ns, power_w, steps })
}

fn read_step(lines: &mut Lines<'_>) -> Result<LaserEdge, PlanFileError> {
    let line = lines.next("a change of power")?;
    let mut fields = line.split_whitespace();
    let time_ns = lines.field(&mut fields, "a time in ns")?;
    let power_w = lines.field(&mut fields, "a power in W")?;
    Ok(LaserEdge { time_ns, power_w })
}

fn read_vertex(lines: &mut Lines<'_>) -> Result<Point, PlanFileError> {
    let line = lines.next("a vertex")?;
    let mut fields = line.split_whitespace();
    let x = lines.field(&mut fields, "x in mm")?;
    let y = lines.field(&mut fields, "y in mm")?;
    Ok(Point::new(x, y))
}

fn read_station(lines: &mut Lines<'_>) -> Result<Station, PlanFileError> {
    let line = lines.next("a station")?;
    let mut fields = line.split_whitespace();
    let mut direction = || -> Result<Vec2, PlanFileError> {
        let x = lines.field(&mut fields, "x of a direction")?;
        Ok(Vec2::new(x, lines.field(&mut fields, "y of a direction")?))
    };
    let (arriving, leaving) = (direction()?, direction()?);
    let distance_mm = lines.field(&mut fields, "an arc length in mm")?;
    Ok(Station { arriving, leaving, distance_mm })
}

fn read_knot(lines: &mut Lines<'_>) -> Result<Knot, PlanFileError> {
    let line = lines.next("a knot")?;
    let mut fields = line.split_whitespace();
    Ok(Knot {
        time_s: lines.field(&mut fields, "a time in s")?,
        distance_mm: lines.field(&mut fields, "an arc length in mm")?,
        speed_mm_s: lines.field(&mut fields, "a speed in mm/s")?,
    })
}

fn read_drive(lines: &mut Lines<'_>) -> Result<[f32; 2], PlanFileError> {
    let line = lines.next("a drive")?;
    let mut fields = line.split_whitespace();
    let x = lines.field(&mut fields, "what drives x")?;
    Ok([x, lines.field(&mut fields, "what drives y")?])
}

fn read_segment(lines: &mut Lines<'_>) -> Result<Segment, PlanFileError> {
    let line = lines.next("a segment")?;
    let mut fields = line.split_whitespace();
    let mark_index = match fields.next().unwrap_or_default() {
        "-" => None,
        index => Some(lines.parse(index, "a mark's index or -")?),
    };
    let n_ticks = lines.field(&mut fields, "a number of samples")?;
    let kind = fields.next().unwrap_or_default();
    let interpolation = match kind {
        "hold" => {
            let vertex = lines.field(&mut fields, "a vertex")?;
            return Ok(Segment { mark_index, n_ticks, motion: Motion::Hold { vertex } });
        }
        "drive" => {
            let first = lines.field(&mut fields, "a drive's index")?;
            return Ok(Segment { mark_index, n_ticks, motion: Motion::Drive { first } });
        }
        "track" => {
            let motion = read_track(lines, &mut fields)?;
            return Ok(Segment { mark_index, n_ticks, motion });
        }
        "travel" => Interpolation::Absolute,
        "dda" => Interpolation::Dda,
        other => return Err(lines.error("hold, travel, dda, track or drive", other)),
    };
    let motion = Motion::Travel {
        first_vertex: lines.field(&mut fields, "a vertex")?,
        n_vertices: lines.field(&mut fields, "a number of vertices")?,
        profile: SpeedProfile {
            length_mm: lines.field(&mut fields, "a length in mm")?,
            speed_mm_s: lines.field(&mut fields, "a speed in mm/s")?,
            acceleration_mm_s2: lines.field(&mut fields, "an acceleration in mm/s²")?,
            deceleration_mm_s2: lines.field(&mut fields, "a deceleration in mm/s²")?,
        },
        interpolation,
    };
    Ok(Segment { mark_index, n_ticks, motion })
}

fn read_track(
    lines: &mut Lines<'_>,
    fields: &mut SplitWhitespace<'_>,
) -> Result<Motion, PlanFileError> {
    let first_vertex = lines.field(fields, "a vertex")?;
    let n_vertices = lines.field(fields, "a number of vertices")?;
    let first_station = match fields.next().unwrap_or_default() {
        "-" => None,
        index => Some(lines.parse(index, "a station or -")?),
    };
    Ok(Motion::Track {
        first_vertex,
        n_vertices,
        first_station,
        first_knot: lines.field(fields, "a knot")?,
        n_knots: lines.field(fields, "a number of knots")?,
        smoothing_ticks: lines.field(fields, "a number of ticks")?,
    })
}

/// The lines of the file, counted.
struct Lines<'a> {
    lines: std::str::Lines<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self, expected: &'static str) -> Result<&'a str, PlanFileError> {
        self.number += 1;
        self.lines.next().ok_or_else(|| self.error(expected, "the end of the file"))
    }

    fn error(&self, expected: &'static str, found: &str) -> PlanFileError {
        let found = found.chars().take(60).collect();
        PlanFileError::Line { line: self.number, expected, found }
    }

    fn parse<T: FromStr>(&self, text: &str, expected: &'static str) -> Result<T, PlanFileError> {
        text.parse().map_err(|_| self.error(expected, text))
    }

    fn field<T: FromStr>(
        &self,
        fields: &mut SplitWhitespace<'_>,
        expected: &'static str,
    ) -> Result<T, PlanFileError> {
        self.parse(fields.next().unwrap_or_default(), expected)
    }

    /// What follows `keyword` on the next line.
    fn after(&mut self, keyword: &'static str) -> Result<&'a str, PlanFileError> {
        let line = self.next(keyword)?;
        line.strip_prefix(keyword)
            .and_then(|rest| rest.strip_prefix(' '))
            .ok_or_else(|| self.error(keyword, line))
    }

    fn number_after<T: FromStr>(&mut self, keyword: &'static str) -> Result<T, PlanFileError> {
        let text = self.after(keyword)?;
        self.parse(text, keyword)
    }

    /// A keyword with a count, and so many rows. Memory grows with the rows that are really there.
    fn table<T>(
        &mut self,
        keyword: &'static str,
        mut row: impl FnMut(&mut Self) -> Result<T, PlanFileError>,
    ) -> Result<Vec<T>, PlanFileError> {
        let n_rows: usize = self.number_after(keyword)?;
        (0..n_rows).map(|_| row(self)).collect()
    }
}
