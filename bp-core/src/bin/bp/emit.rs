//! `bp emit`: what the compiler makes of a program.
//!
//! In: a program, perhaps a question. Out: Rust as the macro writes it, or shaders in WGSL. Invariant: the same plan and
//! kernel in both.

use crate::failure::Failure;
use crate::{output, program};
use bp_core::answer::link;
use bp_core::emit::{Emitted, emit_rust, wgsl::emit_wgsl_module};
use bp_core::kernel::Kernel;
use bp_core::lower::lower;
use bp_core::model::Model;
use bp_core::plan::{Options, plan};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::PathBuf;

/// The largest size: as many cells as an answer may have.
const MOST: usize = 1_000_000_000;

/// Compile questions to source code, in Rust or WGSL.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp emit wet_grass.bp
  bp emit cell.bp step --to wgsl --out step.wgsl
  bp emit cell.bp step --to wgsl --size Grid.depth=10 --size Grid.rows=90 \\
      --size Grid.lanes=360 --size Velocity=7 --size Sensors=1

Sizes that are not fixed are read from a buffer at run time. If all sizes are
fixed, indices are constants, and the intermediate values of a cell stay in
registers.")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// A question, or the name of a declared one; all declared questions if left out.
    question: Option<String>,
    /// Target language.
    #[arg(long, value_enum, default_value = "rust")]
    to: Language,
    /// Fix a size in the shader; sizes that are not fixed are read at run time.
    #[arg(long = "size", value_name = "NAME=N", value_parser = size)]
    sizes: Vec<(String, usize)>,
    /// Write to this file instead of stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Language {
    /// The module that `bayesian_program!` writes.
    Rust,
    /// One module of compute shaders for all questions that have exact loops.
    Wgsl,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let (network, source) = program::with_source(&arguments.file)?;
    let questions = program::questions(&network, arguments.question.as_deref())?;
    let mut model = link(&network.model)?.into_owned();
    let mut page = Vec::new();
    if arguments.to == Language::Rust && !arguments.sizes.is_empty() {
        let words = "`--size` is for `--to wgsl`: Rust is written for any sizes";
        return Err(Failure::Words(words.to_owned()));
    }
    if arguments.to == Language::Rust {
        model.questions = Default::default();
        questions.into_iter().for_each(|question| {
            model.questions.push(question);
        });
        let asked = model.questions.len();
        let Emitted { text, refused } = emit_rust(&model, &source, None);
        refuse(asked, refused.into_iter().map(|(name, error)| (name, Failure::Data(error))).collect())?;
        write!(page, "{text}")?;
        return output::write(arguments.out.as_deref(), &page, out);
    }
    let (mut written, mut refused) = (Vec::new(), Vec::new());
    for question in &questions {
        match kernels(&model, question) {
            Ok(kernels) => written.extend(kernels),
            Err(error) => refused.push((question.name.clone(), error)),
        }
    }
    refuse(questions.len(), refused)?;
    has_sizes(&written, &arguments.sizes)?;
    let size = |name: &str| arguments.sizes.iter().find(|(known, _)| known == name).map(|(_, size)| *size);
    let sized: Vec<Kernel> =
        written.iter().map(|kernel| kernel.with_sizes(size)).collect::<Result<_, _>>()?;
    write!(page, "{}", emit_wgsl_module(&sized))?;
    output::write(arguments.out.as_deref(), &page, out)
}

/// Questions that are not compiled: an error where none is, else a warning for each.
fn refuse(asked: usize, refused: Vec<(String, Failure)>) -> Result<(), Failure> {
    let none_is_compiled = refused.len() == asked;
    for (name, failure) in refused {
        let reason = match failure {
            failure if none_is_compiled => return Err(failure),
            Failure::Data(error) => error.to_string(),
            Failure::Words(words) => words,
            other => return Err(other),
        };
        // Where stderr is closed there is nobody to be told.
        let _ = writeln!(std::io::stderr(), "warning: the question `{name}` is left out: {reason}");
    }
    Ok(())
}

/// Refuses sizes that no kernel has, or that are given twice.
fn has_sizes(kernels: &[Kernel], sizes: &[(String, usize)]) -> Result<(), Failure> {
    let twice = |(place, (name, _)): &(usize, &(String, usize))| {
        sizes[..*place].iter().any(|(before, _)| before == name)
    };
    if let Some((_, (name, _))) = sizes.iter().enumerate().find(twice) {
        return Err(Failure::Words(format!("size `{name}` is given twice; give it once")));
    }
    let known: BTreeSet<&str> =
        kernels.iter().flat_map(Kernel::sizes).map(|size| size.name.as_str()).collect();
    match sizes.iter().find(|(name, _)| !known.contains(name.as_str())) {
        None => Ok(()),
        Some((name, _)) if known.is_empty() => {
            Err(Failure::Words(format!("there is no size `{name}`: all are known")))
        }
        Some((name, _)) => {
            let known: Vec<&str> = known.into_iter().collect();
            let words = format!("there is no size `{name}`; there are `{}`", known.join("`, `"));
            Err(Failure::Words(words))
        }
    }
}

fn size(text: &str) -> Result<(String, usize), String> {
    let parts = text.split_once('=').and_then(|(name, size)| Some((name.trim(), size.trim().parse().ok()?)));
    match parts {
        Some((name, size)) if !name.is_empty() && (1..=MOST).contains(&size) => Ok((name.to_owned(), size)),
        _ => Err(format!("expected NAME=N, such as `Velocity=7`, with N from 1 to {MOST}")),
    }
}

/// The kernels of a question, as far as kernels answer it.
fn kernels(model: &Model, question: &bp_core::model::Question) -> Result<Vec<Kernel>, Failure> {
    let mut kernels = Vec::new();
    for route in plan(model, question, Options::default())?.routes {
        match route.exact() {
            Some(exact) => kernels.push(lower(model, exact, &question.name)?.kernel),
            None => {
                let words = format!("`{}` is not answered by loops: {}", question.name, route.reason());
                return Err(Failure::Words(words));
            }
        }
    }
    Ok(kernels)
}
