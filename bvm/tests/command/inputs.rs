//! Input files that are too long, have no end, or do not fit each other.
//!
//! In: `/dev/zero` and long files instead of pictures, calibrations, fields and readings; pictures of other sizes. Out: one
//! line that names the file, and the limit or what was expected. Invariant: a file is refused before it is read to its end.
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

/// A folder with a pair of 8 x 8 pixels, and its calibration.
fn pair() -> tempfile::TempDir {
    let place = tempfile::TempDir::new().unwrap();
    let picture = [b"P5 8 8 255\n".as_slice(), &[7; 64]].concat();
    let keys = "focal_px = 9\ncx_px = 4\ncy_px = 4\nbaseline_m = 0.1\ndoffs_px = 0\nmax_disparity_px = 4";
    for (name, bytes) in
        [("left.pgm", picture.as_slice()), ("right.pgm", &picture), ("pair.toml", keys.as_bytes())]
    {
        std::fs::write(place.path().join(name), bytes).unwrap();
    }
    place
}

#[test]
fn files_that_do_not_fit_each_other_are_named() {
    let place = pair();
    let folder = place.path();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let look = |right: &str, calibration: &str, names: &[&str]| {
        let pair = ["--left", "left.pgm", "--right", right, "--calibration", calibration, "--out", "out"];
        refuses(folder, &[["look"].as_slice(), &pair].concat(), names);
    };
    write("wide.pgm", &[b"P5 9 8 255\n".as_slice(), &[7; 72]].concat());
    look("wide.pgm", "pair.toml", &["`wide.pgm`", "is 9x8", "`left.pgm`, is 8x8"]);
    std::fs::create_dir(folder.join("rig")).unwrap();
    look("right.pgm", "rig", &["`rig`: a folder is a EuRoC recording", "`cam0/sensor.yaml`", "are files"]);
    let keys = std::fs::read_to_string(folder.join("pair.toml")).unwrap();
    write("far.toml", keys.replace("px = 4", "px = 4000000000").replacen("4000000000", "4", 2).as_bytes());
    let names =
        ["`far.toml`: 4000000000 disparities", "`max_disparity_px`", "8 pixels wide", "fewer than the width"];
    look("right.pgm", "far.toml", &names);
    let files = ["left.pgm", "right.pgm", "pair.toml", "wide.pgm"];
    let calibrate = [["calibrate", "vision", "--out", "out", "--pair"].as_slice(), &files].concat();
    refuses(folder, &calibrate, &["`wide.pgm`: the truth is 9x8", "left picture is 8x8"]);
}

#[test]
fn inputs_without_an_end_are_refused() {
    let place = pair();
    let folder = place.path();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
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
