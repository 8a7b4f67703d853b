//! `bvm listen`: where the sounds of a recording are.
//!
//! In: a WAV file of two channels, a calibration, and how the head was turned, if it was. Out: for each look (the whole file, or pieces of it) the sources
//! and their probabilities. Invariant: memory does not grow with the length of the file; a look without cues is flat and
//! says why.

mod pictures;

use super::{check_folder, print};
use bvm::audition::wave::WaveReader;
use bvm::audition::{
    Attitudes, AuditionError, BANDS, BinauralUnit, Calibration, Channels, Cues, Directions, Found, Listening,
    PART_S, Parts, Turns,
};
use bvm::error::Error;
use bvm::vestibular::rotation::heading;
use clap::Args;
use pictures::Pictures;
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
    /// Headings of the head over time (CSV): time_s, heading_deg.
    #[arg(
        long,
        value_name = "CSV",
        conflicts_with = "imu",
        help = "Headings of the head over time: CSV with time_s and\nheading_deg (positive to the left), or with\norientations, as of `bvm balance`"
    )]
    heading: Option<PathBuf>,
    /// Recording of an inertial sensor on the head (CSV), with its axes: x ahead, y left, z up.
    #[arg(
        long,
        value_name = "FILE",
        help = "Recording of an inertial sensor on the head (CSV), as\nof `bvm balance`; its axes are those of the head: x\nahead, y left, z up"
    )]
    imu: Option<PathBuf>,
    /// When the sound begins: on the clock of --heading, or after the first row of --imu, s.
    #[arg(
        long,
        value_name = "S",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        help = "When the sound begins: on the clock of --heading, or\nafter the first row of --imu, s"
    )]
    audio_start: f64,
    /// Draw the posterior and the correlogram into this folder (PNG).
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
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
    /// Azimuth of the head's axis ahead at the start and at the end; absent without a heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    heading_deg: Option<[f64; 2]>,
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
    if !arguments.audio_start.is_finite() {
        return Err(AuditionError::Head("--audio-start is not a finite number".to_owned()).into());
    }
    let calibration = Calibration::read(&arguments.calibration)?;
    let mut wave = WaveReader::open(&arguments.wav)?;
    let refuse = |reason: String| AuditionError::File { path: arguments.wav.clone(), reason };
    if wave.channels() != 2 {
        let channels = wave.channels();
        let kind = if channels == 1 { "one channel has no direction" } else { "too many channels" };
        return Err(refuse(format!("{kind}: found {channels}, expected two, left and right")).into());
    }
    let mut attitudes = match (&arguments.heading, &arguments.imu) {
        (Some(path), _) => Some(Attitudes::of_table(path, arguments.audio_start)?),
        (None, Some(path)) => Some(Attitudes::of_inertial(path, arguments.audio_start)?),
        (None, None) => None,
    };
    if let Some(folder) = &arguments.out {
        check_folder(folder)?;
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
    let (mut begin_of_part, mut end_of_part) = (0_u64, frames_of_part);
    let (mut cues, mut heard, mut channels) = (unit.silence(), Heard::default(), Channels::new(rate_hz));
    let mut pictures = arguments.out.is_some().then(Pictures::default);
    let seconds = |frame: u64| frame as f64 / rate_hz;
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
        if (at == end_of_part || ends) && at > begin_of_part {
            let part = std::mem::replace(&mut cues, unit.silence());
            pictures.iter_mut().for_each(|pictures| pictures.hear(&part));
            heard.push(&part, [seconds(begin_of_part), seconds(at)], attitudes.as_mut())?;
            (begin_of_part, end_of_part) = (at, at + frames_of_part);
        }
        if ends {
            let reason = channels.fault();
            let found = match &reason {
                Some(_) => Found::flat(),
                None => heard.find(&mut listening)?,
            };
            let [start_s, end_s] = [first, at].map(seconds);
            let is_heard = reason.is_none().then_some(&listening);
            pictures.iter_mut().for_each(|pictures| pictures.look([start_s, end_s], is_heard));
            let reason = reason.or_else(|| {
                found.sources.is_empty().then(|| "no sound that is coherent between the ears".to_owned())
            });
            let heading_deg = heard.heading_deg;
            let warnings = channels.warnings();
            let look = Look { start_s, end_s, heading_deg, found, reason, warnings };
            tell(&look, arguments.json);
            if !arguments.json && !look.found.sources.is_empty() {
                tell_distances(&listening);
            }
            first = at;
            (heard, channels) = (Heard::default(), Channels::new(rate_hz));
        }
        if is_last {
            break;
        }
    }
    if let (Some(pictures), Some(folder)) = (pictures, &arguments.out) {
        for file in pictures.write(folder, listening.distances_m())? {
            if !arguments.json {
                print(&format!("wrote {}", file.display()));
            }
        }
    }
    Ok(())
}

/// The cues of a look.
#[derive(Default)]
struct Heard {
    parts: Parts,
    turns: Option<Turns>,
    heading_deg: Option<[f64; 2]>,
}

impl Heard {
    /// Adds a part that was heard between two times.
    fn push(
        &mut self,
        part: &Cues,
        [start_s, end_s]: [f64; 2],
        attitudes: Option<&mut Attitudes>,
    ) -> Result<(), Error> {
        self.parts.push(part);
        let Some(attitudes) = attitudes else { return Ok(()) };
        let [first, middle, last] =
            [attitudes.at(start_s)?, attitudes.at(0.5 * (start_s + end_s))?, attitudes.at(end_s)?];
        self.turns.get_or_insert_default().push(middle, part);
        let [first, last] = [first, last].map(|turn| heading(turn).unwrap_or(0.0).to_degrees());
        self.heading_deg = Some([self.heading_deg.map_or(first, |[first, _]| first), last]);
        Ok(())
    }

    fn find(&self, listening: &mut Listening) -> Result<Found, Error> {
        match &self.turns {
            Some(turns) if !turns.is_ahead() => listening.find_turned(turns),
            _ => listening.find_voices(self.parts.all()),
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

/// The posterior of the distance, as bars.
fn tell_distances(listening: &Listening) {
    let (_, of_distance) = listening.pictured([1, 1]);
    for (distance, p) in listening.distances_m().iter().zip(&of_distance) {
        let bar = "\u{2588}".repeat((40.0 * p.min(1.0)).round() as usize);
        print(&format!("  {distance:5.2} m  {p:.3} {bar}"));
    }
}
