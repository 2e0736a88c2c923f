//! Machine and recipe files: presets, round trips, and what is said of a faulty file.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop at once")]

use expect_test::{Expect, expect};
use ftheta_formats::{machine, recipe};
use ftheta_model::machine::Lens;

#[test]
fn every_preset_reads_and_survives_a_round_trip() {
    for name in machine::PRESETS {
        let preset = machine::preset(name).unwrap().unwrap();
        assert_eq!(preset.name, name);
        let again = machine::read(name, &machine::to_toml(&preset)).unwrap();
        assert_eq!(preset, again);
    }
}

#[test]
fn bare_names_have_their_lens() {
    for (bare, f1_mm, wavelength_nm) in
        [("S10", 163.064, 355.0), ("S14", 255.059, 532.0), ("S25", 420.456, 1064.0)]
    {
        let preset = machine::preset(bare).unwrap().unwrap();
        let Lens::FTheta { coefficients_mm } = &preset.optics.lens else { panic!("a lens") };
        assert_eq!((coefficients_mm[0], preset.laser.wavelength_nm), (f1_mm, wavelength_nm));
    }
    assert!(machine::preset("S11").is_none());
}

/// The stated spot is what wavelength, beam quality and beam diameter give, within 2 %.
#[test]
fn spots_of_presets_follow_from_their_beams() {
    for name in machine::PRESETS {
        let stated = machine::preset(name).unwrap().unwrap().laser.spot_diameter_mm;
        let text: String = machine::preset_text(name)
            .unwrap()
            .lines()
            .filter(|line| !line.starts_with("spot_diameter"))
            .map(|line| format!("{line}\n"))
            .collect();
        let computed = machine::read(name, &text).unwrap().laser.spot_diameter_mm;
        assert!((computed / stated - 1.0).abs() < 0.02, "{name}: {computed} against {stated}");
    }
}

fn check(from: &str, to: &str, expected: Expect) {
    let text = machine::preset_text("S10").unwrap();
    assert!(text.contains(from), "{from}");
    let error = machine::read("my.toml", &text.replacen(from, to, 1)).unwrap_err();
    expected.assert_eq(&error.to_string());
}

