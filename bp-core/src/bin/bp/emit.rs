//! `bp emit`: what the compiler makes of a program.
//!
//! In: a program, perhaps a question. Out: Rust as the macro writes it, or shaders in WGSL. Invariant: the same plan and
//! kernel in both.

use crate::failure::Failure;
use crate::{output, program};
use bp_core::answer::link;
use bp_core::emit::{emit_rust, wgsl::emit_wgsl};
use bp_core::error::Error;
use bp_core::kernel::Kernel;
use bp_core::lower::lower;
use bp_core::model::Model;
use bp_core::plan::{Options, Route, plan};
use std::io::Write;
use std::path::PathBuf;

/// Writes the code that answers, in Rust or WGSL.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp emit wet_grass.bp
  bp emit cell.bp step --to wgsl --out step.wgsl")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// `P(…)`, or the name of a declared question; all of those if left out.
    question: Option<String>,
    /// What to write.
    #[arg(long, value_enum, default_value = "rust")]
    to: Language,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Language {
    /// The module that `bayesian_program!` writes.
    Rust,
    /// A compute shader for each question that has exact loops.
    Wgsl,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (network, source) = program::with_source(&arguments.file)?;
    let questions = program::questions(&network, arguments.question.as_deref())?;
    let mut model = link(&network.model)?.into_owned();
    let mut page = Vec::new();
    if arguments.to == Language::Rust {
        model.questions = Default::default();
        questions.into_iter().for_each(|question| {
            model.questions.push(question);
        });
        let told = |wrong: Vec<(String, Error)>| match wrong.into_iter().next() {
            Some((_, error)) => Failure::Data(error),
            None => Failure::Told,
        };
        write!(page, "{}", emit_rust(&model, &source).map_err(told)?)?;
        return output::write(arguments.out.as_deref(), &page, out);
    }
    for question in &questions {
        for kernel in kernels(&model, question)? {
            write!(page, "{}", emit_wgsl(&kernel).text)?;
        }
    }
    output::write(arguments.out.as_deref(), &page, out)
}

/// The kernels of a question, as far as kernels answer it.
fn kernels(model: &Model, question: &bp_core::model::Question) -> Result<Vec<Kernel>, Failure> {
    let mut kernels = Vec::new();
    for route in plan(model, question, Options::default())?.routes {
        match route {
            Route::Exact(exact) => kernels.push(lower(model, &exact, &question.name)?.kernel),
            other => {
                let words = format!("`{}` is not answered by loops: {}", question.name, other.reason());
                return Err(Failure::Words(words));
            }
        }
    }
    Ok(kernels)
}
