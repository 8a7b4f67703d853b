//! A run: looks until there is no reason for another.
//!
//! In: a head, a policy, the number of looks. Out: the looks, and why it ended. Invariant: after each look the run can be
//! stopped, and what is done is complete.

use super::checkpoint::Checkpoint;
use super::{Head, Look, Policy};
use crate::error::Error;
use crate::map::Map;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// All looks were made.
    Steps,
    /// No direction is left that looks can tell something about.
    NothingLeft,
    /// It was interrupted.
    Interrupted,
}

/// Adds looks to those of a run until there are `steps`, nothing is left to see, or `stop` is set; `done` is called after
/// each. With a checkpoint the run can be resumed.
///
/// # Errors
/// Those of the head; a checkpoint that cannot be written.
pub fn run(
    head: &mut Head,
    policy: &mut dyn Policy,
    looks: &mut Vec<Look>,
    steps: usize,
    mut checkpoint: Option<&mut Checkpoint>,
    stop: &AtomicBool,
    mut done: impl FnMut(&Map, &Look),
) -> Result<Ended, Error> {
    let ended = loop {
        if looks.last().is_some_and(|look| look.open_directions == 0) {
            break Ended::NothingLeft;
        }
        if looks.len() >= steps {
            break Ended::Steps;
        }
        if stop.load(Ordering::Relaxed) {
            break Ended::Interrupted;
        }
        let look = head.look(policy)?;
        done(head.map(), &look);
        looks.push(look);
        if let Some(checkpoint) = checkpoint.as_deref_mut().filter(|one| one.is_due()) {
            checkpoint.write(head, looks)?;
        }
    };
    if let Some(checkpoint) = checkpoint {
        checkpoint.write(head, looks)?;
    }
    Ok(ended)
}
