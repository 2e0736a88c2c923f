//! Names of the laws, as on the command line: a parameter follows a colon.

use super::{Aim, Law, LawError, N_SEGMENTS};
use std::fmt;
use std::str::FromStr;

/// Most segments of `bisection`.
const N_SEGMENTS_MAX: usize = 200;

impl Law {
    /// One of each law, the optimum first.
    pub const ALL: [Self; 12] = [
        Self::Optimal,
        Self::Robust,
        Self::Residual,
        Self::Zv,
        Self::Zvd,
        Self::Asymmetric,
        Self::SCurve(Aim::Arrival),
        Self::Quintic(Aim::Arrival),
        Self::Cycloid(Aim::Arrival),
        Self::Bisection { n_segments: N_SEGMENTS, current_bound: false },
        Self::Trapezoid,
        Self::FixedStep,
    ];
}

impl fmt::Display for Law {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::Optimal => "optimal",
            Self::Robust => "robust",
            Self::Bisection { n_segments, current_bound } => {
                let bound = if *current_bound { ":current" } else { "" };
                return write!(out, "bisection:{n_segments}{bound}");
            }
            Self::FixedStep => "fixed-step",
            Self::Trapezoid => "trapezoid",
            Self::SCurve(Aim::Arrival) => "s-curve",
            Self::SCurve(Aim::Fastest) => "s-curve:fastest",
            Self::Asymmetric => "asymmetric",
            Self::Cycloid(Aim::Arrival) => "cycloid",
            Self::Cycloid(Aim::Fastest) => "cycloid:fastest",
            Self::Quintic(Aim::Arrival) => "quintic",
            Self::Quintic(Aim::Fastest) => "quintic:fastest",
            Self::Zv => "zv",
            Self::Zvd => "zvd",
            Self::Residual => "residual",
        };
        out.write_str(name)
    }
}

impl FromStr for Law {
    type Err = LawError;

    /// Reads `s-curve`, `bisection:8`, `bisection:120:current`, `quintic:fastest`.
    fn from_str(text: &str) -> Result<Self, LawError> {
        let (name, parameter) = text.split_once(':').unwrap_or((text, ""));
        let refused = |expected| {
            let (law, parameter) = (name.into(), parameter.into());
            Err(LawError::LawParameter { law, parameter, expected })
        };
        let law = match name {
            "bisection" => {
                let (count, bound) = parameter.split_once(':').unwrap_or((parameter, ""));
                let n_segments =
                    if count.is_empty() { Some(N_SEGMENTS) } else { count.parse().ok() };
                let known = |n: &usize| *n == 1 || (3..=N_SEGMENTS_MAX).contains(n);
                return match (n_segments.filter(known), bound) {
                    (Some(n_segments), "") => {
                        Ok(Self::Bisection { n_segments, current_bound: false })
                    }
                    (Some(n_segments), "current") if n_segments > 1 => {
                        Ok(Self::Bisection { n_segments, current_bound: true })
                    }
                    _ => refused("expected 1 or 3 to 200 segments, then perhaps :current"),
                };
            }
            "s-curve" | "cycloid" | "quintic" => {
                let aim = match parameter {
                    "" => Aim::Arrival,
                    "fastest" => Aim::Fastest,
                    _ => return refused("expected fastest or none"),
                };
                return Ok(match name {
                    "s-curve" => Self::SCurve(aim),
                    "cycloid" => Self::Cycloid(aim),
                    _ => Self::Quintic(aim),
                });
            }
            "optimal" => Self::Optimal,
            "robust" => Self::Robust,
            "fixed-step" => Self::FixedStep,
            "trapezoid" => Self::Trapezoid,
            "asymmetric" => Self::Asymmetric,
            "zv" => Self::Zv,
            "zvd" => Self::Zvd,
            "residual" => Self::Residual,
            _ => {
                let known = "optimal, robust, bisection, fixed-step, trapezoid, s-curve, \
                             asymmetric, cycloid, quintic, zv, zvd, residual";
                return Err(LawError::Unknown { name: name.into(), known: known.into() });
            }
        };
        if parameter.is_empty() { Ok(law) } else { refused("expected none") }
    }
}
