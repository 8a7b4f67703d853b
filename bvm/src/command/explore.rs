//! `bvm explore`: active exploration of a simulated world.
//!
//! In: a scene, senses, a number of steps and a seed. Out: a folder of pictures, `run.json`, and a table. Invariant: the same
//! seed gives the same figures, in one piece or resumed; Ctrl-C ends a run after the look that is being made, and what is
//! done is kept.

use super::look::EvidenceName;
use super::{check_folder, print};
use bvm::audition::checksum;
use bvm::error::Error;
use bvm::exploration::{Episode, Gazer, PolicyKind, Record, Report, entropies};
use bvm::head::checkpoint::{Checkpoint, Settings};
use bvm::head::{Account, Ended, Head, Look, account, depth, real, run as look_on, tracks::tracks};
use bvm::map::Map;
use bvm::vision::EvidenceKind;
use bvm::world::scene::{DEFAULT, Scene};
use bvm::world::sensors::DepthCamera;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Explore a simulated room by entropy, and compare gaze policies.
#[derive(Args)]
#[command(after_help = "A look: sense, predict, estimate, choose a gaze, turn. With --senses depth,\n\
a gaze without a map, a random and a sweeping one run beside it in the same\n\
world. The other senses are those of a whole head: rendered stereo pairs\n\
(stereo), waveforms at two ears (audio), inertial samples (imu), each through\n\
the code of look, listen and balance.\n\n\
Scenes: furnished, empty, office, corridor, speaker_behind, two_speakers,\n\
passer_by, door, hands, glass_and_black, fog, box; or a scene file (TOML).\n\n\
Ctrl-C keeps what is done; --resume goes on.\n\n\
Examples:\n  bvm explore\n  bvm explore --steps 60 --seed 7 --out run\n  bvm explore --policy attention\n  \
bvm explore --scene office --senses stereo,audio,imu --steps 20\n  \
bvm explore --scene my.toml --out run --resume\n  \
bvm explore --json | jq '.policies[0].final_entropy_share'")]
pub(crate) struct Arguments {
    /// The world: a name, or a file.
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT)]
    scene: String,
    /// The senses, separated by commas.
    #[arg(
        long,
        value_name = "NAMES",
        value_enum,
        value_delimiter = ',',
        default_value = "depth",
        hide_possible_values = true,
        help = "The senses, separated by commas: depth, a fast\ncamera with formulas of hearing; or some of stereo,\naudio and imu"
    )]
    senses: Vec<SenseName>,
    /// Number of looks.
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: u32,
    /// Gaze policy.
    #[arg(
        long,
        value_name = "NAME",
        default_value = PolicyKind::Inhibited.name(),
        value_parser = policy_parser(),
        hide_possible_values = true,
        help = "Gaze policy: inhibited (entropy gradient and\ninhibition of return), paper (the gradient as\nprinted), view, information-gain, attention, null,\nrandom or sweep"
    )]
    policy: PolicyKind,
    /// Random seed of world and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Evidence of a reading for its line of sight.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "virtual",
        hide_possible_values = true,
        help = "Evidence of a reading: a likelihood for each cell of\nits line of sight, from the sensor's deviation\n(virtual), or the cell that it lies in, as in the\npaper (hard; with depth only)"
    )]
    evidence: EvidenceName,
    /// Missing readings as evidence, with depth.
    #[arg(
        long,
        help = "With depth: take no reading in view as evidence that a\nsurface that was read has left, as stereo does"
    )]
    missing: bool,
    /// Carry the joint distribution of occupancy and velocity of each cell, not the paper's two marginals.
    #[arg(
        long,
        help = "Carry the joint distribution of occupancy and velocity\nof each cell, not the paper's two marginals"
    )]
    joint: bool,
    /// Output folder.
    #[arg(long, default_value = "bvm-run")]
    out: PathBuf,
    /// Go on with an interrupted run in the output folder.
    #[arg(long)]
    resume: bool,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// The policies that run beside the one that is asked for.
