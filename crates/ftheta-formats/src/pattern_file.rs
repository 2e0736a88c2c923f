//! Pattern files: the nominal place of every feature of a pattern, as JSON.

use ftheta_model::pattern::{
    Feature, FeatureShape, GridMark, LaserDelays, LineProcess, MarkStyle, Pattern,
};
use ftheta_model::space::FieldPoint;
use serde_json::{Map, Value, json};
use std::collections::HashSet;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Most features of a pattern.
const N_FEATURES_MAX: usize = 1_000_000;
/// Greatest coordinate, mm.
const PLACE_MAX_MM: f64 = 1e6;

/// What is wrong with a pattern file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum PatternFileError {
    /// Not JSON.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line from 1.
        line: usize,
        /// Column from 1.
        column: usize,
        /// What the JSON parser says.
        message: String,
    },
    /// Something that has to be there and is not.
    #[error("{place} is missing, expected {expected}")]
    Missing {
        /// Where in the file, as `features[3].x_mm`.
        place: String,
        /// What should be there.
        expected: String,
    },
    /// A value that cannot be.
    #[error("{place} is {found}, expected {expected}")]
    Value {
        /// Where in the file, as `features[3].x_mm`.
        place: String,
        /// What is there.
        found: String,
        /// What is allowed.
        expected: String,
    },
}

impl PatternFileError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        match self {
            Self::Syntax { line, column, message } => {
                (format!("line {line}, column {column}"), message.clone(), "JSON".into())
            }
            Self::Missing { place, expected } => {
                (place.clone(), "missing".into(), expected.clone())
            }
            Self::Value { place, found, expected } => {
                (place.clone(), found.clone(), expected.clone())
            }
        }
    }
}

/// A pattern as a file; numbers are the shortest that read back as the same.
pub fn write(pattern: &Pattern) -> String {
    let features: Vec<Value> = pattern.features.iter().map(feature_value).collect();
    let mut object = json!({
        "kind": pattern.kind,
        "field_mm": pattern.field_mm,
        "features": features,
        "machine": pattern.machine,
    });
    if let Some(LaserDelays { on_us, off_us }) = pattern.laser {
        object["laser"] = json!({"on_us": on_us, "off_us": off_us});
    }
    object.to_string()
}

fn feature_value(feature: &Feature) -> Value {
    let line = |kind: &str, from: &FieldPoint, to: &FieldPoint| {
        json!({
            "kind": kind, "x1_mm": from.x_mm, "y1_mm": from.y_mm, "x2_mm": to.x_mm, "y2_mm": to.y_mm,
        })
    };
    let centred = |kind: &str, place: &FieldPoint| json!({"kind": kind, "x_mm": place.x_mm, "y_mm": place.y_mm});
    let marked = |mut value: Value, process: &LineProcess| {
        value["speed_mm_s"] = json!(process.speed_mm_s);
        value["power_ratio"] = json!(process.power_ratio);
        value
    };
    let mut value = match &feature.shape {
        FeatureShape::Line { from_mm, to_mm, process } => {
            marked(line("line", from_mm, to_mm), process)
        }
        FeatureShape::Circle { centre_mm, radius_mm, process } => {
            let mut value = centred("circle", centre_mm);
            value["radius_mm"] = json!(radius_mm);
            marked(value, process)
        }
        FeatureShape::Mark(mark) => {
            let kind = if mark.style == MarkStyle::Cross { "cross" } else { "dot" };
            let mut value = centred(kind, &mark.place_mm);
            value["size_mm"] = json!(mark.size_mm);
            value["row"] = json!(mark.row);
            value["column"] = json!(mark.column);
            value
        }
        FeatureShape::Fiducial { family, code, place_mm, size_mm, burned } => {
            let mut value = centred("fiducial", place_mm);
            value["family"] = json!(family);
            value["code"] = json!(code);
            value["size_mm"] = json!(size_mm);
            value["burned"] = json!(burned);
            value
        }
        FeatureShape::Reference { from_mm, to_mm, burned } => {
            let mut value = line("reference", from_mm, to_mm);
            value["burned"] = json!(burned);
            value
        }
    };
    value["id"] = json!(feature.id);
    value
}

/// Reads a pattern.
///
/// Keys that mean nothing here are left alone, since others may add to the form.
///
/// # Errors
/// The first thing that is wrong, with its place in the file.
pub fn read(bytes: &[u8]) -> Result<Pattern, PatternFileError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let value: Value = serde_json::from_slice(bytes).map_err(|error| PatternFileError::Syntax {
        line: error.line(),
        column: error.column(),
        // The parser says the place once more at the end.
        message: error.to_string().split(" at line ").next().unwrap_or_default().into(),
    })?;
    let root = Node::of(&value, String::new())?;
    let Some(Value::Array(values)) = root.get("features") else {
        return Err(root.bad("features", "a list of features"));
    };
    if values.len() > N_FEATURES_MAX {
        return Err(PatternFileError::Value {
            place: "features".into(),
            found: format!("{} of them", values.len()),
            expected: format!("at most {N_FEATURES_MAX}"),
        });
    }
    let mut ids = HashSet::new();
    let mut features = Vec::with_capacity(values.len());
    for (index, value) in values.iter().enumerate() {
        let node = Node::of(value, format!("features[{index}]"))?;
        let feature = feature(&node)?;
        if !ids.insert(feature.id.clone()) {
            return Err(node.bad("id", "a name of its own"));
        }
        features.push(feature);
    }
    Ok(Pattern {
        kind: root.text("kind")?,
        field_mm: root.number("field_mm", 1e-3..=PLACE_MAX_MM)?,
        features,
        machine: root.text_or_none("machine")?,
        laser: laser(&root)?,
    })
}

