//! How well `bvm listen` hears: every figure of docs/hearing.md, in one run.
//!
//! In: the responses of a head (SOFA), those of another head, dry recordings of one channel (WAV). Out: a table. Each case is
//! one second of sound at 44.1 kHz with independent white noise in each ear, at a ratio to the mean power of both ears.
//! Invariant: the same arguments give the same table.
//!
//! ```sh
//! cargo run --release -p bvm --example hearing -- --hrir KEMAR.sofa --other OTHER.sofa --sound a.wav --sound b.wav
//! ```

mod cases;
mod score;

use bvm::audition::{
    BANDS, BinauralUnit, Calibration, Directions, Head, Listening, Origin, PART_S, Parts, Responses, Source,
    checksum, sofa, sphere,
};
use bvm::frame::{Spherical, great_circle};
use cases::{RATE_HZ, Room, Sound, both, in_room, rendered};
use clap::Parser;
use rayon::prelude::*;
use score::{Case, Outcome, reliability, table};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Measure hearing.
#[derive(Parser)]
struct Arguments {
    /// Responses of the head that listens.
    #[arg(long, value_name = "SOFA")]
    hrir: PathBuf,
    /// Responses of another head, which the first one's calibration hears with.
    #[arg(long, value_name = "SOFA")]
    other: Option<PathBuf>,
    /// The other file counts azimuth clockwise.
    #[arg(long)]
    mirror_other: bool,
    /// Dry recordings of one channel.
    #[arg(long, value_name = "WAV")]
    sound: Vec<PathBuf>,
    /// Take one of so many cases.
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Only sets whose names contain this.
    #[arg(long, default_value = "")]
    only: String,
}

/// Ratios of signal to noise, dB.
const RATIOS_DB: [f64; 3] = [20.0, 10.0, 0.0];

fn head_of(path: &Path, mirror: bool) -> Result<(Responses, Calibration), Box<dyn Error>> {
    let (responses, bytes) = sofa::read(path)?;
    let responses = if mirror { responses.mirrored() } else { responses };
    let origin =
        Origin::Sofa { file: path.display().to_string(), checksum: checksum(&bytes), mirrored: mirror };
    let calibration = Calibration::of(&Head::Measured(responses.clone()), origin)?;
    Ok((responses, calibration))
}

fn frontal(head: &Responses) -> Vec<Spherical> {
    let places = head.measured.iter().map(|one| one.place);
    places.filter(|it| it.elevation.abs() < 0.01 && it.azimuth.abs() < 91f64.to_radians()).collect()
}

