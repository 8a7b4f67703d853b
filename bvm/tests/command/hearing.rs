//! `bvm calibrate audition`, `synth` and `listen`, one after the other.
//!
//! In: a sound of one channel that is made here. Out: the direction that it was given; errors that name their reason.

use super::general::{bvm, refuses, succeeds, text};
use bvm::audition::wave::encode;
use serde_json::Value;
use tempfile::TempDir;

/// Noise that is the same on every machine: half a second at 16 kHz.
fn noise() -> Vec<f64> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    (0..8000).map(|_| next()).collect()
}

#[test]
fn a_sound_is_calibrated_made_and_heard() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let [dry, head, wet] = ["dry.wav", "head.json", "wet.wav"].map(path);
    std::fs::write(&dry, encode(16_000, &[noise()])).unwrap();
    succeeds(&["calibrate", "audition", "--sphere", "--out", text(&head)]);
    assert!(std::fs::metadata(&head).unwrap().len() < 5 << 20, "under 5 MB");
    let listen = |file, more: &[&str]| {
        let found = succeeds(
            &[&["listen", "--wav", text(file), "--calibration", text(&head), "--json"], more].concat(),
        );
        let lines = String::from_utf8(found.stdout).unwrap();
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect::<Vec<Value>>()
    };
    for azimuth in ["30", "-60"] {
        let place = ["--azimuth", azimuth, "--snr", "20", "--out", text(&wet)];
        let head = ["--calibration", text(&head), "--source", text(&dry)];
        succeeds(&[&["synth"], head.as_slice(), &place].concat());
        let looks = listen(&wet, &["--directions", "frontal"]);
        let first = &looks[0]["sources"][0];
        let found = first["azimuth_deg"].as_f64().unwrap();
        let truth: f64 = azimuth.parse().unwrap();
        assert!(looks.len() == 1 && (found - truth).abs() < 3.0, "{azimuth}: {found}");
        assert!(looks[0]["flat"] == false && first["probability"].as_f64().unwrap() > 0.8);
        assert!(first["region90"].as_array().unwrap().len() <= 200);
    }
    // 0.25 s each; the last one is what is left.
    let looks = listen(&wet, &["--every", "0.25"]);
    assert!(looks.len() == 3 && looks[1]["start_s"] == 0.25 && looks[1]["end_s"] == 0.5, "{looks:?}");
    // Equal channels carry no cue.
    std::fs::write(&wet, encode(16_000, &[noise(), noise()])).unwrap();
    let looks = listen(&wet, &[]);
    assert_eq!((&looks[0]["flat"], looks[0]["sources"].as_array().unwrap().len()), (&Value::Bool(true), 0));
    assert!(looks[0]["reason"].as_str().unwrap().contains("the same to the bit"));

    refuses(&["listen", "--wav", text(&dry), "--calibration", text(&head)], &["dry.wav", "one channel"]);
    refuses(
        &["listen", "--wav", text(&head), "--calibration", text(&head)],
        &["head.json", "not a WAV file"],
    );
    std::fs::write(&head, "{}").unwrap();
    refuses(
        &["listen", "--wav", text(&wet), "--calibration", text(&head)],
        &["head.json", "not a calibration"],
    );
    refuses(
        &["synth", "--sphere", "--source", text(&wet), "--out", text(&path("no.wav"))],
        &["wet.wav", "2 channels: a source has one"],
    );
    refuses(
        &["calibrate", "audition", "--hrir", text(&dry), "--out", text(&head)],
        &["dry.wav", "not a SOFA file"],
    );
    assert_eq!(bvm(&["calibrate", "audition"]).status.code(), Some(2), "a head is needed");
}

/// A folder with `head.json` of a sphere, and the paths of files in it.
fn sphere() -> (TempDir, impl Fn(&str) -> std::path::PathBuf) {
    let folder = TempDir::new().unwrap();
    let root = folder.path().to_path_buf();
    let path = move |name: &str| root.join(name);
    succeeds(&["calibrate", "audition", "--sphere", "--out", text(&path("head.json"))]);
    (folder, path)
}

