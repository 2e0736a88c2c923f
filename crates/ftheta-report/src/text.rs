//! Text for the report: escaped, and numbers with as many digits as say something.

use std::fmt::Write;

/// Text with the characters that HTML and SVG give a meaning replaced.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // Control characters are not allowed in a document at all.
            c if c.is_control() && c != '\n' && c != '\t' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A number with three significant digits, without exponent where it can be read.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.2e}");
    }
    let n_whole = if size < 1.0 { 0 } else { size.log10() as i32 + 1 };
    let n_zeros = match size < 1.0 && size > 0.0 {
        true => (-size.log10()).floor() as i32,
        false => 0,
    };
    let n_digits = (3 - n_whole + n_zeros).clamp(0, 6) as usize;
    let text = format!("{value:.n_digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// A time with a unit that suits it.
pub fn time(seconds: f64) -> String {
    match seconds {
        0.0 => "0 s".into(),
        s if s < 1e-3 => format!("{} µs", number(1e6 * s)),
        s if s < 1.0 => format!("{} ms", number(1e3 * s)),
        s if s < 120.0 => format!("{} s", number(s)),
        s => format!("{:.0} min {:.0} s", (s / 60.0).floor(), s % 60.0),
    }
}

/// A tick's label with as many decimals as its step needs.
pub fn tick(value: f64, step: f64) -> String {
    let n_digits = (-(step * 1.000_001).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.n_digits$}");
    // A zero that came from below has a sign that means nothing.
    match text.trim_start_matches('-').trim_matches(['0', '.']) {
        "" => text.trim_start_matches('-').into(),
        _ => text.replace('-', "\u{2212}"),
    }
}

/// The step of 1, 2 or 5 times a power of ten that divides `range` into `n` parts or a few more.
pub fn tick_step(range: f64, n: f64) -> f64 {
    let rough = (range / n).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|step| step * power);
    step.into_iter().find(|step| *step >= 0.7 * rough).unwrap_or(10.0 * power)
}

/// Ticks from `lo` to `hi`, both included where they fall on one.
pub fn ticks(lo: f64, hi: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (lo / step - 1e-6).ceil() as i64;
    let last = (hi / step + 1e-6).floor() as i64;
    // A range that is not one gives no ticks rather than millions.
    let n = (last - first + 1).clamp(0, 100);
    (first..first + n).map(move |k| k as f64 * step)
}

/// Appends formatted text; writing to a string cannot fail.
pub fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.write_fmt(text).expect("writing to a string does not fail");
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    #[test]
    fn numbers_have_three_digits() {
        let values = [0.0, 1.0, 0.012345, 1.5, 12.345, 123.45, 12345.6, 1e-7, f64::NAN, -0.5];
        let text = values.map(number).join(" ");
        expect!["0 1 0.0123 1.5 12.3 123 12346 1.00e-7 – -0.5"].assert_eq(&text);
        let times = [0.0, 2.5e-5, 0.0123, 3.21, 125.0].map(time).join(" ");
        expect!["0 s 25 µs 12.3 ms 3.21 s 2 min 5 s"].assert_eq(&times);
    }

    #[test]
    fn ticks_are_round() {
        let step = tick_step(7.3, 5.0);
        let labels: Vec<_> = ticks(-1.0, 7.3, step).map(|v| tick(v, step)).collect();
        expect!["0 2 4 6"].assert_eq(&labels.join(" "));
        assert_eq!(tick(-0.25, 0.05), "\u{2212}0.25");
    }
}
