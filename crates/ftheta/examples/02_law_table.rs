//! Prints laws, all or those named, against the reference: three scanners, six steps.

use ftheta::formats::machine;
use ftheta::jump::{JumpOptions, Law, compare};
use serde_json::Value;
use std::error::Error;

const LAWS: [&str; 19] = [
    "s-curve",
    "s-curve:fastest",
    "asymmetric",
    "residual",
    "zv",
    "zvd",
    "quintic",
    "quintic:fastest",
    "cycloid",
    "cycloid:fastest",
    "bisection:1",
    "bisection:3",
    "bisection:5",
    "bisection:8",
    "bisection:20",
    "bisection:120",
    "bisection:120:current",
    "trapezoid",
    "fixed-step",
];

fn main() -> Result<(), Box<dyn Error>> {
    let reference: Value = serde_json::from_str(include_str!("../tests/fixtures/laws.json"))?;
    let named: Vec<String> = std::env::args().skip(1).collect();
    let names = if named.is_empty() { LAWS.map(String::from).to_vec() } else { named };
    let laws = names.iter().map(|name| name.parse()).collect::<Result<Vec<Law>, _>>()?;
    for set in ["S10", "S14", "S25"] {
        let machine = machine::preset(set).ok_or("no such preset")??;
        for step_deg in ["0.01", "0.1", "1", "5", "10", "20"] {
            let case = &reference[set][step_deg];
            let options = JumpOptions {
                steps_rad: vec![step_deg.parse::<f64>()?.to_radians()],
                laws: laws.clone(),
                from_rad_s: 0.0,
                to_rad_s: 0.0,
                tolerance_rad: 0.002_f64.to_radians(),
                reserve: 0.0,
                period_s: 1e-5,
                mismatch: Default::default(),
            };
            let step = &compare(&machine, &options)?[0];
            println!("{set} {step_deg}°, limit {:.1} µs", step.limit_s * 1e6);
            for law in &step.laws {
                let name = law.law.to_string();
                let segments = name.strip_prefix("bisection:").unwrap_or_default();
                let expected = [
                    &case["laws_us"][&name][1],
                    &case["bisection_us"][segments],
                    if segments == "1" { &case["passing"]["plan_us"] } else { &Value::Null },
                ];
                let expected = expected.into_iter().find_map(Value::as_f64);
                match &law.outcome {
                    Err(error) => println!("  {name:22} {error}"),
                    Ok(outcome) => {
                        let plan_us = outcome.motion.plan_s * 1e6;
                        let total_us = outcome.total_s().map_or(f64::INFINITY, |total| total * 1e6);
                        let found = if segments.is_empty() { total_us } else { plan_us };
                        println!(
                            "  {name:22} plan {plan_us:9.1} total {total_us:9.1} of {:9.1}: {:+6.1} %, \
                             voltage {:.4}, current {:.4}, residual {:.1e}",
                            expected.unwrap_or(f64::NAN),
                            expected.map_or(f64::NAN, |expected| (found / expected - 1.0) * 100.0),
                            outcome.peak_voltage_ratio,
                            outcome.arrival.peak_current_a / machine.scanner.current_max_a,
                            outcome.arrival.residual_rad,
                        );
                    }
                }
            }
        }
    }
    Ok(())
}
