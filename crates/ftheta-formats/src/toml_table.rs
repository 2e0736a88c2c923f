//! Reads TOML tables key by key: what is never asked for is an error, as is what is out of range.

use std::borrow::Cow;
use std::cell::RefCell;
use std::ops::RangeInclusive;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a machine or recipe file.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TomlError {
    /// Not TOML.
    #[error("{file}:{line}: {message}")]
    Syntax {
        /// File or preset.
        file: String,
        /// Line from 1.
        line: usize,
        /// What the TOML parser says.
        message: String,
    },
    /// A key that means nothing here.
    #[error("{file}:{line}: unknown key {key}{hint}")]
    UnknownKey {
        /// File or preset.
        file: String,
        /// Line from 1.
        line: usize,
        /// The key with its sections.
        key: String,
        /// The nearest known key, or nothing.
        hint: String,
    },
    /// A key that must be there.
    #[error("{file}:{line}: {key} is missing")]
    MissingKey {
        /// File or preset.
        file: String,
        /// Line of the section, from 1.
        line: usize,
        /// The key with its sections.
        key: String,
    },
    /// A value that cannot be.
    #[error("{file}:{line}: {key} = {value} is outside {limit}")]
    Range {
        /// File or preset.
        file: String,
        /// Line from 1.
        line: usize,
        /// The key with its sections.
        key: String,
        /// The value as written.
        value: String,
        /// What is allowed.
        limit: String,
    },
    /// A value of the wrong kind.
    #[error("{file}:{line}: {key} is {found}, expected {expected}")]
    Kind {
        /// File or preset.
        file: String,
        /// Line from 1.
        line: usize,
        /// The key with its sections.
        key: String,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
    },
}

impl TomlError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        let at = |file: &str, line: &usize| format!("{file}:{line}");
        match self {
            Self::Syntax { file, line, message } => {
                (at(file, line), message.clone(), "TOML".into())
            }
            Self::UnknownKey { file, line, key, hint } => {
                (at(file, line), key.clone(), hint.trim_start_matches(", ").into())
            }
            Self::MissingKey { file, line, key } => {
                (at(file, line), "missing".into(), format!("{key} is required"))
            }
            Self::Range { file, line, key, value, limit } => {
                (format!("{}: {key}", at(file, line)), value.clone(), limit.clone())
            }
            Self::Kind { file, line, key, found, expected } => {
                (format!("{}: {key}", at(file, line)), found.clone(), expected.clone())
            }
        }
    }
}

/// One table of a file, and the keys that were asked for.
pub struct Section<'a> {
    file: &'a str,
    text: &'a str,
    path: String,
    start: usize,
    table: &'a DeTable<'a>,
    asked: RefCell<Vec<&'static str>>,
}

