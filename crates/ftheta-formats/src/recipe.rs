//! Recipe files: pens and the settings of the classic planner, TOML with units in the keys.

use crate::toml_table::{Section, TomlError, parse};
use ftheta_model::recipe::{ClassicRecipe, Hatch, Interpolation, Pen, PenRule, Recipe, TextStyle};

/// Reads a recipe file.
///
/// * `file`: its name, for messages
///
/// # Errors
/// The first thing that is wrong, with line, value and limit. Unknown keys are errors.
pub fn read(file: &str, text: &str) -> Result<Recipe, TomlError> {
    parse(file, text, |root| {
        let styles = [("outline", TextStyle::Outline), ("single-stroke", TextStyle::SingleStroke)];
        let text = root.section("text", |section| section.choice("style", &styles))?;
        let orders = [("shortest", false), ("keep", true)];
        let keep_order = root.choice("order", &orders)?.unwrap_or(false);
        let flatten = root.number("flatten_tolerance_um", 0.01..=1000.0)?;
        Ok(Recipe {
            pens: root.sections("pen", pen)?,
            keep_order,
            classic: root.section("classic", classic)?.unwrap_or_default(),
            text: text.flatten().unwrap_or_default(),
            flatten_tolerance_mm: flatten.map(|um| um * 1e-3),
        })
    })
}

fn pen(section: &Section<'_>) -> Result<PenRule, TomlError> {
    let default = Pen::default();
    let color = section.text("color")?;
    let color_rgb = match color {
        Some(text) => Some(
            rgb(text)
                .ok_or_else(|| section.refuse("color", "\"#rrggbb\" with hexadecimal digits"))?,
        ),
        None => None,
    };
    let layer = section.text("layer")?.map(str::to_owned);
    let name = section.text("name")?.or(layer.as_deref()).or(color).unwrap_or("pen").to_owned();
    let spacing_mm = section.number("hatch_spacing_mm", 1e-3..=1e3)?;
    let angle_deg = section.number("hatch_angle_deg", -360.0..=360.0)?.unwrap_or(0.0);
    let outline = section.boolean("hatch_outline")?.unwrap_or(true);
    let speed = section.number("mark_speed_mm_s", 1e-3..=1e6)?;
    let pen = Pen {
        name,
        mark_speed_mm_s: speed.unwrap_or(default.mark_speed_mm_s),
        power_w: section.number("power_w", 0.0..=1e5)?.unwrap_or(default.power_w),
        n_passes: section.whole("passes", 1..=1000)?.unwrap_or(1),
        hatch: spacing_mm.map(|spacing_mm| Hatch { spacing_mm, angle_deg, outline }),
    };
    Ok(PenRule { pen, color_rgb, layer })
}

/// The colour of `#rrggbb` or `#rgb`.
fn rgb(text: &str) -> Option<[u8; 3]> {
    let digits: Vec<u8> = text
        .strip_prefix('#')?
        .chars()
        .map(|digit| digit.to_digit(16).map(|value| value as u8))
        .collect::<Option<_>>()?;
    match digits[..] {
        [r, g, b] => Some([r * 17, g * 17, b * 17]),
        [r1, r0, g1, g0, b1, b0] => Some([r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0]),
        _ => None,
    }
}

fn classic(section: &Section<'_>) -> Result<ClassicRecipe, TomlError> {
    let seconds = |key| Ok(section.number(key, 0.0..=1e5)?.map(|us| us * 1e-6));
    let nanoseconds =
        |key| Ok(section.number(key, -1e5..=1e5)?.map(|us| (us * 1e3).round() as i64));
    let kinds = [("absolute", Interpolation::Absolute), ("dda", Interpolation::Dda)];
    Ok(ClassicRecipe {
        jump_speed_mm_s: section.number("jump_speed_mm_s", 1e-3..=1e6)?,
        jump_delay_min_s: seconds("jump_delay_min_us")?,
        jump_delay_s: seconds("jump_delay_us")?,
        jump_length_limit_mm: section.number("jump_length_limit_mm", 1e-3..=1e5)?,
        mark_delay_s: seconds("mark_delay_us")?,
        polygon_delay_s: seconds("polygon_delay_us")?,
        laser_on_delay_ns: nanoseconds("laser_on_delay_us")?,
        laser_off_delay_ns: nanoseconds("laser_off_delay_us")?,
        interpolation: section.choice("interpolation", &kinds)?,
        acceleration_mm_s2: section.number("acceleration_mm_s2", 1.0..=1e12)?,
        deceleration_mm_s2: section.number("deceleration_mm_s2", 1.0..=1e12)?,
        sky_run_in_s: seconds("sky_run_in_us")?,
        sky_run_out_s: seconds("sky_run_out_us")?,
    })
}
