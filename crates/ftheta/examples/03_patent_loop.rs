//! The example of patent CN105005322B: a laser-off loop that turns the beam by 90 degrees at
//! 100 m/s in the field, in the fewest ticks that both axes have in common.
//!
//! Writes `patent-loop.html`, into the folder that is its argument or `target/patent-loop`.

use ftheta::jump_results::add_route;
use ftheta::machines;
use ftheta::output::Output;
use ftheta::planner::jump::{AxisOptions, CurrentBound, Model, Route, fewest_ticks_between};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/patent-loop".into());
    let machine = machines::find("S10-f160")?;
    // The patent plans in field units, 0.05 m and 100 m/s, on an ideal lens of 0.32 m/rad.
    let (angle_rad, speed_rad_s) = (0.05 / 0.32, 100.0 / 0.32);
    let route = |to_rad_s: f64| Route {
        from_rad: angle_rad,
        to_rad: angle_rad,
        from_rad_s: speed_rad_s,
        to_rad_s,
    };
    let routes = [route(speed_rad_s), route(-speed_rad_s)];
    let options = AxisOptions {
        model: Model::Flexible,
        tick_s: machine.output.period_s(),
        voltage_reserve: 0.0,
        current_bound: CurrentBound::Always,
    };
    let voltages_v = fewest_ticks_between(&machine.scanner, options, &routes)?
        .ok_or("no loop within the angles")?;
    let mut output = Output::new(Path::new(&folder))?;
    let title = "The loop of patent CN105005322B";
    add_route(&mut output, "patent-loop.html", title, &machine, (&routes, &voltages_v))?;
    output.publish()?;
    println!("{} ticks: {folder}/patent-loop.html", voltages_v[0].len());
    Ok(())
}