/// Pairs of voices 40 degrees apart at 10 dB: in how many both are found, of how many; and single voices that seem to be two.
fn talkers(
    head: &Head,
    sounds: &[Sound],
    places: Vec<Spherical>,
    every: usize,
    ears: &Listening,
    independent: &[f64; BANDS],
) -> Result<[usize; 4], bvm::error::Error> {
    let heard = |waves: &[Vec<f64>; 2]| {
        let mut unit = BinauralUnit::new(RATE_HZ, independent);
        let mut parts = Parts::default();
        let length = (PART_S * RATE_HZ) as usize;
        for (left, right) in waves[0].chunks(length).zip(waves[1].chunks(length)) {
            let mut cues = unit.silence();
            unit.add(left, right, &mut cues);
            parts.push(&cues);
        }
        ears.clone().find_voices(parts.all())
    };
    let away = |one: &Source, place: Spherical| {
        great_circle(
            (one.azimuth_deg.to_radians(), one.elevation_deg.to_radians()),
            (place.azimuth, place.elevation),
        )
        .to_degrees()
    };
    let pairs: Vec<(usize, Spherical, Spherical)> = (places.iter().enumerate())
        .flat_map(|(number, one)| places.iter().map(move |other| (number, *one, *other)))
        .filter(|(_, one, other)| ((one.azimuth - other.azimuth).to_degrees() - 40.0).abs() < 0.5)
        .step_by(every.div_ceil(2))
        .collect();
    let both = pairs.par_iter().map(|(number, one, other)| {
        let waves =
            both(head, [&sounds[0].samples, &sounds[1].samples], [*one, *other], 10.0, *number as u64);
        let found = heard(&waves)?;
        let first: Vec<&Source> = found.sources.iter().take(2).collect();
        Ok([one, other].iter().all(|place| first.iter().any(|source| away(source, **place) <= 10.0)))
    });
    let both = both.collect::<Result<Vec<bool>, bvm::error::Error>>()?;
    let single = pairs.par_iter().map(|(number, one, _)| {
        let found = heard(&rendered(head, &sounds[number % 2].samples, *one, 10.0, *number as u64))?;
        Ok(found.sources.iter().map(|source| source.probability).sum::<f64>() > 1.2)
    });
    let single = single.collect::<Result<Vec<bool>, bvm::error::Error>>()?;
    let count = |all: &[bool]| all.iter().filter(|one| **one).count();
    Ok([count(&both), both.len(), count(&single), single.len()])
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut sounds: Vec<Sound> =
        arguments.sound.iter().map(|path| Sound::read(path)).collect::<Result<_, _>>()?;
    sounds.push(Sound::noise());
    let (own, calibration) = head_of(&arguments.hrir, false)?;
    let room = Room { size_m: [6.0, 5.0, 2.8], head_m: [2.6, 2.2, 1.4], reflection: 0.75, order: 4 };
    let other = arguments.other.as_ref().map(|path| head_of(path, arguments.mirror_other)).transpose()?;
    let radius_m = sphere::HEAD_RADIUS_M;
    let sphere = Head::Sphere(radius_m);
    let of_sphere = Calibration::of(&sphere, Origin::Sphere { radius_m })?;
    let independent = std::array::from_fn(|band| calibration.independent[band]);
    let frontal_ears = Listening::new(&calibration, Directions::Frontal)?;
    let all_ears = Listening::new(&calibration, Directions::All)?;
    let sphere_ears = Listening::new(&of_sphere, Directions::Frontal)?;
    let measured = Head::Measured(own.clone());
    // Which set, the place, the sound, the ratio, the kind of rendering.
    let mut cases: Vec<Case> = Vec::new();
    let mut add = |set: &'static str, places: &[Spherical], ratios: &[f64], step: usize| {
        for (index, place) in places.iter().enumerate() {
            for (sound, _) in sounds.iter().enumerate() {
                for snr_db in ratios {
                    if (index * 7 + sound * 3 + *snr_db as usize / 10).is_multiple_of(step) {
                        let (is_noise, seed) = (sound + 1 == sounds.len(), cases.len() as u64);
                        cases.push(Case { set, place: *place, sound, is_noise, snr_db: *snr_db, seed });
                    }
                }
            }
        }
    };
    let every = arguments.every;
    add("front", &frontal(&own), &RATIOS_DB, every);
    let all: Vec<Spherical> = own.measured.iter().map(|one| one.place).collect();
    add("sphere", &all, &RATIOS_DB, 8 * every);
    if let Some((other, _)) = &other {
        add("other", &frontal(other), &RATIOS_DB, every);
        add("room", &frontal(other), &[20.0], every);
    }
    let near: Vec<Spherical> = [0.25, 0.4, 0.63, 1.0, 1.6]
        .iter()
        .flat_map(|rho_m| {
            [-90.0, -60.0, -30.0, 30.0, 60.0, 90.0f64].map(|azimuth| Spherical {
                rho_m: *rho_m,
                azimuth: azimuth.to_radians(),
                elevation: 0.0,
            })
        })
        .collect();
    add("near", &near, &RATIOS_DB, every);
    cases.retain(|case| case.set.contains(&arguments.only));
    let begun = Instant::now();
    let outcomes: Vec<Outcome> = cases
        .par_iter()
        .map_init(
            || [&frontal_ears, &all_ears, &sphere_ears].map(Listening::clone),
            |[frontal, all, near], case| -> Result<Outcome, bvm::error::Error> {
                let (head, listener) = match (case.set, &other) {
                    ("other" | "room", Some((responses, _))) => (&Head::Measured(responses.clone()), frontal),
                    ("near", _) => (&sphere, near),
                    ("sphere", _) => (&measured, all),
                    _ => (&measured, frontal),
                };
                let sound = &sounds[case.sound].samples;
                let ears = match (head, case.set) {
                    (Head::Measured(responses), "room") => {
                        in_room(&room, responses, sound, case.place, case.snr_db, case.seed)
                    }
                    _ => rendered(head, sound, case.place, case.snr_db, case.seed),
                };
                let cues = BinauralUnit::new(RATE_HZ, &independent).hear(&ears[0], &ears[1]).bands();
                Ok(Outcome::of(case.place, &listener.find(&cues)?))
            },
        )
        .collect::<Result<_, _>>()?;
    print!("{}", table(&cases, &outcomes));
    if "talkers".contains(&arguments.only) {
        let found = talkers(&measured, &sounds, frontal(&own), every, &all_ears, &independent)?;
        println!("two talkers 40° apart, 10 dB: both within 10° in {} of {}", found[0], found[1]);
        println!("one talker, 10 dB: a second voice in {} of {}", found[2], found[3]);
    }
    println!();
    print!("{}", reliability(&outcomes));
    eprintln!("{} cases in {:.0} s", cases.len(), begun.elapsed().as_secs_f64());
    Ok(())
}
