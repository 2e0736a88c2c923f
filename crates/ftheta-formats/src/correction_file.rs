//! Correction files: a head's correction table as text, with a checksum over everything.
//!
//! Angles are rad rather than degrees, since a conversion would cost last digits.

use crate::cache_key::hex;
use ftheta_physics::correction::{About, CorrectionError, CorrectionPlane, CorrectionTable, Drift};
use ftheta_physics::grid_map::{GridMap, Interpolation};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use thiserror::Error;

const HEADER: &str = "ftheta correction 1";
/// Most nodes along a side, and most planes.
const N_NODES_MAX: usize = 1025;
const N_PLANES_MAX: usize = 64;

/// Why a correction file cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CorrectionFileError {
    /// A line that should be another.
    #[error("line {line}: {found} is not {expected}")]
    Line {
        /// From 1.
        line: usize,
        /// What is there, in quotes, or that the file ends.
        found: String,
        /// What should be.
        expected: String,
    },
    /// Text that is none.
    #[error("byte {offset} is not text")]
    NotText {
        /// The first such byte.
        offset: usize,
    },
    /// The checksum is not that of the lines above it.
    #[error("line {line}: the checksum is not that of the lines above it: the file was changed")]
    Checksum {
        /// From 1.
        line: usize,
    },
    /// A table that cannot be used.
    #[error(transparent)]
    Table(#[from] CorrectionError),
}

impl CorrectionFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Line { line, found, expected } => {
                (format!("line {line}"), found.clone(), expected.clone())
            }
            Self::NotText { offset } => {
                (format!("byte {offset}"), "not text".into(), "text".into())
            }
            Self::Checksum { line } => (
                format!("line {line}"),
                "another checksum".into(),
                "that of the lines above it".into(),
            ),
            Self::Table(error) => error.fault(),
        }
    }
}

/// A table as a file that [`read`] reads as the same table, bit for bit.
pub fn write(table: &CorrectionTable) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = rows(table, &mut out);
    let digest = hex(&Sha256::digest(&out));
    let _ = writeln!(out, "sha256 {digest}");
    out
}

fn rows(table: &CorrectionTable, out: &mut String) -> std::fmt::Result {
    let About { machine, optics_id, model, n_rounds } = table.about();
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    writeln!(out, "{HEADER}")?;
    writeln!(out, "machine {} {}", quoted(machine), quoted(optics_id))?;
    writeln!(out, "model {}", quoted(model))?;
    writeln!(out, "rounds {n_rounds}")?;
    let Drift { gain: [gain_x, gain_y], offset_rad: [x_rad, y_rad] } = table.drift();
    if table.drift() != Drift::NONE {
        writeln!(out, "drift gain {gain_x:?} {gain_y:?} offset_rad {x_rad:?} {y_rad:?}")?;
    }
    writeln!(out, "planes {}", table.planes().len())?;
    for CorrectionPlane { z_mm, angles } in table.planes() {
        let (n_nodes, half_rad) = (angles.n_nodes(), angles.half_width());
        let name = interpolation_name(angles.interpolation());
        writeln!(out, "plane z_mm {z_mm:?} nodes {n_nodes} half_width_rad {half_rad:?} {name}")?;
        for (.., [x_rad, y_rad]) in angles.nodes() {
            writeln!(out, "{x_rad:?} {y_rad:?}")?;
        }
    }
    Ok(())
}

fn interpolation_name(interpolation: Interpolation) -> &'static str {
    match interpolation {
        Interpolation::Bilinear => "bilinear",
        Interpolation::CatmullRom => "catmull-rom",
    }
}

/// Reads a correction file.
///
/// # Errors
/// The first line that is not what it should be, a checksum that does not fit, or a table that
/// folds over or holds angles that are none.
pub fn read(bytes: &[u8]) -> Result<CorrectionTable, CorrectionFileError> {
    let text = str::from_utf8(bytes)
        .map_err(|error| CorrectionFileError::NotText { offset: error.valid_up_to() })?;
    let mut lines = Lines { text, read: 0, line: 0 };
    lines.expect(HEADER, |line| (line == HEADER).then_some(()))?;
    let names = lines.expect("machine \"NAME\" \"ID\"", |line| texts(line, "machine", 2))?;
    let models = lines.expect("model \"NAME\"", |line| texts(line, "model", 1))?;
    let n_rounds = lines.expect("rounds N", |line| word(line, "rounds")?.parse().ok())?;
    let drift = lines.drift()?;
    let n_planes = lines.expect(&format!("planes N, N from 1 to {N_PLANES_MAX}"), |line| {
        word(line, "planes")?.parse().ok().filter(|n| (1..=N_PLANES_MAX).contains(n))
    })?;
    let planes = (0..n_planes).map(|_| lines.plane()).collect::<Result<_, _>>()?;
    let digest = hex(&Sha256::digest(lines.done()));
    let is_digest = |text: &&str| {
        text.len() == digest.len() && text.bytes().all(|digit| digit.is_ascii_hexdigit())
    };
    let found = lines.expect("sha256 and 64 hexadecimal digits", |line| {
        word(line, "sha256").filter(is_digest)
    })?;
    if found != digest {
        return Err(CorrectionFileError::Checksum { line: lines.line });
    }
    lines.end()?;
    let [machine, optics_id] = <[String; 2]>::try_from(names).unwrap_or_default();
    let model = models.into_iter().next().unwrap_or_default();
    let about = About { machine, optics_id, model, n_rounds };
    Ok(CorrectionTable::new(about, planes, drift)?)
}