const COMPARED: [PolicyKind; 3] = [PolicyKind::Null, PolicyKind::Random, PolicyKind::Sweep];

/// Reads the name of a policy.
pub(crate) fn policy_parser() -> impl TypedValueParser<Value = PolicyKind> {
    let names = PossibleValuesParser::new(PolicyKind::ALL.map(PolicyKind::name));
    names.map(|name| PolicyKind::of_name(&name).expect("internal: one of the names"))
}

/// A sense, as an argument.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SenseName {
    Depth,
    Stereo,
    Audio,
    Imu,
}

impl SenseName {
    /// The senses of a whole head; none for the fast one.
    ///
    /// # Errors
    /// Depth together with another sense.
    pub(crate) fn whole(names: &[Self]) -> Result<Option<real::Senses>, Error> {
        let has = |sense: SenseName| names.contains(&sense);
        match (has(SenseName::Depth), names.iter().any(|sense| *sense != SenseName::Depth)) {
            (true, true) => Err(Error::Scene(String::from(
                "--senses: depth goes with no other sense: expected depth, or some of stereo, audio and imu",
            ))),
            (true, false) => Ok(None),
            _ => Ok(Some(real::Senses {
                stereo: has(SenseName::Stereo),
                audio: has(SenseName::Audio),
                imu: has(SenseName::Imu),
                joint: false,
            })),
        }
    }

