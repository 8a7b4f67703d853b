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