#[test]
fn faults_name_line_value_and_limit() {
    check(
        "coil_inductance_uh = 180.0",
        "coil_inductance = 180.0",
        expect![[
            "my.toml:10: unknown key scanner.coil_inductance, the unit is missing: did you mean coil_inductance_uh?"
        ]],
    );
    check(
        "coil_resistance_ohm = 2.79",
        "coil_resistance_ohm = -2.79",
        expect![["my.toml:9: scanner.coil_resistance_ohm = -2.79 is outside 0.01 to 1000"]],
    );
    check(
        "voltage_max_v = 24.0",
        "voltage_max_v = nan",
        expect![["my.toml:13: scanner.voltage_max_v = nan is outside 0.1 to 1000"]],
    );
    check(
        "thermal_time_s = 1.0",
        "thermal_tmie_s = 1.0",
        expect![["my.toml:16: unknown key scanner.thermal_tmie_s, did you mean thermal_time_s?"]],
    );
    check(
        "thermal_time_s = 1.0",
        "thermal_time = 1.0",
        expect![[
            "my.toml:16: unknown key scanner.thermal_time, the unit is missing: did you mean thermal_time_s?"
        ]],
    );
    check(
        "first_mirror = \"x\"",
        "first_mirror = \"z\"",
        expect![[r#"my.toml:31: optics.first_mirror = "z" is outside "x", "y""#]],
    );
    check(
        "word_bits = 20",
        "word_bits = 20.5",
        expect![["my.toml:46: output.word_bits is a float, expected a whole number"]],
    );
    check(
        "period_us = 10.0",
        "period_us = 0",
        expect![["my.toml:45: output.period_us = 0 is outside 1 to 100"]],
    );
    check("[optics]", "[optics", expect![["my.toml:28: unclosed table, expected `]`"]]);
}

#[test]
fn recipe_reads_pens_and_delays() {
    let text = r##"
        [[pen]]
        name = "fill"
        color = "#F00"
        hatch_spacing_mm = 0.05
        [[pen]]
        layer = "Cut"
        mark_speed_mm_s = 250
        passes = 3
        [classic]
        jump_delay_us = 120
        laser_on_delay_us = -12.5
    "##;
    let recipe = recipe::read("r.toml", text).unwrap();
    assert_eq!(recipe.pens[0].color_rgb, Some([255, 0, 0]));
    assert_eq!(recipe.pens[0].pen.hatch.unwrap().spacing_mm, 0.05);
    assert_eq!((recipe.pens[1].pen.n_passes, recipe.pens[1].pen.name.as_str()), (3, "Cut"));
    assert_eq!(recipe.classic.laser_on_delay_ns, Some(-12_500));
    let error = recipe::read("r.toml", "[[pen]]\nspeed = 3").unwrap_err().to_string();
    assert_eq!(error, "r.toml:2: unknown key pen.speed, did you mean mark_speed_mm_s?");
}

#[test]
fn losses_read_and_survive_a_round_trip() {
    let text = machine::preset_text("S10").unwrap().replacen(
        "thermal_time_s = 1.0",
        "torque_falloff = 0.06\nfriction_coulomb_mn_m = 0.2\nfriction_viscous_un_m_s_rad = 0.3",
        1,
    );
    let read = machine::read("my.toml", &text).unwrap();
    let losses = read.scanner.losses;
    assert_eq!((losses.torque_falloff, losses.friction_coulomb_n_m), (0.06, 0.2 * 1e-3));
    assert_eq!(losses.friction_viscous_n_m_s_rad, 0.3 * 1e-6);
    assert_eq!(machine::read("my.toml", &machine::to_toml(&read)).unwrap(), read);
}

#[test]
fn axes_that_cannot_be_steered_are_refused() {
    check(
        "period_us = 10.0",
        "period_us = 100",
        expect![[
            "my.toml:11: scanner.torsional_mode_hz = 5200.0 is outside what a period of 100 µs can steer, below 5000 Hz"
        ]],
    );
    check(
        "thermal_time_s = 1.0",
        "torque_falloff = 0.5\nfriction_coulomb_mn_m = 25",
        expect![[
            "my.toml:17: scanner.friction_coulomb_mn_m = 25 is outside what the peak torque overcomes, below 24.680 mN·m"
        ]],
    );
}

const DYNAMIC_FOCUS: &str = include_str!("../../../gallery/dynamic-focus.toml");

#[test]
fn a_work_plane_survives_a_round_trip() {
    let text = DYNAMIC_FOCUS.replace("travel_mm = 5.0", "travel_mm = 11.0");
    let raised = text.replace("field_mm = 280.0", "field_mm = 280.0\nplane_mm = 20.0");
    let machine = machine::read("m.toml", &raised).unwrap();
    assert_eq!(machine.optics.plane_mm, 20.0);
    assert_eq!(machine::read("m.toml", &machine::to_toml(&machine)).unwrap(), machine);
    let error = |plane: &str| {
        let text =
            text.replace("field_mm = 280.0", &format!("field_mm = 280.0\nplane_mm = {plane}"));
        machine::read("m.toml", &text).unwrap_err().to_string()
    };
    assert!(error("460.0").contains("plane_mm"), "{}", error("460.0"));
    // There the lens would have to be at -11.2 mm.
    assert!(error("25.0").contains("travel_mm"), "{}", error("25.0"));
}

#[test]
fn a_focusing_lens_survives_a_round_trip() {
    let machine = machine::read("dynamic-focus.toml", DYNAMIC_FOCUS).unwrap();
    let focus = machine.optics.focus.as_ref().unwrap();
    assert_eq!((focus.magnification, focus.travel_mm, focus.balanced), (4.0, 5.0, true));
    assert_eq!((focus.lag_s, machine.optics.aperture_mm), (7e-4, Some(14.0)));
    let again = machine::read("dynamic-focus.toml", &machine::to_toml(&machine)).unwrap();
    assert_eq!(machine, again);
}

#[test]
fn faults_of_a_focusing_lens_name_line_value_and_limit() {
    let check = |from: &str, to: &str, expected: Expect| {
        assert!(DYNAMIC_FOCUS.contains(from), "{from}");
        let text = DYNAMIC_FOCUS.replacen(from, to, 1);
        expected.assert_eq(&machine::read("my.toml", &text).unwrap_err().to_string());
    };
    check(
        "travel_mm = 5.0",
        "travel_mm = 4.9",
        expect![[
            "my.toml:36: optics.focus.travel_mm = 4.9 is outside what a field of 280 mm needs at this magnification, 4.959 mm or more"
        ]],
    );
    check(
        "lag_us = 700.0",
        "lag_us = 700.0\nbalanced = false",
        expect![[
            "my.toml:36: optics.focus.travel_mm = 5.0 is outside what a field of 280 mm needs at this magnification, 9.917 mm or more"
        ]],
    );
    check(
        "magnification = 4.0",
        "magnification = 0.0",
        expect![
            "my.toml:35: optics.focus.magnification = 0.0 is outside 0.001 to 1000, either sign"
        ],
    );
    check(
        "speed_max_mm_s = 280.0\n",
        "",
        expect!["my.toml:34: optics.focus.speed_max_mm_s is missing"],
    );
    check(
        "kind = \"post-objective\"\nmirror_distance_mm = 30.0\nworking_distance_mm = 460.0",
        "kind = \"f-theta\"\ncoefficients_mm = [460.0]",
        expect![[
            "my.toml:26: optics.kind = \"f-theta\" is outside \"post-objective\", the only kind with [optics.focus]"
        ]],
    );
}
