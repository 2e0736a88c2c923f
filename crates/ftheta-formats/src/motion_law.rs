//! Motion laws as text: a time and an angle in every line.

use thiserror::Error;

/// The line that a motion law begins with.
pub const HEADER: &str = "time_us,angle_deg";

/// Most samples of a law.
const N_SAMPLES_MAX: usize = 1_000_000;

/// What is wrong with a motion law.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{file}:{line}: {found} is not {expected}")]
pub struct MotionLawError {
    /// The file.
    pub file: String,
    /// Line from 1.
    pub line: usize,
    /// What is there.
    pub found: String,
    /// What should be.
    pub expected: String,
}

impl MotionLawError {
    /// Place, value and limit for a machine-readable message.
    pub fn fault(&self) -> (String, String, String) {
        (format!("{}:{}", self.file, self.line), self.found.clone(), self.expected.clone())
    }
}

/// Angles of a shaft at rising times.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLaw {
    /// Times, s.
    pub times_s: Vec<f64>,
    /// Mechanical angles, rad.
    pub angles_rad: Vec<f64>,
}

/// Reads a law: the header, then `time,angle` in µs and degrees, times rising. Empty lines do not
/// count.
///
/// # Errors
/// The first line that is none of these, or fewer than two samples.
pub fn read(file: &str, text: &str) -> Result<MotionLaw, MotionLawError> {
    let mut law = MotionLaw { times_s: Vec::new(), angles_rad: Vec::new() };
    let mut n_lines = 0;
    for (index, line) in text.lines().enumerate() {
        n_lines = index + 1;
        let fault = |expected: String| MotionLawError {
            file: file.into(),
            line: n_lines,
            // A line of a wrong file may be long.
            found: format!("\"{}\"", line.chars().take(60).collect::<String>()),
            expected,
        };
        if index == 0 {
            if line.trim() != HEADER {
                return Err(fault(format!("the header {HEADER}")));
            }
            continue;
        }
        if line.trim().is_empty() {
            continue;
        }
        let [time_us, angle_deg] = numbers(line).ok_or_else(|| {
            fault("a time in µs and an angle of at most 360 degrees, with a comma between".into())
        })?;
        let time_s = time_us * 1e-6;
        if let Some(last_s) = law.times_s.last().filter(|&&last_s| time_s <= last_s) {
            return Err(fault(format!("later than {} µs", last_s * 1e6)));
        }
        if law.times_s.len() == N_SAMPLES_MAX {
            return Err(fault(format!("within the limit of {N_SAMPLES_MAX} samples")));
        }
        law.times_s.push(time_s);
        law.angles_rad.push(angle_deg.to_radians());
    }
    if law.times_s.len() < 2 {
        return Err(MotionLawError {
            file: file.into(),
            line: n_lines,
            found: format!("{} samples", law.times_s.len()),
            expected: "two samples and more".into(),
        });
    }
    Ok(law)
}

/// The two finite numbers of a line; the angle is one of a shaft.
fn numbers(line: &str) -> Option<[f64; 2]> {
    let (time, angle) = line.split_once(',')?;
    let time_us: f64 = time.trim().parse().ok()?;
    let angle_deg: f64 = angle.trim().parse().ok()?;
    (time_us.is_finite() && angle_deg.abs() <= 360.0).then_some([time_us, angle_deg])
}