/// Lines read one by one.
struct Lines<'a> {
    text: &'a str,
    /// Bytes of the lines read so far.
    read: usize,
    /// The line read last, from 1.
    line: usize,
}

impl<'a> Lines<'a> {
    /// What a line holds.
    fn expect<T>(
        &mut self,
        expected: &str,
        value: impl FnOnce(&'a str) -> Option<T>,
    ) -> Result<T, CorrectionFileError> {
        let rest = &self.text[self.read..];
        self.line += 1;
        let fault = |found: String| CorrectionFileError::Line {
            line: self.line,
            found,
            expected: expected.into(),
        };
        // A line without its end was cut.
        let Some((line, _)) = rest.split_once('\n') else {
            let found = if rest.is_empty() { "the end of the file".into() } else { shown(rest) };
            return Err(fault(found));
        };
        let value = value(line).ok_or_else(|| fault(shown(line)))?;
        self.read += line.len() + 1;
        Ok(value)
    }

    /// All that has been read.
    fn done(&self) -> &'a str {
        &self.text[..self.read]
    }

    fn end(&self) -> Result<(), CorrectionFileError> {
        match &self.text[self.read..] {
            "" => Ok(()),
            rest => Err(CorrectionFileError::Line {
                line: self.line + 1,
                found: shown(rest.lines().next().unwrap_or_default()),
                expected: "the end of the file".into(),
            }),
        }
    }

    fn drift(&mut self) -> Result<Drift, CorrectionFileError> {
        if !self.text[self.read..].starts_with("drift") {
            return Ok(Drift::NONE);
        }
        self.expect("drift gain X Y offset_rad X Y", |line| {
            let words: Vec<&str> = line.split(' ').collect();
            let ["drift", "gain", gain_x, gain_y, "offset_rad", x_rad, y_rad] = words[..] else {
                return None;
            };
            let gain = [number(gain_x)?, number(gain_y)?];
            Some(Drift { gain, offset_rad: [number(x_rad)?, number(y_rad)?] })
        })
    }

    fn plane(&mut self) -> Result<CorrectionPlane, CorrectionFileError> {
        let expected = format!(
            "plane z_mm Z nodes N half_width_rad W and bilinear or catmull-rom, N from {} to \
             {N_NODES_MAX}, W above 0",
            GridMap::N_NODES_MIN
        );
        let (z_mm, n_nodes, half_width_rad, interpolation) = self.expect(&expected, plane_line)?;
        let mut nodes = Vec::new();
        for _ in 0..n_nodes * n_nodes {
            nodes.push(self.expect("two angles in rad", |line| {
                let (x_rad, y_rad) = line.split_once(' ')?;
                Some([number(x_rad)?, number(y_rad)?])
            })?);
        }
        let angles = GridMap::new(half_width_rad, interpolation, &nodes);
        // The line above the nodes has been checked, so that there is nothing left to refuse.
        let angles = angles.ok_or(CorrectionFileError::Table(CorrectionError::Empty))?;
        Ok(CorrectionPlane { z_mm, angles })
    }
}

fn plane_line(line: &str) -> Option<(f64, usize, f64, Interpolation)> {
    let words: Vec<&str> = line.split(' ').collect();
    let ["plane", "z_mm", z_mm, "nodes", n_nodes, "half_width_rad", half_rad, name] = words[..]
    else {
        return None;
    };
    let n_nodes = n_nodes.parse().ok()?;
    let half_rad = number(half_rad)?;
    let known = [Interpolation::Bilinear, Interpolation::CatmullRom];
    let interpolation = known.into_iter().find(|known| interpolation_name(*known) == name)?;
    let fits = (GridMap::N_NODES_MIN..=N_NODES_MAX).contains(&n_nodes) && half_rad > 0.0;
    fits.then_some((number(z_mm)?, n_nodes, half_rad, interpolation))
}

/// A finite number.
fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// What follows a key.
fn word<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    line.strip_prefix(key)?.strip_prefix(' ')
}

/// So many quoted texts after a key, with one blank before each.
fn texts(line: &str, key: &str, n_texts: usize) -> Option<Vec<String>> {
    let mut rest = line.strip_prefix(key)?;
    let mut texts = Vec::new();
    for _ in 0..n_texts {
        rest = rest.strip_prefix(' ')?;
        let mut values = serde_json::Deserializer::from_str(rest).into_iter::<String>();
        texts.push(values.next()?.ok()?);
        rest = rest.get(values.byte_offset()..)?;
    }
    rest.is_empty().then_some(texts)
}

/// A line in quotes; one of a wrong file may be long.
fn shown(line: &str) -> String {
    format!("{:?}", line.chars().take(60).collect::<String>())
}
