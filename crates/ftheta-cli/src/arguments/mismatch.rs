//! How the twin differs from the machine file, as `key=value` pairs.

use super::{number, within};
use ftheta::twin::mismatch::Mismatch;

/// Time by which light or a lens is late, ns, from µs.
fn lateness(late_us: f64) -> Result<i64, String> {
    Ok((within(late_us, -5000.0..=5000.0)? * 1e3).round() as i64)
}

/// Reads `f1=+0.03,kt=-0.02,zeta=0.0025,laser_on_us=85,laser_off_us=60`.
pub(super) fn mismatch(text: &str) -> Result<Mismatch, String> {
    let mut mismatch = Mismatch::default();
    for part in text.split(',').filter(|part| !part.trim().is_empty()) {
        let (key, value) = part
            .split_once('=')
            .ok_or_else(|| format!("\"{part}\" is not of the form key=value"))?;
        let value = number(value)?;
        let key = key.trim();
        let named = |message: String| format!("{key} = {message}");
        match key {
            "f1" => mismatch.f1 = within(value, -0.5..=0.5).map_err(named)?,
            "kt" => mismatch.kt = within(value, -0.5..=0.5).map_err(named)?,
            "zeta" => mismatch.zeta = Some(within(value, 1e-5..=0.5).map_err(named)?),
            "laser_on_us" => mismatch.late_ns[0] = lateness(value).map_err(named)?,
            "laser_off_us" => mismatch.late_ns[1] = lateness(value).map_err(named)?,
            "lens_us" => mismatch.lens_late_ns = lateness(value).map_err(named)?,
            other => {
                return Err(format!(
                    "unknown key \"{other}\", known are f1, kt, zeta, laser_on_us, laser_off_us, \
                     lens_us"
                ));
            }
        }
    }
    Ok(mismatch)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mismatch_is_read_or_refused() {
        let read = mismatch("f1=+0.03, kt=-0.02,zeta=0.0025").unwrap();
        let expected = Mismatch { f1: 0.03, kt: -0.02, zeta: Some(0.0025), ..Mismatch::default() };
        assert_eq!(read, expected);
        let read = mismatch("laser_on_us=85,laser_off_us=-0.5").unwrap();
        assert_eq!(read.late_ns, [85_000, -500]);
        assert_eq!(mismatch("lens_us=200").unwrap().lens_late_ns, 200_000);
        assert_eq!(mismatch("").unwrap(), Mismatch::default());
        for (text, expected) in [
            ("f1", "\"f1\" is not of the form key=value"),
            (
                "f2=1",
                "unknown key \"f2\", known are f1, kt, zeta, laser_on_us, laser_off_us, lens_us",
            ),
            ("f1=nan", "NaN is not finite"),
            ("kt=0.6", "kt = 0.6 is outside -0.5 to 0.5"),
        ] {
            assert_eq!(mismatch(text).unwrap_err(), expected);
        }
    }
}