fn laser(root: &Node<'_>) -> Result<Option<LaserDelays>, PatternFileError> {
    let Some(value) = root.get("laser") else { return Ok(None) };
    let node = Node::of(value, "laser".into())?;
    let (on_us, off_us) = (node.number("on_us", -1e6..=1e6)?, node.number("off_us", -1e6..=1e6)?);
    Ok(Some(LaserDelays { on_us, off_us }))
}

fn feature(node: &Node<'_>) -> Result<Feature, PatternFileError> {
    let ends = || Ok((node.place("x1_mm", "y1_mm")?, node.place("x2_mm", "y2_mm")?));
    let size = |key| node.number(key, 1e-6..=PLACE_MAX_MM);
    let index = |key| {
        let value = node.number(key, 0.0..=1e6)?;
        // In range, so that a whole number converts exactly.
        let whole = Some(value as u32).filter(|_| value.fract() == 0.0);
        whole.ok_or_else(|| node.bad(key, "a whole number"))
    };
    let kind = node.text("kind")?;
    let shape = match kind.as_str() {
        "line" => {
            let (from_mm, to_mm) = ends()?;
            FeatureShape::Line { from_mm, to_mm, process: process(node)? }
        }
        "circle" => FeatureShape::Circle {
            centre_mm: node.place("x_mm", "y_mm")?,
            radius_mm: size("radius_mm")?,
            process: process(node)?,
        },
        "cross" | "dot" => FeatureShape::Mark(GridMark {
            style: if kind == "cross" { MarkStyle::Cross } else { MarkStyle::Dot },
            place_mm: node.place("x_mm", "y_mm")?,
            size_mm: size("size_mm")?,
            row: index("row")?,
            column: index("column")?,
        }),
        "fiducial" => FeatureShape::Fiducial {
            family: node.text("family")?,
            code: node.text("code")?,
            place_mm: node.place("x_mm", "y_mm")?,
            size_mm: size("size_mm")?,
            burned: node.boolean("burned")?,
        },
        "reference" => {
            let (from_mm, to_mm) = ends()?;
            FeatureShape::Reference { from_mm, to_mm, burned: node.boolean("burned")? }
        }
        _ => return Err(node.bad("kind", "line, circle, cross, dot, fiducial or reference")),
    };
    Ok(Feature { id: node.text("id")?, shape })
}

fn process(node: &Node<'_>) -> Result<LineProcess, PatternFileError> {
    Ok(LineProcess {
        speed_mm_s: node.number("speed_mm_s", 1e-3..=1e6)?,
        power_ratio: node.number("power_ratio", 0.0..=1e3)?,
    })
}

/// An object of the file and where it is.
struct Node<'a> {
    object: &'a Map<String, Value>,
    place: String,
}

impl<'a> Node<'a> {
    fn of(value: &'a Value, place: String) -> Result<Self, PatternFileError> {
        match value {
            Value::Object(object) => Ok(Self { object, place }),
            other => Err(PatternFileError::Value {
                place: if place.is_empty() { "the file".into() } else { place },
                found: shown(other),
                expected: "an object".into(),
            }),
        }
    }

    /// A value; null is as good as none.
    fn get(&self, key: &str) -> Option<&'a Value> {
        self.object.get(key).filter(|value| !value.is_null())
    }

    fn number(&self, key: &str, range: RangeInclusive<f64>) -> Result<f64, PatternFileError> {
        let number = self.get(key).and_then(Value::as_f64).filter(|value| range.contains(value));
        number.ok_or_else(|| self.bad(key, format!("{} to {}", range.start(), range.end())))
    }

    fn place(&self, x: &str, y: &str) -> Result<FieldPoint, PatternFileError> {
        let coordinate = |key| self.number(key, -PLACE_MAX_MM..=PLACE_MAX_MM);
        Ok(FieldPoint::new(coordinate(x)?, coordinate(y)?))
    }

    fn text(&self, key: &str) -> Result<String, PatternFileError> {
        self.text_or_none(key)?.ok_or_else(|| self.bad(key, "text"))
    }

    /// Text; a number, as others use for ids, is its digits.
    fn text_or_none(&self, key: &str) -> Result<Option<String>, PatternFileError> {
        match self.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(Value::Number(number)) => Ok(Some(number.to_string())),
            Some(_) => Err(self.bad(key, "text")),
        }
    }

    fn boolean(&self, key: &str) -> Result<bool, PatternFileError> {
        self.get(key).and_then(Value::as_bool).ok_or_else(|| self.bad(key, "true or false"))
    }

    /// The error of a key that is missing or has another value.
    fn bad(&self, key: &str, expected: impl Into<String>) -> PatternFileError {
        let dot = if self.place.is_empty() { "" } else { "." };
        let (place, expected) = (format!("{}{dot}{key}", self.place), expected.into());
        match self.get(key) {
            None => PatternFileError::Missing { place, expected },
            Some(value) => PatternFileError::Value { place, found: shown(value), expected },
        }
    }
}

/// A value in short.
fn shown(value: &Value) -> String {
    match value {
        Value::Array(values) => format!("a list of {}", values.len()),
        Value::Object(_) => "an object".into(),
        Value::String(text) => format!("{:?}", text.chars().take(60).collect::<String>()),
        other => other.to_string(),
    }
}
