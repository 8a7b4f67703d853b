//! `bvm calibrate`: the numbers of a sense, from data with known truth.
//!
//! In: the arguments of one sense. Out: its calibration. Invariant: one file for each sense.

mod audition;
mod vision;

use bvm::error::Error;
use clap::Subcommand;

/// Calibrate a sense against data with known truth.
#[derive(Subcommand)]
pub(crate) enum Sense {
    Audition(audition::Audition),
    Vision(vision::Vision),
}

pub(crate) fn run(sense: &Sense) -> Result<(), Error> {
    match sense {
        Sense::Audition(arguments) => audition::run(arguments),
        Sense::Vision(arguments) => vision::run(arguments),
    }
}
