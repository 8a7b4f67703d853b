//! The active head: scenes, the whole loop, faults, and runs that are resumed.
//!
//! In: scenes, built in and written here. Out: maps compared with the true world, records, files. Invariant: the truth is
//! computed by ray casting, which no sense of the whole head uses.

mod depth;
mod moving;
mod rendering;
mod whole;
