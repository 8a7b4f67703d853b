//! Doors for programs: the macro, and shaders.
//!
//! In: programs written here and in files. Out: answers of emitted code beside the interpreter and hand counts;
//! messages beside wrong programs.

mod gallery_macro;
mod macros;
mod macros_questions;
mod wgsl;
