//! Marks a small drawing on the twin and prints how well it went.

use ftheta::formats::{machine, svg};
use ftheta::mark::{MarkOptions, mark};
use ftheta::model::recipe::Recipe;
use std::error::Error;

const DRAWING: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" width="30mm" height="20mm"
    viewBox="0 0 30 20" fill="none" stroke="black">
  <rect x="2" y="2" width="26" height="16" rx="3"/>
  <circle cx="15" cy="10" r="5"/>
</svg>"#;

fn main() -> Result<(), Box<dyn Error>> {
    let recipe = Recipe::default();
    let machine = machine::preset("S10").ok_or("no such preset")??;
    let job = svg::read(DRAWING.as_bytes(), &recipe, &svg::SvgOptions::default())?;
    let marked = mark(&job.value, &machine, &recipe, &MarkOptions::default(), &mut |_| {})?;
    println!("plan {}: {:.1} ms", marked.plan.id(), marked.times.duration_s * 1e3);
    println!("contour error {:.2} µm max", marked.score.contour_error_um.max);
    Ok(())
}