/// Parses a file and hands its root table to `read`, which must ask for every key there is.
pub fn parse<T>(
    file: &str,
    text: &str,
    read: impl FnOnce(&Section<'_>) -> Result<T, TomlError>,
) -> Result<T, TomlError> {
    let root = DeTable::parse(text).map_err(|error| TomlError::Syntax {
        file: file.into(),
        line: line_of(text, error.span().map_or(0, |span| span.start)),
        message: error.message().into(),
    })?;
    let section = Section {
        file,
        text,
        path: String::new(),
        start: 0,
        table: root.get_ref(),
        asked: RefCell::default(),
    };
    let value = read(&section)?;
    section.finish()?;
    Ok(value)
}

fn line_of(text: &str, offset: usize) -> usize {
    1 + text.as_bytes().iter().take(offset).filter(|&&byte| byte == b'\n').count()
}

impl<'a> Section<'a> {
    fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.asked.borrow_mut().push(key);
        self.table.get(key)
    }

    fn full_key(&self, key: &str) -> String {
        format!("{}{key}", self.path)
    }

    fn line(&self, value: &Spanned<DeValue<'_>>) -> usize {
        line_of(self.text, value.span().start)
    }

    /// The error for a value of the wrong kind.
    fn kind(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: &str) -> TomlError {
        TomlError::Kind {
            file: self.file.into(),
            line: self.line(value),
            key: self.full_key(key),
            found: format!("a {}", value.get_ref().type_str()),
            expected: expected.into(),
        }
    }

    fn range(&self, key: &str, value: &Spanned<DeValue<'_>>, limit: String) -> TomlError {
        TomlError::Range {
            file: self.file.into(),
            line: self.line(value),
            key: self.full_key(key),
            value: self.text[value.span()].into(),
            limit,
        }
    }

    fn in_range(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        range: &RangeInclusive<f64>,
    ) -> Result<f64, TomlError> {
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            _ => None,
        };
        let number: f64 = number.ok_or_else(|| self.kind(key, value, "a number"))?;
        if range.contains(&number) {
            return Ok(number);
        }
        Err(self.range(key, value, format!("{} to {}", range.start(), range.end())))
    }

    /// A number within a range, if it is there.
    pub fn number(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
    ) -> Result<Option<f64>, TomlError> {
        self.get(key).map(|value| self.in_range(key, value, &range)).transpose()
    }

    /// A number within a range, which must be there.
    pub fn need(&self, key: &'static str, range: RangeInclusive<f64>) -> Result<f64, TomlError> {
        self.number(key, range)?.ok_or_else(|| self.missing(key))
    }

    /// A whole number within a range, if it is there.
    pub fn whole(
        &self,
        key: &'static str,
        range: RangeInclusive<u32>,
    ) -> Result<Option<u32>, TomlError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let bounds = f64::from(*range.start())..=f64::from(*range.end());
        let number = self.in_range(key, value, &bounds)?;
        if number.fract() != 0.0 {
            return Err(self.kind(key, value, "a whole number"));
        }
        Ok(Some(number as u32))
    }

    /// Numbers, from one to `n_max`, each within a range, if they are there.
    pub fn numbers(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        n_max: usize,
    ) -> Result<Option<Vec<f64>>, TomlError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        let array = value
            .get_ref()
            .as_array()
            .ok_or_else(|| self.kind(key, value, "an array of numbers"))?;
        if array.is_empty() || array.len() > n_max {
            return Err(self.range(key, value, format!("1 to {n_max} numbers")));
        }
        array
            .iter()
            .map(|item| self.in_range(key, item, &range))
            .collect::<Result<_, _>>()
            .map(Some)
    }

    /// A text, if it is there.
    pub fn text(&self, key: &'static str) -> Result<Option<&'a str>, TomlError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        value.get_ref().as_str().map(Some).ok_or_else(|| self.kind(key, value, "a text"))
    }

    /// One of the given words and what it stands for, if it is there.
    pub fn choice<T: Copy>(
        &self,
        key: &'static str,
        choices: &[(&str, T)],
    ) -> Result<Option<T>, TomlError> {
        let Some(word) = self.text(key)? else {
            return Ok(None);
        };
        if let Some(&(_, choice)) = choices.iter().find(|(name, _)| *name == word) {
            return Ok(Some(choice));
        }
        let names: Vec<String> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        let value = &self.table[key];
        Err(self.range(key, value, names.join(", ")))
    }

    /// Yes or no, if it is there.
    pub fn boolean(&self, key: &'static str) -> Result<Option<bool>, TomlError> {
        let Some(value) = self.get(key) else {
            return Ok(None);
        };
        value.get_ref().as_bool().map(Some).ok_or_else(|| self.kind(key, value, "true or false"))
    }

    /// Reads a sub-table, if it is there; it must be asked for every key it has.
    pub fn section<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(&Section<'_>) -> Result<T, TomlError>,
    ) -> Result<Option<T>, TomlError> {
        self.get(key).map(|value| self.enter(key, value, read)).transpose()
    }

    /// Reads every table of an array of tables; none if it is not there.
    pub fn sections<T>(
        &self,
        key: &'static str,
        mut read: impl FnMut(&Section<'_>) -> Result<T, TomlError>,
    ) -> Result<Vec<T>, TomlError> {
        let Some(value) = self.get(key) else {
            return Ok(Vec::new());
        };
        let array = value
            .get_ref()
            .as_array()
            .ok_or_else(|| self.kind(key, value, "an array of tables ([[...]])"))?;
        array.iter().map(|item| self.enter(key, item, &mut read)).collect()
    }

    fn enter<T>(
        &self,
        key: &'static str,
        value: &Spanned<DeValue<'_>>,
        read: impl FnOnce(&Section<'_>) -> Result<T, TomlError>,
    ) -> Result<T, TomlError> {
        let table = value.get_ref().as_table().ok_or_else(|| self.kind(key, value, "a table"))?;
        let section = Section {
            file: self.file,
            text: self.text,
            path: format!("{}{key}.", self.path),
            start: value.span().start,
            table,
            asked: RefCell::default(),
        };
        let found = read(&section)?;
        section.finish()?;
        Ok(found)
    }

    /// The error for a key that must be there; if another key looks meant for it, that one's.
    pub fn missing(&self, key: &'static str) -> TomlError {
        let meant = self.table.iter().find(|(name, _)| likeness(name.get_ref(), key) > 0.7);
        match meant {
            Some((name, _)) => self.unknown(name, &[key]),
            None => TomlError::MissingKey {
                file: self.file.into(),
                line: line_of(self.text, self.start),
                key: self.full_key(key),
            },
        }
    }

    fn unknown(&self, name: &Spanned<Cow<'_, str>>, known: &[&'static str]) -> TomlError {
        TomlError::UnknownKey {
            file: self.file.into(),
            line: line_of(self.text, name.span().start),
            key: self.full_key(name.get_ref()),
            hint: hint(name.get_ref(), known),
        }
    }

    /// The error for a value that is wrong for a reason of its own; `limit` says what is right.
    pub fn refuse(&self, key: &'static str, limit: impl Into<String>) -> TomlError {
        match self.get(key) {
            Some(value) => self.range(key, value, limit.into()),
            None => self.missing(key),
        }
    }

    /// Every key that was not asked for is unknown.
    fn finish(&self) -> Result<(), TomlError> {
        let asked = self.asked.borrow();
        let unknown = self
            .table
            .iter()
            .filter(|(key, _)| !asked.contains(&key.get_ref().as_ref()))
            .min_by_key(|(key, _)| key.span().start);
        unknown.map_or(Ok(()), |(key, _)| Err(self.unknown(key, &asked)))
    }
}

/// How much a written key looks like a known one: 1 where only the unit or a word is left out.
fn likeness(name: &str, key: &str) -> f64 {
    let words: Vec<&str> = key.split('_').collect();
    if name.split('_').all(|word| words.contains(&word)) {
        return 1.0;
    }
    strsim::normalized_damerau_levenshtein(name, key)
}

/// What was probably meant: the nearest known key, or all of them.
fn hint(name: &str, known: &[&'static str]) -> String {
    let nearest =
        known.iter().map(|key| (likeness(name, key), key)).max_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, key)) if key.starts_with(&format!("{name}_")) => {
            format!(", the unit is missing: did you mean {key}?")
        }
        Some((likeness, key)) if likeness > 0.4 => format!(", did you mean {key}?"),
        _ => format!(", known here: {}", known.join(", ")),
    }
}
