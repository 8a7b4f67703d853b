//! The command `bvm`, run as a process.
//!
//! In: arguments and files. Out: its output, its exit status, and the files that it leaves.

mod balance;
mod explore;
mod general;
mod hearing;
mod inputs;
