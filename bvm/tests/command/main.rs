//! The command `bvm`, run as a process.
//!
//! In: arguments and files. Out: its output, its exit status, and the files that it leaves.

mod balance;
mod course;
mod explore;
mod general;
mod hearing;
#[path = "../../../bp-core/tests/support/help.rs"]
mod help;
mod inputs;
#[path = "../../../bp-core/tests/support/kinds.rs"]
mod kinds;
mod options;
#[path = "../../../bp-core/tests/support/shown.rs"]
mod shown;
