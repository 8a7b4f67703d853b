//! WAV files of every kind, channels that are no ears, SOFA files.
//!
//! In: bytes written by hand; the files of `shared`, where they are. Out: samples, or errors that name the reason.

use crate::noise;
use bvm::audition::wave::{WaveReader, encode};
use bvm::audition::{AuditionError, BANDS, BinauralUnit, Calibration, Channels, Head, Origin, sofa};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A format chunk: tag, channels, rate, container bytes, bits.
fn format(tag: u16, channels: u16, rate: u32, width: u16, bits: u16) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend(tag.to_le_bytes());
    body.extend(channels.to_le_bytes());
    body.extend(rate.to_le_bytes());
    body.extend((rate * u32::from(width * channels)).to_le_bytes());
    body.extend((width * channels).to_le_bytes());
    body.extend(bits.to_le_bytes());
    body
}

fn chunk(name: &[u8; 4], length: u32, body: &[u8]) -> Vec<u8> {
    let mut bytes = name.to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(body);
    bytes.extend(vec![0; body.len() % 2]);
    bytes
}

fn wave(chunks: &[Vec<u8>]) -> Vec<u8> {
    let body: Vec<u8> = chunks.concat();
    [b"RIFF".as_slice(), &(body.len() as u32 + 4).to_le_bytes(), b"WAVE", &body].concat()
}

fn read(bytes: &[u8]) -> Result<Vec<Vec<f64>>, AuditionError> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("sound.wav");
    std::fs::write(&path, bytes).unwrap();
    WaveReader::open(&path)?.read(1000)
}

#[test]
fn codings_of_samples_are_read() {
    let data = |length: u32, body: &[u8]| chunk(b"data", length, body);
    let plain = |tag, width, bits, body: &[u8]| {
        wave(&[chunk(b"fmt ", 16, &format(tag, 1, 16_000, width, bits)), data(body.len() as u32, body)])
    };
    // ½ and −1, or the nearest.
    for (bytes, expected) in [
        (plain(1, 1, 8, &[192, 0]), [0.5, -1.0]),
        (plain(1, 2, 16, &[0, 0x40, 0, 0x80]), [0.5, -1.0]),
        (plain(1, 3, 24, &[0, 0, 0x40, 0, 0, 0x80]), [0.5, -1.0]),
        // 24 bits in a container of 32, left-justified.
        (plain(1, 4, 24, &[0, 0, 0, 0x40, 0, 0, 0, 0x80]), [0.5, -1.0]),
        (plain(3, 4, 32, &[0.5_f32.to_le_bytes(), (-1.0_f32).to_le_bytes()].concat()), [0.5, -1.0]),
        (plain(3, 8, 64, &[0.5_f64.to_le_bytes(), (-1.0_f64).to_le_bytes()].concat()), [0.5, -1.0]),
    ] {
        assert_eq!(read(&bytes).unwrap(), [expected.to_vec()]);
    }
}