fn looks(arguments: &[&str]) -> Vec<Value> {
    let found = succeeds(&[&["listen", "--json"], arguments].concat());
    let lines = String::from_utf8(found.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_turn_and_two_sources_are_made_and_heard() {
    let (_folder, path) = sphere();
    let [dry, head, wet, places, headings, drawn] =
        ["dry.wav", "head.json", "wet.wav", "path.csv", "heading.csv", "drawn"].map(&path);
    let (dry, head, wet) = (text(&dry), text(&head), text(&wet));
    std::fs::write(dry, encode(16_000, &[[noise(), noise(), noise()].concat()])).unwrap();
    // Behind on the left, while the head turns by 30 degrees to the left in 1.5 s.
    std::fs::write(&places, "time_s,azimuth_deg,elevation_deg,distance_m\n0,140,0,1.6\n1.5,110,0,1.6\n")
        .unwrap();
    std::fs::write(&headings, "time_s,heading_deg\n0,0\n1.5,30\n").unwrap();
    succeeds(&["synth", "--sphere", "--source", dry, "--path", text(&places), "--out", wet]);
    let found =
        looks(&["--wav", wet, "--calibration", head, "--heading", text(&headings), "--out", text(&drawn)]);
    let first = &found[0]["sources"][0];
    assert!((first["azimuth_deg"].as_f64().unwrap() - 140.0).abs() < 6.0, "{first}");
    assert!(first["front_back_mass"].as_f64().unwrap() < 0.05, "{first}");
    let [start, end] = [0, 1].map(|at| found[0]["heading_deg"][at].as_f64().unwrap());
    assert!(start.abs() < 0.1 && (end - 30.0).abs() < 0.5, "{start} {end}");
    for name in ["panorama.png", "course.png", "distance.png", "correlogram.png"] {
        assert!(std::fs::read(drawn.join(name)).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    std::fs::write(&headings, "time_s,heading_deg\n0,0\n1,20\n").unwrap();
    let short = ["listen", "--wav", wet, "--calibration", head, "--heading", text(&headings)];
    refuses(&short, &["heading.csv", "ends at 1.000 s, before the sound"]);

    let other = path("other.wav");
    let reversed: Vec<f64> = noise().into_iter().rev().collect();
    std::fs::write(&other, encode(16_000, &[reversed])).unwrap();
    let places = ["--azimuth", "35", "--azimuth", "-25", "--out", wet];
    succeeds(
        &[&["synth", "--sphere", "--source", dry, "--source", text(&other)], places.as_slice()].concat(),
    );
    let three = ["--azimuth", "1", "--azimuth", "2", "--azimuth", "3", "--out", wet];
    let sources = ["synth", "--sphere", "--source", dry, "--source", text(&other)];
    refuses(&[sources.as_slice(), &three].concat(), &["--azimuth is given 3 times, and there are 2 sources"]);
}

#[test]
fn channels_that_are_no_ears_are_flat_with_their_reason_or_warned_of() {
    let (_folder, path) = sphere();
    let [head, wet] = ["head.json", "wet.wav"].map(&path);
    let (head, wet) = (text(&head), text(&wet));
    let sound = noise();
    let late = |samples: usize, gain: f64| -> Vec<f64> {
        (0..8000).map(|n| if n < samples { 0.0 } else { gain * sound[n - samples] }).collect()
    };
    let nothing = vec![0.0; 8000];
    let heard = |rate: u32, channels: &[Vec<f64>]| {
        std::fs::write(wet, encode(rate, channels)).unwrap();
        looks(&["--wav", wet, "--calibration", head]).remove(0)
    };
    for (channels, reason) in [
        ([nothing.clone(), nothing.clone()], "silence"),
        ([sound.clone(), nothing], "the right channel is silent"),
        ([sound.clone(), late(80, 0.9)], "the right channel is 5.0 ms late"),
        ([sound.clone(), late(2, -0.8)], "inverted polarity"),
    ] {
        let look = heard(16_000, &channels);
        assert!(look["flat"] == true && look["reason"].as_str().unwrap().contains(reason), "{look}");
    }
    let clipped = |ear: Vec<f64>| ear.iter().map(|value| (6.0 * value).clamp(-1.0, 1.0)).collect();
    let offset = |ear: Vec<f64>| ear.iter().map(|value| 0.1 * value + 0.3).collect();
    for (channels, warning) in [
        ([clipped(sound.clone()), clipped(late(3, 0.9))], "clipped?"),
        ([offset(sound.clone()), offset(late(3, 0.9))], "offset"),
    ] {
        let look = heard(16_000, &channels);
        assert!(look["warnings"][0].as_str().unwrap().contains(warning), "{look}");
    }
    // Lowest and highest rates; time differences are kept in seconds. 2 samples at 8 kHz, 48 at 192 kHz: 250 µs, about 22 degrees.
    for (rate, delay) in [(8_000, 2), (192_000, 48)] {
        let look = heard(rate, &[late(0, 0.9), late(delay, 0.8)]);
        let azimuth = look["sources"][0]["azimuth_deg"].as_f64().unwrap().to_radians();
        let elevation = look["sources"][0]["elevation_deg"].as_f64().unwrap().to_radians();
        let lateral = (azimuth.sin() * elevation.cos()).asin().to_degrees();
        assert!((lateral - 22.0).abs() < 10.0, "{rate}: {lateral}");
    }
    std::fs::write(wet, encode(16_000, &[sound.clone(), sound.clone(), sound])).unwrap();
    refuses(&["listen", "--wav", wet, "--calibration", head], &["too many channels: found 3"]);
}
