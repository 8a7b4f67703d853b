//! `bvm listen`: where the sounds of a recording are.
//!
//! In: a WAV file of two channels, and a calibration. Out: for each look (the whole file, or pieces of it) the sources
//! and their probabilities. Invariant: memory does not grow with the length of the file; a look without cues is flat and
//! says why.

use super::print;
use bvm::audition::wave::WaveReader;
use bvm::audition::{
    AuditionError, BANDS, BinauralUnit, Calibration, Channels, Directions, Found, Listening, PART_S, Parts,
};
use bvm::error::Error;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Frames that are read at once.
const BLOCK: usize = 4096;

/// Find the sources of a binaural recording.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  bvm listen --wav in.wav --calibration head.json\n  bvm listen --wav in.wav --calibration head.json --every 0.5 --json\n\n\
Azimuth is counter-clockwise, positive to the left; elevation is positive\n\
upwards. A look is reported when it ends: its length is the latency.\n\n\
A look without cues (silence, two equal channels, the delay of a device) is\n\
flat: it has no direction, and says why."
)]
pub(crate) struct Arguments {
    /// The recording (WAV, two channels: left, right).
    #[arg(long, value_name = "FILE")]
    wav: PathBuf,
    /// Calibration of the head.
    #[arg(long, value_name = "FILE")]
    calibration: PathBuf,
    /// Length of a look, s [default: the whole file].
    #[arg(long, value_name = "S")]
    every: Option<f64>,
    /// Directions that are searched: all, or the front half of the horizontal plane.
    #[arg(long, value_name = "NAME", value_enum, default_value_t)]
    directions: DirectionsName,
    /// Print one JSON object for each look.
    #[arg(long)]
    json: bool,
}

/// [`Directions`], as an argument.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum DirectionsName {
    #[default]
    All,
    Frontal,
}

/// A look.
#[derive(Serialize)]
struct Look {
    start_s: f64,
    end_s: f64,
    #[serde(flatten)]
    found: Found,
    /// Why the look is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    if let Some(every) = arguments.every.filter(|every| !(0.02..=1e6).contains(every)) {
        return Err(AuditionError::Head(format!("--every is {every} s: expected at least 0.02")).into());
    }
    let calibration = Calibration::read(&arguments.calibration)?;
    let mut wave = WaveReader::open(&arguments.wav)?;
    let refuse = |reason: String| AuditionError::File { path: arguments.wav.clone(), reason };
    if wave.channels() != 2 {
        let channels = wave.channels();
        let kind = if channels == 1 { "one channel has no direction" } else { "too many channels" };
        return Err(refuse(format!("{kind}: found {channels}, expected two, left and right")).into());
    }
    let directions = match arguments.directions {
        DirectionsName::All => Directions::All,
        DirectionsName::Frontal => Directions::Frontal,
    };
    let mut listening = Listening::new(&calibration, directions)?;
    let independent: [f64; BANDS] = std::array::from_fn(|band| calibration.independent[band]);
    let rate_hz = wave.rate_hz();
    let mut unit = BinauralUnit::new(rate_hz, &independent);
    let frames_of_look = arguments.every.map(|every| ((every * rate_hz).round() as u64).max(1));
    let (mut first, mut at) = (0_u64, 0_u64);
    let frames_of_part = ((PART_S * rate_hz).round() as u64).max(1);
    let mut end_of_part = frames_of_part;
    let (mut cues, mut parts, mut channels) = (unit.silence(), Parts::default(), Channels::new(rate_hz));
    loop {
        let end = frames_of_look.map(|frames| first + frames);
        let next = end.map_or(end_of_part, |end| end.min(end_of_part));
        let most = BLOCK.min((next - at) as usize);
        let block = wave.read(most)?;
        let [left, right] = [&block[0], &block[1]];
        unit.add(left, right, &mut cues);
        channels.add(left, right);
        at += left.len() as u64;
        let is_last = left.is_empty();
        if at == 0 && is_last {
            return Err(refuse("there are no samples".to_owned()).into());
        }
        let ends = (is_last && at > first) || end == Some(at);
        if at == end_of_part || ends {
            parts.push(&std::mem::replace(&mut cues, unit.silence()));
            end_of_part = at + frames_of_part;
        }
        if ends {
            let reason = channels.fault();
            let found = match &reason {
                Some(_) => Found::flat(),
                None => listening.find_voices(parts.all())?,
            };
            let [start_s, end_s] = [first, at].map(|frame| frame as f64 / rate_hz);
            let reason = reason.or_else(|| {
                found.sources.is_empty().then(|| "no sound that is coherent between the ears".to_owned())
            });
            tell(&Look { start_s, end_s, found, reason, warnings: channels.warnings() }, arguments.json);
            first = at;
            (parts, channels) = (Parts::default(), Channels::new(rate_hz));
        }
        if is_last {
            return Ok(());
        }
    }
}

fn tell(look: &Look, json: bool) {
    if json {
        return print(&serde_json::to_string(look).expect("internal: a look is numbers"));
    }
    print(&format!("{:.2} to {:.2} s", look.start_s, look.end_s));
    for warning in &look.warnings {
        print(&format!("  warning: {warning}"));
    }
    if let Some(reason) = &look.reason {
        print(&format!("  no direction: {reason}"));
    }
    for source in &look.found.sources {
        print(&format!(
            "  azimuth {:6.1}°, elevation {:5.1}°, {:.2} m: probability {:.3} within 10°",
            source.azimuth_deg, source.elevation_deg, source.distance_m, source.probability
        ));
    }
}
