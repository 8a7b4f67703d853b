//! `bp explain`: how the answer follows from the program, step by step.
//!
//! In: a program and a question. Out: the derivation, as text, LaTeX or JSON. Invariant: every form shows the same steps
//! of the same plan.

use crate::failure::{Failure, colour};
use crate::{latex, parameters, program, wrap};
use bp_core::error::Error;
use bp_core::model::{Model, Question};
use bp_core::plan::{Notation, Options, Plan, Route, plan};
use serde_json::json;
use std::io::Write;
use std::path::PathBuf;

/// Derives the answer to a question, step by step.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp explain wet_grass.bp
  bp explain wet_grass.bp 'P(Rain | Wet = true)'
  bp explain cell.bp state --latex > state.tex    (uses the package amsmath)")]
pub(crate) struct Arguments {
    /// A program; `-` is stdin.
    file: PathBuf,
    /// `P(…)`, or the name of a declared question; all of those if left out.
    question: Option<String>,
    /// Write an `align*` environment for LaTeX.
    #[arg(long, conflicts_with = "json")]
    latex: bool,
    /// Write the steps as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let model = program::linked(&arguments.file)?;
    let questions = program::questions(&model, arguments.question.as_deref())?;
    let plans: Vec<Plan> =
        questions.iter().map(|one| plan(&model, one, Options::default())).collect::<Result<_, Error>>()?;
    if arguments.json {
        let told: Vec<_> = plans.iter().map(|plan| as_json(&model, plan)).collect();
        let written = match told.as_slice() {
            [one] => serde_json::to_writer(&mut *out, one),
            several => serde_json::to_writer(&mut *out, several),
        };
        written.map_err(std::io::Error::from)?;
        writeln!(out)?;
        return Ok(());
    }
    for (position, plan) in plans.iter().enumerate() {
        if position > 0 {
            writeln!(out)?;
        }
        match arguments.latex {
            true => latex::write(&model, plan, &asked(&model, &plan.question), out)?,
            false => write_text(&model, plan, out)?,
        }
    }
    Ok(())
}

/// What is asked, as a user would type it.
fn asked(model: &Model, question: &Question) -> String {
    question.asks.iter().map(|ask| model.ask_text(ask)).collect::<Vec<_>>().join("; ")
}

fn write_text(model: &Model, plan: &Plan, out: &mut impl Write) -> std::io::Result<()> {
    let (bold, plain) = if colour(&std::io::stdout()) { ("\x1b[1m", "\x1b[0m") } else { ("", "") };
    let title = format!("program {}: {}", model.name, asked(model, &plan.question));
    write!(out, "{}", wrap::wrapped("", &title, 4))?;
    for (position, (rule, reason, equation)) in plan.derivation(model, Notation::Unicode).iter().enumerate() {
        let number = position + 1;
        writeln!(out, "\n{number:>2}. {bold}{rule}{plain}")?;
        write!(out, "{}", wrap::wrapped("    ", reason, 4))?;
        write!(out, "{}", wrap::wrapped_equation("      ", equation, 10))?;
    }
    writeln!(out)?;
    write!(out, "{}", wrap::wrapped("decomposition: ", &parameters::in_words(model), 4))?;
    if let Some(cost) = cost(plan) {
        writeln!(out, "cost: about {cost:.0} products")?;
    }
    for equation in plan.computed(model, Notation::Unicode) {
        write!(out, "{}", wrap::wrapped_equation("computed: ", &equation, 10))?;
    }
    Ok(())
}

fn as_json(model: &Model, plan: &Plan) -> serde_json::Value {
    let latex = plan.derivation(model, Notation::Latex);
    let steps: Vec<_> = (plan.derivation(model, Notation::Unicode).into_iter().zip(latex))
        .map(|((rule, reason, equation), (_, _, latex))| {
            json!({ "rule": rule, "reason": reason, "equation": equation, "latex": latex })
        })
        .collect();
    json!({
        "question": asked(model, &plan.question),
        "steps": steps,
        "computed": plan.computed(model, Notation::Unicode),
        "free_parameters": parameters::free(model),
        "products": cost(plan),
    })
}

/// Multiplications of the sums, where there are any.
fn cost(plan: &Plan) -> Option<f64> {
    let costs = plan.routes.iter().filter_map(|route| match route {
        Route::Exact(exact) => Some(exact.cost),
        Route::Gaussian(_) => None,
    });
    let total: f64 = costs.sum();
    (total > 0.0).then_some(total)
}
