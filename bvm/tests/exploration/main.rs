//! Gaze policies, the experiment, and the files that a run leaves, read by other programs.

mod experiment;
mod files;
mod policies;
