//! `bvm balance`: a table for a recording, and refusals that leave nothing.

use super::general::{bvm, refuses, succeeds, text};
use serde_json::Value;
use std::fmt::Write;
use tempfile::TempDir;

/// A roll by 90° within 1 s, half a second of rest on both sides, at 100 Hz; rates times `scale`.
fn roll(scale: f64) -> String {
    let mut table = "t_s,gx,gy,gz,ax,ay,az\n".to_owned();
    for step in 0..=200 {
        let (time, turning) = (f64::from(step) * 0.01, (51..=150).contains(&step));
        let angle = (time - 0.5).clamp(0.0, 1.0) * std::f64::consts::FRAC_PI_2;
        let rate = if turning { scale * std::f64::consts::FRAC_PI_2 } else { 0.0 };
        writeln!(table, "{time},{rate},0,0,0,{},{}", 9.80665 * angle.sin(), 9.80665 * angle.cos()).unwrap();
    }
    table
}

#[test]
fn a_table_a_picture_and_a_summary() {
    let folder = TempDir::new().unwrap();
    let [imu, out, plot] = ["imu.csv", "o.csv", "o.png"].map(|name| folder.path().join(name));
    std::fs::write(&imu, roll(1.0)).unwrap();
    let done = succeeds(&[
        "balance",
        "--imu",
        text(&imu),
        "--out",
        text(&out),
        "--plot",
        text(&plot),
        "--json",
        "--initial-heading",
        "-0.5",
    ]);
    let summary: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!((summary["rows"].as_u64(), summary["duration_s"].as_f64()), (Some(201), Some(2.0)));
    assert!((summary["k"].as_f64().unwrap() - 1.0).abs() < 0.02, "{summary}");
    assert!(std::fs::metadata(&plot).unwrap().len() > 1000);
    let table = std::fs::read_to_string(&out).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    assert_eq!(header[..5], ["t_s", "qw", "qx", "qy", "qz"]);
    assert!(header.last().unwrap().contains("w first") && header.iter().all(|name| !name.is_empty()));
    assert_eq!(table.lines().count(), 202);
    let last: Vec<f64> =
        table.lines().last().unwrap().split(',').filter_map(|cell| cell.parse().ok()).collect();
    let at = |name: &str| last[header.iter().position(|own| *own == name).unwrap()];
    // Turned to the right by 0.5, then rolled by 90°: (cos ¼, 0, 0, −sin ¼) (√½, √½, 0, 0), by hand.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let right = [0.25f64.cos() * half, 0.25f64.cos() * half, -0.25f64.sin() * half, -0.25f64.sin() * half];
    for (name, right) in ["qw", "qx", "qy", "qz"].into_iter().zip(right) {
        assert!((at(name) - right).abs() < 0.01, "{name}: {}", at(name));
    }
    assert!((at("grav_y") - 9.8).abs() < 0.1 && at("grav_z").abs() < 0.1 && at("acc_y").abs() < 0.1);
    assert!(at("t_s") == 2.0 && at("sd_heading") > 0.0 && at("sd_wx") > 0.0 && at("sd_grav_x") > 0.0);

    // What a person feels: the roll, with the gain of the canals.
    succeeds(&["balance", "--imu", text(&imu), "--out", text(&out), "--profile", "human"]);
    let table = std::fs::read_to_string(&out).unwrap();
    let middle: Vec<f64> =
        table.lines().nth(101).unwrap().split(',').filter_map(|cell| cell.parse().ok()).collect();
    let felt = middle[header.iter().position(|own| *own == "wx").unwrap()];
    assert!((1.3..1.6).contains(&felt), "of 1.57: {felt}");
}

#[test]
fn refusals_name_the_way_out() {
    let folder = TempDir::new().unwrap();
    let [imu, out] = ["imu.csv", "o.csv"].map(|name| folder.path().join(name));
    let arguments = ["balance", "--imu", text(&imu), "--out", text(&out)];
    std::fs::write(&imu, roll(180.0 / std::f64::consts::PI)).unwrap();
    refuses(&arguments, &["imu.csv", "0.01745", "--rate-unit deg/s"]);
    assert!(!out.exists(), "nothing is left");
    assert!(std::fs::read_dir(folder.path()).unwrap().count() == 1);
    succeeds(&[&arguments, ["--rate-unit", "deg/s"].as_slice()].concat());
    for (content, names) in [
        ("", vec!["the file is empty"]),
        ("t_s,gx,gy,gz,ax,ay,az\n", vec!["there are no rows"]),
        ("t_s,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,9.8\n", vec!["one row"]),
        ("t_s,gx,gy,gz,ax,ay\n0,0,0,0,0,0\n", vec!["no column `az`"]),
        ("t_s,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,9.8\n0.01,0,0,0,0,0\n", vec!["row 3", "6 cells, expected 7"]),
        (
            "t_s,gx,gy,gz,ax,ay,az\n0,nan,0,0,0,0,9.8\n0.01,nan,0,0,0,0,9.8\n",
            vec!["no row has a reading of the gyroscope"],
        ),
    ] {
        std::fs::write(&imu, content).unwrap();
        refuses(&arguments, &names);
    }
    let lines: Vec<String> = roll(1.0).lines().map(str::to_owned).collect();
    let reversed = std::iter::once(&lines[0]).chain(lines[1..].iter().rev());
    let reversed: String = reversed.map(|line| format!("{line}\n")).collect();
    std::fs::write(&imu, reversed).unwrap();
    refuses(&arguments, &["run back at 200 of 201 rows", "reverse order"]);
    // One broken reading: no unit makes it a rate.
    let mut broken = lines;
    broken[80] = "0.79,4e9,0,0,0,0,9.8".to_owned();
    std::fs::write(&imu, broken.join("\n")).unwrap();
    refuses(&arguments, &["row 81", "4e9", "broken"]);
    refuses(&["balance", "--imu", text(&folder.path().join("none.csv")), "--out", text(&out)], &["none.csv"]);
    assert_eq!(bvm(&[&arguments, ["--rate-unit", "mph"].as_slice()].concat()).status.code(), Some(2));
    assert_eq!(bvm(&[&arguments, ["--gyroscope-axes", "x,x,z"].as_slice()].concat()).status.code(), Some(2));
}
