//! `bvm explore`: scenes, senses, mistakes, interruption.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

fn bvm(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bvm")).args(arguments).output().unwrap()
}

fn refused(arguments: &[&str], expected: &str) {
    let output = bvm(arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && message.contains(expected), "{arguments:?}: {message}");
    assert!(!message.contains("panicked"), "{message}");
}

fn figures(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("run.json")).unwrap()).unwrap()
}

#[test]
fn what_cannot_be_explored_is_refused() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, out) = (path("my.toml"), path("out"));
    std::fs::write(&scene, "title = 'x'\n[room]\nmin = [-1, -1, -1]\nmax = [1, 1, nan]\n").unwrap();
    refused(&["explore", "--scene", &scene, "--out", &out], "my.toml` line 4, column 7: found nan");
    let huge = path("huge.toml");
    std::fs::write(&huge, "title = 'x'\n[room]\nmin = [-1, -1, -1]\nmax = [1, 1e30, 1]\n").unwrap();
    refused(&["explore", "--scene", &huge, "--out", &out], "expected a wall within 1000 m of the head");
    refused(
        &["explore", "--scene", "kitchen", "--out", &out],
        "there is no scene `kitchen`: expected furnished",
    );
    refused(&["explore", "--scene", &path("none.toml"), "--out", &out], "none.toml");
    refused(&["explore", "--steps", "0", "--out", &out], "0 is not in 1..=100000");
    refused(&["explore", "--senses", "depth,stereo", "--out", &out], "depth goes with no other sense");
    refused(&["explore", "--senses", "smell", "--out", &out], "invalid value 'smell'");
    refused(&["explore", "--senses", "imu", "--evidence", "hard", "--out", &out], "--evidence hard is for");
    assert!(!Path::new(&out).exists(), "nothing is left behind");
    let file = path("file");
    std::fs::write(&file, "").unwrap();
    refused(&["explore", "--scene", "empty", "--steps", "1", "--out", &file], "cannot write into the folder");
}

#[test]
fn all_senses_explore_a_scene() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("run");
    let arguments = ["explore", "--scene", "door", "--senses", "stereo,audio,imu", "--steps", "2", "--out"];
    let output = bvm(&[&arguments[..], &[out.to_str().unwrap()]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains("scene         door: A door opens")
            && text.lines().all(|line| line.chars().count() <= 80)
    );
    let run = &figures(&out)["run"];
    assert_eq!(run["senses"], serde_json::json!(["stereo", "audio", "imu"]));
    assert_eq!((&run["ended"], run["looks"].as_array().unwrap().len()), (&Value::from("steps"), 2));
    assert!(run["looks"][0]["senses"][0]["readings"].as_u64().unwrap() > 200, "{run}");
    for name in ["cameras.png", "top_view.png", "occupancy_panorama.png"] {
        bvm::vision::image::read(&out.join(name)).unwrap();
    }
    assert!(std::fs::read_dir(&out).unwrap().all(|entry| {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        !name.starts_with("checkpoint")
    }));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_is_kept_and_goes_on() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("run");
    let arguments = |steps: &str| {
        let all = ["explore", "--scene", "empty", "--senses", "imu", "--steps", steps, "--out"];
        all.iter()
            .map(|part| (*part).to_owned())
            .chain([out.to_str().unwrap().to_owned()])
            .collect::<Vec<_>>()
    };
    let mut child = Command::new(env!("CARGO_BIN_EXE_bvm"));
    let mut child = child.args(arguments("100000")).stderr(std::process::Stdio::null()).spawn().unwrap();
    let checkpoint = out.join("checkpoint-inhibited.bvm");
    for _ in 0..600 {
        if checkpoint.exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(child.wait().unwrap().success());
    let first = figures(&out);
    let looks = first["run"]["looks"].as_array().unwrap().len();
    assert_eq!(first["run"]["ended"], "interrupted");
    assert!(looks > 0 && checkpoint.exists());
    refused(
        &["explore", "--scene", "box", "--senses", "imu", "--resume", "--out", out.to_str().unwrap()],
        "it is of a run with scene empty, seed 1, senses imu, evidence virtual, not with scene box",
    );
    let more = arguments(&(looks + 1).to_string());
    let more: Vec<&str> = more.iter().map(String::as_str).chain(["--resume"]).collect();
    assert!(bvm(&more).status.success());
    let second = figures(&out);
    assert_eq!(second["run"]["resumed_after"], looks);
    assert_eq!(second["run"]["looks"].as_array().unwrap().len(), looks + 1);
    assert_eq!(second["run"]["looks"][0]["next"], first["run"]["looks"][0]["next"]);
    assert!(!checkpoint.exists(), "a complete run needs no checkpoint");
}