#[test]
fn lengths_are_limits_and_chunks_have_pad_bytes() {
    let samples = [0, 0x40, 0, 0x80];
    let head = chunk(b"fmt ", 16, &format(1, 1, 16_000, 2, 16));
    for length in [4, 0, 0xFFFF_FFFF, 4000] {
        let bytes = wave(&[chunk(b"LIST", 13, &[7; 13]), head.clone(), chunk(b"data", length, &samples)]);
        assert_eq!(read(&bytes).unwrap(), [[0.5, -1.0]], "{length}");
    }
    // What stands behind the data is no sound; half a frame is none.
    let bytes = wave(&[head.clone(), chunk(b"data", 4, &samples), chunk(b"LIST", 4, &[9; 4])]);
    assert_eq!(read(&bytes).unwrap(), [[0.5, -1.0]]);
    let mut cut = wave(&[head.clone(), chunk(b"data", 400, &samples)]);
    cut.pop();
    assert_eq!(read(&cut).unwrap(), [[0.5]]);
    // RIFX has its numbers the other way round.
    let mut other = [b"RIFX".as_slice(), &100_u32.to_be_bytes(), b"WAVEfmt ", &16_u32.to_be_bytes()].concat();
    other.extend([0, 1, 0, 1, 0, 0, 0x3E, 0x80, 0, 0, 0x7D, 0, 0, 2, 0, 16]);
    other.extend([b"data".as_slice(), &4_u32.to_be_bytes(), &[0x40, 0, 0x80, 0]].concat());
    assert_eq!(read(&other).unwrap(), [[0.5, -1.0]]);
    // RF64 has the length in its ds64 chunk.
    let mut sizes = vec![0; 28];
    sizes[8..16].copy_from_slice(&4_u64.to_le_bytes());
    let mut long =
        wave(&[chunk(b"ds64", 28, &sizes), head, chunk(b"data", 0xFFFF_FFFF, &samples), vec![1; 20]]);
    long[..4].copy_from_slice(b"RF64");
    assert_eq!(read(&long).unwrap(), [[0.5, -1.0]]);
}

#[test]
fn what_is_no_wave_file_is_named() {
    let head = |tag, width, rate| chunk(b"fmt ", 16, &format(tag, 1, rate, width, 8 * width));
    let data = chunk(b"data", 4, &[0; 4]);
    for (bytes, name) in [
        (b"fLaC0000000000000".to_vec(), "FLAC"),
        (Vec::new(), "empty"),
        (wave(&[head(6, 1, 8000), data.clone()]), "A-law"),
        (wave(&[head(1, 2, 4000), data.clone()]), "4000 Hz"),
        (wave(&[head(1, 2, 16_000)]), "before its data chunk"),
        (wave(std::slice::from_ref(&data)), "before the format chunk"),
        (wave(&[head(3, 4, 16_000), chunk(b"data", 4, &f32::NAN.to_le_bytes())]), "not a finite number"),
    ] {
        let error = read(&bytes).unwrap_err().to_string();
        assert!(error.contains(name), "{error} should name {name}");
    }
}

#[test]
fn what_is_written_is_read() {
    let sound = [vec![0.5, -0.25, 0.0], vec![1.0, 0.125, -1.0]];
    assert_eq!(read(&encode(44_100, &sound)).unwrap(), sound);
}

#[test]
fn channels_that_are_no_ears_are_named() {
    let sound = noise(5, 16_000, "sound");
    let late = |samples: usize, gain: f64| -> Vec<f64> {
        (0..16_000).map(|n| if n < samples { 0.0 } else { gain * sound[n - samples] }).collect()
    };
    let fault = |left: &[f64], right: &[f64]| {
        let mut channels = Channels::new(16_000.0);
        channels.add(left, right);
        (channels.fault(), channels.warnings())
    };
    for (right, name) in [
        (sound.clone(), "the same to the bit"),
        (late(80, 0.9), "right channel is 5.0 ms late"),
        (late(3, -0.8), "inverted polarity"),
        (vec![0.0; 16_000], "right channel is silent"),
    ] {
        let reason = fault(&sound, &right).0.unwrap_or_default();
        assert!(reason.contains(name), "{reason} should say {name}");
    }
    assert_eq!(fault(&vec![0.0; 100], &vec![0.0; 100]).0.as_deref(), Some("silence"));
    // Half a millisecond, and independent noises, are those of ears.
    assert_eq!(fault(&sound, &late(8, 0.5)), (None, Vec::new()));
    assert_eq!(fault(&sound, &noise(5, 16_000, "other")), (None, Vec::new()));
    let offset: Vec<f64> = sound.iter().map(|value| value + 0.5).collect();
    let clipped: Vec<f64> = sound.iter().map(|value| (20.0 * value).clamp(-1.0, 1.0)).collect();
    assert!(fault(&offset, &late(8, 0.5)).1[0].contains("offset of 0.5"));
    assert!(fault(&clipped, &late(8, 0.5)).1[0].contains("full scale"));
}

