//! A head that turns while it listens.
//!
//! In: tables of headings, the readings of a sensor, a noise in front of a sphere and behind it. Out: orientations by hand; the
//! side on which the noise is.

use crate::noise;
use bvm::audition::synthesis::{Waypoint, add_noise, binaural};
use bvm::audition::{
    Attitudes, BinauralUnit, Calibration, Directions, Found, Head, Listening, Origin, Turns,
};
use bvm::frame::Spherical;
use bvm::vestibular::rotation::heading;
use std::path::PathBuf;
use tempfile::TempDir;

fn written(folder: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn headings_are_interpolated_and_end_with_their_file() {
    let folder = TempDir::new().unwrap();
    let degrees =
        |attitudes: &mut Attitudes, time_s: f64| heading(attitudes.at(time_s).unwrap()).unwrap().to_degrees();
    let path = written(&folder, "h.csv", "time_s,heading_deg\n0,0\n1,10\n\n2,-170\n3,170\n");
    let mut found = Attitudes::of_table(&path, 0.0).unwrap();
    for (time_s, expected) in
        [(0.0, 0.0), (0.25, 2.5), (1.0, 10.0), (2.0, -170.0), (2.5, 180.0), (3.05, 170.0)]
    {
        let away = (degrees(&mut found, time_s) - expected).to_radians();
        // Half way between -170 and 170 is 180, or -180.
        assert!(away.sin().abs() < 1e-3 && away.cos() > 0.0, "{time_s}");
    }
    let error = found.at(3.2).unwrap_err().to_string();
    assert!(error.contains("ends at 3.000 s, before the sound"), "{error}");
    // The sound begins at 1.5 s on the clock of the table.
    let later = written(
        &folder,
        "q.csv",
        "t_s,qw,qx,qy,qz\n1,1,0,0,0\n2,0.7071067811865476,0,0,0.7071067811865476\n",
    );
    let mut found = Attitudes::of_table(&later, 1.5).unwrap();
    assert!((degrees(&mut found, 0.0) - 45.0).abs() < 1e-9);
    let mut early = Attitudes::of_table(&later, 0.5).unwrap();
    assert!(early.at(0.0).unwrap_err().to_string().contains("after the sound"));
    for (text, reason) in [
        ("", "empty"),
        ("time_s,yaw\n0,1\n", "expected `time_s` and `heading_deg`"),
        ("time_s,heading_deg\n0,left\n", "line 2: `left` is not a number"),
        ("time_s,heading_deg\n1,0\n0,0\n", "the clock runs back"),
        ("time_s,heading_deg\n", "there are no rows"),
        ("t_s,qw,qx,qy,qz\n0,2,0,0,0\n", "a quaternion of length 2"),
    ] {
        let path = written(&folder, "wrong.csv", text);
        let error = Attitudes::of_table(&path, 0.0).err().unwrap().to_string();
        assert!(error.contains(reason) && error.contains("wrong.csv"), "{error}");
    }
}

#[test]
fn an_inertial_sensor_tells_the_heading() {
    // 0.5 rad/s to the left, at 200 Hz: 0.25 rad after half a second.
    let mut text = "t_s,gx,gy,gz,ax,ay,az\n".to_owned();
    for row in 0..=200 {
        text += &format!("{},0,0,0.5,0,0,9.80665\n", 100.0 + f64::from(row) * 0.005);
    }
    let folder = TempDir::new().unwrap();
    let mut found = Attitudes::of_inertial(&written(&folder, "imu.csv", &text), 0.0).unwrap();
    for (time_s, expected) in [(0.0, 0.0), (0.5, 0.25), (1.0, 0.5)] {
        let angle = heading(found.at(time_s).unwrap()).unwrap();
        assert!((angle - expected).abs() < 0.01, "{time_s}: {angle}");
    }
}

/// Noise from an azimuth at a sphere that turns to the left by some degrees in a second; half of the power of the ears is noise.
fn heard(calibration: &Calibration, azimuth_deg: f64, turn_deg: f64) -> Found {
    let rate_hz = 32_000.0;
    let at = |time_s: f64| Waypoint {
        time_s,
        place: Spherical {
            rho_m: 1.6,
            azimuth: (azimuth_deg - turn_deg * time_s).to_radians(),
            elevation: 0.0,
        },
    };
    let mut ears = binaural(&Head::Sphere(0.0875), &noise(5, 32_000, "source"), rate_hz, &[at(0.0), at(1.0)]);
    add_noise(&mut ears, 0.0, 6);
    let independent = std::array::from_fn(|band| calibration.independent[band]);
    let mut unit = BinauralUnit::new(rate_hz, &independent);
    let mut turns = Turns::default();
    for (part, (left, right)) in ears[0].chunks(3200).zip(ears[1].chunks(3200)).enumerate() {
        let mut cues = unit.silence();
        unit.add(left, right, &mut cues);
        let half = (0.5 * turn_deg * 0.1 * (part as f64 + 0.5)).to_radians();
        turns.push([half.cos(), 0.0, 0.0, half.sin()], &cues);
    }
    Listening::new(calibration, Directions::All).unwrap().find_turned(&turns).unwrap()
}

#[test]
fn a_turn_of_the_head_tells_front_from_back() {
    let head = Head::Sphere(0.0875);
    let calibration = Calibration::of(&head, Origin::Sphere { radius_m: 0.0875 }).unwrap();
    // Of a sphere at rest the whole cone is alike: no direction has half.
    let still = heard(&calibration, 30.0, 0.0);
    assert!(still.sources.iter().all(|one| one.probability < 0.5), "{:?}", still.sources.len());
    for azimuth in [30.0, 150.0, -20.0, -160.0] {
        let found = heard(&calibration, azimuth, 20.0);
        let first = &found.sources[0];
        let away = (first.azimuth_deg - azimuth).to_radians();
        let away = away.sin().atan2(away.cos()).to_degrees();
        assert!(away.abs() < 6.0 && first.front_back_mass < 0.02, "{azimuth}: {first:?}");
    }
}
