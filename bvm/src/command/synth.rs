//! `bvm synth`: a binaural test sound.
//!
//! In: sounds of one channel, a head, a place or a path for each, a ratio of signal to noise. Out: a WAV file of two channels.
//! Invariant: a measured head has the checksum of its calibration.

use super::print;
use bvm::audition::synthesis::{Waypoint, add_noise, binaural};
use bvm::audition::wave::{WaveReader, encode};
use bvm::audition::{AuditionError, Calibration, Head, Origin, checksum, resampled, sofa, sphere};
use bvm::error::Error;
use bvm::frame::Spherical;
use bvm::report::write_atomically;
use clap::Args;
use std::path::{Path, PathBuf};

/// Most samples of a source: ten minutes at 192 kHz.
const MOST_SAMPLES: usize = 115_200_000;

/// Make a binaural test sound.
#[derive(Args)]
#[command(after_help = "Examples:\n  bvm synth --sphere --source speech.wav --azimuth 30 --out left.wav\n  \
bvm synth --calibration h.json --source a.wav --azimuth 60 --snr 9 --out b.wav\n  \
bvm synth --sphere --source speech.wav --path path.csv --out moving.wav\n\n\
The path is CSV with the columns time_s, azimuth_deg, elevation_deg and\n\
distance_m; between its rows they change evenly. Azimuth is positive to the\n\
left.")]
pub(crate) struct Arguments {
    /// The head of this calibration.
    #[arg(long, value_name = "FILE", required_unless_present = "sphere", conflicts_with = "sphere")]
    calibration: Option<PathBuf>,
    /// A rigid sphere.
    #[arg(long)]
    sphere: bool,
    /// A sound (WAV, one channel); several sound together, each with the place of its number.
    #[arg(
        long,
        value_name = "WAV",
        required = true,
        help = "A sound (WAV, one channel); several sound together:\nthe places may be repeated as well, or are the same"
    )]
    source: Vec<PathBuf>,
    /// Azimuth, degrees.
    #[arg(long, value_name = "DEG", default_value = "0", allow_negative_numbers = true)]
    azimuth: Vec<f64>,
    /// Elevation, degrees.
    #[arg(long, value_name = "DEG", default_value = "0", allow_negative_numbers = true)]
    elevation: Vec<f64>,
    /// Distance, m.
    #[arg(long, value_name = "M", default_value = "1.6")]
    distance: Vec<f64>,
    /// Places over time (CSV), instead of one place; one for each sound.
    #[arg(long, value_name = "CSV", conflicts_with_all = ["azimuth", "elevation", "distance"])]
    path: Vec<PathBuf>,
    /// Add white noise to each ear at this ratio of signal to noise, dB.
    #[arg(long, value_name = "DB", allow_negative_numbers = true)]
    snr: Option<f64>,
    /// Random seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Output file (WAV, 32-bit float).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let head = head(arguments)?;
    let paths = paths(arguments)?;
    if let Some(snr) = arguments.snr.filter(|snr| !(-60.0..=120.0).contains(snr)) {
        return Err(AuditionError::Head(format!("--snr is {snr} dB: expected -60 to 120")).into());
    }
    let mut rate_hz = 0.0;
    let mut ears = [Vec::new(), Vec::new()];
    for (file, path) in arguments.source.iter().zip(&paths) {
        let (own_hz, sound) = sound(file)?;
        if rate_hz == 0.0 {
            rate_hz = own_hz;
        }
        let ratio = rate_hz / own_hz;
        let sound = if ratio == 1.0 {
            sound
        } else {
            resampled(&sound, ratio, 0.0, (sound.len() as f64 * ratio) as usize)
        };
        for (ear, heard) in ears.iter_mut().zip(binaural(&head, &sound, rate_hz, path)) {
            ear.resize(ear.len().max(heard.len()), 0.0);
            ear.iter_mut().zip(&heard).for_each(|(sum, value)| *sum += value);
        }
    }
    if let Some(snr) = arguments.snr {
        add_noise(&mut ears, snr, arguments.seed);
    }
    // Floats may exceed full scale, but players and other formats do not expect it.
    let most = ears.iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
    if most > 0.99 {
        ears.iter_mut().flatten().for_each(|value| *value *= 0.99 / most);
    }
    write_atomically(&arguments.out, &encode(rate_hz as u32, &ears))?;
    // Where stdout is the sound, the report is beside it.
    let beside = bp_core::compiler::files::is_stream(&arguments.out);
    let print = |line: &str| if beside { eprintln!("{line}") } else { print(line) };
    for path in &paths {
        let [only] = path.as_slice() else { continue };
        let (_, place) = head.responses(only.place, rate_hz);
        print(&format!(
            "source        azimuth {:.1}°, elevation {:.1}°, {:.2} m",
            place.azimuth.to_degrees(),
            place.elevation.to_degrees(),
            place.rho_m
        ));
    }
    print(&format!("wrote {}", arguments.out.display()));
    Ok(())
}