    fn name(self) -> &'static str {
        match self {
            SenseName::Depth => "depth",
            SenseName::Stereo => "stereo",
            SenseName::Audio => "audio",
            SenseName::Imu => "imu",
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Error> {
    let scene = Scene::find(&arguments.scene)?;
    let whole = SenseName::whole(&arguments.senses)?;
    let is_fast = whole.is_none();
    let evidence: EvidenceKind = arguments.evidence.into();
    if !is_fast && evidence == EvidenceKind::Hard {
        let reason = "--evidence hard is for --senses depth: pictures give whole population codes";
        return Err(Error::Scene(String::from(reason)));
    }
    check_folder(&arguments.out)?;
    std::fs::create_dir_all(&arguments.out)
        .map_err(|source| Error::Folder { path: arguments.out.clone(), source })?;
    if !arguments.resume {
        Record::clear(&arguments.out)?;
    }
    let options = depth::Options { missing: arguments.missing, joint: arguments.joint };
    let head = || match whole {
        None => {
            let world = scene.world(arguments.seed);
            Ok((depth::head_with(world, evidence, options, arguments.seed)?, None))
        }
        Some(senses) => real::head(&scene, real::Senses { joint: arguments.joint, ..senses }, arguments.seed)
            .map(|(head, shown)| (head, Some(shown))),
    };
    let mut policies = vec![arguments.policy];
    if is_fast {
        policies.extend(COMPARED.into_iter().filter(|other| *other != arguments.policy));
    }
    let stop = interruption();
    let steps = arguments.steps as usize;
    let bar = ProgressBar::new((policies.len() * steps) as u64);
    let style = ProgressStyle::with_template("{prefix:>16} [{bar:24}] {pos}/{len} looks, {eta} left  {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let world = scene.world(arguments.seed);
    let (mut episodes, mut checkpoints, mut accounts) = (Vec::new(), Vec::new(), Vec::new());
    let mut pictures = None;
    let mut record = Record::new(&arguments.out, steps, arguments.resume)?;
    for kind in policies {
        bar.set_prefix(kind.name());
        let (mut head, shown): (Head, _) = head()?;
        let (camera, tilt) = match is_fast {
            true => (DepthCamera::default(), depth::MOST_TILT),
            false => (real::camera_of(&scene), real::most_tilt(&scene)),
        };
        let mut policy = Gazer::new(kind, &camera, head.map().grid(), tilt, arguments.seed);
        let initial = entropies(head.map());
        let mut checkpoint = Checkpoint::new(&arguments.out, settings(arguments, &scene, kind));
        let mut looks: Vec<Look> = match arguments.resume {
            true => checkpoint.resume(&mut head, &mut policy)?,
            false => Vec::new(),
        };
        let resumed_after = looks.len();
        bar.inc(resumed_after as u64);
        let done = |map: &Map, look: &Look| {
            // The first policy is the one that was asked for; the others are compared with it.
            if kind == arguments.policy {
                record.add(map, look);
            }
            bar.inc(1);
            bar.set_message(format!(
                "H {:.1} %, {} open",
                100.0 * look.entropy / initial[0],
                look.open_directions
            ));
        };
        let ended = look_on(&mut head, &mut policy, &mut looks, steps, Some(&mut checkpoint), &stop, done)?;
        checkpoints.push(checkpoint);
        let account = Account {
            scene: scene.name.clone(),
            title: scene.title.clone(),
            senses: arguments.senses.iter().map(|sense| sense.name().to_owned()).collect(),
            ended,
            resumed_after,
            faults: account::failures(&looks),
            tracks: tracks(head.map(), step_s(&looks)),
            unseeable: head.coverage().unseeable(head.map()),
            heard: account::heard(&looks),
            totals: account::totals(&looks),
            mean_ms: account::mean_ms(&looks),
            looks: looks.clone(),
        };
        accounts.push(account);
        episodes.push(Episode::of(kind, initial, head, looks, &world));
        pictures = pictures.or(shown);
        if ended == Ended::Interrupted {
            break;
        }
    }
    bar.finish_and_clear();
    let is_interrupted = accounts.iter().any(|account| account.ended == Ended::Interrupted);
    let account = accounts.swap_remove(0);
    let text = account.text();
    let is_default = is_fast && arguments.scene == DEFAULT && !is_interrupted;
    let mut report = Report::new(&scene.name, arguments.seed, evidence, &episodes);
    if !is_default {
        report = report.with(account);
    }
    let mut files = report.write(&arguments.out, &world, &episodes)?;
    let title = format!("{} (scene {}, seed {})", scene.title, scene.name, arguments.seed);
    files.extend(record.leave(&arguments.out, &title, &episodes)?);
    if let Some(views) = pictures.and_then(|shown| shown.borrow().clone()) {
        let path = arguments.out.join("cameras.png");
        bvm::report::cameras(&views.pair, &views.found).write(&path)?;
        files.push(path);
    }
    if !is_interrupted {
        checkpoints.iter().for_each(Checkpoint::remove);
    }
    if arguments.json {
        print(&serde_json::to_string(&report).expect("internal: figures are numbers"));
        return Ok(());
    }
    print(&report.table());
    print("");
    if !is_default {
        print(&text);
    }
    files.iter().for_each(|file| print(&format!("wrote {}", file.display())));
    Ok(())
}

/// The mean time between looks, s, which the step of the map's velocities stands for.
fn step_s(looks: &[Look]) -> f64 {
    match looks {
        [first, .., last] => (last.time_s - first.time_s) / (looks.len() - 1) as f64,
        _ => depth::STEP_S,
    }
}

fn settings(arguments: &Arguments, scene: &Scene, policy: PolicyKind) -> Settings {
    let senses: Vec<&str> = arguments.senses.iter().map(|sense| sense.name()).collect();
    let evidence: EvidenceKind = arguments.evidence.into();
    Settings {
        scene: arguments.scene.clone(),
        checksum: checksum(format!("{scene:?}").as_bytes()),
        seed: arguments.seed,
        senses: senses.join(",")
            + if arguments.missing { " with missing readings" } else { "" }
            + if arguments.joint { " with the joint distribution" } else { "" },
        policy: policy.name().to_owned(),
        evidence: evidence.name().to_owned(),
    }
}

/// A flag that Ctrl-C sets; a second one ends the program at once.
fn interruption() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    // Without a handler Ctrl-C ends the program, and the last checkpoint is kept.
    let _ = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("interrupted: the run ends after this look");
    });
    stop
}
