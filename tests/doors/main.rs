//! Interfaces of programs: the macro, and shaders.
//!
//! In: programs written here and in files. Out: answers of emitted code, compared with the interpreter and with counts
//! by hand; messages of wrong programs.

mod gallery_macro;
mod macros;
mod macros_questions;
mod wgsl;