/// The sampling rate and the samples of a sound.
fn sound(file: &Path) -> Result<(f64, Vec<f64>), Error> {
    let mut source = WaveReader::open(file)?;
    let refuse = |reason: String| AuditionError::File { path: file.to_path_buf(), reason };
    if source.channels() != 1 {
        let reason = format!("{} channels: a source has one", source.channels());
        return Err(refuse(reason).into());
    }
    let sound = source.read(MOST_SAMPLES)?.swap_remove(0);
    if sound.is_empty() {
        return Err(refuse("there are no samples".to_owned()).into());
    }
    Ok((source.rate_hz(), sound))
}

/// The path of each source.
fn paths(arguments: &Arguments) -> Result<Vec<Vec<Waypoint>>, Error> {
    let count = arguments.source.len();
    let refuse = |name: &str, found: usize| {
        AuditionError::Head(format!("--{name} is given {found} times, and there are {count} sources"))
    };
    if !arguments.path.is_empty() {
        if arguments.path.len() != count {
            return Err(refuse("path", arguments.path.len()).into());
        }
        return Ok(arguments.path.iter().map(|file| waypoints(file)).collect::<Result<_, _>>()?);
    }
    let places = [
        ("azimuth", &arguments.azimuth),
        ("elevation", &arguments.elevation),
        ("distance", &arguments.distance),
    ];
    let wrong = |(_, values): &&(&str, &Vec<f64>)| values.len() != 1 && values.len() != count;
    if let Some((name, values)) = places.iter().find(wrong) {
        return Err(refuse(name, values.len()).into());
    }
    let path = |number: usize| {
        let [azimuth, elevation, distance] = places.map(|(_, values)| values[number.min(values.len() - 1)]);
        Ok(vec![waypoint([0.0, azimuth, elevation, distance]).map_err(AuditionError::Head)?])
    };
    (0..count).map(path).collect()
}

fn head(arguments: &Arguments) -> Result<Head, Error> {
    let Some(path) = &arguments.calibration else { return Ok(Head::Sphere(sphere::HEAD_RADIUS_M)) };
    match Calibration::read(path)?.head {
        Origin::Sphere { radius_m } => Ok(Head::Sphere(radius_m)),
        Origin::Sofa { file, checksum: expected, mirrored } => {
            let (responses, bytes) = sofa::read(Path::new(&file))?;
            if checksum(&bytes) != expected {
                let reason =
                    format!("not the file from which `{}` was made: calibrate again", path.display());
                return Err(AuditionError::File { path: PathBuf::from(file), reason }.into());
            }
            Ok(Head::Measured(if mirrored { responses.mirrored() } else { responses }))
        }
    }
}

/// A place at a time, from seconds, degrees and metres.
fn waypoint([time_s, azimuth, elevation, rho_m]: [f64; 4]) -> Result<Waypoint, String> {
    if !(time_s.is_finite() && azimuth.is_finite() && (-90.0..=90.0).contains(&elevation)) {
        return Err(format!(
            "azimuth {azimuth}°, elevation {elevation}° at {time_s} s: expected finite numbers, and elevation in -90 to 90"
        ));
    }
    if !(0.1..=1000.0).contains(&rho_m) {
        return Err(format!("a distance of {rho_m} m: expected 0.1 to 1000"));
    }
    let place = Spherical { rho_m, azimuth: azimuth.to_radians(), elevation: elevation.to_radians() };
    Ok(Waypoint { time_s, place })
}

fn waypoints(path: &Path) -> Result<Vec<Waypoint>, AuditionError> {
    let refuse = |reason: String| AuditionError::File { path: path.to_path_buf(), reason };
    let text = std::fs::read_to_string(path)
        .map_err(|source| AuditionError::Read { path: path.to_path_buf(), source })?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let expected = ["time_s", "azimuth_deg", "elevation_deg", "distance_m"];
    let (_, header) = lines.next().ok_or_else(|| refuse("the file is empty".to_owned()))?;
    if header.trim_start_matches('\u{feff}').split(',').map(str::trim).ne(expected) {
        return Err(refuse(format!("the columns are `{header}`: expected `{}`", expected.join(","))));
    }
    let mut found: Vec<Waypoint> = Vec::new();
    for (number, line) in lines {
        let cells: Vec<f64> = line.split(',').map_while(|cell| cell.trim().parse().ok()).collect();
        let row: [f64; 4] = cells
            .try_into()
            .map_err(|_| refuse(format!("line {}: `{line}` is not four numbers", number + 1)))?;
        let next = waypoint(row).map_err(|reason| refuse(format!("line {}: {reason}", number + 1)))?;
        if found.last().is_some_and(|last| last.time_s >= next.time_s) {
            return Err(refuse(format!("line {}: time does not go on", number + 1)));
        }
        found.push(next);
    }
    if found.is_empty() {
        return Err(refuse("there is no row".to_owned()));
    }
    Ok(found)
}
