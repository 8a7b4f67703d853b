//! Hearing: filters, correlations, files and posteriors.
//!
//! In: impulses, tones, noise; files written by hand, and those of `shared` where they are. Out: closed forms, series at 40
//! digits, densities multiplied by hand. Invariant: no expected value is an answer of this project.

mod ears;
mod files;
mod places;
