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
mod pictures;
mod score;
mod talkers;

use bvm::audition::{
    BinauralUnit, Calibration, Directions, Head, Listening, Origin, Responses, checksum, sofa, sphere,
};
use bvm::error::Error as HearingError;
use bvm::frame::Spherical;
use cases::{RATE_HZ, Room, Sound, in_room, rendered, turned};
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
    /// Draw the pictures of docs/hearing.md into this folder.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
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
    let sphere_all = Listening::new(&of_sphere, Directions::All)?;
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
    add("turned", &all, &[0.0], 8 * every);
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
    let outcome = |[frontal, all, near]: &mut [Listening; 3], case: &Case| -> Result<Outcome, HearingError> {
        let (head, listener) = match (case.set, &other) {
            ("other" | "room", Some((responses, _))) => (&Head::Measured(responses.clone()), frontal),
            ("near", _) => (&sphere, near),
            ("sphere" | "turned", _) => (&measured, all),
            _ => (&measured, frontal),
        };
        let sound = &sounds[case.sound].samples;
        if case.set == "turned" {
            let heard = turned(head, sound, case.place, case.snr_db, case.seed, &independent);
            return Ok(Outcome::of(case.place, &listener.find_turned(&heard)?));
        }
        let ears = match (head, case.set) {
            (Head::Measured(responses), "room") => {
                in_room(&room, responses, sound, case.place, case.snr_db, case.seed)
            }
            _ => rendered(head, sound, case.place, case.snr_db, case.seed),
        };
        let cues = BinauralUnit::new(RATE_HZ, &independent).hear(&ears[0], &ears[1]).bands();
        Ok(Outcome::of(case.place, &listener.find(&cues)?))
    };
    let ears = || [&frontal_ears, &all_ears, &sphere_ears].map(Listening::clone);
    let outcomes: Vec<Outcome> =
        cases.par_iter().map_init(ears, outcome).collect::<Result<_, HearingError>>()?;
    print!("{}", table(&cases, &outcomes));
    if "talkers".contains(&arguments.only) {
        let places = frontal(&own);
        for (name, ears) in [("frontal", &frontal_ears), ("all directions", &all_ears)] {
            let found = talkers::count(&measured, &sounds, &places, every, ears, &independent)?;
            println!("two talkers 40° apart, 10 dB, {name}: both within 10° in {} of {}", found[0], found[1]);
            println!("one talker, 10 dB, {name}: a second voice in {} of {}", found[2], found[3]);
        }
    }
    println!();
    print!("{}", reliability(&outcomes));
    if let Some(folder) = &arguments.out {
        std::fs::create_dir_all(folder)?;
        pictures::itd(&calibration, &folder.join("hearing_itd.png"))?;
        pictures::over_noise(&cases, &outcomes, &folder.join("hearing_noise.png"))?;
        pictures::reliability(&outcomes, &folder.join("hearing_reliability.png"))?;
        let found_m = sphere_ears.distances_m();
        pictures::distances(&cases, &outcomes, found_m, &folder.join("hearing_distance.png"))?;
        // A voice on the left in front, in noise, with a head at rest and one that turns to it.
        let place = Spherical { rho_m: 1.4, azimuth: 40f64.to_radians(), elevation: 0.0 };
        let [mut still, mut moving] = [sphere_all.clone(), sphere_all.clone()];
        moving.find_turned(&turned(&sphere, &sounds[0].samples, place, 0.0, 7, &independent))?;
        let ears = rendered(&sphere, &sounds[0].samples, place, 0.0, 7);
        still.find(&BinauralUnit::new(RATE_HZ, &independent).hear(&ears[0], &ears[1]).bands())?;
        let looks = [
            ("A voice at 40°, 0 dB, ears on a sphere: the head at rest", &still),
            ("The same, while the head turns by 20° to the left", &moving),
        ];
        pictures::panoramas(&looks, &folder.join("hearing_turn.png"))?;
    }
    eprintln!("{} cases in {:.0} s", cases.len(), begun.elapsed().as_secs_f64());
    Ok(())
}
