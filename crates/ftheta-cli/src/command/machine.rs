//! `ftheta machine`: presets and machine files.

use crate::arguments::{Machine, MachineAction};
use crate::json;
use crate::screen::say;
use ftheta::formats::machine::{self, PRESETS};
use ftheta::model::machine::{Lens, Machine as MachineFile};
use ftheta::physics::audit::check_field;
use ftheta::physics::galvo::Galvo;
use ftheta::physics::optics::scale_mm_per_rad;
use ftheta::physics::servo::Gains;
use ftheta::{Error, focus_report, machines};
use serde_json::{Value, json};

/// Lists, shows or checks machines.
pub fn run(arguments: &Machine, as_json: bool) -> Result<(), Error> {
    match &arguments.action {
        MachineAction::List => list(as_json),
        MachineAction::Show { machine } => show(machine, as_json),
        MachineAction::Check { machine } => check(machine, as_json),
        MachineAction::Mechanism(mechanism) => super::mechanism::run(mechanism, as_json),
    }
}

fn list(as_json: bool) -> Result<(), Error> {
    let rows = PRESETS.into_iter().map(machines::find).collect::<Result<Vec<_>, _>>()?;
    if as_json {
        let machines: Vec<Value> = rows.iter().map(summary).collect();
        json::print(&json!({"machines": machines}));
        return Ok(());
    }
    say!(
        "{:10} {:>8} {:>10} {:>9} {:>12}",
        "preset",
        "field mm",
        "focal mm",
        "spot µm",
        "laser nm"
    );
    for machine in rows {
        say!(
            "{:10} {:>8} {:>10.1} {:>9.0} {:>12.0}",
            machine.name,
            machine.optics.field_mm,
            0.5 * scale_mm_per_rad(&machine.optics),
            machine.laser.spot_diameter_mm * 1e3,
            machine.laser.wavelength_nm
        );
    }
    say!("S10 stands for S10-f163, S14 for S14-f255, S25 for S25-f420");
    Ok(())
}

fn summary(machine: &MachineFile) -> Value {
    json!({
        "name": machine.name,
        "field_mm": machine.optics.field_mm,
        "wavelength_nm": machine.laser.wavelength_nm,
        "spot_diameter_um": machine.laser.spot_diameter_mm * 1e3,
    })
}

fn show(name: &str, as_json: bool) -> Result<(), Error> {
    let (file, text) = machines::source(name)?;
    let machine = machine::read(&file, &text)?;
    if as_json {
        json::print(&json!({"name": machine.name, "toml": text}));
    } else {
        say!("{}", text.trim_end());
    }
    Ok(())
}

/// What follows from a machine file and is worth comparing with a data sheet.
fn check(name: &str, as_json: bool) -> Result<(), Error> {
    let machine = machines::find(name)?;
    check_field(&machine)?;
    let scanner = &machine.scanner;
    let galvo = Galvo::new(scanner);
    let gains = Gains::design(scanner, machine.output.period_s())?;
    let scale_mm = scale_mm_per_rad(&machine.optics);
    let acceleration_rad_s2 =
        scanner.torque_constant_n_m_a * scanner.current_max_a / scanner.inertia_kg_m2();
    let mut rows = vec![
        ("servo_lag_us", gains.lag_s(&galvo) * 1e6),
        ("acceleration_max_rad_s2", acceleration_rad_s2),
        ("coil_time_constant_us", scanner.inductance_h / scanner.resistance_ohm * 1e6),
        ("field_mm_per_rad", scale_mm),
        ("word_step_um", machine.output.word_step_rad() * scale_mm * 1e3),
    ];
    let focus = focus_report::report(&machine);
    rows.extend(focus.rows);
    if as_json {
        let mut object: Value =
            rows.iter().map(|&(key, value)| (key.to_owned(), Value::from(value))).collect();
        object["name"] = json!(machine.name);
        object["warnings"] = focus.warnings.iter().map(ToString::to_string).collect();
        json::print(&object);
        return Ok(());
    }
    let lens = match (&machine.optics.lens, &machine.optics.focus) {
        (Lens::FTheta { .. }, _) => "F-theta lens",
        (Lens::PostObjective { .. }, None) => "post-objective",
        (Lens::PostObjective { .. }, Some(_)) => "post-objective, dynamic focus",
    };
    say!("{}: {lens}, field {} mm: good", machine.name, machine.optics.field_mm);
    for (key, value) in rows {
        say!("  {key:24} {value:.6}");
    }
    for warning in focus.warnings {
        say!("warning: {warning}");
    }
    Ok(())
}
