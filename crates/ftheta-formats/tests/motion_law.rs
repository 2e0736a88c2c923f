//! Motion laws: what is read and what is refused.
#![allow(clippy::unwrap_used, reason = "a test may stop at once")]

use ftheta_formats::motion_law::read;

#[test]
fn samples_are_read_in_si() {
    let law = read("l.csv", "time_us,angle_deg\n0,0\n 10 , 180\n\n20,-1e1\n").unwrap();
    assert_eq!(law.times_s, [0.0, 10.0 * 1e-6, 20.0 * 1e-6]);
    assert_eq!(law.angles_rad, [0.0, std::f64::consts::PI, (-10_f64).to_radians()]);
}

#[test]
fn faults_name_line_value_and_limit() {
    for (text, expected) in [
        ("t,x\n0,0", "l.csv:1: \"t,x\" is not the header time_us,angle_deg"),
        ("", "l.csv:0: 0 samples is not two samples and more"),
        ("time_us,angle_deg\n0,0\n", "l.csv:2: 1 samples is not two samples and more"),
        ("time_us,angle_deg\n0,0\n0,1", "l.csv:3: \"0,1\" is not later than 0 µs"),
        (
            "time_us,angle_deg\n0,nan",
            "l.csv:2: \"0,nan\" is not a time in µs and an angle of at most 360 degrees, with a comma between",
        ),
    ] {
        assert_eq!(read("l.csv", text).unwrap_err().to_string(), expected);
    }
}
