//! The command `bvm`.
//!
//! In: arguments. Out: pictures, figures, an exit status: 0, 1 for wrong data, 2 for wrong usage. Invariant: errors go
//! to stderr, one line each; stdout holds the answer only.

mod command;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// The Bayesian Volumetric Map: sensor fusion and active exploration.
#[derive(Parser)]
#[command(version, max_term_width = 80)]
#[command(
    after_help = "Examples:\n  bvm explore\n  bvm explore --steps 60 --seed 7 --out run\n  bvm look --left L.png --right R.png --calibration C.toml\n  bvm calibrate vision --pair L.png R.png C.toml TRUTH.pfm\n  bvm replay --recording V1_01_easy/mav0\n  bvm listen --wav in.wav --calibration head.json\n  bvm balance --imu imu.csv --out orientation.csv\n\n\
Frame: x ahead, y left, z up; azimuth and yaw are positive to the left."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Balance(Box<command::balance::Arguments>),
    #[command(subcommand)]
    Calibrate(command::calibrate::Sense),
    Experiment(command::experiment::Arguments),
    Explore(command::explore::Arguments),
    Listen(command::listen::Arguments),
    Look(command::look::Arguments),
    Replay(command::replay::Arguments),
    Synth(command::synth::Arguments),
}

fn main() -> ExitCode {
    bp_core::compiler::door::enter(bp_core::compiler::door::Door::Command);
    let done = match Arguments::parse().command {
        Command::Balance(arguments) => command::balance::run(&arguments),
        Command::Calibrate(sense) => command::calibrate::run(&sense),
        Command::Experiment(arguments) => command::experiment::run(&arguments),
        Command::Explore(arguments) => command::explore::run(&arguments),
        Command::Listen(arguments) => command::listen::run(&arguments),
        Command::Look(arguments) => command::look::run(&arguments),
        Command::Replay(arguments) => command::replay::run(&arguments),
        Command::Synth(arguments) => command::synth::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(1)
        }
    }
}
