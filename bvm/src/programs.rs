//! The Bayesian Programs of the map, compiled with the crate.
//!
//! In: the files of `models/`, the only place where the map's probabilities are written. Out: a module for each.
//! Invariant: no other file of this crate writes a probability of the map.

use bp_macros::bayesian_program;

bayesian_program!("models/cell.bp");
bayesian_program!("models/line_of_sight.bp");
bayesian_program!("models/binaural.bp");
bayesian_program!("models/vestibular.bp");
bayesian_program!("models/gaze.bp");
bayesian_program!("models/view.bp");
