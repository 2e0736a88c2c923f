//! How a table of text is written: what separates cells, and which decimal sign numbers have.

use std::borrow::Cow;

/// What separates the cells of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// One character, between which cells may be empty.
    Sign(char),
    /// Any number of blanks or tabs.
    Blanks,
}

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// What separates cells.
    pub separator: Separator,
    /// `.` or `,`.
    pub decimal: char,
    /// Cells of most rows.
    pub n_columns: usize,
}

/// In the order in which they are preferred where a table can be read in several ways.
const CANDIDATES: [(Separator, char); 8] = [
    (Separator::Sign('\t'), '.'),
    (Separator::Sign('\t'), ','),
    (Separator::Sign(';'), '.'),
    (Separator::Sign(';'), ','),
    (Separator::Sign(','), '.'),
    // Numbers with a decimal comma between commas have to be quoted.
    (Separator::Sign(','), ','),
    (Separator::Blanks, '.'),
    (Separator::Blanks, ','),
];

impl Dialect {
    /// The dialect under which most cells of these lines are numbers; lines without a number, as
    /// the header, count for nothing.
    pub fn of(lines: &[&str]) -> Self {
        let read = CANDIDATES.map(|(separator, decimal)| {
            let mut widths = Vec::new();
            let mut score = 0;
            for line in lines {
                let cells = split(without_comment(line, separator), separator);
                let n_filled = cells.iter().filter(|cell| !cell.is_empty()).count();
                let is_number = |cell: &&Cow<'_, str>| number(cell, decimal).is_some();
                let n_numbers = cells.iter().filter(is_number).count();
                if cells.len() > 1 && n_numbers > 0 {
                    score += 2 * n_numbers as i64 - n_filled as i64;
                }
                widths.push(cells.len());
            }
            (score, Self { separator, decimal, n_columns: most_frequent(&mut widths) })
        });
        // The first of the best: `max_by_key` would give the last.
        let best = read.into_iter().reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.map_or(Self { separator: Separator::Sign(','), decimal: '.', n_columns: 0 }, |b| b.1)
    }
}

/// The value that is there most often; of several the largest.
fn most_frequent(values: &mut [usize]) -> usize {
    values.sort_unstable();
    let groups = values.chunk_by(|a, b| a == b);
    groups.max_by_key(|group| group.len()).and_then(|group| group.first()).copied().unwrap_or(0)
}

/// A line up to a comment: `#`, `//`, and `;` where that does not separate cells.
pub fn without_comment(line: &str, separator: Separator) -> &str {
    let mut quoted = false;
    let mut last = ' ';
    for (index, sign) in line.char_indices() {
        match sign {
            '"' => quoted = !quoted,
            '#' if !quoted => return &line[..index],
            ';' if !quoted && separator != Separator::Sign(';') => return &line[..index],
            '/' if !quoted && last == '/' => return &line[..index - 1],
            _ => {}
        }
        last = sign;
    }
    line
}

/// The cells of a row, without quotes and the blanks around them.
pub fn split(line: &str, separator: Separator) -> Vec<Cow<'_, str>> {
    let mut cells = Vec::new();
    let (mut start, mut quoted) = (0, false);
    for (index, sign) in line.char_indices() {
        let ends = match separator {
            Separator::Sign(separator) => sign == separator,
            Separator::Blanks => sign.is_whitespace(),
        };
        if sign == '"' {
            quoted = !quoted;
        } else if ends && !quoted {
            cells.push(&line[start..index]);
            start = index + sign.len_utf8();
        }
    }
    cells.push(&line[start..]);
    if separator == Separator::Blanks {
        cells.retain(|cell| !cell.is_empty());
    }
    cells.into_iter().map(unquoted).collect()
}

fn unquoted(cell: &str) -> Cow<'_, str> {
    let cell = cell.trim();
    match cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')) {
        Some(inner) if inner.contains("\"\"") => Cow::Owned(inner.trim().replace("\"\"", "\"")),
        Some(inner) => Cow::Borrowed(inner.trim()),
        None => Cow::Borrowed(cell),
    }
}

/// The number in a cell, which may be infinite or none (NaN); `None` for other text.
pub fn number(cell: &str, decimal: char) -> Option<f64> {
    // Spreadsheets write the sign with a character of its own.
    let cell = cell.replace('\u{2212}', "-");
    if decimal == '.' {
        return cell.parse().ok();
    }
    // A point beside decimal commas would separate thousands, or be a mistake.
    if cell.contains('.') { None } else { cell.replace(',', ".").parse().ok() }
}
