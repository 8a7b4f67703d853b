//! Input files that are too long, or have no end.
//!
//! In: `/dev/zero` and long files instead of pictures, calibrations, fields and readings. Out: one line that names the
//! file and the limit. Invariant: a file is refused before it is read to its end.
#![cfg(unix)]

use std::path::Path;
use std::process::Command;

const ENDLESS: &str = "/dev/zero";

/// `bvm` refuses in one line that holds all of these.
#[track_caller]
fn refuses(folder: &Path, arguments: &[&str], names: &[&str]) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_bvm")).current_dir(folder).args(arguments).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
    assert!(message.starts_with("error: ") && message.lines().count() == 1, "{arguments:?}: {message}");
    names
        .iter()
        .for_each(|name| assert!(message.contains(name), "{arguments:?}: {message} should name {name}"));
    assert!(!folder.join("out").exists(), "{arguments:?}: something is left");
}

#[test]
fn inputs_without_an_end_are_refused() {
    let place = tempfile::TempDir::new().unwrap();
    let folder = place.path();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let picture = [b"P5 8 8 255\n".as_slice(), &[7; 64]].concat();
    write("left.pgm", &picture);
    write("right.pgm", &picture);
    let keys = [
        "focal_px = 9",
        "cx_px = 4",
        "cy_px = 4",
        "baseline_m = 0.1",
        "doffs_px = 0",
        "max_disparity_px = 4",
    ];
    write("pair.toml", keys.join("\n").as_bytes());
    let look = |left, calibration, names: &[&str]| {
        let files =
            ["look", "--left", left, "--right", "right.pgm", "--calibration", calibration, "--out", "out"];
        refuses(folder, &files, names);
    };
    look(ENDLESS, "pair.toml", &[ENDLESS, "more than 256 MiB"]);
    look("left.pgm", ENDLESS, &[ENDLESS, "longer than 1 MiB"]);
    let calibrate =
        ["calibrate", "vision", "--out", "out", "--pair", "left.pgm", "right.pgm", "pair.toml", ENDLESS];
    refuses(folder, &calibrate, &[ENDLESS, "more than 256 MiB"]);
    write("words.toml", b"focal_px = \xff");
    look("left.pgm", "words.toml", &["words.toml", "byte 11 is not UTF-8"]);
    // A recording whose inertial readings have no end, or whose calibration is invalid.
    for camera in ["cam0", "cam1"] {
        std::fs::create_dir(folder.join(camera)).unwrap();
        ["1.png", "2.png"].iter().for_each(|name| write(&format!("{camera}/{name}"), b""));
        write(&format!("{camera}/sensor.yaml"), &vec![b'#'; (1 << 20) + 1]);
    }
    let replay = ["replay", "--recording", ".", "--out", "out"];
    std::os::unix::fs::symlink(ENDLESS, folder.join("imu0.csv")).unwrap();
    refuses(folder, &replay, &["imu0.csv", "more than 256 MiB"]);
    std::fs::remove_file(folder.join("imu0.csv")).unwrap();
    write("imu0.csv", b"1,0,0,0,0,0,9.8\n2,0,0,0,0,0,9.8\n");
    refuses(folder, &replay, &["sensor.yaml", "longer than 1 MiB"]);
}