/// A file of the test data, if they are there.
fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(path);
    if found.exists() {
        return Some(found);
    }
    eprintln!("skipped: {} is not there", found.display());
    None
}

#[test]
fn ears_and_delays_of_sofa_files_are_those_that_they_say() {
    // A sphere of 8.75 cm by Woodworth: at azimuth 90 the left ear leads by 655.8 µs. In `right_first` the first receiver is
    // the right ear; in `delay_m_r` the delays are in `Data.Delay`.
    for case in ["00/head", "02/right_first", "04/delay_m_r"] {
        let Some(path) = shared(&format!("cases/senses/{case}.sofa")) else { return };
        let (responses, _) = sofa::read(&path).unwrap();
        let left = responses
            .measured
            .iter()
            .find(|one| (one.place.azimuth.to_degrees() - 90.0).abs() < 1.0)
            .unwrap();
        let peak = |ear: &[f64]| {
            let top =
                (1..ear.len() - 1).fold(1, |top, at| if ear[at].abs() > ear[top].abs() { at } else { top });
            let [before, here, after] = [ear[top - 1], ear[top], ear[top + 1]];
            (top as f64 + 0.5 * (before - after) / (before - 2.0 * here + after)) / responses.rate_hz
        };
        let itd_us = 1e6 * (peak(&left.ears[1]) - peak(&left.ears[0]));
        assert!((itd_us - 655.8).abs() < 6.0, "{case}: {itd_us} µs");
    }
}

#[test]
fn clockwise_azimuths_are_refused_or_mirrored() {
    let Some(path) = shared("cases/senses/01/clockwise.sofa") else { return };
    let (responses, _) = sofa::read(&path).unwrap();
    let origin = Origin::Sphere { radius_m: 0.0875 };
    let error = Calibration::of(&Head::Measured(responses.clone()), origin.clone()).unwrap_err().to_string();
    assert!(error.contains("counted clockwise") && error.contains("--mirror"), "{error}");
    let mirrored = Calibration::of(&Head::Measured(responses.mirrored()), origin).unwrap();
    // Woodworth, 655.8 µs.
    assert!((mirrored.largest_itd_us() - 655.8).abs() < 15.0, "{}", mirrored.largest_itd_us());
}

#[test]
fn what_is_no_sofa_file_is_named() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("head.sofa");
    std::fs::write(&path, b"no head").unwrap();
    assert!(sofa::read(&path).unwrap_err().to_string().contains("not a SOFA file"));
    let Some(whole) = shared("cases/senses/00/head.sofa") else { return };
    let bytes = std::fs::read(whole).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(sofa::read(&path).unwrap_err().to_string().contains("cut off"));
}

#[test]
fn recordings_of_every_length_say_the_same() {
    // 4000 frames from azimuth +60, whose header lies about their number.
    let mut found = Vec::new();
    for name in ["13/pipe_ffffffff", "13/too_long", "13/zero", "14/odd_chunk", "13/cut_mid_frame"] {
        let Some(path) = shared(&format!("cases/senses/{name}.wav")) else { return };
        let mut wave = WaveReader::open(&path).unwrap();
        let sound = wave.read(10_000).unwrap();
        assert_eq!(sound[0].len(), if name.contains("cut") { 3999 } else { 4000 }, "{name}");
        let cues = BinauralUnit::new(wave.rate_hz(), &[0.5; BANDS]).hear(&sound[0], &sound[1]).bands();
        // Woodworth at 60°: (a/c) (π/3 + sin 60°) = 488 µs.
        assert!((cues[9].itd_s - 488e-6).abs() < 15e-6, "{name}: {}", cues[9].itd_s);
        found.push(sound[0][..3999].to_vec());
    }
    assert!(found.windows(2).all(|pair| pair[0] == pair[1]));
}
